#!/usr/bin/env python3
"""Changes signs, bounds and constants of the libraries and sees whether the tests notice.

    scripts/mutate.py [--count N] [--seed N] [--limit S] [--jobs N] [--json FILE] [folder or file...]
                                        default: 300 mutants of base, collision and engine

A mutant is one edit of one expression. All of them are built at once, each behind a switch that an environment variable
throws; those that do not compile are left out. One run of the suite tells which tests reach which mutant; then, mutant
by mutant, those tests run until the first fails, the quickest first, for so many seconds. What nothing notices is
listed last: each is a test that is missing or slow, or a line that does nothing. Recorded bits and pictures, which
notice everything, are left out. All of it takes about an hour on two cores. The tree is edited for the minutes in which
it is built and put back: what is mutated must be committed. The build folder (build/release) holds the mutants
afterwards; the next build puts that right.
"""
import argparse
import collections
import concurrent.futures
import json
import os
import pathlib
import random
import re
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = ROOT / "build/release"
sys.path.insert(0, str(ROOT / "scripts"))
from source_text import blank  # noqa: E402

# What compares with a recording of what was.
RECORDINGS = {"golden", "standard"}
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
CONSTANT = re.compile(r"\bconstexpr (?:\w+(?:::\w+)*(?:<\w+>)?) (\w+) = [^;{}]*;")

# What each mutated file is built with. Expressions of Eigen are of one type each, so both are worked out where they are
# chosen between.
SWITCH = """#pragma once
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <type_traits>
#include <utility>
%s
namespace mutants {
inline const int active = [] {
    const char* const id = std::getenv("CAIRN_MUTANT");
    return id == nullptr ? -1 : std::atoi(id);
}();
inline std::atomic<bool> reached[%d];
inline const struct Report {
    ~Report() {
        const char* const path = std::getenv("CAIRN_MUTANTS_REACHED");
        std::FILE* const file = path == nullptr ? nullptr : std::fopen(path, "a");
        if (file != nullptr) {
            for (int id = 0; id < %d; ++id) {
                if (reached[id]) {
                    std::fprintf(file, "%%d\\n", id);
                }
            }
            std::fclose(file);
        }
    }
} report;
inline bool is(int id) {
    reached[id].store(true, std::memory_order_relaxed);
    return active == id;
}
template <class T>
auto plain(T&& x) {
    using Given = std::decay_t<T>;
    if constexpr (requires { typename Given::PlainObject; }) {
        return typename Given::PlainObject(std::forward<T>(x));
    } else {
        return Given(std::forward<T>(x));
    }
}
template <class Mutated, class Given>
auto choose(int id, const Mutated& mutated, const Given& given) -> decltype(plain(given())) {
    if (is(id)) {
        return decltype(plain(given()))(mutated());
    }
    return plain(given());
}
template <class T>
T value(int id, std::type_identity_t<T> mutated, T given) {
    return is(id) ? mutated : given;
}
}  // namespace mutants
"""
QUIET = ["all", "extra", "conversion", "sign-conversion", "float-conversion", "useless-cast", "duplicated-branches",
         "duplicated-cond", "logical-op", "parentheses", "shadow", "old-style-cast", "double-promotion", "unused",
         "bool-compare", "tautological-compare", "unused-but-set-variable", "unused-variable", "bool-operation",
         "sign-compare", "int-in-bool-context", "maybe-uninitialized", "float-equal", "bool-compare"]

# `edits` of the file's text, (begin, end, new) each, with MUTANT where its number comes; `old`, `new`: for people.
Mutant = collections.namedtuple("Mutant", "path line old new edits")


def extent(code, begin, end, isOr):
    """The whole expression that code[begin:end] stands in, up to brackets, commas and assignments; or None."""
    depth, left = 0, begin
    while left > 0:
        c, before = code[left - 1], code[left - 2:left - 1]
        if c in ")]}":
            depth += 1
        elif c in "([{":
            if depth == 0:
                break
            depth -= 1
        elif depth == 0:
            if c in ",;?" or (c == ":" and before != ":" and code[left] != ":"):
                break
            if c == "=" and before not in "<>=!" and code[left] != "=":
                break
            if not isOr and code[left - 2:left] in ("&&", "||") or re.search(r"\breturn$", code[left - 8:left]):
                break
        left -= 1
    right = end
    while right < len(code):
        c = code[right]
        if c in "([{":
            depth += 1
        elif c in ")]}":
            if depth == 0:
                break
            depth -= 1
        elif depth == 0:
            if c in ",;?" or (c == ":" and code[right + 1] != ":" and code[right - 1] != ":"):
                break
            if c == "=" and code[right + 1] != "=" and code[right - 1] not in "<>=!":
                return None
            if not isOr and code[right:right + 2] in ("&&", "||"):
                break
        right += 1
    while left < begin and code[left].isspace():
        left += 1
    while right > end and code[right - 1].isspace():
        right -= 1
    return left, right


