#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The page of sonard-web in a real browser: what is drawn is what the socket says, and nothing is drawn that is not known.
Skips where there is no chromium, node or npm. SHOTS=folder keeps the pictures of docs/web.md."""
import glob
import json
import math
import os
import re
import shutil
import signal
import subprocess
import time

from lib import PATIENCE, Process, Skipped, check, note, pings_until, run, until
from webclient import Web

SHOTS = os.environ.get("SHOTS")


class Browser(Process):
    def __init__(self, bench):
        chromium = shutil.which("chromium") or shutil.which("chromium-browser")
        if not chromium or not shutil.which("node") or not shutil.which("npm"):
            raise Skipped("needs chromium, node and npm")
        modules = bench.path("modules")
        os.mkdir(modules)
        with open(os.path.join(modules, "package.json"), "w", encoding="ascii") as f:
            f.write("{}")
        try:
            subprocess.run(["npm", "install", "--silent", "--no-audit", "--no-fund", "playwright-core@1"], cwd=modules, check=True,
                           timeout=90, capture_output=True)
        except (subprocess.SubprocessError, OSError):
            raise Skipped("npm cannot get playwright-core") from None
        super().__init__(bench, "browser", ["node", "tests/web/browser.mjs"],
                         {"BROWSER_MODULES": modules, "CHROMIUM": chromium, "HOME": bench.path("home")},
                         stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        bench.processes.append(self)
        check(json.loads(self.process.stdout.readline() or b"{}").get("value") == "ready", "no browser: " + self.log())

    def do(self, what, **more):
        self.process.stdin.write(json.dumps(dict(more, do=what)).encode() + b"\n")
        self.process.stdin.flush()
        answer = json.loads(self.process.stdout.readline())
        check("fault" not in answer, "%s: %s" % (what, answer.get("fault")))
        return answer["value"]

    def eval(self, code):
        return self.do("eval", code=code)

    def text(self, selector):
        return self.eval("document.querySelector(%s).innerText" % json.dumps(selector))

    def stop(self):
        self.process.stdin.close()
        status = self.wait(30)
        self.process.stdout.close()
        return status


# What each sector of the ring is drawn as, and how solid: by how much of a state's colour is over that of the disc in the
# middle of its inner half, where "clear" leaves the ring open, and of its outer half. Of "unknown" any hatching within it.
RINGS = """(() => {
  const p = sonardPage.painter, g = p.geometry(), c = p.canvas, context = c.getContext("2d");
  const colour = (name) => { const h = p.colour[name]; return [1, 3, 5].map((k) => parseInt(h.slice(k, k + 2), 16)); };
  const disc = colour("disc");
  const share = (d, name) => {
    const full = colour(name).map((v, k) => v - disc[k]), has = disc.map((v, k) => d[k] - v), dot = (a, b) => a.reduce((n, v, k) => n + v * b[k], 0);
    const t = dot(full, has) / dot(full, full);
    return d[3] > 200 && t > 0.4 && full.every((v, k) => Math.abs(v * t - has[k]) < 30) ? t : 0;
  };
  const data = context.getImageData(0, 0, c.width, c.height).data;
  const at = (azimuth, r) => {
    const a = (azimuth + p.turn - 90) * Math.PI / 180, x = Math.round(g.c + r * Math.cos(a)), y = Math.round(g.c + r * Math.sin(a));
    return data.slice(4 * (y * c.width + x), 4 * (y * c.width + x) + 4);
  };
  const sectors = sonardPage.state.sectors ? sonardPage.state.sectors.sectors : Array.from({ length: 72 }, (_, k) => ({ azimuth_deg: 5 * k, width_deg: 5 }));
  return sectors.map((s) => {
    const inner = at(s.azimuth_deg, g.inner + (g.outer - g.inner) * 0.25), outer = at(s.azimuth_deg, g.inner + (g.outer - g.inner) * 0.75);
    if (share(inner, "blocked") && share(outer, "blocked")) return ["blocked", share(outer, "blocked")];
    if (share(outer, "clear") && !share(inner, "clear")) return ["clear", share(outer, "clear")];
    return [share(inner, "blocked") || share(outer, "blocked") || share(inner, "clear") || share(outer, "clear") ? "?" : "unknown", 0];
  });
})()"""
RING = RINGS + ".map(([state]) => state)"


TOKEN = "a-token-for-the-tests"


def with_token(bench):
    """The options with which a page may set something."""
    os.mkdir(bench.path("sonard.conf.d"))
    token = bench.write("token", TOKEN)
    os.chmod(token, 0o600)
    return "--settings", bench.path("sonard.conf.d/web.conf"), "--token", token


def begun(bench, *arguments, scene="box", pings=210, record=None, **sonar):
    bench.sim(scene=scene)
    bench.conf(sonar=sonar, vehicle={"near": "0.8 m"}, extract={"no_echo": "range"}, record=record or {})
    daemon = bench.sonard()
    client = daemon.client()
    web = Web(bench, *arguments)
    browser = Browser(bench)
    pings_until(client, pings, 60)
    browser.do("open", url="http://127.0.0.1:%d/" % web.port, width=1280, height=860)
    until(lambda: browser.text("#link") == "live", "a live page")
    return daemon, client, web, browser


def drawn(bench):
    """Ring, image, numbers and words against the socket."""
    _, client, _, browser = begun(bench)
    until(lambda: browser.eval("sonardPage.rows.size") >= 200, "the whole image")
    own = client.call("sectors")["distance_m"]
    until(lambda: browser.eval("sonardPage.state.sectors.distance_m") == own and browser.text("#judged") == "Ring judged to %.2f m" % own, "look_ahead as it is by itself")
    browser.do("choose", selector="#distance", value="3")

    def agrees():
        time.sleep(0.3)
        said = [s["state"] for s in client.call("sectors", distance_m=3)["sectors"]]
        ring = browser.eval(RING)
        return ring if len(ring) == 72 and sum(a != b for a, b in zip(ring, said)) <= 2 else None
    ring = until(agrees, "a ring like the socket's answer", 20, 0.1)
    note("drawn: %s" % {state: ring.count(state) for state in sorted(set(ring))})
    check("?" not in ring and ring.count("clear") > 3, ring)
    wrong = [5 * k for k, state in enumerate(ring) if state == "clear" and
             client.call("blocked", azimuth_deg=5 * k, distance_m=3, half_angle_deg=2.5)["state"] != "clear"]
    check(not wrong, "drawn clear, but not so for the socket: %s" % wrong)
    browser.do("choose", selector="#distance", value="0")
    until(lambda: "blocked" in browser.eval(RING), "obstacles that are farther away")

    def how_far():
        """Obstacles are drawn the more solid the nearer they are, and the numbers around are those of the socket."""
        answer = client.call("sectors", distance_m=0)
        drawn = [(s["range_m"] / answer["distance_m"], share) for s, (state, share) in zip(answer["sectors"], browser.eval(RINGS))
                 if s["state"] == "blocked" and state == "blocked"]
        wrong = [d for d in drawn if abs(0.45 + 0.55 * max(0, 1 - d[0]) - d[1]) > 0.05]
        told = browser.eval("sonardPage.numbers()")
        said = [min((s["range_m"] for k in (-1, 0, 1) for s in [answer["sectors"][(3 * i + k) % 72]] if s["state"] == "blocked"), default=None) for i in range(24)]
        differ = [(s, t) for s, t in zip(said, told) if s is not None and not 0 <= s - float(t) < 1.001 - 0.9 * (s < 10)]
        return len(drawn) > 20 and len(wrong) <= 2 and len(differ) <= 1
    until(how_far, "how far the obstacles are")
    said = {round(r["azimuth_deg"] * 100): r for r in client.call("image")["rows"]}
    rows = browser.eval("Array.from(sonardPage.rows, ([k, r]) => [k, r.echoes.map(e => e.range), Array.from(r.bins.slice(0, 40))])")
    same = sum(1 for k, echoes, bins in rows if k in said and bytes(bins).hex() == said[k]["samples"][:80]
               and [round(e, 2) for e in echoes] == [round(e["range_m"], 2) for e in said[k]["echoes"]])
    check(len(rows) == 200 and same > 150, "%d of %d rows are the socket's" % (same, len(rows)))
    loud = browser.eval("(() => { const p = sonardPage.painter.image, d = p.context.getImageData(0, 0, p.size, p.size).data; let n = 0;"
                        " for (let i = 0; i < d.length; i += 4) if (d[i] > 120 && d[i + 3] > 60) n++; return n; })()")
    check(loud > 200, "%d loud pixels: the walls are not in the image" % loud)
    tiles = browser.text("#tiles").split("\n")
    check("Ahead ±15°" in tiles and any(t.startswith(("■ Blocked", "✓ Clear", "? Unknown")) for t in tiles), tiles)
    sonars = browser.text("#sonars")
    check("head" in sonars and "running" in sonars and "Ping360" in sonars and "/s" in sonars, sonars)
    check("ping to picture" in browser.text("#timing"), browser.text("#timing"))
    browser.do("click", selector="#plan summary")
    plan = client.call("plan")["stages"]
    shown = browser.text("#plan")
    check(all(s["name"] in shown and s["why"] in shown for s in plan), shown)
    check(browser.do("faults") == [], browser.do("faults"))


def why(bench):
    """A click and a key ask, in words, what explain says; that is asked again, dated, and gone when the data are."""
    daemon, client, _, browser = begun(bench)
    browser.do("choose", selector="#distance", value="20")
    for azimuth in (90, 200):
        browser.do("at", x=0.5 + 0.3 * math.sin(math.radians(azimuth)), y=0.5 - 0.3 * math.cos(math.radians(azimuth)))
        until(lambda: browser.text("#why").split("\n")[1:2] and ("%d°" % azimuth) in browser.text("#why").split("\n")[1], "an explanation")
        answer = client.call("explain", azimuth_deg=azimuth, distance_m=20, half_angle_deg=7.5)["answer"]
        text = browser.text("#why")
        check({"blocked": "Blocked at", "clear": "Clear to", "unknown": "Unknown"}[answer["state"]] in text, "%s, but %s" % (answer, text))
        check("Of the last" in text, text)
        near = [(e["range_m"], e["confidence"]) for r in client.call("image")["rows"] for e in r["echoes"] if abs(r["azimuth_deg"] - azimuth) <= 7.5]
        told = re.findall(r"(\d+\.\d+) m \((\d+) % sure", text)
        known = [t for t in told if any(abs(float(t[0]) - m) < 0.2 and abs(int(t[1]) - 100 * sure) < 15 for m, sure in near)]
        check(len(told) > 0 and len(known) >= 0.5 * len(told), "%s, but the image has %s" % (told, near))
    as_of = lambda: browser.text("#why .asof")
    first = as_of()
    until(lambda: as_of() > first, "an explanation that is asked for again")
    browser.eval("document.querySelector('#canvas').focus()")
    for _ in range(4):
        browser.do("press", selector="#canvas", key="ArrowRight")
    browser.do("press", selector="#canvas", key="Enter")
    until(lambda: "220°" in browser.text("#why"), "the direction that the keys chose")
    before = browser.eval("sonardPage.view.range")
    browser.do("press", selector="#canvas", key="+")
    until(lambda: browser.eval("sonardPage.view.range") < before, "a nearer range")
    check(browser.eval("document.querySelector('#canvas').getAttribute('aria-label')").startswith("Ring of sectors: Ahead"), "no words for the picture")
    check(browser.text("#why-said").startswith("220°"), "a screen reader is not told: " + browser.text("#why-said"))
    daemon.process.send_signal(signal.SIGSTOP)
    until(lambda: browser.text("#link") != "live", "the loss")
    until(lambda: not any(word in browser.text("#why") + browser.text("#why-said") for word in ("Blocked", "Clear", "As of", "blocked", "clear")),
          "no explanation of a daemon that does not answer: " + browser.text("#why"))
    daemon.process.send_signal(signal.SIGCONT)
    until(lambda: "As of" in browser.text("#why"), "an explanation again")
    check(browser.do("faults") == [], browser.do("faults"))


def unknown_at_once(browser, chip):
    def all_unknown():
        ring = browser.eval(RING)
        return browser.text("#link") == chip and set(ring) == {"unknown"} and browser.eval("!document.querySelector('#curtain').hidden")
    until(all_unknown, "an unknown ring and '%s'" % chip)
    tiles = browser.text("#tiles")
    check("Blocked" not in tiles and "Clear" not in tiles and tiles.count("Unknown") == 4, tiles)
    check(browser.eval("sonardPage.rows.size") == 0 or chip == "waiting", "the old image stays")


def recovers(bench):
    """Nothing is shown of a daemon or a sonard-web that is gone; both come back by themselves."""
    daemon, _, web, browser = begun(bench, pings=50)
    daemon.process.kill()
    daemon.expected = -9
    daemon.wait()
    unknown_at_once(browser, "daemon lost")
    check("does not answer" in browser.text("#curtain"), browser.text("#curtain"))
    bench.sonard()
    until(lambda: browser.text("#link") == "live" and browser.eval("sonardPage.rows.size") > 0, "the daemon's return")
    web.process.kill()
    web.expected = -9
    web.wait()
    unknown_at_once(browser, "no connection")
    again = Web(bench, port=web.port)
    until(lambda: browser.text("#link") == "live" and browser.eval("sonardPage.rows.size") > 0, "sonard-web's return")
    again.process.send_signal(19)  # SIGSTOP: the network hangs, no end of the connection comes
    try:
        unknown_at_once(browser, "waiting")
    finally:
        again.process.send_signal(18)
    until(lambda: browser.text("#link") == "live", "the network's return")
    check(browser.do("faults") == [], browser.do("faults"))


def warns(bench):
    """A pose that stops and a sonar that falls silent are warned of, with what to do."""
    _, client, _, browser = begun(bench, pings=20)
    check(browser.text("#warnings") == "", browser.text("#warnings"))
    client.call("pose", attitude_deg=[0, 0, 0], depth_m=2)
    until(lambda: "The pose is" in browser.text("#warnings") and "Keep sending poses" in browser.text("#warnings"), "a warning of the pose")
    unknown = lambda: "Blocked" not in browser.text("#tiles") and "Clear" not in browser.text("#tiles")
    until(unknown, "unknown directions under an old pose")
    bench.processes[0].command("unplug")
    until(lambda: "no port" in browser.text("#warnings") or "sends no pings" in browser.text("#warnings"), "a warning of the sonar")
    said = browser.text("#warnings")
    check("no data from" not in said and "pose is too old" not in said, "it says one thing twice: " + said)
    url = browser.eval("location.href")
    for width, height in ((1280, 860), (1366, 700), (390, 844), (844, 390), (667, 375), (900, 600), (1024, 768), (768, 1024)):
        browser.do("open", url=url, width=width, height=height)
        until(lambda: "The pose is" in browser.text("#warnings"), "warnings of %dx%d" % (width, height))
        box = browser.eval("(({left, top, right, bottom}) => [left, top, right, bottom])(document.querySelector('#canvas').getBoundingClientRect())")
        check(box[0] >= 0 and box[1] >= 0 and box[2] <= width and box[3] <= height, "the ring is cut off on %dx%d: %s" % (width, height, box))
        check(box[2] - box[0] > 0.55 * min(width, height), "a small ring on %dx%d: %s" % (width, height, box))
        check(browser.eval("document.documentElement.scrollWidth <= innerWidth"), "wider than %dx%d" % (width, height))
    bench.processes[0].command("plug")
    until(lambda: "no port" not in browser.text("#warnings") and "sends no pings" not in browser.text("#warnings"), "its end", 40)


def heading(bench):
    """Where the vehicle points is told while a fresh pose says so, with a mark at north; an old heading is none."""
    _, client, _, browser = begun(bench, pings=20)
    check(browser.text("#compass") == "Heading unknown no pose", browser.text("#compass"))
    mark = """(() => { const p = sonardPage.painter, g = p.geometry(), a = (-100 - 90) * Math.PI / 180, r = g.disc - 10 * g.u;
      const d = p.context.getImageData(Math.round(g.c + r * Math.cos(a) - 6 * g.u), Math.round(g.c + r * Math.sin(a)), 1, 1).data;
      const h = p.colour.accent; return [1, 3, 5].every((k, i) => Math.abs(parseInt(h.slice(k, k + 2), 16) - d[i]) < 30); })()"""
    check(not browser.eval(mark), "a north mark without a heading")

    def told():
        client.call("pose", attitude_deg=[5, -3, 100])
        return browser.text("#compass").startswith("Heading 100° pose 0.") and browser.eval(mark)
    until(told, "a heading of 100 degrees and north at its place")
    check(client.call("status")["pose"]["attitude_deg"] == [5, -3, 100], client.call("status")["pose"])
    until(lambda: "5.0°, -3.0°" in browser.text("#vehicle"), "roll and pitch")
    until(lambda: browser.text("#compass").startswith("Heading unknown pose ") and not browser.eval(mark), "no heading of an old pose")
    check("heading" not in browser.text("#vehicle"), browser.text("#vehicle"))


def for_pilot(bench):
    """How fast it may go is what the socket says; a sound when it drops; north up, measuring and a picture, by keyboard too."""
    daemon, client, web, browser = begun(bench)
    browser.do("click", selector="#tab-pilot")
    speed = lambda: browser.eval("(document.querySelector('#limit-speed b') || {innerText: '–'}).innerText")

    def agrees():
        said = client.call("limit", velocity_mps=[5, 0, 0])
        shown = speed()
        return shown == "%.2f" % said["speed_mps"] and said["reason"][1:].split(",")[0][:12] in browser.text("#limit-why")
    until(agrees, "the speed that the socket allows: " + browser.text("#limit"))
    near = client.call("nearest")
    until(lambda: "%.1f" % near["range_m"] in browser.text("#facts"), "the nearest obstacle: " + browser.text("#facts"))
    check("no velocity is known" in browser.text("#facts"), browser.text("#facts"))
    for _ in range(60):
        client.call("pose", attitude_deg=[0, 0, 90], velocity_mps=[0, 0.5, 0])
        if "no velocity" not in browser.text("#facts"):
            break
        time.sleep(0.1)
    check("no velocity" not in browser.text("#facts"), browser.text("#facts"))
    browser.do("press", selector="#north-up", key="Enter")

    def turned():
        client.call("pose", attitude_deg=[0, 0, 90], velocity_mps=[0, 0.5, 0])
        return abs(browser.eval("sonardPage.painter.turn") - 90) < 1
    until(turned, "north at the top")
    browser.do("press", selector="#north-up", key="Enter")
    until(lambda: browser.eval("sonardPage.painter.turn") == 0, "the bow at the top")
    browser.do("press", selector="#measure", key="Enter")
    browser.do("at", x=0.5, y=0.5)
    px = browser.eval("sonardPage.painter.frame.scale / sonardPage.painter.unit / document.querySelector('#canvas').clientWidth")
    browser.do("at", x=0.5 + 3 * px, y=0.5 - 4 * px)
    told = browser.text("#measured")
    check(abs(float(told.split(" ")[0]) - 5) < 0.1 and "37°" in told, told)
    for key in ("Enter", "ArrowUp", "ArrowUp", "Enter"):
        browser.do("press", selector="#canvas", key=key)
    step = 2 * browser.eval("sonardPage.view.range") * 5 / 100
    check(browser.text("#measured") == "%.2f m, 0° from the bow" % step, browser.text("#measured"))
    browser.eval("(() => { const make = URL.createObjectURL; URL.createObjectURL = (b) => { globalThis.saved = b.size; return make(b); }; })()")
    browser.do("press", selector="#shot", key="Enter")
    until(lambda: browser.eval("globalThis.saved > 5000"), "a picture")
    browser.do("press", selector="#sound", key="Enter")
    check(browser.eval("sonardPage.sound.on") and browser.eval("document.querySelector('#sound').getAttribute('aria-pressed')") == "true", "no sound")
    daemon.process.send_signal(signal.SIGSTOP)
    until(lambda: browser.eval("sonardPage.sound.played") >= 2, "a sound, and another, when nothing is known any more")
    check(speed() == "–", browser.text("#limit"))
    daemon.process.send_signal(signal.SIGCONT)
    until(lambda: speed() != "–", "the speed again")
    browser.do("click", selector="#full")
    until(lambda: browser.eval("document.fullscreenElement !== null") and browser.text("#awake") != "", "a full screen, and whether it stays awake")
    for _ in range(2):
        browser.do("click", selector="#theme")
    check(browser.text("#theme") in ("Night", "Light", "Dark"), browser.text("#theme"))
    url = "http://127.0.0.1:%d/#pilot" % web.port
    for width, height in ((1280, 860), (390, 844), (844, 390), (1024, 768)):
        browser.do("open", url=url, width=width, height=height)
        until(lambda: speed() != "–", "the speed on %dx%d" % (width, height))
        for part in ("#canvas", "#limit-speed"):
            box = browser.eval("(({left, top, right, bottom}) => [left, top, right, bottom])(document.querySelector('%s').getBoundingClientRect())" % part)
            check(box[0] >= 0 and box[1] >= 0 and box[2] <= width and box[3] <= height, "%s is cut off on %dx%d: %s" % (part, width, height, box))
    check(browser.do("faults") == [], browser.do("faults"))


def settings(bench):
    """The form says why nothing may be changed; with a token it changes a setting, and says what it does not know. The
    pilot's button begins and ends a recording, with the token too."""
    daemon, client, _, browser = begun(bench, pings=5, record={"directory": bench.path("captures"), "start": "on_request"})
    recording = lambda: client.call("status")["record"]["recording"]

    def press_record():
        browser.do("click", selector="#tab-pilot")
        until(lambda: not browser.eval("document.querySelector('#record').hidden"), "the button")
        browser.do("press", selector="#record", key="Enter")

    def apply(text, token):
        browser.eval("document.querySelector('#settings').open = true")
        browser.eval("document.querySelector('#setting').value = %s; document.querySelector('#token').value = %s" % (json.dumps(text), json.dumps(token)))
        browser.do("click", selector="#settings button")
    browser.do("click", selector="#tab-pilot")
    until(lambda: browser.text("#limit-speed"), "the pilot's page")
    check(browser.eval("document.querySelector('#record').hidden"), "a button that can do nothing")
    browser.do("click", selector="#tab-sonar")
    apply("[grid] clear_for = 21 s", "x")
    until(lambda: "--settings" in browser.text("#setting-said"), "the reason")
    web = Web(bench, *with_token(bench))
    browser.do("open", url="http://127.0.0.1:%d/" % web.port, width=1280, height=860)
    until(lambda: browser.text("#link") == "live", "a live page")
    press_record()
    until(lambda: "token" in browser.text("#record-said"), "what is missing: " + browser.text("#record-said"))
    browser.do("click", selector="#tab-sonar")
    apply("[grid] clear_for = 21 s", TOKEN)
    until(lambda: browser.text("#setting-said") == "Applied: [grid] clear_for = 21 s", "the change")
    check(client.call("status")["grids"][0]["clear_for_s"] == 21, "the daemon knows nothing of it")
    press_record()
    until(recording, "a recording: " + browser.text("#record-said"))
    until(lambda: browser.text("#record").startswith("Stop recording sonard-"), "its name: " + browser.text("#record"))
    browser.do("press", selector="#record", key="Enter")
    until(lambda: not recording() and browser.text("#record") == "Record", "its end: " + browser.text("#record"))
    browser.do("click", selector="#tab-sonar")
    daemon.process.send_signal(signal.SIGSTOP)
    apply("[grid] clear_for = 33 s", TOKEN)
    until(lambda: "not known" in browser.text("#setting-said"), "doubt")
    until(lambda: browser.text("#link") == "daemon lost", "the loss")
    daemon.process.send_signal(signal.SIGCONT)
    until(lambda: browser.text("#setting-said").startswith(("Applied", "the daemon was lost")), "what became of it")
    said, has = browser.text("#setting-said"), client.call("status")["grids"][0]["clear_for_s"]
    check(has == (33 if said.startswith("Applied") else 21), "%s, but it is %s s" % (said, has))
    check(browser.do("faults") == [], browser.do("faults"))


