#!/usr/bin/env python3
"""Holds the includes of the tree against its layers: fails on a wrong direction, on a circle between files and on a
circle between folders.

    scripts/check_includes.py                        checks; prints a summary and each finding as file:line
    scripts/check_includes.py --draw includes.svg    draws the folders with their arrows too (or a .dot file)
    scripts/check_includes.py --lines                long functions and long files of the libraries
    scripts/check_includes.py --max-function 80      the same, and fails where a function is longer

Needs Python 3.9 and nothing beside it. Exit code 1: there are findings; 2: bad usage."""
import sys
sys.dont_write_bytecode = True

import argparse
import collections
import fnmatch
import json
import pathlib
import posixpath
import re

import include_picture
import source_text

# Each layer with what it stands on: a file may include its own layer, those, and all that they stand on in turn.
# Lowest first. A layer is a folder with all folders in it.
LAYERS = {
    "base": [],
    "collision": ["base"],
    "engine/model": ["collision"],
    "engine/constraints": ["engine/model"],
    "engine/contacts": ["engine/constraints"],
    "engine/islands": ["engine/contacts"],
    "engine/problem": ["engine/islands"],
    "engine/measure": ["engine/problem"],
    "engine/solve": ["engine/measure"],
    "engine/world": ["engine/solve"],
    "engine/analysis": ["engine/world"],
    "assets": ["engine/analysis"],
    "render": ["base"],
    "demos": ["assets", "render"],
    "command": ["demos"],
}

# The headers in include/cairn, without their .hpp, by the lowest layer that may include them; the first line that
# fits counts. They include each other by the same rule, and nothing else of the project.
PUBLIC = [
    ("base", ["id", "input_error", "jobs", "pose", "triangle_mesh", "types", "version"]),
    ("collision", ["narrow_counts", "narrow_phase", "shape_query", "shapes"]),
    ("assets", ["assets", "assets/*"]),
    ("render", ["render", "render/*"]),
    ("engine/model", ["*"]),
]

# Libraries that only some files may see: the beginning of their headers' names, the files.
LIBRARIES = {
    "fcl/": ["collision/*/fcl_*", "collision/fcl_*"],
    "ccd/": ["collision/*/ccd_*", "collision/ccd_*", "collision/*/fcl_*", "collision/fcl_*"],
    "hwy/": ["base/vector_lanes.hpp", "base/vector_targets.hpp", "collision/shapes/vector_groups.cpp",
             "engine/problem/turn_kernels.cpp", "engine/solve/kernels/*"],
}

# Headers that only the build makes, so that no such file is in the tree.
GENERATED = []

# Above all layers: these include what they like, and no layer includes them.
FREE = ["tests", "bench", "python", "c"]

# Not part of this tree's includes: a project of its own, and what is built or hidden.
LEFT_OUT = ["demos/game", "build*", "out", ".*"]

# Long functions and files are looked for here.
LIBRARY_FOLDERS = ["include", "base", "collision", "engine", "assets", "render"]
MAX_FUNCTION = 80
MAX_FILE = 600

PUBLIC_FOLDER = "include/cairn"
SUFFIXES = (".hpp", ".cpp", ".h", ".c", ".inl")
# What a public header may include beside others of its kind: the standard library and Eigen.
PUBLIC_SYSTEM = re.compile(r"[a-z_0-9]+|(std|c)?[a-z]+\.h|Eigen/\w+")

Arrow = collections.namedtuple("Arrow", "file line target")
Finding = collections.namedtuple("Finding", "file line words")


class Layers:
    """The tables above, or those of a JSON file under the same names in small letters."""

    def __init__(self, tables):
        self.stands_on = tables.get("layers", LAYERS)
        self.public = tables.get("public", PUBLIC)
        self.libraries = tables.get("libraries", LIBRARIES)
        self.generated = tables.get("generated", GENERATED)
        self.free = tables.get("free", FREE)
        self.left_out = tables.get("left_out", LEFT_OUT)
        self.order = list(self.stands_on)
        self.reach = {}
        for layer in self.order:
            below = {layer}
            for under in self.stands_on[layer]:
                if under not in self.reach:
                    raise ValueError(f"layer {layer} stands on {under}, which is not in a line above it")
                below |= self.reach[under]
            self.reach[layer] = below

    def of(self, file):
        """The layer of a file; None: it is free, or it stands nowhere."""
        if file.startswith(PUBLIC_FOLDER + "/"):
            name = posixpath.splitext(file[len(PUBLIC_FOLDER) + 1:])[0]
            return next((layer for layer, names in self.public if any(fnmatch.fnmatchcase(name, n) for n in names)),
                        None)
        fitting = [layer for layer in self.order if file.startswith(layer + "/")]
        return max(fitting, key=len, default=None)

    def is_free(self, file):
        return file.split("/")[0] in self.free

    def is_generated(self, file):
        return any(fnmatch.fnmatchcase(file, pattern) for pattern in self.generated)

    def is_left_out(self, path):
        return any(fnmatch.fnmatchcase(path, pattern) or fnmatch.fnmatchcase(posixpath.basename(path), pattern)
                   for pattern in self.left_out)


