#!/usr/bin/env bash
# Runs clang-tidy, with the checks of .clang-tidy, on the library's own sources (tests are left to the compiler's
# warnings: googletest's macros cost most of the time and find nothing). Prints findings only.
#   scripts/check_tidy.sh [folder...]    default: base collision engine assets render demos
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folders=("$@")
if [[ ${#folders[@]} -eq 0 ]]; then
    folders=(base collision engine assets render demos)
fi
if [[ ! -f build/release/compile_commands.json ]]; then
    cmake --preset release
fi
# demos/game is a project of its own, without compile commands here.
find "${folders[@]}" -name '*.cpp' ! -path 'demos/game/*' -print0 |
    xargs -0 -r -n 1 -P "$(nproc)" bash -c '
        if ! words=$(clang-tidy -p build/release --quiet "$0" 2>/dev/null); then
            printf "%s\n" "$words"
            exit 1
        fi'