FOCUSED = "(() => { const e = document.activeElement; return e === document.body ? null : e.id || e.tagName + ':' + e.textContent.trim().slice(0, 20); })()"
REACHED = """Array.from(document.querySelectorAll("button, select, input, canvas, summary, a[href]"))
  .filter((e) => e.checkVisibility() && !e.disabled && e.tabIndex >= 0).map((e) => e.id || e.tagName + ':' + e.textContent.trim().slice(0, 20))"""


def by_keyboard(bench):
    """The Tab key reaches all that can be used on each tab, each has a name for a screen reader, and keys are enough."""
    _, _, _, browser = begun(bench, *with_token(bench), pings=30, record={"directory": bench.path("captures"), "start": "on_request"})
    for tab, keys in (("sonar", ()), ("map", ("ArrowRight",)), ("pilot", ("ArrowRight",))):
        browser.eval("document.querySelector('[role=tab][tabindex=\"0\"]').focus()")
        for key in keys:
            browser.do("key", key=key)
        until(lambda: browser.eval("sonardPage.view.tab") == tab and browser.eval(FOCUSED) == "tab-" + tab, "the tab " + tab)
        if tab != "pilot":
            browser.eval("for (const d of document.querySelectorAll('details')) d.open = true")
        if tab == "sonar":
            until(lambda: browser.eval("!document.querySelector('#head').disabled"), "the head's settings")
        time.sleep(0.5)
        wanted, reached = set(browser.eval(REACHED)), set()
        browser.eval("document.activeElement.blur()")
        for _ in range(3 * len(wanted)):
            browser.do("key", key="Tab")
            reached.add(browser.eval(FOCUSED))
        check(len(wanted) > 8 and wanted <= reached, "%s: the Tab key does not reach %s" % (tab, sorted(wanted - reached)))
        tree = browser.do("tree")
        nameless = [n for n in tree if n["focusable"] and not n["name"] and n["role"] != "RootWebArea"]
        check(not nameless, "%s: without a name: %s" % (tab, nameless))
        check({"main", "banner", "tablist", "tabpanel"} <= {n["role"] for n in tree}, "%s: no landmarks" % tab)
    browser.do("key", key="Home")
    browser.eval("document.querySelector('#tab-sonar').focus(); document.querySelector('#tab-sonar').click()")
    browser.do("press", selector="#canvas", key="ArrowRight")
    ring = lambda: next(n for n in browser.do("tree") if n["role"] == "slider" and (n["name"] or "").startswith("Ring of sectors: Ahead"))
    until(lambda: re.match(r"5° \(ahead\): (blocked at \d|clear|unknown, free to \d)", browser.eval("document.querySelector('#canvas').getAttribute('aria-valuetext')") or ""),
          "the direction in words: %s" % ring())
    said = browser.eval("document.querySelector('#link-said').textContent")
    check(said == "live", "the state is said as: " + said)
    browser.do("press", selector="#canvas", key="f")
    until(lambda: browser.text("#link").startswith("looking back"), "a picture that stands still")
    check(browser.eval("document.querySelector('#freeze').getAttribute('aria-pressed')") == "true", "the button does not say so")
    until(lambda: "not now" in browser.eval("document.querySelector('#link-said').textContent"), "that it is not now")
    newest = browser.eval("sonardPage.view.newest.t")
    until(lambda: browser.eval("Math.max(...Array.from(sonardPage.rows.values(), (r) => r.t))") > newest + 1, "pings behind it")
    check(browser.eval("sonardPage.view.newest.t") == newest, "it goes on")
    browser.do("press", selector="#freeze", key="Enter")
    until(lambda: browser.text("#link") == "live" and browser.eval("sonardPage.view.newest.t") > newest, "it to go on")
    browser.do("press", selector="#measure", key="Enter")
    until(lambda: any(n["role"] == "application" and n["name"].startswith("Measure") for n in browser.do("tree")), "what the keys do")
    check(browser.do("faults") == [], browser.do("faults"))


