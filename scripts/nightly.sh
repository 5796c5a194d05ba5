#!/usr/bin/env bash
# What scripts/test.sh is too short for, within three hours on two cores: the whole
# suite with the counts of the night, every planted error against every test that
# should find it, the pages that tests write. Goes on after a failure, and ends with
# what it proved and what it could not.
#
#   scripts/nightly.sh [stage…]     of: suite wgpu fuzz fresh farm stability mutants; all of them if none is named
#   ETENDUE_SEED=N                  seed of the stage `fresh`; else another one each night
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/setup.sh
source scripts/binaries.sh
unset DISPLAY WAYLAND_DISPLAY
export ETENDUE_REQUIRE_DEVICE=1 RUST_TEST_THREADS=1 ETENDUE_NIGHTLY=1
# A failure can be repeated with the seed that is printed.
seed="${ETENDUE_SEED:-$(date +%s)}"
unset ETENDUE_SEED
log="$work/suite"
: >"$log"

proved=()
failed=()
started=$SECONDS

# stage WHAT COMMAND…: remembers how it went, and goes on.
stage() {
    local what="$1" start=$SECONDS line
    shift
    printf '\n== %s\n' "$what"
    if "$@"; then
        line="$(printf '%6d s  proved      %s' $((SECONDS - start)) "$what")"
        proved+=("$line")
    else
        line="$(printf '%6d s  NOT PROVED  %s' $((SECONDS - start)) "$what")"
        failed+=("$line")
    fi
}

# What the tests print are the figures of docs/stability.md.
whole_suite() {
    build_faults && build_tests && cat "$work/faults.list" "$work/list" >"$work/all" &&
        ETENDUE_GO_ON=1 run_binaries "$work/all" --nocapture | tee "$log" && cargo test --release --locked --doc
}
wgpu_pictures() { cargo test --release --locked --features wgpu --lib --test wgpu; }
# Of tests whose law is known exactly (tests/common/statistics.rs): at least a thousand, by Kolmogorov and Smirnov at 1e-3.
p_values() {
    ETENDUE_P_VALUES="$log" cargo test --release --locked --test statistics p_values_of_the_night -- --ignored --nocapture
}
# Tests of chance hold for other seeds too, in all likelihood: a failure is worth a second night with the same
# seed and more samples.
fresh_seed() {
    build_tests && grep -E '/(integrator|matter|reference|stability)-[0-9a-f]*$' "$work/list" >"$work/chance" &&
        ETENDUE_NIGHTLY=0 ETENDUE_SEED="$seed" ETENDUE_GO_ON=1 run_binaries "$work/chance"
}
farms() { scripts/farm.sh; }
pages() { ETENDUE_STABILITY_LOG="$log" scripts/stability.sh; }
every_mutant() { ETENDUE_NIGHTLY=0 ETENDUE_MUTANTS_ALL=1 scripts/mutants.sh; }
fuzzing() { ETENDUE_FUZZ_SEED="$((seed % 2147483647 + 1))" scripts/fuzz.sh; }
unchanged() {
    command -v git >/dev/null && git diff --stat -- docs/stability.md docs/physics.md || true
}

stages=("$@")
(($# > 0)) || stages=(suite wgpu fuzz fresh farm stability mutants)
printf 'nightly.sh: seed %s, stages: %s\n' "$seed" "${stages[*]}"
for name in "${stages[@]}"; do
    case "$name" in
        suite)
            stage "every test passes with the counts of the night" whole_suite
            stage "the p-values of all tests together are uniform" p_values
            ;;
        wgpu) stage "pictures through wgpu are the same" wgpu_pictures ;;
        fuzz) stage "a million damaged files of every kind do no harm" fuzzing ;;
        fresh) stage "the pictures of known answers hold for seed $seed" fresh_seed ;;
        farm) stage "Slurm and Open Job Description give the picture of one run, with a task killed on the way" farms ;;
        stability) stage "every case of docs/stability.md is measured and written" pages ;;
        mutants) stage "every planted error is found, and no control; docs/physics.md is written" every_mutant ;;
        *) printf 'nightly.sh: no stage %s\n' "$name" >&2; exit 2 ;;
    esac
done
unchanged

printf '\nnightly.sh: %d s, seed %s\n' $((SECONDS - started)) "$seed"
printf '%s\n' "${proved[@]}" "${failed[@]}" | sed '/^$/d'
cat <<'TEXT'
Not tried here, ever: other devices and drivers than the one above (scripts/gpu.sh), loss of power,
and the cases that docs/stability.md marks with "does not hold".
TEXT
((${#failed[@]} == 0))
