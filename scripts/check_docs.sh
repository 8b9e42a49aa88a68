#!/usr/bin/env bash
# Fails where a number in README.md or docs/ is not what the command named beside it says. Options: scripts/check_docs.py.
#   scripts/check_docs.sh [--all] [--fix] [words...]
# CAIRN: the command, if it is not build/release/cairn.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cairn="${CAIRN:-$root/build/release/cairn}"
if [[ ! -x "$cairn" ]]; then
    echo "check_docs: $cairn is not there: build it (cmake --build --preset release), or name another by CAIRN" >&2
    exit 2
fi
exec python3 "$root/scripts/check_docs.py" --cairn "$cairn" "$@"
