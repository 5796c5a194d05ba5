#!/usr/bin/env bash
# Runs the tests of the cases in which methods fail (tests/stability) and writes the
# tables of docs/stability.md. Takes about a quarter of an hour; scripts/nightly.sh
# does it with the counts of the night.
#
#   scripts/stability.sh [CASE,LETTER…]     those only; other rows stay as they are
#   ETENDUE_NIGHTLY=1 scripts/stability.sh  with the counts of the night
#   ETENDUE_STABILITY_LOG=FILE              what `cargo test -- --nocapture` wrote with RUST_TEST_THREADS=1: tests in it do not run again
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/setup.sh
unset DISPLAY WAYLAND_DISPLAY
[[ $# -eq 0 ]] || export ETENDUE_STABILITY="$1"
export ETENDUE_REQUIRE_DEVICE=1
exec cargo test --release --locked --test stability every_case_is_measured -- --ignored --nocapture
