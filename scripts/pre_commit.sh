#!/usr/bin/env bash
# What must hold before a commit, in about a minute: the format of what is staged, the direction of includes, the fast
# tests.
#   scripts/pre_commit.sh              looks now
#   scripts/pre_commit.sh --install    has git look before each commit of this clone (git commit --no-verify does not)
set -euo pipefail
cd "$(git rev-parse --show-toplevel)"

if [[ "${1:-}" == --install ]]; then
    hook=$(git rev-parse --git-path hooks)/pre-commit
    call='exec "$(git rev-parse --show-toplevel)/scripts/pre_commit.sh"'
    if [[ -e "$hook" ]] && ! grep -qF "$call" "$hook"; then
        echo "pre-commit: $hook is another hook; add this line to it: $call" >&2
        exit 1
    fi
    mkdir -p "$(dirname "$hook")"
    printf '#!/bin/sh\n%s\n' "$call" >"$hook"
    chmod +x "$hook"
    echo "pre-commit: installed as $hook"
    exit 0
fi

# What is staged may differ from what lies in the folder: the staged text counts. demos/game/game.cpp is the example of
# README.md, line for line.
unformatted=()
while IFS= read -r -d '' file; do
    staged=$(git show ":$file"; printf x)
    formatted=$(printf '%s' "${staged%x}" | clang-format --assume-filename="$file"; printf x)
    if [[ "$staged" != "$formatted" ]]; then
        unformatted+=("$file")
    fi
done < <(git diff --cached --name-only --diff-filter=ACMR -z -- '*.cpp' '*.hpp' '*.js' ':!demos/game/game.cpp')
if [[ ${#unformatted[@]} -gt 0 ]]; then
    printf 'pre-commit: not as clang-format has it: %s\n' "${unformatted[@]}" >&2
    echo "pre-commit: scripts/check_format.sh --fix mends them; then stage them again" >&2
    exit 1
fi

python3 scripts/check_includes.py

# Git tells a hook which repository and index it works on; the tests must not take that for theirs.
unset GIT_DIR GIT_INDEX_FILE GIT_WORK_TREE GIT_PREFIX
if ! words=$(scripts/test.sh --fast 2>&1); then
    printf '%s\n' "$words" >&2
    echo "pre-commit: the build or a fast test failed" >&2
    exit 1
fi
printf '%s\n' "$words" | tail -n 12
