# To be sourced: builds the test binaries and runs several at a time, which cargo does not.

# Compiling a kernel takes one core, rendering all of them: two processes keep two cores busy.
readonly AT_ONCE=2
# Those that take longest, first, so that none of them is left at the end.
readonly LONGEST=(reference matter integrator traversal stability compare work faults layout cli shading measure fuzz)

# Where lists, logs and the program with the feature faults are for as long as the script runs.
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
export work

# The test binaries of a build, by cargo's messages.
binaries() {
    cargo test --release --locked --no-run --message-format=json-render-diagnostics "$@" >"$work/messages" || return 1
    sed -nE 's/.*"profile":\{[^}]*"test":true\}.*"executable":"([^"]*)".*/\1/p' "$work/messages"
}

# These tests need a program that has the feature too. It lies where the others look for theirs, so it is put aside;
# build_tests then makes the program without the feature.
build_faults() {
    binaries --features faults --test faults >"$work/faults.list" || return 1
    cp "$CARGO_TARGET_DIR/release/etendue" "$work/etendue-faults"
}

build_tests() { binaries >"$work/list" && [[ -s "$work/list" ]]; }

# One binary, with arguments of its own; what it prints stays together, below the line that cargo writes.
run_binary() {
    local binary="$1" name log="$work/log.${1##*-}" code=0
    shift
    name="$(basename "${binary%-*}")"
    [[ "$name" != faults ]] || export ETENDUE_TEST_PROGRAM="$work/etendue-faults"
    local source="tests/$name.rs" TIMEFORMAT="-- $name: %0R s, %0U + %0S s of processor time"
    [[ "$name" != etendue ]] || source=src/lib.rs
    { time CARGO=cargo "$binary" "$@" >"$log" 2>&1; } 2>"$log.time" || code=1
    flock "$work/lock" cat "$log.time" <(printf '     Running %s (%s)\n' "$source" "$binary") "$log"
    # 255 ends xargs.
    ((code == 0 || ${ETENDUE_GO_ON:-0} == 1)) && return $code
    return 255
}
export -f run_binary

# The longest binaries first.
ordered() {
    local name
    for name in "${LONGEST[@]}"; do grep "/$name-[0-9a-f]*\$" "$1"; done
    grep -vE "/($(IFS='|' && echo "${LONGEST[*]}"))-[0-9a-f]*\$" "$1"
}

# run_binaries LIST [ARGUMENTS OF A TEST BINARY…]: stops at the first binary that fails, unless ETENDUE_GO_ON=1.
run_binaries() {
    local list="$1"
    shift
    ordered "$list" | xargs -P "$AT_ONCE" -I{} bash -c 'run_binary "$@"' _ {} "$@"
}
