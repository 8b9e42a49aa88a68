#!/usr/bin/env bash
# Half an hour of a world whose 500 bodies come and go: fails where memory grows, or where the slowest hundredth of the
# steps takes over three times the median. Leave the machine to it.
#   scripts/soak.sh [seconds]    default: 1800
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
cmake --preset bench
cmake --build --preset bench --target cairn_bench_soak -- -j "$(nproc)"
exec build/bench/bench/cairn_bench_soak "${1:-1800}"
