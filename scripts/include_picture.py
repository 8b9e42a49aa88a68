"""Folders in a column, the highest layer on top, and an arc for each pair of which one includes the other: what points
down stands on the right, what points up on the left, a wrong direction in red."""
from xml.sax.saxutils import escape

ROW = 26          # height of a row, px
BOX = 360         # width of a folder's box, px
SPREAD = 15       # by which an arc stands out for each row that it passes, px
COLOURS = ["#1f6f8b", "#b8562b", "#4f7d3a", "#7a4f9a", "#8a7a1f", "#3f5fb0", "#a03f6a", "#2f8a78", "#7d5a3a", "#5a5a6a"]


def _reduced(arrows):
    """Those arrows that no chain of others stands for: they are drawn strongly."""
    after = {}
    for a, b in arrows:
        after.setdefault(a, set()).add(b)

    def reachable(start, goal, direct):
        seen, stack = set(), [n for n in after.get(start, ()) if not (n == goal and direct)]
        while stack:
            node = stack.pop()
            if node == goal:
                return True
            if node not in seen:
                seen.add(node)
                stack.extend(after.get(node, ()))
        return False

    return {(a, b) for a, b in arrows if not reachable(a, b, True)}


def svg(rows, arrows):
    """rows: (key, label, files, lines) from top to bottom; arrows: (key, key) -> (count, whether it is wrong)."""
    place = {key: i for i, (key, _, _, _) in enumerate(rows)}
    up = [place[a] - place[b] for a, b in arrows if place[a] > place[b]]
    down = [place[b] - place[a] for a, b in arrows if place[b] > place[a]]
    left = 30 + SPREAD * max(up, default=0)
    width = max(left + BOX + 30 + SPREAD * max(down, default=0), left + 470)
    height = ROW * len(rows) + 70
    strong = _reduced(arrows)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
           f'viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">',
           f'<rect width="{width}" height="{height}" fill="white"/>',
           f'<text x="{left}" y="20">Arrows point to what is included. Dark: those that no chain of others implies.'
           '</text>',
           f'<text x="{left}" y="36" fill="#666">Right: downwards. Left: upwards, within a layer. Red: a wrong '
           'direction.</text>']
    colours = {}
    for i, (key, _, _, _) in enumerate(rows):
        colours[key] = COLOURS[i % len(COLOURS)]
    for pair in sorted(arrows, key=lambda p: (p in strong, arrows[p][1])):
        out.append(_arc(pair, arrows[pair], pair in strong, place, left, colours[pair[0]], rows))
    for key, label, files, lines in rows:
        y = 50 + ROW * place[key]
        out.append(f'<rect x="{left}" y="{y + 2}" width="{BOX}" height="{ROW - 4}" rx="3" fill="#f4f4f0" '
                   f'stroke="{colours[key]}"/>')
        out.append(f'<text x="{left + 8}" y="{y + 17}">{escape(label)}</text>')
        out.append(f'<text x="{left + BOX - 8}" y="{y + 17}" text-anchor="end" fill="#666">{files} files, '
                   f'{lines} lines</text>')
    return "\n".join(out + ["</svg>", ""])


def _arc(pair, told, is_strong, place, left, colour, rows):
    count, wrong = told
    a, b = (place[key] for key in pair)
    on_right = b > a
    x = left + BOX if on_right else left
    side = 1 if on_right else -1
    out = x + side * SPREAD * 4 / 3 * abs(b - a)  # a cubic reaches three quarters of the way to its handles
    y0, y1 = (50 + ROW * (row + 0.5) for row in (a, b))
    y0 += side * 4 * (1 if on_right else -1)   # arrows leave below the middle of a box and come in above it
    y1 -= 4 if on_right else -4
    stroke = "#d00000" if wrong else colour
    opacity = 1 if wrong or is_strong else 0.22
    weight = 2.2 if wrong else 1.6 if is_strong else 1
    names = rows[a][1], rows[b][1]
    return (f'<g stroke="{stroke}" fill="none" opacity="{opacity}" stroke-width="{weight}">'
            f'<title>{escape(names[0])} includes {escape(names[1])}, {count} times</title>'
            f'<path d="M{x},{y0:.1f} C{out:.1f},{y0:.1f} {out:.1f},{y1:.1f} {x + side},{y1:.1f}"/>'
            f'<path d="M{x + side},{y1:.1f} l{7 * side},-3.5 v7 z" fill="{stroke}" stroke="none"/></g>')


def dot(rows, arrows):
    name = {key: label for key, label, _, _ in rows}
    lines = ["digraph includes {", "    rankdir = TB;", "    node [shape = box, fontname = \"sans-serif\"];"]
    lines += [f'    "{label}" [label = "{label}\\n{files} files, {count} lines"];' for _, label, files, count in rows]
    lines += [f'    "{name[a]}" -> "{name[b]}" [label = "{count}"{", color = red" if wrong else ""}];'
              for (a, b), (count, wrong) in sorted(arrows.items())]
    return "\n".join(lines + ["}", ""])
