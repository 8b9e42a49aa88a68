#!/usr/bin/env python3
"""Opens the pages of `cairn tune --html`, `bench --html` and `view` in headless Chromium, as a reader does: from a
file, without a network, on a screen and on a phone; clicks, and looks at what comes out.

    page_test.py CAIRN FOLDER      exit code 77: no Chromium here

Nothing but Python's standard library: WebDriver (W3C) is JSON over HTTP.
"""
import base64
import json
import pathlib
import shutil
import socket
import struct
import subprocess
import sys
import time
import urllib.error
import urllib.request
import zlib

SKIP = 77
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"  # the key under which WebDriver hands elements out


class Browser:
    def __init__(self, driver, chromium, profile):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.process = subprocess.Popen([driver, f"--port={self.port}"], stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL)
        self.session = ""
        arguments = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
                     "--disable-background-networking", "--hide-scrollbars", f"--user-data-dir={profile}"]
        wanted = {"capabilities": {"alwaysMatch": {
            "browserName": "chrome", "goog:loggingPrefs": {"browser": "ALL"},
            "goog:chromeOptions": {"binary": chromium, "args": arguments}}}}
        for _ in range(100):
            try:
                if self.call("GET", "/status")["ready"]:
                    break
            except (urllib.error.URLError, ConnectionError):
                time.sleep(0.1)
        self.session = "/session/" + self.call("POST", "/session", wanted)["sessionId"]

    def call(self, method, path, body=None):
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}{self.session}{path}", method=method,
                                         data=None if body is None else json.dumps(body).encode(),
                                         headers={"Content-Type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=60) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise AssertionError(f"{method} {path}: {error.read().decode()}") from error

    def command(self, name, **parameters):  # of the DevTools protocol
        return self.call("POST", "/goog/cdp/execute", {"cmd": name, "params": parameters})

    def run(self, script, *arguments):
        return self.call("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def click(self, css):
        found = self.call("POST", "/element", {"using": "css selector", "value": css})[ELEMENT]
        self.call("POST", f"/element/{found}/click", {})

    def screen(self, width, height, phone=False, dark=False):
        self.command("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
                     mobile=phone)
        self.command("Emulation.setEmulatedMedia",
                     features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])
        # One frame, so that what waits for the new width is drawn.
        self.call("POST", "/execute/async", {"script": "requestAnimationFrame(() => requestAnimationFrame("
                                                       "arguments[arguments.length - 1]))", "args": []})

    def frames(self, count=2):
        self.call("POST", "/execute/async", {"script": "let n = arguments[0]; const done = arguments[1], next = () => "
                                                       "n-- > 0 ? requestAnimationFrame(next) : done(); next()",
                                             "args": [count]})

    def mouse(self, kind, x, y, **more):
        self.command("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def press(self, x, y, to=None):
        """A click at a place of the window, or a drag from there."""
        self.mouse("mousePressed", x, y, button="left", buttons=1, clickCount=1)
        if to:
            for share in (0.3, 0.6, 1):
                self.mouse("mouseMoved", x + share * (to[0] - x), y + share * (to[1] - y), button="left", buttons=1)
            x, y = to
        self.mouse("mouseReleased", x, y, button="left", buttons=0, clickCount=1)
        self.frames()

    def place(self, css):
        """x, y, width and height in the window, after scrolling there."""
        return self.run("""const e = document.querySelector(arguments[0]); e.scrollIntoView({block: 'center'});
            const b = e.getBoundingClientRect(); return [b.x, b.y, b.width, b.height]""", css)

    def picture(self, file, whole=True):
        data = base64.b64decode(self.command("Page.captureScreenshot", format="png",
                                             captureBeyondViewport=whole)["data"])
        pathlib.Path(file).write_bytes(data)
        return data

    def close(self):
        try:
            self.call("DELETE", "")
        finally:
            self.process.terminate()
            self.process.wait(10)


def pixels(png):
    """Width, height and rows of bytes of a PNG of 8 bits a channel that is not interlaced, as browsers write them."""
    at, parts = 8, b""
    width = height = channels = 0
    while at < len(png):
        length, kind = struct.unpack(">I4s", png[at:at + 8])
        body = png[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", body)
            assert depth == 8 and not interlaced and colour in (2, 6), "a PNG of another kind"
            channels = 3 if colour == 2 else 4
        elif kind == b"IDAT":
            parts += body
        at += 12 + length
    data, stride, rows, above = zlib.decompress(parts), width * channels, [], bytes(width * channels)
    for y in range(height):
        rule = data[y * (stride + 1)]
        line = bytearray(data[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for x in range(stride):
            left = line[x - channels] if x >= channels else 0
            up = above[x]
            corner = above[x - channels] if x >= channels else 0
            if rule == 1:
                line[x] = (line[x] + left) & 255
            elif rule == 2:
                line[x] = (line[x] + up) & 255
            elif rule == 3:
                line[x] = (line[x] + (left + up) // 2) & 255
            elif rule == 4:
                guess = left + up - corner
                by = [abs(guess - left), abs(guess - up), abs(guess - corner)]
                line[x] = (line[x] + (left, up, corner)[by.index(min(by))]) & 255
        rows.append(bytes(line))
        above = line
    return width, height, channels, rows


def brightness(png):
    """Mean of all channels, and how many colours a grid of samples has."""
    width, height, channels, rows = pixels(png)
    samples = [rows[y][x * channels:x * channels + 3] for y in range(0, height, 3) for x in range(0, width, 3)]
    return sum(map(sum, samples)) / (3 * len(samples)), len(set(samples))


def check(condition, what):
    if not condition:
        raise AssertionError(what)


def check_any(browser, name, folder):
    """What holds of every page."""
    entries = browser.run("return performance.getEntriesByType('resource').map(e => e.name)"
                          ".filter(n => !n.startsWith('data:'))")
    check(not entries, f"it asks for {entries}")
    outer = browser.run("""return [...document.querySelectorAll('[src], [href], link, iframe, object')]
        .map(e => e.getAttribute('src') || e.getAttribute('href') || e.tagName).filter(s => !s.startsWith('data:'))""")
    check(not outer, f"it names {[o[:80] for o in outer]}")
    for width, phone, dark in ((1280, False, False), (1280, False, True), (390, True, False)):
        browser.screen(width, 844 if phone else 900, phone, dark)
        # A phone zooms out until all fits: innerWidth would tell nothing.
        scroll = browser.run("return document.scrollingElement.scrollWidth")
        check(scroll <= width, f"{scroll} px of content on {width}")
        for id_, right in browser.run("""return [...document.querySelectorAll('svg.chart text')].filter(t => {
                const a = t.getBoundingClientRect(), b = t.ownerSVGElement.parentElement.getBoundingClientRect();
                return a.width > 0 && (a.right > b.right + 1 || a.left < b.left - 1); })
                .map(t => [t.textContent, t.getBoundingClientRect().right])"""):
            raise AssertionError(f"at {width} px the words '{id_}' of a plot stick out, to {right}")
        kind = ("phone" if phone else "screen") + ("_dark" if dark else "")
        data = browser.picture(folder / f"{name}_{kind}.png", whole=False)
        mean, colours = brightness(data)
        check(colours > 30, f"the picture {kind} has {colours} colours: it is blank")
        check(mean < 110 if dark else mean > 140, f"the picture {kind} has a mean brightness of {mean}")
        browser.picture(folder / f"{name}_{kind}_whole.png")
    # "rendering": a driver's remarks on its speed.
    errors = [e for e in browser.call("POST", "/se/log", {"type": "browser"})
              if e["level"] != "INFO" and e["source"] != "rendering"]
    check(not errors, f"the console says {errors}")


def check_tune(browser, result):
    browser.screen(1280, 900)
    shown = browser.run("return [...document.querySelectorAll('#frontplot .point')].length")
    check(shown == len(result["entries"]), f"{shown} points for {len(result['entries'])} settings")
    check(browser.run("return document.querySelectorAll('#timeplot polyline').length") >= 2, "no error over time")
    front = [k for k, e in enumerate(result["entries"]) if e["front"]]
    # Settings that cost and err nearly the same lie on one another; those are chosen by their rows.
    covered = browser.run("""
        const dots = [...document.querySelectorAll('#frontplot .dot')].map(d => ({
            index: Number(d.parentElement.dataset.index), x: d.cx.baseVal.value, y: d.cy.baseVal.value,
            r: d.r.baseVal.value}));
        return dots.filter((d, i) => dots.slice(i + 1).some(e => Math.hypot(d.x - e.x, d.y - e.y) < e.r + 3))
            .map(d => d.index)""")
    check(len(covered) < len(result["entries"]), "every point lies under another")
    seen = []
    for k in [k for k in front if k not in covered][:3]:
        entry = result["entries"][k]
        browser.click(f"#frontplot .point[data-index='{k}'] .dot")
        label, hidden, source, row, ring, facts = browser.run("""
            const on = document.querySelector('#settings tr.on');
            return [document.querySelector('#label').textContent, document.querySelector('#shot').hidden,
                    document.querySelector('#shotimage').src, on && on.cells[0].textContent,
                    document.querySelector('#frontplot .ring').parentElement.dataset.index,
                    document.querySelector('#facts').textContent]""")
        check(label == entry["label"], f"a click on {entry['label']} shows {label}")
        check(row is not None and row.startswith(label), f"the row {row} is marked")
        check(ring == str(k), f"the ring is on {ring}")
        check(not hidden and source.startswith("data:image/png;base64,"), "its worst moment is not shown")
        check(browser.run("return document.querySelector('#shotimage').naturalWidth") == 640, "its picture is broken")
        check("ms a frame" in facts and "worst step" in facts, facts)
        seen.append(source)
    check(len(set(seen)) == len(seen), "settings have the same picture")
    # A row; by the keyboard; a filter; a sorted column.
    browser.click(f"#settings tr[data-index='{front[0]}'] td")
    check(browser.run("return document.querySelector('#label').textContent") == result["entries"][front[0]]["label"],
          "a click on a row shows another")
    browser.run("""const r = document.querySelector(`#settings tr[data-index='${arguments[0]}']`); r.focus();
        r.dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter', bubbles: true}))""", front[-1])
    check(browser.run("return document.querySelector('#label').textContent") == result["entries"][front[-1]]["label"],
          "Enter on a row does nothing")
    browser.click("#front")
    rows = browser.run("return [...document.querySelectorAll('#settings tbody tr')].filter(r => !r.hidden).length")
    check(rows == len(front), f"{rows} rows are left of a front of {len(front)}")
    browser.click("#front")
    browser.click("#settings th:nth-child(3) button")
    values = browser.run("return [...document.querySelectorAll('#settings tbody tr')]"
                         ".map(r => Number(r.cells[2].dataset.value))")
    check(values == sorted(values) and len(values) == len(result["entries"]), f"sorted by error: {values}")


def check_bench(browser, result):
    browser.screen(1280, 900)
    scenes = result["scenes"]
    check(browser.run("return document.querySelectorAll('#allplot .point').length") == len(scenes), "points are missing")
    for k, scene in enumerate(scenes):
        browser.click(f"#scenes tr[data-index='{k}'] td")
        label, width, steps, row = browser.run("""
            return [document.querySelector('#label').textContent, document.querySelector('#shotimage').naturalWidth,
                    document.querySelector('#msplot polyline').getAttribute('points').split(' ').length,
                    document.querySelector('#scenes tr.on').cells[0].textContent]""")
        check(label == row == scene["scene"], f"a click on {scene['scene']} shows {label}, marks {row}")
        check(width == 640, "its picture is broken")
        check(steps == scene["steps"], f"{steps} of {scene['steps']} steps are drawn")
    ratios = browser.run("return [...document.querySelectorAll('#scenes tbody tr')]"
                         ".map(r => [Number(r.cells[3].dataset.value), r.cells[4].textContent])")
    check(all(ratio > 0 and work == "the same" for ratio, work in ratios), f"against itself: {ratios}")


def canvas_pixels(browser, file):
    """The samples of a grid on the canvas."""
    x, y, width, height = (int(v) for v in browser.place("#view"))
    browser.frames()
    _, tall, channels, rows = pixels(browser.picture(file, whole=False))
    return [rows[j][i * channels:i * channels + 3] for j in range(max(y, 0) + 4, min(y + height, tall) - 4, 3)
            for i in range(x + 4, x + width - 4, 3)]


def differing(a, b):
    """Share of samples that are another by more than noise."""
    return sum(max(abs(u - v) for u, v in zip(p, q)) > 12 for p, q in zip(a, b)) / len(a)


def check_view(browser, recording, result, folder):
    browser.screen(1280, 900)
    time_of = lambda: float(browser.run("return document.querySelector('#time').textContent").split()[0])
    check(browser.run("return document.querySelector('#nogl').style.display") == "none", "nothing is drawn")
    start = canvas_pixels(browser, folder / "view_start.png")
    colourful = sum(max(p) - min(p) > 60 for p in start) / len(start)
    check(len(set(start)) > 300 and colourful > 0.02, f"the canvas is blank: {len(set(start))} colours, {colourful}")

    # It plays, and pauses.
    check(time_of() == 0, "it does not start at 0")
    browser.run("document.querySelector('#speed').value = '0.1'")  # slow machines take seconds for a click
    browser.click("#play")
    time.sleep(0.6)
    check(browser.run("return document.querySelector('#play').getAttribute('aria-label')") == "pause", "no pause")
    browser.click("#play")
    browser.frames()
    stopped = time_of()
    check(0 < stopped < 2, f"it played to {stopped}")
    time.sleep(0.2)
    check(time_of() == stopped, "it does not pause")
    steps, dt = len(recording["steps"]["hash"]), recording["dt"]

    # Single frames, keys, the slider and the chart move time, and with it picture, numbers and cursor.
    for act, step in ((lambda: browser.click("#home"), None),
                      (lambda: browser.run("document.body.dispatchEvent(new KeyboardEvent('keydown',"
                                           "{key: 'Home', bubbles: true}))"), 0),
                      (lambda: browser.click("#on"), 1), (lambda: browser.click("#on"), 2),
                      (lambda: browser.click("#back"), 1),
                      (lambda: browser.run("const s = document.querySelector('#scrub'); s.value = 60;"
                                           "s.dispatchEvent(new Event('input'))"), 60)):
        act()
        browser.frames()
        if step is not None:
            shown = browser.run("return document.querySelector('#time').textContent")
            check(f"step {step} of {steps}" in shown, f"{shown} where step {step} is meant")
    later = canvas_pixels(browser, folder / "view_later.png")
    check(differing(start, later) > 0.003, "the picture does not move")
    penetration = recording["steps"]["penetration_m"]
    cursor = lambda: float(browser.run("return document.querySelector('#cursor').getAttribute('x1')"))
    at_60 = cursor()
    x, y, width, height = browser.place("#errorplot")
    browser.press(x + 0.8 * width, y + 0.4 * height)
    moved = time_of()
    check(moved > 60 * dt and cursor() > at_60, f"the chart moves time to {moved}, the cursor to {cursor()}")
    share = (cursor() - 58) / (width - 58 - 12)  # the plot's edges: chart() in page.js
    check(abs(share * steps * dt - moved) < 0.01, f"the cursor stands at {share} of the plot, time at {moved}")
    browser.click("#worst button")
    browser.frames()
    worst = max(range(steps), key=lambda i: penetration[i]) + 1
    check(browser.run("return document.querySelector('#stepof').textContent") == f"Step {worst}", "not the worst step")
    facts = browser.run("return document.querySelector('#stepfacts').textContent")
    check("penetration" in facts and "deepest" in facts, facts)

    # A click chooses a body, and tells where it is.
    browser.run("toFrame(data.frames - 1)")
    for body in [b for b in result["bodies"] if b["name"].startswith("crate")]:
        index = [b["name"] for b in result["bodies"]].index(body["name"])
        browser.run("choose(arguments[0])", index)
        browser.frames()
        tag = browser.run("const t = document.querySelector('#tag'); return [Number(t.dataset.x), Number(t.dataset.y)]")
        browser.run("choose(-1)")
        x, y, _, _ = browser.place("#view")
        browser.press(x + tag[0], y + tag[1])
        check(browser.run("return document.querySelector('#label').textContent") == body["name"],
              f"a click on {body['name']} chooses another")
        shown = browser.run("return document.querySelector('#facts dd').textContent")
        off = max(abs(float(a) - b) for a, b in zip(shown.split(","), body["position"]))
        check(off < 0.6e-3, f"{body['name']} is shown {off} m from where it is")
    x, y, _, _ = browser.place("#view")
    browser.press(x + 5, y + 5)
    check(browser.run("return state.chosen") == -1, "a click on nothing chooses something")

    # The camera: a drag turns, the wheel zooms, two fingers do too.
    before = canvas_pixels(browser, folder / "view_before.png")
    x, y, width, height = browser.place("#view")
    browser.press(x + 0.5 * width, y + 0.5 * height, (x + 0.6 * width, y + 0.45 * height))
    check(differing(before, canvas_pixels(browser, folder / "view_turned.png")) > 0.05, "a drag does not turn")
    x, y, width, height = browser.place("#view")
    distance = browser.run("return camera.distance")
    browser.mouse("mouseWheel", x + 0.5 * width, y + 0.5 * height, deltaX=0, deltaY=-300)
    browser.frames()
    near = browser.run("return camera.distance")
    check(0.5 * distance < near < 0.9 * distance, f"the wheel zooms from {distance} to {near}")
    touch = lambda kind, gap: browser.command("Input.dispatchTouchEvent", type=kind, touchPoints=[] if gap is None else [
        {"x": x + 0.5 * width - gap, "y": y + 0.5 * height, "id": 1},
        {"x": x + 0.5 * width + gap, "y": y + 0.5 * height, "id": 2}])
    for kind, gap in (("touchStart", 120), ("touchMove", 90), ("touchMove", 60), ("touchEnd", None)):
        touch(kind, gap)
    browser.frames()
    far = browser.run("return camera.distance")
    check(abs(far / near - 2) < 0.1, f"a pinch to half zooms from {near} to {far}")
    browser.click("#home")
    browser.frames()
    check(differing(before, canvas_pixels(browser, folder / "view_home.png")) < 0.002, "the view is not reset")


def main():
    cairn, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    chromium = shutil.which("chromium")
    driver = shutil.which("chromedriver")
    if not chromium or not driver:
        print("skipped: chromium and chromedriver are not installed (scripts/setup.sh installs them)")
        return SKIP
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    page = folder / "tune.html"
    subprocess.run([cairn, "tune", "tower", "--set", "n=5", "--set", "ratio=20", "--quick", "--repeats", "1",
                    "--html", page, "--json", folder / "tune.json"], check=True, stdout=subprocess.DEVNULL)
    bench = folder / "bench.html"
    command = [cairn, "bench", "tower", "bounce", "ragdoll", "--seconds", "0.3", "--repeats", "1"]
    subprocess.run([*command, "--json", folder / "before.json"], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([*command, "--baseline", folder / "before.json", "--html", bench, "--json", folder / "bench.json"],
                   check=True, stdout=subprocess.DEVNULL)
    run = ["bridge", "--seconds", "2"]
    subprocess.run([cairn, "record", *run, "--out", folder / "bridge.json"], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([cairn, "run", *run, "--bodies", "--json", folder / "bridge_run.json"], check=True,
                   stdout=subprocess.DEVNULL)
    subprocess.run([cairn, "view", folder / "bridge.json", "--html", folder / "view.html"], check=True,
                   stdout=subprocess.DEVNULL)
    for scene in ("cloth", "rope", "jelly", "terrain"):
        subprocess.run([cairn, "view", scene, "--seconds", "0.5", "--html", folder / f"{scene}.html"], check=True,
                       stdout=subprocess.DEVNULL)
    browser = Browser(driver, chromium, folder / "profile")
    try:
        browser.call("POST", "/url", {"url": page.resolve().as_uri()})
        check_any(browser, "tune", folder)
        check_tune(browser, json.loads((folder / "tune.json").read_text()))
        browser.call("POST", "/url", {"url": bench.resolve().as_uri()})
        check_any(browser, "bench", folder)
        check_bench(browser, json.loads((folder / "bench.json").read_text()))
        browser.call("POST", "/url", {"url": (folder / "view.html").resolve().as_uri()})
        check_any(browser, "view", folder)
        check_view(browser, json.loads((folder / "bridge.json").read_text()),
                   json.loads((folder / "bridge_run.json").read_text()), folder)
        # What is not rigid, and what is a mesh.
        for scene in ("cloth", "rope", "jelly", "terrain"):
            browser.call("POST", "/url", {"url": (folder / f"{scene}.html").resolve().as_uri()})
            browser.screen(1280, 900)
            start = canvas_pixels(browser, folder / f"{scene}_start.png")
            browser.run("toFrame(data.frames - 1)")
            share = differing(start, canvas_pixels(browser, folder / f"{scene}_end.png"))
            check(len(set(start)) > 300 and share > 0.001, f"{scene}: {len(set(start))} colours, {share} moves")
    finally:
        browser.close()
    print(f"pictures are in {folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
