#!/usr/bin/env bash
# Tests the tests: plants errors of physics one at a time (tests/mutants) and runs
# the tests that should find each. Writes the table of docs/physics.md. Takes
# about half an hour; not a part of scripts/test.sh.
#
#   scripts/mutants.sh [NAME,NAME…]     those only; other rows stay as they are
#   ETENDUE_MUTANTS_ALL=1 scripts/mutants.sh     every listed test, not only the first that finds one
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/setup.sh
unset DISPLAY WAYLAND_DISPLAY
[[ $# -eq 0 ]] || export ETENDUE_MUTANTS="$1"
exec cargo test --release --locked --features mutants --test mutants -- --ignored --nocapture
