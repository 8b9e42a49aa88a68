#!/usr/bin/env bash
# Builds Cairn and runs its tests; the last lines are ctest's summary.
#   scripts/test.sh [options of ctest, for example -R engine]           all tests
#   scripts/test.sh --fast [options of ctest]                           those that take under a minute together
# Which tests are slow stands in tests/slow_tests.cmake; scripts/slow_tests.py measures it anew.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
which=()
if [[ "${1:-}" == --fast ]]; then
    which=(-L '^fast$')
    shift
fi
scripts/setup.sh
cmake --preset release
cmake --build --preset release -- -j "$(nproc)"
exec ctest --preset release -j "$(nproc)" "${which[@]}" "$@"