def tuned(bench):
    """The console: palette and contrast change the picture, range, gain and mode the head, with the token alone."""
    _, client, _, browser = begun(bench, pings=30)
    browser.do("click", selector="#console summary")
    until(lambda: "--settings" in browser.text("#head-none"), "why nothing can be set")
    check(browser.eval("document.querySelector('#head').disabled"), "it can be set all the same")
    web = Web(bench, *with_token(bench))
    browser.do("open", url="http://127.0.0.1:%d/" % web.port, width=1280, height=860)
    until(lambda: browser.text("#link") == "live" and browser.eval("sonardPage.rows.size") > 20, "a live page")
    browser.do("click", selector="#console summary")
    until(lambda: browser.eval("!document.querySelector('#head').disabled"), "the head's settings")
    tuning = lambda: next(s["tuning"] for s in client.call("sensors")["sensors"])
    check(browser.eval("document.querySelector('#head-range').value") == "%g" % tuning()["range_m"], "another range than the head's")
    browser.do("choose", selector="#head-range", value="5")
    until(lambda: "token" in browser.text("#head-said") and browser.eval(FOCUSED) == "token", "what is missing")
    check(tuning()["range_m"] != 5, "it was set without the token")
    check("enter the token" in browser.text("#head-none"), "it does not say what is missing: " + browser.text("#head-none"))
    browser.eval("(() => { const t = document.querySelector('#token'); t.value = '%s'; t.dispatchEvent(new Event('input')); })()" % TOKEN)
    check(browser.text("#head-none") == "", "something is missing still: " + browser.text("#head-none"))
    choices = (("range", "5", lambda t: t["range_m"] == 5), ("gain", "2", lambda t: t["gain"] == 2), ("gain", "-1", lambda t: t["gain"] is None),
               ("mode", "request", lambda t: t["mode"] == "request"), ("range", "20", lambda t: t["range_m"] == 20))
    for key, value, done in choices:
        browser.eval("document.activeElement.blur()")
        browser.do("choose", selector="#head-" + key, value=value)
        until(lambda: done(tuning()), "%s = %s: %s" % (key, value, browser.text("#head-said")))
        until(lambda: browser.text("#head-said").startswith("Applied: [sonar "), "that it was applied: " + browser.text("#head-said"))
    until(lambda: abs(client.sensor()["range_m"] - 20) < 0.5, "pings of the new range")
    colour = lambda: browser.eval("[1, 60, 200].map((i) => Array.from(sonardPage.painter.table.slice(3 * i, 3 * i + 3)))")
    own = colour()
    browser.do("choose", selector="#palette", value="grey")
    grey = colour()
    check(all(len(set(c)) == 1 for c in grey) and grey[0] < grey[1] < grey[2], "grey is %s" % grey)
    browser.eval("document.querySelector('#contrast').focus()")
    for _ in range(2):
        browser.do("key", key="ArrowRight")
    sharp = colour()
    check(browser.text("#contrast-said") == "+1" and sharp[2][0] - sharp[1][0] > grey[2][0] - grey[1][0] and sharp[0][0] <= grey[0][0], "%s, but %s" % (sharp, grey))
    browser.do("choose", selector="#palette", value="page")
    browser.eval("(() => { const c = document.querySelector('#contrast'); c.value = 0; c.dispatchEvent(new Event('input')); })()")
    check(colour() == own, "not as before")
    for _ in range(3):
        browser.do("click", selector="#theme")
        night = browser.text("#theme") == "Night"
        browser.do("choose", selector="#palette", value="grey")
        check(not night or all(r > g for r, g, _ in colour()[1:]), "the night palette is not red: %s" % colour())
    check(browser.do("faults") == [], browser.do("faults"))