class Tree:
    """The sources under a root, and the arrows between them."""

    def __init__(self, root, layers):
        self.layers = layers
        self.texts = {}
        self._read(pathlib.Path(root), "", layers)
        self.arrows = []    # between files of the project
        self.findings = []  # includes that cannot be an arrow
        self.system = []    # Arrows to what is outside of the project
        for file in self.texts:
            for line, form, name in source_text.includes(self.texts[file]):
                self._add(file, line, form, name)

    def _read(self, folder, prefix, layers):
        for entry in sorted(folder.iterdir()):
            path = prefix + entry.name
            if layers.is_left_out(path) or entry.is_symlink():
                continue
            if entry.is_dir():
                self._read(entry, path + "/", layers)
            elif entry.suffix in SUFFIXES:
                self.texts[path] = entry.read_text(encoding="utf-8", errors="replace")

    def _add(self, file, line, form, name):
        beside = posixpath.normpath(posixpath.join(posixpath.dirname(file), name))
        if form == "<" and name.startswith("cairn/"):
            target = posixpath.join(posixpath.dirname(PUBLIC_FOLDER), name)
            if target not in self.texts:
                self.findings.append(Finding(file, line, f"includes <{name}>: there is no {target}"))
                return
        elif name in self.texts:
            target = name
            if name.startswith(PUBLIC_FOLDER + "/"):
                self.findings.append(Finding(
                    file, line, f"includes {name}: write <{posixpath.relpath(name, posixpath.dirname(PUBLIC_FOLDER))}>"))
            elif form == "<":
                self.findings.append(Finding(file, line, f'includes <{name}>: write "{name}", it is not installed'))
        elif form == "<":
            self.system.append(Arrow(file, line, name))
            return
        elif beside in self.texts:
            target = beside
            if not self.layers.is_free(file):
                self.findings.append(Finding(file, line, f'includes "{name}": write its path from the root, "{beside}"'))
        else:
            if not self.layers.is_generated(name):
                self.findings.append(Finding(file, line, f'includes "{name}": there is no such file'))
            return
        self.arrows.append(Arrow(file, line, target))


def direction_findings(tree):
    layers = tree.layers
    findings = []
    for file in tree.texts:
        if layers.of(file) is None and not layers.is_free(file):
            findings.append(Finding(file, 1, "stands in no layer: see the tables at the head of this script"))
    for arrow in tree.arrows:
        words = _wrong(layers, arrow.file, arrow.target)
        if words:
            findings.append(Finding(arrow.file, arrow.line, f"includes {arrow.target}: {words}"))
    for arrow in tree.system:
        if arrow.file.startswith(PUBLIC_FOLDER + "/") and not PUBLIC_SYSTEM.fullmatch(arrow.target):
            findings.append(Finding(arrow.file, arrow.line, f"includes <{arrow.target}>: a public header may include "
                                    "public headers, the standard library and Eigen only"))
        for library, seen_by in layers.libraries.items():
            if (arrow.target.startswith(library) and not layers.is_free(arrow.file) and
                    not any(fnmatch.fnmatchcase(arrow.file, pattern) for pattern in seen_by)):
                findings.append(Finding(arrow.file, arrow.line,
                                        f"includes <{arrow.target}>: only {', '.join(seen_by)} may"))
    return findings


def _wrong(layers, file, target):
    """Why this arrow may not be; empty: it may."""
    if layers.is_free(file):
        return ""
    if layers.is_free(target):
        return f"no layer includes {target.split('/')[0]}"
    if file.startswith(PUBLIC_FOLDER + "/") and not target.startswith(PUBLIC_FOLDER + "/"):
        return "a public header may not include what is not installed"
    own, other = layers.of(file), layers.of(target)
    if own is None or other is None or other in layers.reach[own]:
        return ""
    if own in layers.reach[other]:
        return f"{own} stands below {other}"
    return f"{own} does not stand on {other}"


def circles(arrows):
    """The shortest circle through each knot (strongly connected component) of a graph, as lists of nodes.
    `arrows`: node -> set of nodes."""
    found = []
    for knot in _knots(arrows):
        shortest = None
        for start in sorted(knot):
            circle = _circle_from(start, arrows, knot)
            if circle and (shortest is None or len(circle) < len(shortest)):
                shortest = circle
        found.append(shortest)
    return found


