#!/usr/bin/env bash
# Runs clang-tidy, with the checks of .clang-tidy, on all sources but those of bench/; prints findings only.
#   scripts/check_tidy.sh [folder or file...]    default: the folders below that exist
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
places=("$@")
if [[ ${#places[@]} -eq 0 ]]; then
    for folder in base collision engine assets render demos command tests; do
        if [[ -d "$folder" ]]; then
            places+=("$folder")
        fi
    done
fi
# In a build folder of its own: clang takes g++'s precompiled headers for broken ones, and what leans on them instead
# of including what it uses is found out.
cmake --preset release -B build/tidy -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON >/dev/null
# The compile commands are g++'s: some of its warnings clang does not know. demos/game is a project of its own, without
# compile commands here.
find "${places[@]}" -name '*.cpp' ! -path 'demos/game/*' -print0 |
    xargs -0 -r -n 1 -P "$(nproc)" bash -c '
        if ! words=$(clang-tidy -p build/tidy --quiet --extra-arg=-Wno-unknown-warning-option "$0" 2>/dev/null); then
            printf "%s\n" "$words"
            exit 1
        fi'
