#!/usr/bin/env python3
"""Writes the meshes, the height grid and arch.json of this folder; run it here after a change. All are the project's own.

Metres, y up, faces counter-clockwise seen from outside. tests/assets checks their volumes against closed forms.
"""
import json
import math
import random
import struct


def write_obj(name, title, vertices, faces):
    with open(name, "w") as out:
        out.write(f"# {title}\n")
        for v in vertices:
            out.write("v " + " ".join(f"{x:.6f}" for x in v) + "\n")
        for face in faces:
            out.write("f " + " ".join(str(i + 1) for i in face) + "\n")


def subtract(a, b):
    return [a[i] - b[i] for i in range(3)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def write_stl(name, title, vertices, faces):
    """Text STL; quads are cut in two."""
    with open(name, "w") as out:
        out.write(f"solid {title}\n")
        for face in faces:
            for k in range(1, len(face) - 1):
                corners = [vertices[face[0]], vertices[face[k]], vertices[face[k + 1]]]
                normal = cross(subtract(corners[1], corners[0]), subtract(corners[2], corners[0]))
                length = math.sqrt(sum(x * x for x in normal))
                out.write("facet normal " + " ".join(f"{x / length:.6f}" for x in normal) + "\nouter loop\n")
                for corner in corners:
                    out.write("vertex " + " ".join(f"{x:.6f}" for x in corner) + "\n")
                out.write("endloop\nendfacet\n")
        out.write(f"endsolid {title}\n")


def write_glb(name, title, vertices, faces, translation):
    """Binary glTF 2.0 with one node, moved by `translation`."""
    triangles = [(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)]
    positions = b"".join(struct.pack("<3f", *v) for v in vertices)
    indices = b"".join(struct.pack("<3H", *t) for t in triangles)
    indices += b"\0" * (-len(indices) % 4)
    document = {
        "asset": {"version": "2.0", "generator": "cairn"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": title, "mesh": 0, "translation": translation}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}]}],
        "buffers": [{"byteLength": len(positions) + len(indices)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(positions), "target": 34962},
            {"buffer": 0, "byteOffset": len(positions), "byteLength": len(indices), "target": 34963},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3",
             "min": [min(v[i] for v in vertices) for i in range(3)],
             "max": [max(v[i] for v in vertices) for i in range(3)]},
            {"bufferView": 1, "componentType": 5123, "count": 3 * len(triangles), "type": "SCALAR"},
        ],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary = positions + indices
    with open(name, "wb") as out:
        out.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(binary)))
        out.write(struct.pack("<I4s", len(text), b"JSON") + text)
        out.write(struct.pack("<I4s", len(binary), b"BIN\0") + binary)


def extrude(outline, z):
    """A prism over a polygon in x, y that is counter-clockwise seen from +z, from -z to +z."""
    n = len(outline)
    vertices = [(x, y, -z) for x, y in outline] + [(x, y, z) for x, y in outline]
    sides = [(i, (i + 1) % n, n + (i + 1) % n, n + i) for i in range(n)]
    return vertices, sides