def _knots(arrows):
    """Tarjan's strongly connected components of more than one node, or of one that points to itself; without
    recursion, which deep chains of includes would exhaust."""
    index, low, on_stack, stack, knots = {}, {}, set(), [], []
    for root in sorted(arrows):
        if root in index:
            continue
        work = [(root, iter(sorted(arrows.get(root, ()))))]
        index[root] = low[root] = len(index)
        stack.append(root)
        on_stack.add(root)
        while work:
            node, rest = work[-1]
            following = next(rest, None)
            if following is None:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    knot = set()
                    while node not in knot:
                        knot.add(stack.pop())
                    on_stack -= knot
                    if len(knot) > 1 or node in arrows.get(node, ()):
                        knots.append(knot)
            elif following not in index:
                index[following] = low[following] = len(index)
                stack.append(following)
                on_stack.add(following)
                work.append((following, iter(sorted(arrows.get(following, ())))))
            elif following in on_stack:
                low[node] = min(low[node], index[following])
    return knots


def _circle_from(start, arrows, knot):
    came_from = {}
    queue = collections.deque([start])
    while queue:
        node = queue.popleft()
        for following in sorted(arrows.get(node, ())):
            if following == start:
                circle = [node]
                while circle[-1] != start:
                    circle.append(came_from[circle[-1]])
                return circle[::-1]
            if following in knot and following not in came_from:
                came_from[following] = node
                queue.append(following)
    return None


def file_circle_findings(tree):
    graph = collections.defaultdict(set)
    first = {}
    for arrow in tree.arrows:
        graph[arrow.file].add(arrow.target)
        first.setdefault((arrow.file, arrow.target), arrow)
    findings = []
    for circle in circles(graph):
        steps = [first[pair] for pair in zip(circle, circle[1:] + circle[:1])]
        findings.append(Finding(steps[0].file, steps[0].line, "circle of files: " +
                                " -> ".join(f"{a.file}:{a.line}" for a in steps) + f" -> {circle[0]}"))
    return findings


def folder_circle_findings(tree):
    """At each level of the tree, a folder with all that is in it is one thing, and so is each unit (.hpp and .cpp of
    one name) that lies beside it: between these there is no circle. Arrows of a wrong direction are told elsewhere."""
    right = [a for a in tree.arrows if not tree.layers.is_free(a.file) and
             not _wrong(tree.layers, a.file, a.target)]
    graphs = collections.defaultdict(lambda: collections.defaultdict(set))
    first = {}
    for arrow in right:
        own, other = arrow.file.split("/"), arrow.target.split("/")
        level = 0
        while own[level] == other[level] and level + 1 < min(len(own), len(other)):
            level += 1
        nodes = tuple(_node(parts, level) for parts in (own, other))
        if nodes[0] != nodes[1]:
            graphs["/".join(own[:level])][nodes[0]].add(nodes[1])
            first.setdefault(nodes, arrow)
    findings = []
    for level in sorted(graphs):
        for circle in circles(graphs[level]):
            if any(node.endswith("/") for node in circle):  # others are pairs of units, which is no folder's matter
                steps = [first[pair] for pair in zip(circle, circle[1:] + circle[:1])]
                findings.append(Finding(
                    steps[0].file, steps[0].line,
                    "circle of folders: " + " -> ".join(circle + circle[:1]) + " by " +
                    ", ".join(f"{a.file}:{a.line} -> {a.target}" for a in steps)))
    return findings


def _node(parts, level):
    if level + 1 < len(parts):
        return "/".join(parts[:level + 1]) + "/"
    return posixpath.splitext("/".join(parts))[0]


def both_ways(tree):
    """Folders whose own files include each other both ways, though through no circle: worth a look, no finding."""
    pairs = {(posixpath.dirname(a.file), posixpath.dirname(a.target)) for a in tree.arrows
             if not tree.layers.is_free(a.file)}
    return sorted((a, b) for a, b in pairs if a < b and (b, a) in pairs)


def long_functions(tree, longest):
    found = []
    for file, text in tree.texts.items():
        if file.split("/")[0] in LIBRARY_FOLDERS:
            for first, last, name in source_text.functions(text):
                if last - first + 1 > longest:
                    found.append((last - first + 1, file, first, name))
    return sorted(found, reverse=True)


def long_files(tree, longest):
    lengths = ((text.count("\n"), file) for file, text in tree.texts.items()
               if file.split("/")[0] in LIBRARY_FOLDERS)
    return sorted((entry for entry in lengths if entry[0] > longest), reverse=True)


