#!/usr/bin/env bash
# Builds Cairn and runs its demonstration scenes: pictures, a film and a table, in out/.
#   scripts/demo.sh [options of `cairn demo`, for example --quick or --scenes tower,arch]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
scripts/setup.sh
cmake --preset release
cmake --build --preset release --target cairn_command -- -j "$(nproc)"
build/release/cairn demo --out out "$@"
