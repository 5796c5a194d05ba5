#!/usr/bin/env bash
# Damages everything that is read, led by which code a damage reaches (libFuzzer, fuzz/): no crash, no file that
# takes over 5 s, no memory over 1 GiB. What breaks stays in $CARGO_TARGET_DIR/fuzz/broken and wants a test.
#
#   scripts/fuzz.sh [TARGET…]     of: gltf glb images exr checkpoint environment numbers; all of them if none is named
#   ETENDUE_FUZZ=N                executions of each target; else 1000000
#   ETENDUE_FUZZ_SEED=N           of libFuzzer; else another one each time
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/setup.sh
folder="$CARGO_TARGET_DIR/fuzz"
runs="${ETENDUE_FUZZ:-1000000}"
targets=("$@")
(($# > 0)) || targets=(gltf glb images exr checkpoint environment numbers)

# Readers take paths: files in memory are the fastest.
memory=/dev/shm
[[ -d "$memory" && -w "$memory" ]] || memory="${TMPDIR:-/tmp}"
TMPDIR="$(mktemp -d -p "$memory")"
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT

# Coverage for libFuzzer from LLVM's own pass, which stable Rust has too. A target is named
# so that programs which run while building get none. Decoders skip checksums where cfg(fuzzing) is set.
triple="$(rustc -vV | sed -n 's/^host: //p')"
coverage="--cfg fuzzing -Ccodegen-units=1 -Cpasses=sancov-module"
for option in level=4 inline-8bit-counters pc-table trace-compares; do
    coverage+=" -Cllvm-args=-sanitizer-coverage-$option"
done
CARGO_TARGET_DIR="$folder" RUSTFLAGS="$coverage" \
    cargo build --release --locked --manifest-path fuzz/Cargo.toml --target "$triple"
built="$folder/$triple/release"
ETENDUE_SEEDS="$folder/seeds" "$built/seeds" -runs=0 2>/dev/null
mkdir -p "$folder/broken"

failed=0
for target in "${targets[@]}"; do
    mkdir -p "$folder/corpus/$target"
    log="$folder/$target.log"
    words=()
    [[ "$target" != gl* ]] || words=(-dict=fuzz/gltf.dict)
    # Bytes that grow without end find nothing that short ones do not.
    if "$built/$target" "$folder/corpus/$target" "$folder/seeds/$target" -runs="$runs" -seed="${ETENDUE_FUZZ_SEED:-0}" \
        -timeout=5 -rss_limit_mb=1024 -max_len=16384 -print_final_stats=1 -artifact_prefix="$folder/broken/$target-" \
        "${words[@]}" >"$log" 2>&1; then
        verdict=sound
    else
        verdict=BROKEN
        failed=1
        tail -n 40 "$log"
    fi
    stat() { sed -n "s/^stat::$1: *//p" "$log"; }
    printf '%-12s %s: %s executions, slowest %s s, peak %s MiB, %s\n' "$target" "$verdict" "$(stat number_of_executed_units)" \
        "$(stat slowest_unit_time_sec)" "$(stat peak_rss_mb)" "$(grep -o 'cov: [0-9]*' "$log" | tail -n 1)"
done
((failed == 0))
