#!/usr/bin/env python3
"""Runs clang-tidy on what is compiled of some folders or files and prints findings only; check_tidy.sh calls it.

    scripts/run_tidy.py BUILD PLACE...

What was found clean is not looked at again while all that clang-tidy reads stays as it is: its version, the settings,
how the file is compiled, and the text with its comments, macros and headers. Only the hash of that is kept, in
$CAIRN_TIDY_CACHE, by default in the user's cache folder; CAIRN_TIDY_CACHE= (empty) looks at everything."""
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import time

ROOT = pathlib.Path.cwd()
CACHE_DAYS = 30  # after which what was not asked for again is forgotten


def compiled(build, places):
    """What is compiled of these places, the largest first, so that no core waits for the others at the end: each a
    source, or a file of the build folder that includes several, with its compile command."""
    found = {place: None for place in places if place.is_file()}
    for command in json.loads((build / "compile_commands.json").read_text()):
        file = home = pathlib.Path(command["file"]).relative_to(ROOT)
        if build in file.parents:
            if "Unity" not in file.parts:
                continue  # made by the build
            home = file.relative_to(build)
        if any(place == home or place in home.parents for place in places):
            found[file] = command
    # A list of includes is larger than it looks.
    return sorted(found.items(), reverse=True,
                  key=lambda item: item[0].stat().st_size * (1000 if "Unity" in item[0].parts else 1))


def settings_of(checks):
    version = subprocess.run(["clang-tidy", "--version"], check=True, capture_output=True, text=True).stdout
    files = [ROOT / ".clang-tidy", ROOT / "tests" / ".clang-tidy", pathlib.Path(__file__)]
    return version + checks + "".join(file.read_text() for file in files)


def hash_of(file, command, settings):
    """Of all that clang-tidy reads; None: it cannot be told."""
    if command is None:
        return None
    words = shlex.split(command["command"])
    compiler = next((i for i, word in enumerate(words) if re.search(r"(^|/)[^/]*(\+\+|clang)[-.\d]*$", word)), None)
    if compiler is None or "-o" not in words:
        return None
    out = words.index("-o")
    words = ["clang++"] + words[compiler + 1:out] + words[out + 2:]
    text = subprocess.run(words + ["-w", "-Wno-error", "-E", "-CC", "-dD"], cwd=command["directory"],
                          stdin=subprocess.DEVNULL, capture_output=True)
    if text.returncode != 0:
        return None
    told = "\n".join([settings, str(file), shlex.join(words)]).encode() + text.stdout
    return hashlib.sha256(told.replace(bytes(ROOT) + b"/", b"")).hexdigest()


def look_at(build, file, command, cache):
    """What clang-tidy finds in a file; None: nothing."""
    # Sources are included by another, as they should not be elsewhere.
    checks = "-bugprone-suspicious-include" if "Unity" in file.parts else ""
    digest = hash_of(file, command, settings_of(checks)) if cache else None
    clean = cache / digest if digest else None
    if clean and clean.exists():
        clean.touch()
        return None
    # The compile commands are g++'s: some of its warnings clang does not know.
    tidy = subprocess.run(["clang-tidy", "-p", str(build), "--quiet", f"--checks={checks}",
                           "--extra-arg=-Wno-unknown-warning-option", str(file)],
                          stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if tidy.returncode != 0:
        return tidy.stdout or tidy.stderr
    if clean:
        clean.touch()
    return None


def cache_folder():
    home = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache")
    folder = os.environ.get("CAIRN_TIDY_CACHE", str(home / "cairn_tidy"))
    if not folder:
        return None
    cache = pathlib.Path(folder)
    cache.mkdir(parents=True, exist_ok=True)
    for old in cache.iterdir():
        if old.stat().st_mtime < time.time() - CACHE_DAYS * 86400:
            old.unlink(missing_ok=True)
    return cache


def main():
    build, places = pathlib.Path(sys.argv[1]), [pathlib.Path(place) for place in sys.argv[2:]]
    cache = cache_folder()
    failed = False
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        answers = [pool.submit(look_at, build, file, command, cache) for file, command in compiled(build, places)]
        for answer in concurrent.futures.as_completed(answers):
            if answer.result() is not None:
                failed = True
                print(answer.result(), flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
