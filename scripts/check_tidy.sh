#!/usr/bin/env bash
# Runs clang-tidy, with the checks of .clang-tidy, on sources; prints findings only.
#   scripts/check_tidy.sh [--alone] [folder or file...]    default: the folders below that exist, which are all but tests and bench
# Files are looked at several at a time (CAIRN_UNITY), which takes a fraction of the time. --alone: one by one, so that
# what leans on another file's includes is found out; a file that is named always is, and so are those with compile
# options of their own. What was found clean and has not changed is not looked at again
# (scripts/run_tidy.py; CAIRN_TIDY_CACHE= looks at everything).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
unity=ON
if [[ "${1:-}" == --alone ]]; then
    unity=OFF
    shift
fi
build=build/tidy
places=("$@")
if [[ ${#places[@]} -eq 0 ]]; then
    for folder in base collision engine assets render demos command; do
        if [[ -d "$folder" ]]; then
            places+=("$folder")
        fi
    done
fi
# In a build folder of its own: clang takes g++'s precompiled headers for broken ones, and what leans on them instead
# of including what it uses is found out.
cmake --preset release -B "$build" -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DCAIRN_UNITY=$unity -DCAIRN_BENCH=ON >/dev/null
# Files compiled together lie in the build folder, where clang-tidy looks for their settings.
mkdir -p "$build/tests"
cp tests/.clang-tidy "$build/tests/.clang-tidy"

exec scripts/run_tidy.py "$build" "${places[@]}"
