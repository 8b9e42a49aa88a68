#!/usr/bin/env python3
"""Sorts the tests into fast and slow by what they last took, and writes tests/slow_tests.cmake anew.

    scripts/test.sh && scripts/slow_tests.py [--seconds 45] [--jobs 2] [--longest 5] [--build build/release]

Slow are tests that take longer than --longest seconds by themselves, and then, the costliest first, as many as it
takes for the others to end within --seconds on --jobs cores. The tests of one case over many parameters stay together.
The default leaves a quarter of a minute's 60 seconds to slower machines."""
import argparse
import collections
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
TABLE = ROOT / "tests" / "slow_tests.cmake"
HEAD = """\
# The cases that are too slow for `scripts/test.sh --fast`, by test program, as filters of GoogleTest.
# Written by scripts/slow_tests.py from what they took; all others are fast.
"""

Case = collections.namedtuple("Case", "program pattern")


def costs_of(build):
    """Seconds that ctest remembers of each test, by its name."""
    costs = {}
    for line in (build / "Testing" / "Temporary" / "CTestCostData.txt").read_text().splitlines():
        if line.strip() == "---":
            break
        name, runs, cost = line.rsplit(None, 2)
        if int(runs) > 0:
            costs[name] = float(cost)
    return costs


def case_of(test):
    """Which case of which program a test of ctest's list is; None: it is none of GoogleTest's."""
    filters = [word.split("=", 1)[1] for word in test.get("command", []) if word.startswith("--gtest_filter=")]
    if not filters:
        return None
    suite, name = filters[0].split(".", 1)
    pattern = re.sub(r"/\d+$", "/*", suite) + "." + re.sub(r"/.*$", "/*", name)
    return Case(test["name"].split(".", 1)[0], pattern)


def sort_cases(tests, costs, longest, budget):
    """(slow cases with their seconds, seconds of all others)."""
    total, worst = collections.Counter(), collections.Counter()
    for test in tests:
        case = case_of(test)
        if case and test["name"] in costs:
            total[case] += costs[test["name"]]
            worst[case] = max(worst[case], costs[test["name"]])
    slow = {case: cost for case, cost in total.items() if worst[case] > longest}
    left = sum(total.values()) - sum(slow.values())
    for case, cost in total.most_common():
        if left <= budget:
            break
        if case not in slow:
            slow[case] = cost
            left -= cost
    return slow, left


def table_of(slow):
    programs = collections.defaultdict(list)
    for case in sorted(slow):
        programs[case.program].append(case.pattern)
    text = HEAD
    for program, patterns in sorted(programs.items()):
        text += f"set(CAIRN_SLOW_{program}\n" + "".join(f"    {pattern}\n" for pattern in patterns)
        text = text[:-1] + ")\n"
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build" / "release")
    parser.add_argument("--seconds", type=float, default=45)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--longest", type=float, default=5)
    parser.add_argument("--out", type=pathlib.Path, default=TABLE)
    arguments = parser.parse_args()
    try:
        costs = costs_of(arguments.build)
    except OSError as error:
        parser.error(f"{error}; run scripts/test.sh first")
    listed = subprocess.run(["ctest", "--test-dir", str(arguments.build), "--show-only=json-v1"], check=True,
                            capture_output=True, text=True)
    tests = json.loads(listed.stdout)["tests"]
    slow, left = sort_cases(tests, costs, arguments.longest, arguments.seconds * arguments.jobs)
    arguments.out.write_text(table_of(slow))
    print(f"slow: {len(slow)} cases, {sum(slow.values()) / arguments.jobs:.0f} s on {arguments.jobs} cores; "
          f"fast: {left / arguments.jobs:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