def looks_back(bench):
    """A capture in the page: the slider shows what was known at any time of it, and says that this is not now."""
    bench.sim()
    bench.conf(vehicle={"near": "0.8 m"}, extract={"no_echo": "range"})
    daemon = bench.sonard("--record", bench.path("kept"))
    pings_until(daemon.client(), 300, 60)
    daemon.stop()
    capture, = glob.glob(bench.path("kept/*.mcap"))
    web, browser = Web(bench), Browser(bench)
    browser.do("open", url="http://127.0.0.1:%d/" % web.port, width=1280, height=860)
    browser.do("choose", selector="#distance", value="0")
    client = bench.sonard("--replay", capture, "--speed", "1", "--stay", "--socket", bench.socket_path, conf=False).client()
    known = []

    def ended():
        answer = client.call("sectors", distance_m=0)
        known.append((client.call("status")["t_unix"], [s["state"] for s in answer["sectors"]]))
        time.sleep(0.1)
        return browser.text("#mode") == "replay, ended"
    until(ended, "the end of the capture", 120)
    end = known[-1][0]
    middle = next(k for k in known if k[0] > end - 3)
    slide = "(() => { const b = document.querySelector('#back'); b.value = %g; b.dispatchEvent(new Event('input')); return Number(b.value); })()"

    def as_then():
        went = browser.eval(slide % (middle[0] - end))
        time.sleep(0.3)
        ring = browser.eval(RING)
        differ = min(sum(a != b for a, b in zip(ring, k[1])) for k in known if abs(k[0] - middle[0] + 0.5) < 0.7 * PATIENCE)
        return abs(went) > 2 and differ <= 8  # the page has the answers of up to a second before
    until(as_then, "the ring of 3 s before the end")
    check(browser.text("#link").startswith("looking back"), browser.text("#link"))
    newest = browser.eval("Math.max(...Array.from(sonardPage.view.rows.values(), (r) => r.t))")
    check(newest <= browser.eval("sonardPage.view.back") and newest > end - 5, "a row of %.2f s before the end" % (end - newest))
    browser.do("at", x=0.7, y=0.5)
    until(lambda: "slider" in browser.text("#why"), "that only the present is explained")
    browser.eval(slide % 0)
    until(lambda: browser.text("#link") == "live", "the end again")
    check(browser.eval("sonardPage.view.newest.t") > newest + 1, "the old picture stays")
    check(browser.do("faults") == [], browser.do("faults"))


