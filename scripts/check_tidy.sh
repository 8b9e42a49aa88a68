#!/usr/bin/env bash
# Runs clang-tidy, with the checks of .clang-tidy, on the library's sources; prints findings only. Tests and demos are
# left to the compiler's warnings: the headers of googletest and CLI11 would cost most of the time.
#   scripts/check_tidy.sh [folder...]    default: base collision engine assets render
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folders=("$@")
if [[ ${#folders[@]} -eq 0 ]]; then
    folders=(base collision engine assets render)
fi
cmake --preset release >/dev/null
# demos/game is a project of its own, without compile commands here.
find "${folders[@]}" -name '*.cpp' ! -path 'demos/game/*' -print0 |
    xargs -0 -r -n 1 -P "$(nproc)" bash -c '
        if ! words=$(clang-tidy -p build/release --quiet "$0" 2>/dev/null); then
            printf "%s\n" "$words"
            exit 1
        fi'