def rock():
    """An icosahedron cut once finer, its corners pushed in and out, about 0.5 m across."""
    golden = (1 + math.sqrt(5)) / 2
    vertices = [(-1, golden, 0), (1, golden, 0), (-1, -golden, 0), (1, -golden, 0), (0, -1, golden), (0, 1, golden),
                (0, -1, -golden), (0, 1, -golden), (golden, 0, -1), (golden, 0, 1), (-golden, 0, -1), (-golden, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
             (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
             (8, 6, 7), (9, 8, 1)]
    middles = {}

    def middle(a, b):
        key = (min(a, b), max(a, b))
        if key not in middles:
            middles[key] = len(vertices)
            vertices.append([(vertices[a][i] + vertices[b][i]) / 2 for i in range(3)])
        return middles[key]

    fine = []
    for a, b, c in faces:
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        fine += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    chance = random.Random(7)
    bumpy = []
    for v in vertices:
        length = math.sqrt(sum(x * x for x in v))
        radius = chance.uniform(0.21, 0.29)
        bumpy.append((1.15 * radius * v[0] / length, 0.8 * radius * v[1] / length, radius * v[2] / length))
    return bumpy, fine


def stairs(steps=6, run=0.3, rise=0.17, half_width=0.8):
    """Climbing along +x from the origin. Each side is cut into one quad a step."""
    outline = [(0, 0), (steps * run, 0)]
    for i in reversed(range(steps)):
        outline += [((i + 1) * run, (i + 1) * rise), (i * run, (i + 1) * rise)]
    vertices, faces = extrude(outline, half_width)
    n = len(outline)
    floor = []
    for i in range(steps + 1):
        floor.append(len(vertices))
        vertices += [(i * run, 0, -half_width), (i * run, 0, half_width)]
    for i in range(steps):
        # Corners of step i in the outline: its nose at (i + 1, i + 1) and its back at (i, i + 1).
        nose, back = 2 + 2 * (steps - 1 - i), 3 + 2 * (steps - 1 - i)
        faces.append((floor[i], back, nose, floor[i + 1]))
        faces.append((floor[i] + 1, floor[i + 1] + 1, n + nose, n + back))
    return vertices, faces


def bowl(segments=24, rings=6, inner=0.5, outer=0.56):
    """Half a spherical shell, open above, its lowest outer point at y = 0."""
    vertices, faces = [], []

    def ring(radius, k):
        angle = math.pi / 2 * k / rings  # from the bottom pole to the rim
        first = len(vertices)
        for s in range(segments):
            turn = 2 * math.pi * s / segments
            vertices.append((radius * math.sin(angle) * math.cos(turn), outer - radius * math.cos(angle),
                             radius * math.sin(angle) * math.sin(turn)))
        return first

    def shell(radius, inwards):
        pole = len(vertices)
        vertices.append((0, outer - radius, 0))
        previous = None
        for k in range(1, rings + 1):
            current = ring(radius, k)
            for s in range(segments):
                t = (s + 1) % segments
                face = (pole, current + s, current + t) if previous is None else (
                    previous + s, current + s, current + t, previous + t)
                faces.append(tuple(reversed(face)) if inwards else face)
            previous = current
        return previous

    outside, inside = shell(outer, False), shell(inner, True)
    for s in range(segments):
        t = (s + 1) % segments
        faces.append((outside + s, inside + s, inside + t, outside + t))
    return vertices, faces


def voussoir(stones=9, inner=1.0, outer=1.3, half_depth=0.2):
    """The topmost of `stones` equal wedges of a half-circle arch centred at the origin."""
    half = math.pi / stones / 2
    low, high = math.pi / 2 - half, math.pi / 2 + half
    outline = [(radius * math.cos(angle), radius * math.sin(angle))
               for radius, angle in ((inner, low), (outer, low), (outer, high), (inner, high))]
    vertices, faces = extrude(outline, half_depth)
    return vertices, faces + [(3, 2, 1, 0), (4, 5, 6, 7)]


def cube():
    vertices, faces = extrude([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)], 0.5)
    return vertices, faces + [(3, 2, 1, 0), (4, 5, 6, 7)]


def hills(rows=13, columns=17):
    return [[0.4 * math.sin(0.7 * column) * math.cos(0.6 * row) for column in range(columns)] for row in range(rows)]


write_obj("rock.obj", "a rock, about 0.5 m across", *rock())
write_stl("stairs.stl", "stairs", *stairs())
write_obj("bowl.obj", "a bowl, 1.12 m across", *bowl())
write_obj("voussoir.obj", "the keystone of an arch of nine", *voussoir())
write_glb("cube.glb", "a unit cube standing on y = 0", *cube(), [0, 0.5, 0])
with open("hills.csv", "w") as grid:
    for heights in hills():
        grid.write(",".join(f"{h:.4f}" for h in heights) + "\n")


def arch(stones=9):
    """Nine keystones, each turned to its place, on the ground."""
    bodies = [{"name": "ground", "type": "static",
               "shapes": [{"halfspace": {"normal": [0, 1, 0], "offset": 0}, "material": "stone"}]}]
    for i in range(stones):
        half_turn = (math.pi / 2 - math.pi * (i + 0.5) / stones) / 2
        bodies.append({"name": f"stone {i + 1}", "rotation": [0, 0, math.sin(-half_turn), math.cos(half_turn)],
                       "shapes": [{"hull": {"file": "voussoir.obj"}, "material": "stone"}]})
    return {"cairn": 1, "name": "arch", "description": "An arch of nine equal stones, held by friction alone.",
            "seconds": 5, "view": {"eye": [1.5, 1.6, 4], "target": [0, 0.6, 0]},
            "materials": {"stone": {"friction": 0.8, "density": 2500}}, "bodies": bodies}


with open("arch.json", "w") as out:
    scene = arch()
    out.write("{\n")
    rows = [json.dumps(b) for b in scene.pop("bodies")]
    out.write("".join(f"  {json.dumps(key)}: {json.dumps(value)},\n" for key, value in scene.items()))
    out.write('  "bodies": [\n    ' + ",\n    ".join(rows) + "\n  ]\n}\n")