def jumps(bench):
    """The time line of a capture: pause, play, to any time forth and back; what is drawn is what the socket then says."""
    daemon = bench.sonard("--replay", "tests/replay/box.mcap", "--speed", "1", "--stay", "--socket", bench.socket_path, conf=False)
    browser = Browser(bench)
    plain = Web(bench)
    browser.do("open", url="http://127.0.0.1:%d/" % plain.port, width=1280, height=860)
    until(lambda: not browser.eval("document.querySelector('#replay').hidden"), "the time line")
    check(browser.eval("document.querySelector('#at').disabled"), "it can be moved without --replay")
    web = Web(bench, "--replay")
    browser.do("open", url="http://127.0.0.1:%d/" % web.port, width=1280, height=860)
    browser.do("choose", selector="#distance", value="0")
    until(lambda: browser.eval("!document.querySelector('#replay').hidden && !document.querySelector('#at').disabled"), "the time line")
    length = daemon.client().call("status")["replay"]["length_s"]
    check(abs(browser.eval("Number(document.querySelector('#at').max)") - length) < 0.01, "another length")
    until(lambda: browser.text("#mode") == "replay, ended" and browser.text("#play") == "Play", "the end")
    browser.do("click", selector="#play")
    until(lambda: browser.text("#play") == "Pause", "it to play again")
    browser.do("click", selector="#play")
    until(lambda: browser.text("#mode") == "replay, paused", "a pause")
    slide = "(() => { const a = document.querySelector('#at'); a.value = %g; for (const e of ['input', 'change']) a.dispatchEvent(new Event(e)); })()"
    for to_s in (length, 3.6, 2.7, 4.0, 1.0, 4.2):
        browser.eval(slide % to_s)

        def shown():
            if browser.eval("sonardPage.view.dragging") or not browser.text("#at-said").startswith("0:%04.1f of" % to_s) or not browser.eval("sonardPage.fresh()"):
                return False
            said = [s["state"] for s in daemon.client().call("sectors", distance_m=0)["sectors"]]
            time.sleep(0.3)
            return browser.eval(RING) == said and browser.eval("sonardPage.state.status.replay.position_s") == daemon.client().call("status")["replay"]["position_s"]
        until(shown, "%g s" % to_s)
    check("blocked" in browser.eval(RING), "nothing is drawn")
    check(browser.do("faults") == [], browser.do("faults"))


