#!/usr/bin/env bash
# Fails where a tracked source is not as clang-format would have it.
#   scripts/check_format.sh          checks
#   scripts/check_format.sh --fix    mends
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
how=(--dry-run -Werror)
if [[ "${1:-}" == --fix ]]; then
    how=(-i)
fi
# demos/game/game.cpp is the example of README.md, line for line.
git -c safe.directory="$PWD" ls-files -z '*.cpp' '*.hpp' '*.js' ':!demos/game/game.cpp' |
    xargs -0 -r clang-format "${how[@]}"
