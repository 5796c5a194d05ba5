#!/usr/bin/env bash
# A render split over a Slurm array: each task renders one shard, the last job merges.
#
#   examples/farm/slurm.sh SCENE OUT.exr SHARDS SAMPLES_PER_SHARD [OPTION…]
#
# SAMPLES_PER_SHARD should be a power of two. Options go to `etendue render`; those of
# sbatch can be given by its environment, such as SBATCH_TIMELIMIT.
#
# A task whose render is killed, fails for want of memory or a device, or is a minute
# from its time limit is queued again and goes on from its checkpoint, as long as that
# makes progress. Slurm itself does so where a node fails. Where a task failed for good,
# the same command again renders what is missing.
set -euo pipefail

etendue="${ETENDUE:-etendue}"
# So often is a task queued again that added nothing to its checkpoint.
readonly RETRIES=3

# Shards are named so that `ls` sorts them.
shard() { printf '%s.shards/%06d' "${1%.exr}" "$2"; }

# Runs a command that stops cleanly where Slurm warns of the time limit. Slurm's own
# SIGTERM reaches it anyway, and twice would be once too often.
stoppable() {
    local child status
    "$@" &
    child=$!
    trap 'kill -TERM "$child"' USR1
    while :; do
        wait "$child" && status=0 || status=$?
        # else a signal ended the wait and not the command
        kill -0 "$child" 2>/dev/null || break
    done
    trap - USR1
    return "$status"
}

# Queues this task again, unless the end of the last attempt will be that of the next.
again() {
    local status="$1" progress="$2" task
    # 0 done, 2 to 5 refused; 1 may be a lost device, from 128 on it was stopped
    ((status == 1 || status > 128)) || return 0
    [[ -n "${SLURM_JOB_ID:-}" ]] || return 0
    if [[ -z "$progress" ]] && ((${SLURM_RESTART_COUNT:-0} >= RETRIES)); then
        echo "slurm.sh: ended with $status after ${SLURM_RESTART_COUNT} restarts without progress" >&2
        return 0
    fi
    task="${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"
    echo "slurm.sh: the render ended with $status; task $task is queued again" >&2
    scontrol requeue "$task" || return 0
    # until Slurm ends this attempt
    sleep 300
}

render_task() {
    local scene="$1" out="$2" samples="$3" index="$4" name before progress='' status=0
    shift 4
    name="$(shard "$out" "$index")"
    [[ ! -e "$name.exr" ]] || return 0
    before="$(stat -c '%i %Y' "$name.ck" 2>/dev/null || true)"
    # Under its own name only when all samples are there: a signal leaves a part.
    stoppable "$etendue" render "$scene" -o "$name.part.exr" --checkpoint "$name.ck" --resume \
        --samples "$((index * samples))..$(((index + 1) * samples))" "$@" || status=$?
    if ((status != 0)); then
        [[ "$(stat -c '%i %Y' "$name.ck" 2>/dev/null || true)" == "$before" ]] || progress=yes
        again "$status" "$progress"
        return "$status"
    fi
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
    (($# >= 4)) || { sed -n '2,12s/^# \?//p' "$0"; exit 2; }
    scene="$1" out="$2" count="$3" samples="$4"
    folder="${out%.exr}.shards"
    mkdir -p "$folder"
    shards="$(sbatch --parsable --requeue --signal=B:USR1@60 --array="0-$((count - 1))" \
        --open-mode=append --output="$folder/%6a.log" \
        --wrap "$(printf '%q ' exec "$0" --render "$scene" "$out" "$samples" "${@:5}")")"
    merge="$(sbatch --parsable --dependency="afterok:$shards" --output="$folder/merge.log" \
        --wrap "$(printf '%q ' exec "$0" --merge "$out" "$count")")"
    echo "array $shards renders the shards, job $merge merges them"
    ;;
esac