def statement(code, begin, end):
    """That of an operator of assignment, where it stands alone; or None."""
    left = max(code.rfind(c, 0, begin) for c in ";{}") + 1
    right = code.find(";", end)
    inner = code[left:right]
    if inner.count("(") != inner.count(")") or "{" in inner or re.match(r"\s*(for|if|while|else|case)\b", inner):
        return None
    return left + len(inner) - len(inner.lstrip()), right + 1


def candidates(path):
    """All mutants of a file."""
    text = path.read_text()
    code = blank(text)
    lines = text.splitlines()
    at = 0
    for number, bare in enumerate(code.splitlines()):
        start, at = at, at + len(bare) + 1
        if not bare.strip() or bare.strip().startswith(
                ("#", "template", "using", "static_assert", "namespace", "CAIRN_CHECK")):
            continue

        def mutant(first, last, new, edits):
            changed = lines[number][:first - start] + new + lines[number][last - start:]
            return Mutant(path, number, lines[number].strip(), changed.strip(), edits)

        constant = CONSTANT.search(bare)
        if constant:
            # Its uses are changed and not itself: it may stand where the compiler wants to know it.
            name = constant.group(1)
            uses = [m for m in re.finditer(rf"(?<![\w.]){name}\b(?!\()", code[at:])]
            edits = [(at + m.start(), at + m.end(), f"mutants::value(MUTANT, 2 * {name}, {name})") for m in uses]
            if uses:
                first = start + constant.end() - 1
                yield mutant(first, first, " * 2", edits)
            continue
        for pattern, new in SWAPS:
            for match in re.finditer(pattern, bare):
                first, last = start + match.start(), start + match.end()
                if new.strip() in ("+=", "-="):
                    found = statement(code, first, last)
                    if found:
                        left, right = found
                        edit = (f"if (mutants::is(MUTANT)) {{ {text[left:first]}{new}{text[last:right]} }} "
                                f"else {{ {text[left:right]} }}")
                        yield mutant(first, last, new, [(left, right, edit.replace("\n", " "))])
                    continue
                found = extent(code, first, last, "|" in pattern or "|" in new)
                if found and "\n" not in text[found[0]:found[1]] or found and "//" not in text[found[0]:found[1]]:
                    left, right = found
                    edit = (f"mutants::choose(MUTANT, [&] {{ return ({text[left:first]}{new}{text[last:right]}); }}, "
                            f"[&] {{ return ({text[left:right]}); }})")
                    lost = text[left:right].count("\n")
                    yield mutant(first, last, new, [(left, right, edit.replace("\n", " ") + "\n" * lost)])
        for match in NUMBER.finditer(bare):
            if bare[max(0, match.start() - 1):match.start()] in ("[", "<"):
                continue  # an index or a template argument
            value = match.group(1)
            new = "1" if value == "0" else "0" if value == "1" else f"2 * {value}"
            first, last = start + match.start(), start + match.end()
            yield mutant(first, last, new, [(first, last, f"mutants::value(MUTANT, {new}, {value})")])


def sample(files, count, seed):
    """So many mutants, none of which edits what another one does."""
    everything = [m for file in files for m in candidates(file)]
    random.Random(seed).shuffle(everything)
    chosen, taken = [], collections.defaultdict(list)
    for mutant in everything:
        spans = taken[mutant.path]
        if any(begin < right and left < end for begin, end, _ in mutant.edits for left, right in spans):
            continue
        spans += [(begin, end) for begin, end, _ in mutant.edits]
        chosen.append(mutant)
        if len(chosen) == count:
            break
    print(f"{len(chosen)} of {len(everything)} mutants of {len(files)} files", flush=True)
    return chosen


def write(mutants, left_out, switch):
    """Edits the files; {path: text before}."""
    before = {}
    for path in {m.path for m in mutants}:
        text = before[path] = path.read_text()
        edits = [(begin, end, new.replace("MUTANT", str(k))) for k, m in enumerate(mutants)
                 if m.path == path and k not in left_out for begin, end, new in m.edits]
        for begin, end, new in sorted(edits, reverse=True):
            text = text[:begin] + new + text[end:]
        path.write_text(f'#include "{switch}"\n#line 1\n{text}')
    return before


def build(mutants, switch):
    """Builds them; the numbers of those that do not compile."""
    left_out = set()
    while True:
        before = write(mutants, left_out, switch)
        try:
            run = subprocess.run(["ninja", "-C", str(BUILD), "-k0"], stdout=subprocess.PIPE,
                                 stderr=subprocess.STDOUT, text=True)
        finally:
            for path, text in before.items():
                path.write_text(text)
        if run.returncode == 0:
            return left_out
        named = {(m.group(1), int(m.group(2))) for m in re.finditer(r"^([^\s:]+):(\d+):\d+: +(?:error|required from)",
                                                                    run.stdout, re.M)}
        wrong = set()
        for k, mutant in enumerate(mutants):
            lines = set()
            text = mutant.path.read_text()
            for begin, end, _ in mutant.edits:
                lines |= set(range(text.count("\n", 0, begin) + 1, text.count("\n", 0, end) + 2))
            if any(str(mutant.path).endswith(path.lstrip("./")) and line in lines for path, line in named):
                wrong.add(k)
        if not wrong - left_out:
            sys.exit("does not build, and not because of a mutant:\n" + run.stdout[-3000:])
        left_out |= wrong
        print(f"{len(left_out)} do not compile", flush=True)


