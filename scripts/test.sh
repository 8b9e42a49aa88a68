#!/usr/bin/env bash
# Builds Cairn and runs all tests; the last lines are ctest's summary.
#   scripts/test.sh [options of ctest, for example -R engine]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
scripts/setup.sh
cmake --preset release
cmake --build --preset release -- -j "$(nproc)"
exec ctest --preset release -j "$(nproc)" "$@"
