#!/usr/bin/env bash
# Proves that this checkout works on this machine: installs what is missing, builds,
# and passes every check. Ends with one line a check and the time it took.
#
#   scripts/test.sh [ARGUMENTS OF cargo test …]
#   ETENDUE_LINTS=1     also asks clippy, which takes minutes where nothing is built yet
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/setup.sh
source scripts/binaries.sh
# A software driver must not look for a display.
unset DISPLAY WAYLAND_DISPLAY
# Nothing may pass by being skipped. Tests of a process run one after another: they share devices,
# kernels and the memory that some of them measure.
export ETENDUE_REQUIRE_DEVICE=1 RUST_TEST_THREADS=1
readonly WGPU_RUST_VERSION=1.87

summary=()
started=$SECONDS

# step WHAT COMMAND…: runs it, remembers how long it took, stops at a failure.
step() {
    local what="$1" start=$SECONDS
    shift
    printf '\n== %s\n' "$what"
    "$@" || { printf '\ntest.sh: FAILED: %s\n' "$what" >&2; exit 1; }
    summary+=("$(printf '%5d s  %s' $((SECONDS - start)) "$what")")
}

skip() {
    printf '\n== not checked: %s\n' "$1"
    summary+=("not here  $1")
}

# The SPIR-V of the newest build of this crate.
validate_shaders() {
    local newest file count=0
    # a folder that is written again keeps its time
    newest="$(dirname "$(ls -t "$CARGO_TARGET_DIR"/release/build/etendue-*/out/path_software.spv | head -n 1)")"
    for file in "$newest"/*.spv; do
        # devices of wgpu have no scalar layout
        case "$file" in
        */path_wgpu.spv) spirv-val --target-env vulkan1.1 "$file" || return 1 ;;
        */path_wgpu_query.spv) spirv-val --target-env vulkan1.2 "$file" || return 1 ;;
        *) spirv-val --target-env vulkan1.2 --scalar-block-layout "$file" || return 1 ;;
        esac
        count=$((count + 1))
    done
    echo "$count modules are valid"
}

# Tests leave a core idle now and then, which is enough for the documentation.
run_all() {
    local documentation
    # cargo runs the tests in it by itself
    (cargo test --release --locked --doc && document) >"$work/documentation" 2>&1 &
    documentation=$!
    cat "$work/faults.list" "$work/list" >"$work/all"
    run_binaries "$work/all" || { kill "$documentation"; return 1; }
    wait "$documentation" || { cat "$work/documentation"; return 1; }
    awk '/^test result: ok/ { n += $4 } END { print n + 0, "tests passed" }' "$work"/log.*
}

run_some() { cargo test --release --locked "$@"; }

document() { RUSTDOCFLAGS="-D warnings" cargo doc --release --no-deps --locked; }

if cargo fmt --version >/dev/null 2>&1; then
    step "the code is formatted (rustfmt)" cargo fmt --check
else
    skip "formatting: rustfmt is not installed (Debian package rustfmt)"
fi
if command -v python3 >/dev/null; then
    step "scenes/ is what scenes/make.py writes" python3 scenes/make.py --check
else
    skip "scenes/ against its generator: python3 is not installed"
fi
step "the program builds ($(cargo --version))" cargo build --release --locked
step "the device that the tests use" "$CARGO_TARGET_DIR/release/etendue" info
step "the shaders are valid SPIR-V for Vulkan 1.2 (spirv-val)" validate_shaders
if [[ "${ETENDUE_LINTS:-}" != 1 ]]; then
    skip "lints: ETENDUE_LINTS=1 asks for them"
elif cargo clippy --version >/dev/null 2>&1; then
    step "no warnings (clippy)" cargo clippy --release --all-targets --locked --features faults -- -D warnings
else
    skip "lints: clippy is not installed (Debian package rust-clippy)"
fi
# wgpu takes minutes to compile: its tests run every night, the gate looks at types and lints only.
if ! at_least "$(rustc --version | cut -d' ' -f2)" "$WGPU_RUST_VERSION"; then
    skip "the feature wgpu: it needs Rust $WGPU_RUST_VERSION"
elif [[ "${ETENDUE_NIGHTLY:-}" == 1 ]]; then
    step "pictures through wgpu are the same (nightly)" run_some --features wgpu --lib --test wgpu
elif [[ "${ETENDUE_LINTS:-}" != 1 ]]; then
    skip "the feature wgpu: ETENDUE_LINTS=1 asks for its lints, ETENDUE_NIGHTLY=1 for its tests"
elif cargo clippy --version >/dev/null 2>&1; then
    step "no warnings with the feature wgpu (clippy)" cargo clippy --release --lib --bins --test wgpu --features wgpu --locked -- -D warnings
else
    skip "the feature wgpu: clippy is not installed (Debian package rust-clippy)"
fi
if (($# > 0)); then
    step "the tests that were asked for (cargo test $*)" run_some "$@"
    step "the documentation builds without warnings" document
else
    # Before the others, which then find the program without the feature.
    step "the tests of calls and files that fail are built" build_faults
    step "the tests are built" build_tests
    step "every test passes, on a device, $AT_ONCE at a time; the documentation builds without warnings" run_all
fi

printf '\ntest.sh: everything passed in %d s\n' $((SECONDS - started))
printf '%s\n' "${summary[@]}"
