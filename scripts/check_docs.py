#!/usr/bin/env python3
"""Numbers in the documentation against the commands that make them; the list of claims is scripts/doc_claims.json.

    scripts/check_docs.sh [--all] [--fix] [words...]    words: only claims whose file or text has one of them
    --all    also those that take over a second
    --fix    writes what was measured into the documentation, with as many digits as stand there

A claim has
  file     the page
  text     a quotation from it: each # is a number that is checked, each * stands for the rest of a table's cell or of
           a line, a space for any white space, a line's end for itself
  under    the heading that it stands under, as the page writes it; left out: anywhere
  command  what follows `cairn` and takes --json, or the name of a JSON file of this tree; commands: one for each #
  value    a JSON pointer into what the command tells (of several, with | between, the largest counts), and the unit
           of the page: mm, k (thousands) or none; values: one for each #
  noise    relative, by which a number may be off for other reasons than a change of Cairn: another compiler's rounding,
           chance. Half of the last digit that stands on the page comes on top
  for      {name: [words]}: the claim is made once for each word, which takes the place of {name}
  falls    a number from which on the page says "falls" instead
  flags    {flag: letter}: the letters of the flags that the command raised stand after the number
  slow     it takes over a second
Files that pages name must be there, too.
Exit code: 0; 1: a number is off by more, a text is no longer on its page, or a file is missing."""
import argparse
import concurrent.futures
import json
import math
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
UNITS = {"": 1, "mm": 1e3, "k": 1e-3}
NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?"


class Claim:
    def __init__(self, entry):
        self.file = entry["file"]
        self.text = entry["text"]
        self.under = entry.get("under")
        self.noise = entry["noise"]
        self.falls = entry.get("falls")
        self.flags = entry.get("flags", {})
        self.slow = entry.get("slow", False)
        count = self.text.count("#")
        self.commands = entry.get("commands", [entry.get("command")] * count)
        self.values = entry.get("values", [entry.get("value")] * count)
        if not len(self.commands) == len(self.values) == count > 0:
            raise SystemExit(f"doc_claims.json: {self.text!r}: {count} numbers, {len(self.commands)} commands, "
                             f"{len(self.values)} values: give as many of each")

    def pattern(self):
        parts = []
        for part in re.split(r"(#|\*|\s+)", self.text):
            if part == "#":
                letters = "".join(self.flags.values())
                parts.append(rf"({NUMBER}|falls)" + (rf"((?: [{letters}]+)?)" if letters else "()"))
            elif part == "*":
                parts.append(r"[^|\n]*?")
            else:
                parts.append(r"[ ]*\n" if "\n" in part else r"\s+" if part.isspace() else re.escape(part))
        return re.compile("".join(parts))

    def places(self, page):
        """Where the text stands under its heading."""
        start, end = 0, len(page)
        if self.under:
            start = page.find(f"\n{self.under}\n") + 1
            following = re.compile(r"^#", re.MULTILINE).search(page, start + 1)
            end = following.start() if following else end
            if start == 0:
                return []
        return list(self.pattern().finditer(page, start, end))


def expand(entries):
    """Entries with `for` once for each word."""
    for entry in entries:
        words = entry.pop("for", None)
        if words is None:
            yield Claim(entry)
            continue
        (name, choices), = words.items()
        for choice in choices:
            yield Claim(json.loads(json.dumps(entry).replace("{" + name + "}", choice)))


def named(command):
    return command if command.endswith(".json") else "cairn " + command


def run(root, cairn, command):
    """What a command tells, or why it does not."""
    if command.endswith(".json"):
        return json.loads((root / command).read_text())
    done = subprocess.run([cairn, *command.split(), "--json", "-"], cwd=root, capture_output=True, text=True)
    try:
        return json.loads(done.stdout)
    except json.JSONDecodeError:
        return f"`{named(command)}` told no JSON: {done.stderr.strip()}"


def look_up(told, value):
    pointers, _, unit = value.rpartition(" ") if value.rpartition(" ")[2] in UNITS else (value, "", "")
    found = []
    for pointer in pointers.split("|"):
        at = told
        for key in pointer.strip("/").split("/"):
            at = at[int(key) if isinstance(at, list) else key]
        found.append(math.inf if at is None else at)
    return max(found) * UNITS[unit]


