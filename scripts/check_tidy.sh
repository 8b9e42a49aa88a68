#!/usr/bin/env bash
# Runs clang-tidy, with the checks of .clang-tidy, on sources; prints findings only.
#   scripts/check_tidy.sh [--alone] [folder or file...]    default: the folders below that exist, which are all but tests and bench
# Files of the libraries are looked at one by one, so that what leans on another file's includes is found out; those of
# demos and command several at a time (CAIRN_UNITY), which takes a fifth of the time. --alone: those one by one
# too; a file that is named always is.
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

# What is compiled, of these places: a source, or a file of the build folder that includes several.
listed() {
    python3 - "$build" "$@" <<'PYTHON'
import json
import pathlib
import sys

build, places = pathlib.Path(sys.argv[1]), [pathlib.Path(place) for place in sys.argv[2:]]
root = pathlib.Path.cwd()
found = {place: place for place in places if place.is_file()}
for command in json.loads((build / "compile_commands.json").read_text()):
    file = pathlib.Path(command["file"]).relative_to(root)
    home = file
    if build in file.parents:
        if "Unity" not in file.parts:
            continue  # made by the build
        home = file.relative_to(build)
    if any(place == home or place in home.parents for place in places):
        found[file] = file
# The largest first, so that no core waits for the other at the end. A list of includes is larger than it looks.
def size(file):
    return file.stat().st_size * (1000 if "Unity" in file.parts else 1)
print(*sorted(found, key=size, reverse=True), sep="\0", end="\0")
PYTHON
}
# The compile commands are g++'s: some of its warnings clang does not know. Several files at a time are sources
# included by another, as they should not be elsewhere.
listed "${places[@]}" |
    xargs -0 -r -n 1 -P "$(nproc)" bash -c '
        checks=""
        if [[ "$0" == */Unity/* ]]; then
            checks=-bugprone-suspicious-include
        fi
        if ! words=$(clang-tidy -p "'"$build"'" --quiet --checks="$checks" --extra-arg=-Wno-unknown-warning-option \
                "$0" 2>/dev/null); then
            printf "%s\n" "$words"
            exit 1
        fi'
