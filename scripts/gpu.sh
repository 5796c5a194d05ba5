#!/usr/bin/env bash
# The suite on the GPU of this machine, with the counts of the night. Says why not
# and ends with 0 where there is none: a software driver is no GPU.
#
#   scripts/gpu.sh [ARGUMENTS OF cargo test …]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/setup.sh
# A device must be there; what it does not offer (ray query, say) is skipped, and each test says so.
export ETENDUE_REQUIRE_DEVICE=gpu RUST_TEST_THREADS=1 ETENDUE_NIGHTLY=1

cargo build --release --locked
etendue="$CARGO_TARGET_DIR/release/etendue"
devices="$("$etendue" info 2>&1)" || { printf 'gpu.sh: skipped: no Vulkan device\n%s\n' "$devices"; exit 0; }
if ! grep -qiE 'discrete|integrated' <<<"$devices"; then
    printf 'gpu.sh: skipped: the only devices are in software\n%s\n' "$devices"
    exit 0
fi
# The library takes the fastest kind of device by itself: a discrete GPU before an integrated one.
printf '%s\n' "$devices"
printf '\n== what the device and its driver really do\n'
"$etendue" selftest
printf '\n== every test passes on it\n'
cargo test --release --locked --no-fail-fast "$@"
printf '\ngpu.sh: proved on this device and driver, and on no other\n'
