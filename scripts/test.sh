#!/usr/bin/env bash
# Proves that this checkout works on this machine: installs what is missing, builds,
# and passes every check. Ends with one line a check and the time it took.
#
#   scripts/test.sh [ARGUMENTS OF cargo test …]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/setup.sh
# A software driver must not look for a display.
unset DISPLAY WAYLAND_DISPLAY
# Nothing may pass by being skipped, and two tests must not share one device.
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
    newest="$(ls -td "$CARGO_TARGET_DIR"/release/build/etendue-*/out | head -n 1)"
    for file in "$newest"/*.spv; do
        # devices of wgpu have no scalar layout
        case "$file" in
        */path_wgpu.spv) spirv-val --target-env vulkan1.1 "$file" || return 1 ;;
        *) spirv-val --target-env vulkan1.2 --scalar-block-layout "$file" || return 1 ;;
        esac
        count=$((count + 1))
    done
    echo "$count modules are valid"
}

run_tests() {
    local log passed
    log="$(mktemp)"
    cargo test --release --locked "$@" 2>&1 | tee "$log" || { rm -f "$log"; return 1; }
    passed="$(awk '/^test result: ok/ { n += $4 } END { print n + 0 }' "$log")"
    rm -f "$log"
    echo "$passed tests passed"
}

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
if cargo clippy --version >/dev/null 2>&1; then
    step "no warnings (clippy)" cargo clippy --release --all-targets --locked --features faults -- -D warnings
else
    skip "lints: clippy is not installed (Debian package rust-clippy)"
fi
# Before the others, which then find the program without the feature.
step "calls and files that fail do no harm" \
    cargo test --release --locked --features faults --test faults
# wgpu takes minutes to compile: its tests run every night, the gate looks at types and lints only.
if ! at_least "$(rustc --version | cut -d' ' -f2)" "$WGPU_RUST_VERSION"; then
    skip "the feature wgpu: it needs Rust $WGPU_RUST_VERSION"
elif [[ "${ETENDUE_NIGHTLY:-}" == 1 ]]; then
    step "pictures through wgpu are the same (nightly)" run_tests --features wgpu --lib --test wgpu
elif cargo clippy --version >/dev/null 2>&1; then
    step "no warnings with the feature wgpu (clippy)" cargo clippy --release --lib --bins --test wgpu --features wgpu --locked -- -D warnings
else
    skip "the feature wgpu: clippy is not installed (Debian package rust-clippy)"
fi
step "every test passes, on a device (cargo test)" run_tests "$@"
step "the documentation builds without warnings" document

printf '\ntest.sh: everything passed in %d s\n' $((SECONDS - started))
printf '%s\n' "${summary[@]}"
