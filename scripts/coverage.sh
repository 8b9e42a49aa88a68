#!/usr/bin/env bash
# Which lines of the libraries the tests run: a table by file, and every line that none does. Fails where less than 95 %
# are run. The fast tests, unless told of others: a quarter of an hour of building on two cores, ten minutes of tests;
# needs gcovr (Debian: gcovr).
#   scripts/coverage.sh [options of ctest, for example -L slow]    page: build/coverage/report/index.html
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
if ! command -v gcovr >/dev/null; then
    echo "coverage: gcovr is not there: install Debian's package gcovr" >&2
    exit 2
fi
cmake --preset coverage
cmake --build --preset coverage -- -j "$(nproc)"
find build/coverage -name '*.gcda' -delete
# Left out: what is of a release build, and readers of meshes in a process of their own, which may write no file of
# this size and would spoil the counts.
which=("$@")
if [[ $# -eq 0 ]]; then
    which=(-L '^fast$')
fi
ctest --preset coverage -j "$(nproc)" -E '^(docs\.numbers|install\.game|command\.Loading\..*)$' "${which[@]}" ||
    echo "coverage: not all tests passed" >&2
mkdir -p build/coverage/report
filters=()
for folder in base collision engine assets render include; do
    filters+=(--filter "$folder/")
done
gcovr --root . --object-directory build/coverage "${filters[@]}" --exclude-throw-branches \
    --gcov-ignore-parse-errors -j "$(nproc)" --html-details build/coverage/report/index.html \
    --txt build/coverage/report/lines.txt --fail-under-line 95 --print-summary
