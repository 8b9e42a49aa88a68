#!/usr/bin/env bash
# Builds Cairn and runs its tests; the last lines are ctest's summary.
#   scripts/test.sh [--ci] [options of ctest, for example -R engine]    all tests
#   scripts/test.sh [--ci] --fast [options of ctest]                    those that take under a minute together
# --ci: by the preset ci, which builds everything sooner, and what has changed later.
# Which tests are slow stands in tests/slow_tests.cmake; scripts/slow_tests.py measures it anew.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
preset=release
if [[ "${1:-}" == --ci ]]; then
    preset=ci
    shift
fi
which=()
if [[ "${1:-}" == --fast ]]; then
    which=(-L '^fast$')
    shift
fi
scripts/setup.sh
cmake --preset "$preset"
cmake --build --preset "$preset" -- -j "$(nproc)"
exec ctest --preset "$preset" -j "$(nproc)" "${which[@]}" "$@"