def last_digit(said):
    """Half of the last digit of a number as it is written."""
    digits, _, exponent = said.partition("e")
    _, point, decimals = digits.partition(".")
    whole = len(digits) - len(digits.rstrip("0")) if not point else 0
    return 0.5 * 10.0 ** (int(exponent or 0) - len(decimals) + whole)


def written(measured, said):
    """A number with as many digits, and as bare, as what stands there."""
    digits = re.sub(r"e.*", "", said).replace(".", "").strip("0")
    text = f"{measured:.{max(1, len(digits))}g}"
    text = re.sub(r"e([+-])0*", lambda sign: "e" + sign.group(1).strip("+"), text)
    if "e" in text and abs(measured) >= 1:
        text = f"{float(text):.0f}"
    return text.replace("0.", ".", 1) if said.startswith(".") and text.startswith("0.") else text


def told_flags(told, flags):
    letters = "".join(letter for flag, letter in flags.items() if flag in told.get("flags", []))
    return " " + letters if letters else ""


def check(claim, page, told):
    """(the page, mended; what is wrong)."""
    found = claim.places(page)
    if len(found) != 1:
        return page, [f"{claim.file}: stands there {len(found)} times, not once: {claim.text.strip()}"]
    wrong, pieces, end = [], [], 0
    for k, (command, value) in enumerate(zip(claim.commands, claim.values)):
        said, letters = found[0].group(1 + 2 * k), found[0].group(2 + 2 * k)
        if isinstance(told[command], str):
            return page, [f"{claim.file}: {told[command]}"]
        measured = look_up(told[command], value)
        flags = told_flags(told[command], claim.flags)
        falls = claim.falls is not None and measured >= claim.falls
        if said == "falls" or falls:
            right = falls and said == "falls"
        else:
            right = abs(measured - float(said)) <= claim.noise * abs(float(said)) + last_digit(said)
        if not right or letters != flags:
            now = ("falls" if falls else written(measured, said if said != "falls" else "1.00")) + flags
            wrong.append(f"{claim.file}: says {said}{letters}, `{named(command)}` says {now}: {claim.text.strip()}")
            pieces += [page[end:found[0].start(1 + 2 * k)], now]
            end = found[0].end(2 + 2 * k)
    return "".join(pieces) + page[end:], wrong


def missing_paths(root):
    """Files and folders that pages name and that are not there."""
    folders = "base|bench|cmake|collision|command|demos|docs|engine|include|render|scripts|tests"
    for page in [root / "README.md", root / "CONTRIBUTING.md", *sorted((root / "docs").glob("*.md"))]:
        for path in re.findall(rf"`((?:{folders})/[\w./-]+)`", page.read_text() if page.exists() else ""):
            if not (root / path).exists():
                yield f"{page.relative_to(root)}: {path} is not there"


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--fix", action="store_true")
    parser.add_argument("--cairn", required=True)
    parser.add_argument("--claims", default=ROOT / "scripts" / "doc_claims.json", type=pathlib.Path)
    parser.add_argument("--root", default=ROOT, type=pathlib.Path)
    parser.add_argument("words", nargs="*")
    options = parser.parse_args(arguments)
    claims = [claim for claim in expand(json.loads(options.claims.read_text()))
              if (options.all or not claim.slow) and
              (not options.words or any(word in claim.file + claim.text for word in options.words))]
    commands = sorted({command for claim in claims for command in claim.commands})
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        told = dict(zip(commands, pool.map(lambda command: run(options.root, options.cairn, command), commands)))
    wrong, pages = list(missing_paths(options.root)), {}
    for claim in claims:
        before = pages.get(claim.file) or (options.root / claim.file).read_text()
        pages[claim.file], more = check(claim, before, told)
        wrong += more
    if options.fix:
        for file, page in pages.items():
            (options.root / file).write_text(page)
    for words in wrong:
        print(words)
    print(f"docs: {sum(len(claim.commands) for claim in claims)} numbers by {len(commands)} commands, "
          f"{len(wrong)} off")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