def hidden(bench):
    """A tab that nobody sees asks for nothing, and catches up when it is seen."""
    _, client, _, browser = begun(bench, pings=20)
    set_hidden = "Object.defineProperty(document, 'hidden', {value: %s, configurable: true}); document.dispatchEvent(new Event('visibilitychange'))"
    browser.eval(set_hidden % "true")

    def silent():
        before = client.call("status")["server"]["requests"]
        time.sleep(1)
        return client.call("status")["server"]["requests"] - before <= 2
    until(silent, "questions of a hidden page")
    browser.eval(set_hidden % "false")
    until(lambda: browser.text("#link") == "live" and browser.eval("sonardPage.rows.size") > 0, "the page's return")
    until(lambda: browser.eval("sonardPage.past.rows.length") > 250, "enough to look back at", 60)
    check(browser.eval("sonardPage.past.bytes / sonardPage.past.rows.length") > 256, "rows without bytes")
    browser.eval("sonardPage.past.bytes += 64 << 20")  # as if that much had come
    until(lambda: browser.eval("sonardPage.past.rows.length") < 100, "the oldest rows to be dropped")


def looks(bench):
    """On a phone, upright and lying, nothing is cut off; the pictures of the guide, and others to be looked at: by night,
    without colours, with the console."""
    bench.sim(scene="harbour")
    bench.conf(sonar={"range": "20 m"}, vehicle={"near": "1 m"}, map={"voxel": "0.2 m", "memory": "32 MiB"}, extract={"no_echo": "minimum"})
    client = bench.sonard().client()
    web = Web(bench, *with_token(bench))
    browser = Browser(bench)
    end = time.monotonic() + 60 * PATIENCE
    first = client.sensor()["pings"]
    while client.sensor()["pings"] < first + 230 and time.monotonic() < end:
        client.call("pose", attitude_deg=[0, 0, 5 * math.sin(time.monotonic() / 8)], position_m=[0, 0, 2])
        time.sleep(0.1)
    url = "http://127.0.0.1:%d/" % web.port
    for name, width, height, scale, theme in (("web", 1280, 860, 1, "dark"), ("web-light", 1280, 860, 1, "light"), ("web-phone", 390, 844, 2, "light"),
                                              ("web-phone-dark", 390, 844, 2, "dark"), ("web-phone-lying", 844, 390, 2, "dark")):
        browser.do("open", url=url, width=width, height=height, scale=scale, theme=theme)
        shown = 0
        while shown < 60 and not browser.eval("sonardPage.rows.size > 190 && sonardPage.fresh()"):
            client.call("pose", attitude_deg=[0, 0, 5 * math.sin(time.monotonic() / 8)], position_m=[0, 0, 2])
            shown += 1
            time.sleep(0.1)
        browser.do("at", x=0.72, y=0.25)
        for _ in range(12):
            client.call("pose", attitude_deg=[0, 0, 5 * math.sin(time.monotonic() / 8)], position_m=[0, 0, 2])
            time.sleep(0.1)
        check(browser.eval("document.documentElement.scrollWidth <= innerWidth"), "%s: wider than the screen" % name)
        check(browser.eval("document.querySelector('#canvas').getBoundingClientRect().width") > 0.55 * min(width, height), "%s: a small picture" % name)
        check(browser.eval("document.documentElement.dataset.theme") == theme, "%s: another theme" % name)
        ragged = browser.eval("""(() => { const at = (e) => e.getBoundingClientRect(), li = Array.from(document.querySelectorAll('#legend li')).filter((e) => e.checkVisibility());
          return li.filter((e) => { const k = e.querySelector('.key'); return at(k).right > at(e).right || at(k).width < 8; }).map((e) => e.textContent)
            .concat(innerWidth < 500 && new Set(li.map((e) => Math.round(at(e).left))).size > 2 ? ['more than two columns'] : []); })()""")
        check(ragged == [], "%s: the legend: %s" % (name, ragged))
        contrast = browser.eval("""(() => { const l = (c) => { const v = c.match(/\\d+/g).slice(0, 3).map((x) => { x /= 255; return x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4; }); return 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]; };
          const a = l(getComputedStyle(document.querySelector('.muted')).color), b = l(getComputedStyle(document.body).backgroundColor);
          return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05); })()""")
        check(contrast > 4.5, "%s: contrast %.1f of small text" % (name, contrast))
        if SHOTS:
            browser.do("shot", path=os.path.join(SHOTS, name + ".jpg"))
    browser.do("open", url=url, width=1280, height=860, theme="dark")
    browser.do("click", selector="#console summary")
    for _ in range(30):
        client.call("pose", attitude_deg=[0, 0, 0], position_m=[0, 0, 2])
        time.sleep(0.1)
    check(browser.eval("document.querySelector('#head-range').value") == "20", "no console")
    looks = (("web-console", ""), ("web-console-amber", "const p = document.querySelector('#palette'); p.value = 'amber'; p.dispatchEvent(new Event('change'))"),
             ("web-grey", "document.documentElement.style.filter = 'grayscale(1)'"),
             ("web-night", "document.documentElement.style.filter = ''; const t = document.querySelector('#theme'); t.click(); t.click()"))
    for name, does in looks:
        browser.eval("(() => { %s })()" % does)
        client.call("pose", attitude_deg=[0, 0, 0], position_m=[0, 0, 2])
        time.sleep(0.3)
        if SHOTS:
            browser.do("shot", path=os.path.join(SHOTS, name + ".jpg"))
    browser.do("open", url=url, width=1280, height=860, theme="dark")
    browser.do("click", selector="#tab-map")
    for _ in range(30):
        client.call("pose", attitude_deg=[0, 0, 0], position_m=[0, 0, 2])
        time.sleep(0.1)
    said = "".join(client.call("map_slice", size_m=40, cells=160)["rows"])
    got = "".join(browser.eval("sonardPage.state.slice ? sonardPage.state.slice.rows : []"))
    check(len(got) == len(said) and sum(a != b for a, b in zip(got, said)) < 200 and "#" in got, "another map")
    if SHOTS:
        browser.do("shot", path=os.path.join(SHOTS, "web-map.jpg"))
    check(browser.do("faults") == [], browser.do("faults"))


run([("web_page_" + f.__name__, f) for f in (drawn, why, recovers, warns, heading, for_pilot, settings, by_keyboard, tuned, looks_back, jumps, hidden, looks)])
