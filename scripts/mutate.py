#!/usr/bin/env python3
"""Changes one sign, bound or constant of a library at a time and sees whether the fast tests notice.

    scripts/mutate.py [--count N] [--seed N] [--limit S] [--json FILE] [folder or file...]
                                        default: 20 mutants of base, collision and engine

A mutant is one edit of one line: the library is built with it and the tests that concern it are run until the first
fails. Those that nothing notices are listed last: each is a test that is missing, or a line that does nothing. The tree
is edited in place and put back; what is mutated must be committed. One takes a minute or so on two cores: leave the
tree alone meanwhile.
"""
import argparse
import collections
import json
import pathlib
import random
import re
import signal
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = ROOT / "build/release"
sys.path.insert(0, str(ROOT / "scripts"))
from source_text import blank  # noqa: E402

# Which programs hold the tests that concern a library.
PROGRAMS = {
    "base": ["base", "engine"],
    "collision": ["collision", "engine"],
    "engine": ["engine"],
}
# Binary operators stand between blanks, which clang-format sees to; brackets of templates do not.
SWAPS = [
    (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " / "), (r" / ", " * "),
    (r" < ", " <= "), (r" <= ", " < "), (r" > ", " >= "), (r" >= ", " > "),
    (r" < ", " > "), (r" > ", " < "), (r" == ", " != "), (r" != ", " == "),
    (r" && ", " || "), (r" \|\| ", " && "), (r" \+= ", " -= "), (r" -= ", " += "),
    (r"\bstd::min\b", "std::max"), (r"\bstd::max\b", "std::min"),
    (r"\btrue\b", "false"), (r"\bfalse\b", "true"),
    (r"(?<=[(\s])-(?=[a-zA-Z(])", ""), (r"(?<=[(\s])!(?=[a-zA-Z(])", ""),
]
NUMBER = re.compile(r"(?<![\w.'])(\d+\.\d+(?:e-?\d+)?|\d+e-?\d+|\d+)(?![\w.'])")

Mutant = collections.namedtuple("Mutant", "path line old new")


def candidates(path):
    """All mutants of a file."""
    text = path.read_text()
    lines = text.splitlines()
    for number, code in enumerate(blank(text).splitlines()):
        line = lines[number]
        bare = code.strip()
        if not bare or bare.startswith(("#", "template", "using", "static_assert", "namespace", "CAIRN_CHECK")):
            continue
        edits = []
        for pattern, new in SWAPS:
            edits += [(match, new) for match in re.finditer(pattern, code)]
        for match in NUMBER.finditer(code):
            value = match.group(1)
            if "[" in code[max(0, match.start() - 1):match.start()] or "<" in code[match.start() - 1:match.start()]:
                continue  # an index or a template argument
            edits.append((match, "1" if value == "0" else "0" if value == "1" else f"2 * {value}"))
        for match, new in edits:
            yield Mutant(path, number, line, line[:match.start()] + new + line[match.end():])


def slow_cases(program):
    text = (ROOT / "tests/slow_tests.cmake").read_text()
    found = re.search(r"set\(CAIRN_SLOW_" + program + r"\b(.*?)\)", text, re.S)
    return found.group(1).split() if found else []


def build(programs):
    return subprocess.run(["ninja", "-C", str(BUILD), *(f"test_{p}" for p in programs)], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True).returncode == 0


def first_failure(program, limit):
    """The test that fails, "time" where it takes too long, or None."""
    command = [str(BUILD / f"tests/{program}/test_{program}"), "--gtest_fail_fast", "--gtest_brief=1",
               "--gtest_filter=-" + ":".join(slow_cases(program))]
    try:
        run = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=limit,
                             cwd=BUILD / f"tests/{program}", errors="replace")
    except subprocess.TimeoutExpired:
        return "time"
    if run.returncode == 0:
        return None
    named = re.search(r"\[  FAILED  \] ([\w/.]+)", run.stdout)
    return named.group(1) if named else f"exit {run.returncode}"


def judge(mutant, limit):
    """What becomes of a mutant: "no code" where it does not compile, else the test that noticed it, or "survives"."""
    programs = PROGRAMS[mutant.path.relative_to(ROOT).parts[0]]
    whole = mutant.path.read_text()
    lines = whole.splitlines(keepends=True)
    lines[mutant.line] = mutant.new + "\n"
    try:
        mutant.path.write_text("".join(lines))
        if not build(programs):
            return "no code"
        for program in programs:
            failed = first_failure(program, limit)
            if failed:
                return failed
        return "survives"
    finally:
        mutant.path.write_text(whole)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("places", nargs="*", default=["base", "collision", "engine"])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=300, help="seconds that a program of tests may take")
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that what is edited is put back

    places = [(ROOT / place).resolve() for place in options.places]
    if subprocess.run(["git", "diff", "--quiet", "HEAD", "--", *map(str, places)], cwd=ROOT).returncode:
        sys.exit("what is to be mutated has changes that are not committed: commit them first")
    files = sorted(f for place in places for f in ([place] if place.is_file() else place.rglob("*.cpp")))
    mutants = [m for file in files for m in candidates(file)]
    random.Random(options.seed).shuffle(mutants)
    programs = sorted({p for file in files for p in PROGRAMS[file.relative_to(ROOT).parts[0]]})
    if not build(programs) or any(first_failure(p, options.limit) for p in programs):
        sys.exit("the tests fail before anything is mutated")
    print(f"{len(mutants)} mutants are possible in {len(files)} files", flush=True)

    results = []
    for mutant in mutants:
        if len(results) == options.count:
            break
        start = time.monotonic()
        verdict = judge(mutant, options.limit)
        if verdict == "no code":
            continue
        where = f"{mutant.path.relative_to(ROOT)}:{mutant.line + 1}"
        results.append({"where": where, "old": mutant.old.strip(), "new": mutant.new.strip(), "verdict": verdict})
        print(f"{len(results):4} {time.monotonic() - start:5.0f} s  {where}  {verdict}\n"
              f"         {mutant.old.strip()}\n         {mutant.new.strip()}", flush=True)
    build(programs)
    survivors = [r for r in results if r["verdict"] == "survives"]
    print(f"\n{len(results) - len(survivors)} of {len(results)} are noticed")
    for r in survivors:
        print(f"  {r['where']}\n    {r['old']}\n    {r['new']}")
    if options.json:
        options.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
