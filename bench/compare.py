#!/usr/bin/env python3
"""Two builds of cairn_bench_core, before and after a change, measured in turns in one run.

    bench/compare.py BEFORE AFTER [SCENE...] [--repeats 3] [--threads 1,2,4] [--steps N] [--float] [--json FILE]

Of each program the best round counts (the one with the least mean), and the two take turns in who goes first, so that
what disturbs the machine for a while disturbs both. A cell is: before, after, and how many times less. Scenes and
columns are those of `cairn_bench_core --help`.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

SCENES = ["grid", "pyramid", "pyramid@gauss_seidel", "pile=200", "pile", "dolls", "net", "statics", "sleepers", "build"]
COLUMNS = [  # heading, field, factor, whether the ratio says something
    ("mean ms", "mean_ms", 1, True),
    ("late ms", "late_ms", 1, True),
    ("least ms", "least_ms", 1, True),
    ("p99 ms", "p99_ms", 1, True),
    ("first ms", "first_ms", 1, True),
    ("build s", "build_s", 1, True),
    ("KB/body", "bytes_per_body", 1 / 1024, True),
    ("B/point", "bytes_per_point", 1, True),
    ("allocs", "allocations_per_step", 1, True),
    ("x threads", "speed_up", 1, False),
    ("depth mm", "max_penetration_mm", 1, False),
    ("gap mm", "max_joint_gap_mm", 1, False),
    ("flags", "flagged_steps", 1, False),
]


def measure(program, scene, options):
    """The rows of one scene, by number of threads; none where the program failed."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "rows.json")
        done = subprocess.run([program, scene, "--json", path] + options, stdout=subprocess.DEVNULL)
        if done.returncode != 0 or not os.path.exists(path):
            return {}
        with open(path) as file:
            return {row["threads"]: row for row in json.load(file)}


def number(x):
    if x is None:
        return "-"
    return f"{x:.0f}" if x == 0 or abs(x) >= 100 else f"{x:.2f}" if abs(x) >= 1 else f"{x:.4f}"


def cell(before, after, factor, with_ratio):
    values = [None if x is None else factor * x for x in (before, after)]
    text = f"{number(values[0]):>7} {number(values[1]):>7}"
    if with_ratio:
        text += f" {number(values[0] / values[1]):>6}" if values[0] and values[1] else " " * 7
    return text


def print_head():
    print(" " * 32 + " |".join(f"{heading:^{22 if ratio else 15}}" for heading, _, _, ratio in COLUMNS))


def print_row(before, after):
    name = f"{before['scene']}, {before['threads']} thr"
    cells = [cell(before[field], after[field], factor, ratio) for _, field, factor, ratio in COLUMNS]
    same = "  same bits" if before["state"] == after["state"] else ""
    print(f"{name:<32}" + " |".join(cells) + same, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before")
    parser.add_argument("after")
    parser.add_argument("scenes", nargs="*", default=SCENES)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--threads", default="1")
    parser.add_argument("--steps", type=int)
    parser.add_argument("--float", action="store_true")
    parser.add_argument("--json", help="file for the best rows of both")
    arguments = parser.parse_args()
    options = ["--threads", arguments.threads]
    options += ["--steps", str(arguments.steps)] if arguments.steps else []
    options += ["--float"] if arguments.float else []
    programs = [os.path.abspath(arguments.before), os.path.abspath(arguments.after)]

    print_head()
    pairs, failed = [], False
    for scene in arguments.scenes:
        best = [{}, {}]
        for turn in range(arguments.repeats):
            for which in (0, 1) if turn % 2 == 0 else (1, 0):
                for threads, row in measure(programs[which], scene, options).items():
                    kept = best[which].get(threads)
                    if kept is None or row["mean_ms"] < kept["mean_ms"]:
                        best[which][threads] = row
        for which in (0, 1):
            if not best[which]:
                print(f"{scene:<32}failed in {programs[which]}", flush=True)
                failed = True
        for rows in best:
            for row in rows.values():
                row["speed_up"] = rows[min(rows)]["mean_ms"] / row["mean_ms"]
        for threads in sorted(best[0].keys() & best[1].keys()):
            print_row(best[0][threads], best[1][threads])
            pairs.append({"before": best[0][threads], "after": best[1][threads]})
    if arguments.json:
        with open(arguments.json, "w") as file:
            json.dump(pairs, file, indent=1)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
