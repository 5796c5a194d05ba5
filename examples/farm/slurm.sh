#!/usr/bin/env bash
# A render split over a Slurm array: each task renders one shard, the last job merges.
#
#   examples/farm/slurm.sh SCENE OUT.exr SHARDS SAMPLES_PER_SHARD [OPTION…]
#
# SAMPLES_PER_SHARD should be a power of two. Options go to `etendue render`. Tasks that
# are killed are requeued and go on from their checkpoint.
set -euo pipefail

etendue="${ETENDUE:-etendue}"

# Shards are named so that `ls` sorts them.
shard() { printf '%s.shards/%06d' "${1%.exr}" "$2"; }

render_task() {
    local scene="$1" out="$2" samples="$3" index="$4" name
    shift 4
    name="$(shard "$out" "$index")"
    [[ ! -e "$name.exr" ]] || return 0
    # Under its own name only when all samples are there: a signal leaves a part.
    "$etendue" render "$scene" -o "$name.part.exr" --checkpoint "$name.ck" --resume \
        --samples "$((index * samples))..$(((index + 1) * samples))" "$@"
    mv "$name.part.exr" "$name.exr"
    rm -f "$name.ck"
}

merge_task() {
    local out="$1" count="$2" index shards=()
    for ((index = 0; index < count; index++)); do
        shards+=("$(shard "$out" "$index").exr")
    done
    "$etendue" merge "${shards[@]}" -o "$out"
}

case "${1:-}" in
--render)
    shift
    render_task "$1" "$2" "$3" "$SLURM_ARRAY_TASK_ID" "${@:4}"
    ;;
--merge)
    shift
    merge_task "$@"
    ;;
*)
    (($# >= 4)) || { sed -n '2,7s/^# \?//p' "$0"; exit 2; }
    scene="$1" out="$2" count="$3" samples="$4"
    mkdir -p "${out%.exr}.shards"
    array="$(sbatch --parsable --requeue --signal=TERM@60 --array="0-$((count - 1))" \
        --wrap "$(printf '%q ' exec "$0" --render "$scene" "$out" "$samples" "${@:5}")")"
    sbatch --dependency="afterok:$array" \
        --wrap "$(printf '%q ' exec "$0" --merge "$out" "$count")"
    ;;
esac