def folder_graph(tree):
    """(rows, arrows) for the picture: folders from the top layer to the lowest, and how often one includes another,
    with whether that is a wrong direction."""
    def row(file):
        folder = posixpath.dirname(file)
        layer = tree.layers.of(file)
        return (folder, layer) if file.startswith(PUBLIC_FOLDER + "/") else (folder, None)

    rows = collections.defaultdict(list)
    for file in tree.texts:
        if not tree.layers.is_free(file) and tree.layers.of(file) is not None:
            rows[row(file)].append(file)
    order = tree.layers.order

    def height(key):
        folder, public_layer = key
        return (order.index(public_layer or tree.layers.of(folder + "/x")), public_layer is None)

    arrows = collections.Counter()
    wrong = set()
    for arrow in tree.arrows:
        pair = row(arrow.file), row(arrow.target)
        if pair[0] != pair[1] and pair[0] in rows and pair[1] in rows:
            arrows[pair] += 1
            if _wrong(tree.layers, arrow.file, arrow.target):
                wrong.add(pair)
    picture_rows = []
    left = set(rows)
    while left:
        # Within a layer, who is included by none of those left comes first.
        top = max(map(height, left))
        same = sorted(key for key in left if height(key) == top)
        key = next((k for k in same if not any((other, k) in arrows for other in same)), same[0])
        left.remove(key)
        folder, public_layer = key
        lines = sum(tree.texts[file].count("\n") for file in rows[key])
        shared = sum(other == folder for other, _ in rows) > 1  # the folder's headers are of several layers
        label = f"{folder}, from {public_layer} on" if shared else folder
        picture_rows.append((key, label, len(rows[key]), lines))
    return picture_rows, {pair: (count, pair in wrong) for pair, count in arrows.items()}


def check_lines(tree, arguments):
    longest = arguments.max_function if arguments.max_function is not None else MAX_FUNCTION
    functions = long_functions(tree, longest)
    for length, file, first, name in functions:
        print(f"{file}:{first}: {name} has {length} lines")
    longest_file = arguments.max_file if arguments.max_file is not None else MAX_FILE
    files = long_files(tree, longest_file)
    for length, file in files:
        print(f"{file}: {length} lines")
    print(f"lines: {len(functions)} functions over {longest} lines, {len(files)} files over {longest_file}")
    return bool(functions and arguments.max_function is not None) or bool(files and arguments.max_file is not None)


def check_arrows(tree, notes):
    findings = (tree.findings + direction_findings(tree) + file_circle_findings(tree) +
                folder_circle_findings(tree))
    for finding in sorted(findings):
        print(f"{finding.file}:{finding.line}: {finding.words}")
    for a, b in both_ways(tree) if notes else ():
        print(f"note: files of {a} and of {b} include each other, in no circle")
    folders = {posixpath.dirname(file) for file in tree.texts}
    print(f"includes: {len(tree.texts)} files in {len(folders)} folders, {len(tree.arrows)} arrows, "
          f"{len(findings)} findings")
    return bool(findings)


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", default=pathlib.Path(__file__).resolve().parent.parent, type=pathlib.Path,
                        help="the tree (default: the one that this script lies in)")
    parser.add_argument("--layers", type=pathlib.Path, help="a JSON file with other tables than this script's")
    parser.add_argument("--draw", type=pathlib.Path, metavar="FILE", help="draws the folders: FILE.svg or FILE.dot")
    parser.add_argument("--notes", action="store_true",
                        help="says too which folders include each other both ways, though in no circle")
    parser.add_argument("--lines", action="store_true", help="long functions and files instead of includes")
    parser.add_argument("--max-function", type=int, metavar="N", help="as --lines; fails on a function over N lines")
    parser.add_argument("--max-file", type=int, metavar="N", help="as --lines; fails on a file over N lines")
    arguments = parser.parse_args(words)
    if arguments.draw and arguments.draw.suffix not in (".svg", ".dot"):
        parser.error(f"--draw {arguments.draw}: give a file that ends in .svg or .dot")
    try:
        layers = Layers(json.loads(arguments.layers.read_text()) if arguments.layers else {})
        tree = Tree(arguments.root, layers)
    except (OSError, ValueError) as error:
        parser.error(str(error))
    if arguments.draw:
        draw = include_picture.svg if arguments.draw.suffix == ".svg" else include_picture.dot
        arguments.draw.write_text(draw(*folder_graph(tree)), encoding="utf-8")
    if arguments.lines or arguments.max_function is not None or arguments.max_file is not None:
        return int(check_lines(tree, arguments))
    return int(check_arrows(tree, arguments.notes))


if __name__ == "__main__":
    sys.exit(main())
