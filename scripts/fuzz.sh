#!/usr/bin/env bash
# Looks for what breaks Cairn with libFuzzer under the address and undefined-behaviour sanitizers (clang), one target
# after the other, in a build folder of its own.
#   scripts/fuzz.sh [--seconds N] [target...]    default: 60 s each of api twins narrow scene mesh recording
# What reaches new code gathers in build/fuzz/corpus/TARGET, from where the next run goes on.
# What it finds lies in build/fuzz/found/TARGET: mend the cause, then move the file into tests/fuzz/corpus/TARGET, where
# every build replays it (ctest -R '^fuzz\.').
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
seconds=60
targets=()
while [[ $# -gt 0 ]]; do
    case "$1" in
        --seconds) seconds="$2"; shift ;;
        -*) sed -n '2,7s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
        *) targets+=("$1") ;;
    esac
    shift
done
[[ ${#targets[@]} -gt 0 ]] || targets=(api twins narrow scene mesh recording)
cmake --preset fuzz >/dev/null
cmake --build --preset fuzz --target "${targets[@]/#/fuzz_}" -- -j "$(nproc)"
# Odr: the engine and FCL share templates of Eigen, of which ours alone are instrumented.
export ASAN_OPTIONS=detect_odr_violation=0:allocator_may_return_null=1
status=0
for target in "${targets[@]}"; do
    fuzzer=build/fuzz/tests/fuzz/fuzz_$target
    corpus=tests/fuzz/corpus/$target
    work=build/fuzz/corpus/$target
    found=build/fuzz/found/$target
    mkdir -p "$corpus" "$work" "$found"
    echo "$target: $seconds s"
    "$fuzzer" -max_total_time="$seconds" -timeout=30 -rss_limit_mb=4096 -max_len=4096 -print_final_stats=1 \
        -artifact_prefix="$found/" "$work" "$corpus" >"$found/log" 2>&1 || status=1
    grep -E '^(stat::number_of_executed_units|SUMMARY|does not hold)|ERROR' "$found/log" | sed 's/^/    /'
done
exit "$status"