def programs():
    return [p for p in sorted(BUILD.glob("tests/**/test_*"))
            if p.is_file() and os.access(p, os.X_OK) and p.name[5:] not in RECORDINGS]


def run(program, tests, limit, **environment):
    """Of a program's tests; (seconds, what failed or None)."""
    command = [str(program), "--gtest_fail_fast", "--gtest_brief=1", "--gtest_filter=" + tests]
    start = time.monotonic()
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=limit,
                              cwd=program.parent, errors="replace", env={**os.environ, **environment})
    except subprocess.TimeoutExpired:
        return limit, "time"
    if done.returncode == 0:
        return time.monotonic() - start, None
    named = re.search(r"\[  FAILED  \] ([\w/.]+)", done.stdout)
    return time.monotonic() - start, named.group(1) if named else f"exit {done.returncode}"


def reach(pool):
    """{mutant: [(seconds, program, test)]} of all tests."""
    tests = []
    for program in programs():
        listed = subprocess.run([str(program), "--gtest_list_tests"], stdout=subprocess.PIPE, text=True,
                                check=True).stdout
        suite = ""
        for line in listed.splitlines():
            if not line.startswith(" "):
                suite = line.split()[0]
            elif suite.endswith("."):
                tests.append((program, suite + line.split()[0]))

    def one(test):
        with tempfile.NamedTemporaryFile("r") as file:
            seconds, failed = run(*test, 600, CAIRN_MUTANTS_REACHED=file.name)
            return seconds, failed, {int(line) for line in file}

    reached = collections.defaultdict(list)
    for test, (seconds, failed, ids) in zip(tests, pool.map(one, tests)):
        if failed:
            print(f"fails before anything is mutated and is left out: {test[1]} ({failed})", flush=True)
            continue
        for k in ids:
            reached[k].append((seconds, *test))
    return reached


def judge(k, tests, limit):
    """The test that notices mutant k, "not reached" or "survives"."""
    if not tests:
        return "not reached"
    tests = sorted(tests)
    spent, begin = 0, 0
    for most in (2, 10, limit):  # s
        end = begin
        while end < len(tests) and spent + tests[end][0] <= most:
            spent += tests[end][0]
            end += 1
        for program in programs():
            mine = [t for t in tests[begin:end] if t[1] == program]
            if mine:
                due = sum(t[0] for t in mine)
                _, failed = run(program, ":".join(t[2] for t in mine), 10 + 6 * due, CAIRN_MUTANT=str(k))
                if failed:
                    return failed
        begin = end
    return "survives" if begin == len(tests) else f"survives ({len(tests) - begin} slower tests not run)"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("places", nargs="*", default=["base", "collision", "engine"])
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=60, help="seconds of tests a mutant")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that what is edited is put back

    places = [(ROOT / place).resolve() for place in options.places]
    if subprocess.run(["git", "diff", "--quiet", "HEAD", "--", *map(str, places)], cwd=ROOT).returncode:
        sys.exit("what is to be mutated has changes that are not committed: commit them first")
    files = sorted(f for place in places for f in ([place] if place.is_file() else place.rglob("*.cpp")))
    # Half as many again as are asked for, since some will not compile.
    mutants = sample(files, options.count * 3 // 2, options.seed)
    subprocess.run(["cmake", "--preset", "release"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    switch = BUILD / "mutants.hpp"
    quiet = "".join(f'#pragma GCC diagnostic ignored "-W{name}"\n' for name in QUIET)
    switch.write_text(SWITCH % (quiet, len(mutants), len(mutants)))
    left_out = build(mutants, switch)
    chosen = [k for k in range(len(mutants)) if k not in left_out][:options.count]

    results = []
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        reached = reach(pool)
        for k, verdict in zip(chosen, pool.map(lambda k: judge(k, reached[k], options.limit), chosen)):
            mutant = mutants[k]
            where = f"{mutant.path.relative_to(ROOT)}:{mutant.line + 1}"
            results.append({"where": where, "old": mutant.old, "new": mutant.new, "verdict": verdict})
            print(f"{len(results):4}  {where}  {verdict}\n        {mutant.old}\n        {mutant.new}", flush=True)
            if options.json:
                options.json.write_text(json.dumps(results, indent=1))
    lost = [r for r in results if r["verdict"].startswith(("survives", "not reached"))]
    unreached = sum(r["verdict"] == "not reached" for r in lost)
    print(f"\n{len(results) - len(lost)} of {len(results)} are noticed, by "
          f"{len({r['verdict'] for r in results} - {r['verdict'] for r in lost})} tests; {unreached} are not reached")
    for r in lost:
        print(f"  {r['where']}  {r['verdict']}\n    {r['old']}\n    {r['new']}")


if __name__ == "__main__":
    main()
