#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""sonard-web: what it answers over HTTP and shows to pages is what the socket says; hostile browsers get nothing; slow
ones cost nobody anything; a daemon that is lost comes back."""
import base64
import glob
import json
import math
import os
import re
import select
import shutil
import socket
import struct
import subprocess
import threading
import time

import protobuf
from lib import Client, jsonschema, PATIENCE, Skipped, SANITIZER, SCHEMAS, RpcError, check, note, pings_until, run, until
from webclient import Page, Web, rows_of


def started(bench, *arguments, **conf):
    bench.sim()
    bench.conf(**conf)
    bench.sonard()
    client = bench.processes[-1].client()
    return client, Web(bench, *arguments)


def asks():
    """The methods that change nothing and answer at once."""
    watched = SCHEMAS.document["$defs"]["notification"]["properties"]["params"]["properties"]["method"]["enum"]
    return [m for m in watched if m not in ("watch", "unwatch")]


def answers(bench):
    """Every method that asks: the result of the socket, or its refusal."""
    client, web = started(bench, map={"voxel": "0.5 m", "memory": "8 MiB"})
    pings_until(client, 20)
    statuses = {}
    for method in asks():
        params = SCHEMAS.needed(method)
        if "points_m" in params:
            query = dict(params, points_m="[[0,0,0]]")
        else:
            query = params
        status, body = web.get("/api/" + method, **query)
        statuses[status] = statuses.get(status, 0) + 1
        try:
            result = client.call(method, **params)
            check(status == 200, "%s: %d %s" % (method, status, body))
            SCHEMAS.check(method, "result", body)
            check(set(body) == set(result), "%s: other fields: %s" % (method, set(body) ^ set(result)))
        except RpcError as error:
            check(status == 400 and body["error"]["code"] == error.code and body["error"]["message"].endswith(str(error)),
                  "%s: %s, but %d %s" % (method, error, status, body))
    note("%d methods: %s" % (len(asks()), statuses))
    status, body = web.get("/api/sectors", count=8, frame="body")
    check(status == 200 and len(body["sectors"]) == 8, body)
    check(web.get("/api/limit", velocity_mps=[1, 0, 0])[1]["asked_mps"] == 1, "another velocity")
    check(web.get("/api/version")[1] == client.call("version"), "another version")


def only_questions(bench):
    client, web = started(bench)
    every = SCHEMAS.methods()
    changing = sorted(set(every) - set(asks()) - {"watch", "unwatch"})
    check(len(changing) > 8, changing)
    for method in changing + ["watch", "unwatch", "", "nonsense", "version/", "Version"]:
        status, body = web.get("/api/" + method)
        check(status == 404 and body["error"]["code"] == -32601, "%s: %d" % (method, status))
    for method in ("POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT"):
        status = web.request("/api/version", method=method, body=b"x" * 100)[0]
        check(status in (405, 400, 403, 404, None), "%s: %s" % (method, status))
    status, headers, body = web.request("/", method="HEAD")
    check(status == 200 and body == b"" and int(headers["content-length"]) > 1000, headers)
    page = Page(web)
    check(page.ask("pose", depth_m=1)["error"]["code"] == -32601, "a page can change something")
    page.watch("reload", "version")
    page.of("version")
    check(client.call("status")["pose"]["count"] == 0, "a pose was taken")
    for query in ("azimuth_deg=1", "azimuth_deg=1&distance_m=1&x=1", "azimuth_deg=x&distance_m=1", "azimuth_deg=1&azimuth_deg=1",
                  "azimuth_deg=999&distance_m=1", "azimuth_deg=1&distance_m=1&half_angle_deg=1&radius_m=1", "=&=", "&&a"):
        status, _, body = web.request("/api/blocked?" + query)
        check(status == 400 and json.loads(body)["error"]["code"] == -32602, "%s: %s %s" % (query, status, body))
    check(web.request("/api/blocked?azimuth_deg=1&distance_m=1%00")[0] in (400, None), "a NUL is taken")


TOKEN = "a-token-for-the-tests"


def set_up_settings(bench):
    """(client, sonard-web that lets pages change settings, the file)."""
    os.mkdir(bench.path("sonard.conf.d"))
    token = bench.write("token", TOKEN + "\n")
    os.chmod(token, 0o600)
    path = bench.path("sonard.conf.d/web.conf")
    client, web = started(bench, "--settings", path, "--token", token)
    until(lambda: client.call("status")["sensors"][0]["pings"] > 0, "a ping")
    return client, web, path


def settings(bench):
    """With the token a page changes what can be reloaded; what the daemon refuses leaves no trace."""
    client, web, path = set_up_settings(bench)
    page = Page(web)
    clear_for = lambda: client.call("status")["grids"][0]["clear_for_s"]
    content = lambda: open(path, encoding="ascii").read() if os.path.exists(path) else ""

    def set_it(text, token=TOKEN):
        return page.ask("settings", text=text, token=token)
    check(set_it("[grid] clear_for = 21 s")["result"]["applied"] == ["[grid] clear_for = 21 s"], "not applied")
    check(clear_for() == 21 and "clear_for = 21 s" in content(), content())
    before = content()
    for text, why in (("[grid] clear_for = 1 parsec", "clear_for"), ("[map] voxel = 1 m", "restart"), ("[grid] nonsense = 1", "nonsense"),
                      ("[grid fine] clear_for = 20 s", "restart"), ("[grid ] clear_for = 5 s", "blank"),
                      ("[sonar  box] rotation = 0 0 180 deg", "blank"),
                      ("[server] change = all", "server"), ("[grid] clear_for = 5 s\n[server]\nchange = all", "expected")):
        error = set_it(text)["error"]["message"]
        check(why in error and content() == before and clear_for() == 21, "%s: %s, and the file has %s" % (text, error, content()))
    wrong = set_it("[grid] clear_for = 5 s", TOKEN[:-1] + "x")
    check("token" in wrong["error"]["message"], "a wrong token is taken")
    check(content() == before and clear_for() == 21, "changed all the same")
    check(set_it("[grid] clear_for = 22 s")["result"]["applied"] and clear_for() == 22, "not after a wrong token")
    for token, why in ((TOKEN, "folder"), ("", "token")):
        error = page.ask("record", on=True, token=token)["error"]["message"]
        check(why in error, "a recording, where none is configured, with the token '%s': %s" % (token, error))
    leaving = Page(web)
    leaving.say({"id": 1, "method": "settings", "params": {"text": "[map] voxel = 2 m", "token": TOKEN}})
    leaving.close()  # its change is refused, though nobody waits for the answer
    until(lambda: "result" in set_it("[grid] clear_for = 23 s"), "a change after that of a page that has left")
    check("voxel" not in content(), content())


def settings_guessed(bench):
    """Who gave a wrong token waits for a second."""
    client, web, _ = set_up_settings(bench)
    page = Page(web)
    for number, token in ((8, TOKEN[:-1] + "x"), (9, TOKEN)):
        page.say({"id": number, "method": "settings", "params": {"text": "[grid] clear_for = 5 s", "token": token}})
    said = page.until(lambda m: isinstance(m, dict) and "id" in m, "the first answer")
    check(said["id"] == 9 and "wait" in said["error"]["message"], "guesses are not slowed down: %s" % said)
    wrong = page.until(lambda m: isinstance(m, dict) and "id" in m, "the second")
    check(wrong["id"] == 8 and "token" in wrong["error"]["message"], wrong)
    check(client.call("status")["grids"][0]["clear_for_s"] != 5, "changed all the same")


def settings_in_a_flood(bench):
    """Wrong tokens of others, from the same address, keep nobody with the right one waiting."""
    client, web, _ = set_up_settings(bench)
    stop, guesses, taken = threading.Event(), [0], []

    def flood():
        while not stop.is_set():
            guesser = Page(web)
            for i in range(2):
                guesser.say({"id": i, "method": "settings", "params": {"text": "[grid] clear_for = 5 s", "token": "x" * len(TOKEN)}})
                guesses[0] += 1
            if guesses[0] % 10 == 0:  # some wait for the answer
                refused = [guesser.until(lambda m: isinstance(m, dict) and "id" in m, "an answer").get("error", {}).get("code") for _ in range(2)]
                taken.extend(code for code in refused if code not in (-32001, -32000))
            guesser.close()
    threads = [threading.Thread(target=flood) for _ in range(3)]
    for thread in threads:
        thread.start()
    page = Page(web)
    changes = 0
    try:
        while changes < 30 or (guesses[0] <= 30 and changes < 3000):
            changes += 1
            clear_for = 30 + changes % 30
            answer = page.ask("settings", text="[grid] clear_for = %d s" % clear_for, token=TOKEN)
            check(answer.get("result", {}).get("applied"), answer)
            check(client.call("status")["grids"][0]["clear_for_s"] == clear_for, "not applied")
    finally:
        stop.set()
        for thread in threads:
            thread.join()
    note("%d changes among %d wrong tokens" % (changes, guesses[0]))
    check(guesses[0] > 30 and not taken, "%d guesses, taken: %s" % (guesses[0], taken))


class Between(threading.Thread):
    """Stands between sonard-web and the daemon, and loses the next request of a method on its way there or its answer back."""

    def __init__(self, bench):
        super().__init__(daemon=True)
        self.daemon_path, self.loses, self.method, self.open = bench.socket_path, None, b'"reload"', True
        self.listener = socket.socket(socket.AF_UNIX)
        self.path = bench.path("between")
        self.listener.bind(self.path)
        self.listener.listen(8)
        self.start()

    def run(self):
        while True:
            near = self.listener.accept()[0]
            far = socket.socket(socket.AF_UNIX)
            try:
                if self.open:
                    far.connect(self.daemon_path)
                    threading.Thread(target=self.carry, args=(near, far), daemon=True).start()
                    continue
            except OSError:
                pass
            near.close()

    def carry(self, near, far):
        losing = False
        with near, far:
            while True:
                for s in select.select([near, far], [], [])[0]:
                    try:
                        data = s.recv(65536)
                    except OSError:
                        return
                    losing |= s is near and self.loses is not None and self.method in data
                    if not data or losing and (self.loses == "request" or s is far):
                        self.loses = None
                        return
                    (far if s is near else near).sendall(data)


def settings_lost(bench):
    """Where the daemon's answer is lost, the change is taken back, and the daemon has what the file and the page say."""
    bench.sim()
    bench.conf()
    daemon = bench.sonard()
    between = Between(bench)
    os.mkdir(bench.path("sonard.conf.d"))
    token = bench.write("token", TOKEN + "\n")
    os.chmod(token, 0o600)
    path = bench.path("sonard.conf.d/web.conf")
    web = Web(bench, "--settings", path, "--token", token, socket=between.path)
    page = Page(web)
    clear_for = lambda of: of.client().call("status")["grids"][0]["clear_for_s"]
    content = lambda: open(path, encoding="ascii").read() if os.path.exists(path) else ""

    def set_it(text):
        page.say({"id": 7, "method": "settings", "params": {"text": text, "token": TOKEN}})
        return page.until(lambda m: isinstance(m, dict) and m.get("id") == 7, "the answer to " + text)
    until(lambda: "result" in set_it("[grid] clear_for = 21 s"), "a change that is taken")
    before = content()
    for loses, taken in (("request", False), ("answer", True)):
        between.loses = loses
        message = set_it("[grid] clear_for = 33 s")["error"]["message"]
        check("lost" in message and "taken back" in message, message)
        check(content() == before and clear_for(daemon) == 21, "%s: %s s, and the file has %s" % (loses, clear_for(daemon), content()))
        check(("clear_for = 33 s" in daemon.log()) == taken, "the daemon had it: %s" % daemon.log())
    between.method = b'"reload_check"'
    for loses in ("request", "answer"):
        between.loses = loses
        message = set_it("[grid] clear_for = 34 s")["error"]["message"]
        check("lost" in message and "nothing is changed" in message, message)
        check(content() == before and clear_for(daemon) == 21, "%s: the file has %s" % (loses, content()))
        until(lambda: "needs a restart" in set_it("[map] voxel = 1 m")["error"]["message"], "the connection")
    between.method = b'"reload"'
    between.loses, between.open = "request", False
    page.say({"id": 7, "method": "settings", "params": {"text": "[grid] clear_for = 35 s", "token": TOKEN}})
    until(lambda: between.loses is None and content() == before, "the change to be taken back")
    daemon.process.kill()
    daemon.expected = -9
    daemon.wait()
    again = bench.sonard()
    check(clear_for(again) == 21, "another start, another value")
    between.open = True
    answer = page.until(lambda m: isinstance(m, dict) and m.get("id") == 7, "the answer")
    check("taken back" in answer["error"]["message"] and content() == before and clear_for(again) == 21, answer)
    check(set_it("[grid] clear_for = 22 s")["result"]["applied"] and clear_for(again) == 22, "nothing can be changed afterwards")


def settings_refused(bench):
    """A file that the daemon does not read gets nothing, and a page's line that is wrong keeps no daemon from starting."""
    bench.sim()
    bench.conf(grid={"clear_for": "12 s"})
    daemon = bench.sonard()
    daemon.client().call("status")
    token = bench.write("token", TOKEN + "\n")
    os.chmod(token, 0o600)
    elsewhere = bench.path("web.conf")
    page = Page(Web(bench, "--settings", elsewhere, "--token", token))
    for text in ("[grid] clear_for = 1 parsec", "[grid] clear_for = 21 s"):
        until(lambda: "no daemon" not in page.ask("settings", text=text, token=TOKEN)["error"]["message"], "the connection")
        error = page.ask("settings", text=text, token=TOKEN)["error"]["message"]
        check("does not read" in error and not os.path.exists(elsewhere), "%s: %s" % (text, error))
    daemon.stop()
    folder = bench.path("sonard.conf.d")
    os.mkdir(folder)
    written = bench.write("sonard.conf.d/web.conf", "# Written by sonard-web; a change by hand is lost.\n[answers]\nlook_ahead = 4 m\n"
                          "[grid]\nclear_for = 1 parsec\n")
    daemon = bench.sonard()
    client = daemon.client()
    check("has no effect" in daemon.log() and "web.conf:5: [grid] clear_for = 1 parsec" in daemon.log(), daemon.log())
    check(client.call("status")["grids"][0]["clear_for_s"] == 12, "not what sonard.conf says")
    check(client.call("sectors")["distance_m"] == 4, "what is good in the file is left out, too")
    page = Page(Web(bench, "--settings", written, "--token", token))
    until(lambda: "no daemon" not in page.ask("settings", text="[answers] look_ahead = 5 m", token=TOKEN)["error"]["message"], "the connection")
    error = page.ask("settings", text="[answers] look_ahead = 5 m", token=TOKEN)["error"]["message"]
    check("web.conf:5: [grid] clear_for = 1 parsec" in error, error)
    check("result" in page.ask("settings", text="[grid] clear_for = 13 s", token=TOKEN), "it cannot be mended from the page")
    check(client.call("status")["grids"][0]["clear_for_s"] == 13, "not applied")


def replays(bench):
    """With --replay a page pauses a capture and jumps in it, and nothing else; without, it may not even that."""
    client = bench.sonard("--replay", "tests/replay/box.mcap", "--speed", "0.001", "--stay", "--socket", bench.socket_path, conf=False).client()
    plain, web = Web(bench), Web(bench, "--replay")
    page = Page(plain)
    link = page.of("link")["result"]
    check(link["replay"] is False, "it says that it may")
    check(link["settings"] is False, "it says that settings may be changed")
    check(page.ask("replay", pause="yes")["error"]["code"] == -32601, "without --replay")
    check(not client.call("status")["replay"]["paused"], "paused all the same")
    page = Page(web)
    check(page.of("link")["result"]["replay"] is True, "it does not say that it may")
    until(lambda: page.ask("replay", pause="yes", to_s=2).get("result", {}).get("paused"), "a pause")
    until(lambda: client.call("status")["replay"]["position_s"] == 2, "a jump")
    check(page.ask("map_forget")["error"]["code"] == -32601, "it may more than that")
    check(web.get("/api/replay", to_s=1)[0] == 404, "over HTTP, too")
    connection = page.ask("replay", to_s=1)
    check("result" in connection, connection)
    page.until(lambda m: m.get("method") == "link" and m["result"]["fault"] is None, "the daemon that starts anew")
    until(lambda: web.get("/api/status")[1].get("replay", {}).get("position_s") == 1, "a jump back")


def settings_of_strangers(bench):
    """Without the token, over HTTP, and from other sites nothing is changed; without --settings nobody changes anything."""
    client, web, path = set_up_settings(bench)
    wanted = {"id": 7, "method": "settings", "params": {"text": "[grid] clear_for = 5 s", "token": TOKEN}}
    before = client.call("status")["grids"][0]["clear_for_s"]
    for headers, host in ((["Origin: http://evil.example"], None), (["Origin: null"], None), ([], "evil.example")):
        page = Page(web, headers=headers, host=host)
        check(page.status != 101, "a page of another site is connected: %s %s" % (headers, host))
        page.close()
    for method in ("GET", "POST", "PUT"):
        for at in ("/api/settings", "/api/reload", "/settings", "/live"):
            status = web.request(at, method=method, body=json.dumps(wanted).encode() if method != "GET" else b"")[0]
            check(status != 200, "%s %s: %s" % (method, at, status))
    foxglove_page = Page(web, protocol="foxglove.websocket.v1")
    foxglove_page.say(wanted)
    foxglove_page.close()
    page = Page(web)
    for params in ({}, {"text": "[grid] clear_for = 5 s"}, {"text": "[grid] clear_for = 5 s", "token": ""},
                   {"text": "[grid] clear_for = 5 s", "token": 1}, {"text": "[grid] clear_for = 5 s", "token": "x" * 2000}):
        check(page.ask("settings", **params)["error"]["code"] in (-32001, -32000), params)
        time.sleep(1.1)
    plain = Web(bench)
    check(Page(web).of("link")["result"]["settings"] is True, "it does not say that settings may be changed")
    check(Page(plain).ask("settings", **wanted["params"])["error"]["code"] == -32601, "without --settings")
    check(not os.path.exists(path) and client.call("status")["grids"][0]["clear_for_s"] == before, "something was changed")


def who_may_ask(bench):
    """DNS rebinding and pages of other sites."""
    _, web = started(bench, "--names", "blueos.local", "--origins", "https://lichtblick.example")
    port = web.port
    for host, good in (("127.0.0.1:%d" % port, True), ("localhost", True), ("192.168.2.2:%d" % port, True), ("[::1]:80", True),
                       ("blueos.local:%d" % port, True), ("evil.example", False), ("evil.example:%d" % port, False),
                       ("localhost.evil.example", False)):
        for path in ("/", "/api/version", "/metrics", "/api/openapi.json", "/register_service"):
            status, _, body = web.request(path, host=host)
            check(status == (200 if good else 403), "%s %s: %s" % (host, path, status))
            check(good or b"version" not in body, "it answered")
        status, head, body = web.request("/", host=host, headers=["Accept: text/html,*/*"])
        check(good or (status == 403 and head["content-type"].startswith("text/html") and b"http://127.0.0.1:%d/" % port in body),
              "%s: a person is not told what to type: %s" % (host, body))
        check("default-src 'none'" in head["content-security-policy"] and ("evil" not in head["content-security-policy"]), head)
        page = Page(web, host=host)
        check((page.status == 101) == good, "%s: WebSocket %s" % (host, page.status))
        page.close()
    for origin, good in (("http://127.0.0.1:%d" % port, True), ("https://lichtblick.example", True), ("http://evil.example", False),
                         ("null", False), ("http://127.0.0.1:1", False), ("", True), ("http://127.0.0.1:%d.evil.example" % port, False)):
        status = web.request("/api/version", headers=["Origin: " + origin])[0]
        check(status == (200 if good else 403), "Origin %s: %s" % (origin, status))
        page = Page(web, headers=["Origin: " + origin])
        check((page.status == 101) == good, "Origin %s: WebSocket %s" % (origin, page.status))
        page.close()
    for site, status in (("cross-site", 403), ("same-site", 403), ("same-origin", 200), ("none", 200)):
        got, headers, _ = web.request("/api/version", headers=["Sec-Fetch-Site: " + site])
        check(got == status, "%s: %s" % (site, got))
        check("access-control-allow-origin" not in headers, "other sites may read it")
    for method, params, cheap in (("version", "", True), ("blocked", "?azimuth_deg=0&distance_m=3", True), ("sectors", "", False),
                                  ("next_look", "?count=64&elevation_deg=-90,90", False), ("clusters", "", False), ("image", "", False)):
        status, _, body = web.request("/api/" + method + params)  # as for an <img> of any page, over plain HTTP
        check(status == (200 if cheap else 403), "%s without the header: %d" % (method, status))
        check(cheap or "X-Sonard" in json.loads(body)["error"]["message"], body)
        check(web.request("/api/" + method + params, headers=["X-Sonard: 1"])[0] == 200, "%s with the header" % method)
    _, headers, _ = web.request("/")
    policy = headers["content-security-policy"]
    check("default-src 'none'" in policy and "unsafe" not in policy and headers["x-content-type-options"] == "nosniff", headers)
    check("no-such-host" not in policy and "frame-ancestors 'self' http://127.0.0.1:*" in policy, policy)
    with web.raw() as s:
        s.sendall(b"GET / HTTP/1.1\r\n\r\n")
        s.settimeout(10 * PATIENCE)
        check(b" 200 " not in s.recv(4096)[:20], "a request without Host is served")


def no_paths(bench):
    _, web = started(bench)
    for path in ("/../etc/passwd", "/..%2f..%2fetc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd", "/style.css/../../etc/passwd",
                 "/etc/passwd", "/index.html", "/web/page/app.js", "/.git/config", "/app.js%00.html", "/\\..\\..\\etc\\passwd",
                 "/api/../../etc/passwd", "/?/../../etc/passwd", "http://evil.example/", "/" + "a" * 3000):
        status, _, body = web.request(path)
        check(b"root:" not in body and (status != 200 or path.startswith("/?") or b"<!DOCTYPE html>" in body), "%s: %s %s" % (path, status, body[:80]))
    size = 0
    for path, kind in (("/", "text/html"), ("/app.js", "text/javascript"), ("/draw.js", "text/javascript"),
                       ("/words.js", "text/javascript"), ("/style.css", "text/css"), ("/icon.svg", "image/svg+xml"), ("/foxglove-layout.json", "application/json")):
        status, headers, body = web.request(path)
        check(status == 200 and headers["content-type"].startswith(kind) and int(headers["content-length"]) == len(body), path)
        name = "index.html" if path == "/" else path[1:]
        with open("web/page/" + name, "rb") as f:
            check(f.read() == body, "%s is not the file" % path)
        size += len(body)
    check(size < 300000, "the page has %d bytes" % size)


def hostile(bench):
    """What comes too slowly or is too large ends, and others are served meanwhile."""
    _, web = started(bench)
    start = time.monotonic()
    slow = []
    for i in range(100):
        s = web.raw()
        s.sendall(b"GET /api/version HTTP/1.1\r\nHost: 127." if i % 2 else b"")
        slow.append(s)
    for _ in range(10):
        check(web.get("/api/version")[0] == 200, "slow ones hold others up")
    took = time.monotonic() - start
    gone = 0
    for s in slow:
        s.settimeout(max(0.1, start + 25 * PATIENCE - time.monotonic()))
        try:
            while s.recv(4096):
                pass
            gone += 1
        except ConnectionResetError:
            gone += 1
        except TimeoutError:
            pass
        s.close()
    note("100 slow requests: others took %.2f s, %d were ended within %.1f s" % (took, gone, time.monotonic() - start))
    check(gone == 100, "%d of 100 slow requests were ended" % gone)
    rss = web.rss()
    for junk in (b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + b"a" * 100000 + b"\r\n\r\n", b"\x16\x03\x01" * 1000, b"\0" * 5000,
                 b"GET " + b"/" * 60000 + b" HTTP/1.1\r\n\r\n", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + b"\0\0\xff" * 500,
                 b"GET /?" + b"a=1&" * 5000 + b" HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"):
        with web.raw() as s:
            try:
                s.sendall(junk)
                s.settimeout(10 * PATIENCE)
                check(b"root:" not in s.recv(65536), "it answered")
            except (ConnectionResetError, BrokenPipeError):
                pass
        check(web.get("/api/version")[0] == 200, "it is gone after %r" % junk[:20])
    for opcode, payload in ((1, b"x" * 5000), (1, b"{\"watch\":" + b"[" * 3000), (2, b"\0" * 10), (1, b"\xff\xfe"), (1, b"[]"), (1, b"{}"),
                            (1, b"{\"id\":1,\"method\":5}"), (1, b"{\"id\":\"x\",\"method\":\"version\"}")):
        page = Page(web)
        page.frame(opcode, payload)
        got = [m for m in iter(page.next, None)]
        check(len(got) <= 2, "it goes on after %r" % payload[:20])
        page.close()
    page = Page(web)
    page.socket.sendall(bytes([0x81, 0xff]) + (1 << 40).to_bytes(8, "big") + b"abcd")  # promises a frame of a terabyte
    page.socket.sendall(b"x" * 20000)
    check(all(isinstance(m, dict) for m in iter(page.next, None)), "a frame of a terabyte is taken")
    page.close()
    pages = [Page(web) for _ in range(40)]
    check(sum(p.status == 101 for p in pages) == 32, "%d pages" % sum(p.status == 101 for p in pages))
    check(web.get("/api/version")[0] == 200, "pages keep others out")
    for p in pages:
        p.close()
    grown = web.rss() - rss
    note("grew by %d KiB" % (grown >> 10))
    check(grown < 8 << 20 or SANITIZER, "it grew by %d bytes" % grown)
    until(lambda: Page(web).status == 101, "room for another page")


def examples_fit(typed, body):
    """The rules and the dashboard of examples/prometheus name metrics that there are, and promtool takes them."""
    folder = "examples/prometheus"
    for name in os.listdir(folder):
        text = open(os.path.join(folder, name)).read()
        for metric in set(re.findall(r"\bsonard_[a-z_]+", text)):
            check(re.sub("_(bucket|sum|count)$", "", metric) in typed, f"{name}: no metric {metric}")
    json.load(open(os.path.join(folder, "dashboard.json")))
    if shutil.which("promtool"):
        subprocess.run(["promtool", "check", "metrics"], input=body, text=True, check=True)
        subprocess.run(["promtool", "check", "rules", "alerts.yml"], cwd=folder, check=True)
        subprocess.run(["promtool", "test", "rules", "alerts_test.yml"], cwd=folder, check=True)


def metrics(bench):
    client, web = started(bench)
    pings_until(client, 5)
    status, headers, body = web.request("/metrics")
    check(status == 200 and headers["content-type"].startswith("text/plain; version=0.0.4"), headers)
    line = re.compile(r'^([a-z0-9_]+)(\{(?:[a-z_]+="[^"]*",?)+\})? (\S+)$')
    seen, typed = {}, {}
    for text in body.decode().splitlines():
        if text.startswith("# TYPE "):
            _, _, name, kind = text.split()
            typed[name] = kind
        elif not text.startswith("# HELP "):
            found = line.match(text)
            check(found, text)
            seen[found.group(1) + (found.group(2) or "")] = float(found.group(3))
    said = client.call("stats")["metrics"]
    asked = {"sonard_sectors", "sonard_sectors_distance_metres", "sonard_limit_ahead_mps"}
    check(set(typed) == {m["name"] for m in said} | asked, set(typed) ^ {m["name"] for m in said} ^ asked)
    ring = client.call("sectors")
    check(sum(seen['sonard_sectors{state="%s"}' % state] for state in ("clear", "blocked", "unknown")) == len(ring["sectors"]), seen)
    check(seen["sonard_sectors_distance_metres"] == ring["distance_m"], seen)
    check(len([name for name in seen if name.startswith("sonard_limit_ahead_mps{limited_by=")]) == 1, seen)
    check(seen['sonard_data_ok{data="ok"}'] == 1, seen)
    client.call("pose", attitude_deg=[0, 0, 90], depth_m=2)
    body = web.request("/metrics")[1 + 1].decode()
    check(set(re.findall(r'sonard_pose_age_seconds{part="(\w+)"}', body)) == {"attitude", "depth"}, body)
    examples_fit(typed, body)
    check(seen["sonard_clients_now"] >= 2 and seen['sonard_sensor_pings_total{sensor="head"}'] >= 5, seen)
    buckets = [seen[k] for k in seen if k.startswith('sonard_latency_seconds_bucket{stage="maps"')]
    check(len(buckets) > 5 and buckets == sorted(buckets) and buckets[-1] == seen['sonard_latency_seconds_count{stage="maps"}'], buckets)


def openapi(bench):
    _, web = started(bench)
    status, document = web.get("/api/openapi.json")
    check(status == 200 and document["openapi"].startswith("3.1"), document.get("openapi"))
    check(set(document["paths"]) == {"/api/" + m for m in asks()}, set(document["paths"]) ^ {"/api/" + m for m in asks()})

    def walk(node):
        if isinstance(node, dict):
            if "$ref" in node:
                check(node["$ref"].startswith("#/components/schemas/"), node)
                check(node["$ref"].split("/")[-1] in document["components"]["schemas"], node)
            for value in node.values():
                walk(value)
        elif isinstance(node, list):
            for value in node:
                walk(value)
    walk(document)
    for path, entry in document["paths"].items():
        table = SCHEMAS.document["$defs"][path.split("/")[-1] + ".params"]
        params = [p for p in entry["get"]["parameters"] if p["in"] == "query"]
        costs = [p["name"] for p in entry["get"]["parameters"] if p["in"] == "header"]
        check(costs in ([], ["X-Sonard"]) and (costs or path not in ("/api/sectors", "/api/next_look")), path)
        check([p["name"] for p in params] == list(table["properties"]), path)
        check({p["name"] for p in params if p["required"]} == set(table["required"]), path)
    service = web.get("/register_service")[1]
    check(service["name"] and service["icon"] and service["api"] == "/api/openapi.json", service)


def live(bench):
    """What a page gets is what the socket says."""
    client, web = started(bench)
    pings_until(client, 210)
    page = Page(web)
    check(page.of("link")["result"]["fault"] is None, "no daemon")
    page.watch("status", ("sectors", {"count": 36, "distance_m": 2}), "image")
    sectors = page.of("sectors")
    check(sectors["params"] == {"count": 36, "distance_m": 2}, sectors["params"])
    SCHEMAS.check("sectors", "result", sectors["result"])
    check(len(sectors["result"]["sectors"]) == 36, "another count")
    SCHEMAS.check("status", "result", page.of("status")["result"])
    rows = {}

    def take(message):
        if isinstance(message, bytes):
            sensor, _, some = rows_of(message)
            check(sensor == "head", sensor)
            rows.update({round(r["azimuth"], 1): r for r in some})
        return len(rows) >= 200
    page.until(take, "a whole turn")
    said = {round(r["azimuth_deg"], 1): r for r in client.call("image")["rows"]}
    same, sures = 0, set()
    for azimuth, row in rows.items():
        other = said[azimuth]
        if row["bins"].hex() != other["samples"]:
            continue  # pinged again meanwhile
        same += 1
        check(row["state"] == other["state"] and len(row["echoes"]) == len(other["echoes"]), azimuth)
        check(abs(row["r1"] - other["r1_m"]) < 1e-4 and abs(row["blind"] - other["blind_m"]) < 1e-4, azimuth)
        for (range_m, marks, sure), echo in zip(row["echoes"], other["echoes"]):
            check(abs(range_m - echo["range_m"]) < 1e-3 and bool(marks) == bool(echo["marks"]), azimuth)
            check(abs(sure - 100 * echo["confidence"]) <= 0.6, "%s: confidence %d %%, not %s" % (azimuth, sure, echo["confidence"]))
            sures.add(sure)
    note("%d of %d rows are the same" % (same, len(rows)))
    check(same > 100 and len(sures) > 3 and 0 not in sures, "%d rows are the same, confidences %s" % (same, sorted(sures)))
    newer = client.call("image", newer_s=0.5)["rows"]
    check(0 < len(newer) < 100 and all(r["age_s"] <= 0.5 for r in newer), "%d rows of half a second" % len(newer))
    check(client.call("image", newer_s=0)["rows"] == [], "rows from the future")
    pings = client.sensor()["pings"]
    got = {}

    def news(message):
        if isinstance(message, bytes):
            got.update({r["t"]: r for r in rows_of(message)[2]})
        return client.sensor()["pings"] >= pings + 60
    page.until(news, "60 more pings")
    check(len(got) >= 55, "%d of 60 pings came" % len(got))
    answer = page.ask("explain", azimuth_deg=0, distance_m=3)
    SCHEMAS.check("explain", "result", answer["result"])
    check(page.ask("blocked", azimuth_deg=0)["error"]["code"] == -32602, "a question without distance")
    page.watch(("blocked", {"azimuth_deg": 1}), "version")
    check(page.of("blocked")["error"]["code"] == -32602, "a watch without distance")
    page.close()

    def silent():
        before = client.call("status")["server"]["requests"]
        time.sleep(1)
        return client.call("status")["server"]["requests"] - before <= 2
    until(silent, "sonard-web asks although nobody looks")


def slow(bench):
    """A page that does not read costs nobody anything, and gets the newest when it does."""
    client, web = started(bench)
    pings_until(client, 50)
    everything = ("status", "stats", "plan", ("sectors", {"count": 720}), "image")
    sleeper = Page(web, receive_buffer=4096)
    sleeper.watch(*everything)
    other = Page(web)
    other.watch(("sectors", {"count": 72}))
    other.of("sectors")
    before = web.rss()
    gaps, last, end = [], time.monotonic(), time.monotonic() + 8
    while time.monotonic() < end:
        other.of("sectors")
        gaps.append(time.monotonic() - last)
        last = time.monotonic()
    note("the other page waits at most %.2f s; sonard-web grew by %d KiB" % (max(gaps), (web.rss() - before) >> 10))
    check(max(gaps) < 1.5 * PATIENCE and len(gaps) > 15 / PATIENCE, "the other page waits %.2f s" % max(gaps))
    check(web.rss() - before < 4 << 20 or SANITIZER, "it grew by %d bytes" % (web.rss() - before))
    now = client.call("status")["uptime_s"]
    n = [0]

    def catches_up(message):
        n[0] += 1
        return isinstance(message, dict) and message.get("method") == "status" and message["result"]["uptime_s"] > now - 1
    sleeper.until(catches_up, "the newest status")
    check(n[0] < 60, "%d old messages were kept" % n[0])


def drain(pages, stop, late):
    """Reads what comes to pages, as browsers do; of rows that are new, how long after their ping they came."""
    held, seen, start = {p: p.held for p in pages}, {}, time.time()
    while not stop.is_set():
        for p in select.select([p.socket for p in pages], [], [], 0.1)[0]:
            page = next(q for q in pages if q.socket is p)
            held[page] += p.recv(1 << 18)
            if page is not pages[0]:
                held[page] = b""
                continue
            while len(held[page]) >= 4:
                size, head = held[page][1] & 127, 2
                if size == 126:
                    size, head = int.from_bytes(held[page][2:4], "big"), 4
                elif size == 127:
                    size, head = int.from_bytes(held[page][2:10].ljust(8, b"\0"), "big"), 10
                if len(held[page]) < head + size:
                    break
                opcode, payload = held[page][0] & 15, held[page][head:head + size]
                held[page] = held[page][head + size:]
                if opcode == 2:
                    for row in rows_of(payload)[2]:
                        if row["t"] > max(seen.get(row["azimuth"], 0), start + 1):
                            late.append(time.time() - row["t"])
                        seen[row["azimuth"]] = row["t"]


def crowd(bench):
    """20 pages, one of which reads nothing: `blocked` is as quick as without, and sonard-web takes little."""
    bench.sim(quick=False)
    bench.conf(sonar={"range": "20 m", "step": "0.9 deg"})
    client = bench.sonard().client()
    web = Web(bench)
    pings_until(client, 5)
    took, cpu, late = {0: [], 1: [], 20: []}, {}, []
    rounds = int(os.environ.get("ROUNDS", "2"))
    for n in (0, 20, 1) * rounds:
        pages = [Page(web, receive_buffer=None if k != 1 else 4096) for k in range(n)]
        for p in pages:
            p.watch("status", "stats", "plan", "map", "sectors", "image")
        stop = threading.Event()
        reader = threading.Thread(target=drain, args=([p for k, p in enumerate(pages) if k != 1], stop, late if n == 1 else []))
        if pages:
            reader.start()
        time.sleep(1)
        before, start = web.cpu_s(), time.monotonic()
        while time.monotonic() < start + 5:
            begin = time.monotonic()
            client.call("blocked", azimuth_deg=30, distance_m=5)
            took[n].append(time.monotonic() - begin)
            time.sleep(0.005)
        cpu.setdefault(n, []).append((web.cpu_s() - before) / (time.monotonic() - start))
        rss = web.rss()
        stop.set()
        if pages:
            reader.join()
        for p in pages:
            p.close()
        note("%d pages: blocked p50 %.2f ms, p99 %.2f ms; sonard-web %.1f %% of a core, %.1f MiB" % (
            n, *(sorted(took[n])[int(q * len(took[n]))] * 1e3 for q in (0.5, 0.99)), 100 * cpu[n][-1], rss / (1 << 20)))
    p99 = {n: sorted(t)[int(0.99 * len(t))] for n, t in took.items()}
    late.sort()
    note("%d rows came %.0f ms after their ping (median), 99 %% within %.0f ms" % (len(late), 1e3 * late[len(late) // 2], 1e3 * late[int(0.99 * len(late))]))
    if not SANITIZER:
        check(p99[20] < 1.2 * p99[0] + 2e-3, "p99 of blocked: %.2f ms, with 20 pages %.2f ms" % (1e3 * p99[0], 1e3 * p99[20]))
        check(max(cpu[1]) < 0.1 and rss < 20 << 20, "sonard-web takes %.1f %% of a core and %d bytes" % (100 * max(cpu[1]), rss))


def recovers(bench):
    """Killed and started again, the daemon is shown again; meanwhile nothing is."""
    bench.sim()
    bench.conf()
    web = Web(bench)
    status, body = web.get("/api/version")
    check(status == 503 and body["error"]["message"], "%s %s" % (status, body))
    check(web.request("/metrics")[0] == 503, "metrics without a daemon")
    page = Page(web)
    check(page.of("link")["result"]["fault"], "a daemon that is not there")
    page.watch("version", "sectors")
    viewer = Page(web, protocol="foxglove.sdk.v1")
    state = lambda op: viewer.until(lambda m: isinstance(m, dict) and m["op"] == op, op)
    check(state("status")["level"] == 2, "a daemon that is not there")
    daemon = bench.sonard()
    check(state("removeStatus")["statusIds"] == ["daemon"], "no daemon")
    check(page.until(lambda m: m.get("method") == "link" and m["result"]["fault"] is None, "a daemon"), "no daemon")
    page.of("sectors")
    until(lambda: web.get("/api/version")[0] == 200, "answers")
    daemon.process.kill()
    daemon.expected = -9
    daemon.wait()
    lost = page.until(lambda m: m.get("method") == "link", "the loss")["result"]
    check(lost["fault"], lost)
    told = state("status")
    check((told["message"], told["id"]) == (lost["fault"], "daemon"), told)
    check(web.get("/api/version")[0] == 503, "an answer without a daemon")
    late = Page(web)
    late.watch("sectors")
    late.socket.settimeout(1)
    try:
        while True:
            check(late.next().get("method") == "link", "an answer of a daemon that is gone")
    except TimeoutError:
        late.close()
    bench.sonard()
    back = page.until(lambda m: m.get("method") == "link" and m["result"]["fault"] is None, "another daemon")["result"]
    check(back["connection"] > lost["connection"], back)
    state("removeStatus")
    viewer.close()
    page.of("sectors")
    until(lambda: web.get("/api/version")[0] == 200, "answers again")


def silent_daemon(bench):
    """A daemon that hangs is no daemon."""
    import signal
    _, web = started(bench)
    daemon = next(p for p in bench.processes if p.name.startswith("sonard"))
    page = Page(web)
    page.watch("sectors")
    page.of("sectors")
    daemon.process.send_signal(signal.SIGSTOP)
    try:
        lost = page.until(lambda m: isinstance(m, dict) and m.get("method") == "link" and m["result"]["fault"], "the loss", 30)["result"]
        check("not answered" in lost["fault"], lost)
    finally:
        daemon.process.send_signal(signal.SIGCONT)
    page.until(lambda m: isinstance(m, dict) and m.get("method") == "sectors", "its return", 30)


def npm(bench, *packages):
    """A folder with these packages of the registry."""
    if not shutil.which("node") or not shutil.which("npm"):
        raise Skipped("needs node and npm")
    modules = bench.path("modules")
    os.mkdir(modules)
    with open(os.path.join(modules, "package.json"), "w", encoding="ascii") as f:
        f.write("{}")
    if bench.run("sh", "-c", "cd '%s' && npm install --silent --no-audit --no-fund %s" % (modules, " ".join(packages)), limit_s=90).returncode:
        raise Skipped("npm cannot get " + packages[0])
    return modules


def foxglove(bench):
    """What a client of npm's @foxglove/ws-protocol gets, decoded by protobufjs, is what the socket says."""
    modules = npm(bench, "@foxglove/ws-protocol@0.8.0", "ws@8.23.0", "protobufjs@8.8.1")
    client, web = started(bench, map={"voxel": "0.2 m", "memory": "16 MiB"})
    end = client.sensor()["pings"] + 230
    place = {"attitude_deg": [0, 0, 30], "position_m": [3, 4, 2]}
    while client.sensor()["pings"] < end:
        client.call("pose", **place)
        time.sleep(0.05)
    stop = threading.Event()
    poses = threading.Thread(target=keep_telling, args=(bench, place, stop))
    poses.start()
    try:
        run_it = subprocess.run(["node", "tests/web/foxglove.mjs", "ws://127.0.0.1:%d/" % web.port], capture_output=True, text=True, timeout=60,
                                env=dict(os.environ, FOXGLOVE_MODULES=modules), check=False)
        image, level = client.call("image"), client.call("map_slice", size_m=40, cells=160)
    finally:
        stop.set()
        poses.join()
    check(run_it.returncode == 0, run_it.stderr)
    got = json.loads(run_it.stdout)
    check(not got["errors"] and got["server"]["name"].startswith("sonard ") and got["server"]["capabilities"] == [], got["errors"])
    names = {c["topic"]: c["schemaName"] for c in got["channels"]}
    layout = json.dumps(web.get("/foxglove-layout.json")[1])
    check(set(re.findall(r'"(/[a-z/]+)"', layout)) <= set(names), "the layout names another topic")
    check(set(got["messages"]) == set(names), "no message of %s" % (set(names) - set(got["messages"])))
    for c in got["channels"]:
        check(c["encoding"] == c["schemaEncoding"] == "protobuf", c)
        check(abs(got["messages"][c["topic"]]["timestamp"] - time.time()) < 120, "another time")
    cloud = got["messages"]["/sonar/echoes"]["data"]
    points = list(struct.iter_unpack("<ffffB", base64.b64decode(cloud["data"])))
    check(names["/sonar/echoes"] == "foxglove.PointCloud" and cloud["point_stride"] == 17 and cloud["frame_id"] == "vehicle", cloud["frame_id"])
    want = [(e["range_m"] * math.cos(math.radians(r["azimuth_deg"])), -e["range_m"] * math.sin(math.radians(r["azimuth_deg"])))
            for r in image["rows"] for e in r["echoes"]]
    near = sum(1 for x, y in want if any(math.hypot(x - p[0], y - p[1]) < 0.05 for p in points))
    check(len(points) > 100 and near > 0.8 * len(want), "%d of %d echoes are among %d points" % (near, len(want), len(points)))
    ping = got["messages"]["/sonar/ping"]["data"]
    check([(f["name"], f["type"]) for f in ping["fields"]] == [("x", "FLOAT32"), ("y", "FLOAT32"), ("intensity", "UINT8")], ping["fields"])
    beam = list(struct.iter_unpack("<ffB", base64.b64decode(ping["data"])))
    check(len(beam) > 100 and 9 < math.hypot(*beam[-1][:2]) < 10.1, beam[-1])
    picture = base64.b64decode(got["messages"]["/sonar/image"]["data"]["data"])
    check(picture.startswith(b"\x89PNG") and 1000 < len(picture) < 60000, len(picture))
    grid = got["messages"]["/map/slice"]["data"]
    cells = base64.b64decode(grid["data"])
    rows = [cells[k * grid["row_stride"]:(k + 1) * grid["row_stride"]] for k in range(grid["column_count"])][::-1]
    other = sum({" ": 0, ".": 1, "#": 2}[c] != rows[i][k] for i, row in enumerate(level["rows"]) for k, c in enumerate(row))
    check(other < 300 and sum(c == 2 for c in cells) > 20, "%d other cells" % other)
    corner = grid["pose"]["position"]
    check(abs(corner["y"] + len(rows) * grid["cell_size"]["y"] - (level["north_m"] + level["step_m"] / 2)) < 1e-6, corner)
    check(abs(corner["x"] - (level["east_m"] - level["step_m"] / 2)) < 1e-6, corner)
    pose = got["messages"]["/vehicle/pose"]["data"]["pose"]
    check([round(pose["position"][k], 2) for k in "xyz"] == [4, 3, -2], pose)
    check(abs(2 * math.degrees(math.atan2(pose["orientation"]["z"], pose["orientation"]["w"])) - 60) < 1, pose)
    moved = got["messages"]["/tf"]["data"]
    check(moved["translation"] == pose["position"] and moved["rotation"] == pose["orientation"] and moved["child_frame_id"] == "vehicle", moved)
    sectors, scan = got["messages"]["/sonard/sectors"]["data"], got["messages"]["/sonard/scan"]["data"]
    check(len(sectors["sectors"]) == len(scan["ranges"]) == 72 and all(s["state"] in ("blocked", "clear", "unknown") for s in sectors["sectors"]), sectors)
    check(sum(r is not None and 3 < r < 10 for r in scan["ranges"]) > 60, scan["ranges"])  # in a basin
    ring = got["messages"]["/sonard/ring"]["data"]["entities"][0]
    check(len(ring["triangles"]) == 3 and sum(len(t["indices"]) for t in ring["triangles"]) <= 2 * 72 * 6, ring["id"])
    status = got["messages"]["/sonard/status"]["data"]
    check(status["sensors"][0]["name"] == "head" and status["mode"] == "live" and int(status["sensors"][0]["pings"]) > 200, status)
    check(got["messages"]["/sonard/log"]["data"]["name"] == "data", got["messages"]["/sonard/log"])


def foxglove_traffic(bench):
    """All topics, of a head of some 20 pings a second and with a map: less than 100 kB/s."""
    bench.sim("--ms-per-gradian", "1", "--processing-ms", "30", quick=False)
    bench.conf(map={"voxel": "0.25 m", "memory": "16 MiB"}, pose={"max_age": "600 s"})
    bench.sonard()
    client = bench.processes[-1].client()
    client.call("pose", attitude_deg=[0, 0, 30], position_m=[3, 4, 2])
    web = Web(bench)
    pings_until(client, 210)  # a whole turn
    page = Page(web, protocol="foxglove.sdk.v1")
    topics = [c["id"] for c in page.until(lambda m: isinstance(m, dict) and m["op"] == "advertise", "the channels")["channels"]]
    page.say({"op": "subscribe", "subscriptions": [{"id": t, "channelId": t} for t in topics]})

    def read(seconds):
        size, begun = 0, time.monotonic()
        while time.monotonic() < begun + seconds:
            size += len(page.next()) + 4  # with the frame's head
        return size / (time.monotonic() - begun)
    read(3)  # the whole turn, once
    before, begun = client.sensor()["pings"], time.monotonic()
    rate = read(15)
    pings = (client.sensor()["pings"] - before) / (time.monotonic() - begun)
    note("%.1f kB/s at %.1f pings a second" % (rate / 1e3, pings))
    check(3 < pings < 30 and rate < 100e3, "%.1f kB/s at %.1f pings a second" % (rate / 1e3, pings))


def foxglove_by_hand(bench):
    """Subscriptions: what is none is ignored, and what is given up does not come any more. Both names of the protocol are known."""
    client, web = started(bench, map={"voxel": "0.5 m", "memory": "8 MiB"}, pose={"max_age": "60 s"})
    client.call("pose", attitude_deg=[0, 0, 30], position_m=[3, 4, 2])

    def greeted(protocol):
        page = Page(web, protocol=protocol)
        check(page.status == 101 and page.next()["op"] == "serverInfo", "%s: %s" % (protocol, page.status))
        return page, {c["topic"]: c for c in page.next()["channels"]}
    other, told = greeted("foxglove.websocket.v1")
    page, channels = greeted("foxglove.sdk.v1")
    check(told == channels, "another name, other channels")
    other.close()
    schemas = {topic: protobuf.Schema(base64.b64decode(c["schema"])) for topic, c in channels.items()}
    both, _ = greeted("foxglove.sdk.v1, foxglove.websocket.v1")
    both.close()

    def subscribe(*pairs):
        page.say({"op": "subscribe", "subscriptions": [{"id": number, "channelId": channels[topic]["id"]} for number, topic in pairs]})
        for number, topic in pairs:
            subscribed.setdefault(number, topic)
    subscribed = {}

    def message_of(number):
        """The next message of this subscription."""
        message = page.until(lambda m: isinstance(m, bytes) and int.from_bytes(m[1:5], "little") == number, "a message of %d" % number)
        check(message[0] == 1, message[:20])
        topic = subscribed[number]
        return schemas[topic].read(channels[topic]["schemaName"], message[13:])
    page.say({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 99}, {"id": -1, "channelId": 1}, {"id": 5}, {}, 7]})
    page.say({"op": "advertise", "channels": []})
    subscribe((4000000000, "/sonard/status"), (4000000000, "/sonard/sectors"))
    status = message_of(4000000000)
    check(status["version"] and status["pose"]["position_m"] == [3, 4, 2] and status["sensors"][0]["name"] == "head", status)
    subscribe((2, "/sonar/echoes"), (3, "/vehicle/pose"), (4, "/map/slice"), (5, "/sonard/sectors"), (6, "/sonard/scan"), (7, "/sonard/ring"))
    position = message_of(3)["pose"]["position"]
    check([round(position[axis], 2) for axis in "xyz"] == [4, 3, -2], position)
    columns = len(client.call("map_slice", size_m=40, cells=160)["rows"])
    check(message_of(4)["column_count"] == columns, "another map than one of %d columns" % columns)
    until(lambda: len(message_of(2)["data"]) > 17 * 20, "echoes")
    sectors = until(lambda: [s for s in message_of(5)["sectors"] if not math.isnan(s["range_m"])], "an obstacle")
    check(all(0 < s["range_m"] < 10 and (s["state"] == "unknown" or not math.isnan(s["age_s"])) for s in sectors), sectors)
    until(lambda: [r for r in message_of(6)["ranges"] if math.isfinite(r)], "an obstacle in the scan")
    until(lambda: message_of(7)["entities"][0]["triangles"][1]["points"], "clear water in the ring")
    subscribe((8, "/sonard/log"))
    check(message_of(8)["level"] in ("INFO", "WARNING"), "no log")
    page.say({"op": "unsubscribe", "subscriptionIds": [2, 3, 4, 5, 6, 7, 8, 4000000000, 77, "x"]})
    subscribe((9, "/sonar/ping"))
    ping = message_of(9)
    check(len(ping["data"]) == 171 * 9 and [f["name"] for f in ping["fields"]] == ["x", "y", "intensity"], ping["fields"])
    for _ in range(5):
        check(int.from_bytes(page.next()[1:5], "little") == 9, "what was given up comes behind what was asked for later")
    subscribe((10, "/sonar/image"))
    check(message_of(10)["data"].startswith(b"\x89PNG"), "no picture")
    page.say([])
    check(all(m is not None for m in iter(page.next, None)), "it goes on")
    page.close()


def keep_telling(bench, place, stop):
    client = Client(bench.socket_path)
    while not stop.wait(0.1):
        client.call("pose", **place)
    client.close()


def page_names(bench):
    """A module of the page that declares a name twice, or imports one that is not there, stops the whole page."""
    declared = {}
    for path in glob.glob("web/page/*.js"):
        with open(path, encoding="utf-8") as f:
            text = f.read()
        names = re.findall(r"^(?:export )?(?:async )?(?:const|let|function|class) +([A-Za-z_$][\w$]*)", text, re.MULTILINE)
        imports = re.findall(r"^import \{ ([^}]*) \} from \"./([^\"]*)\"", text, re.MULTILINE)
        names += re.findall(r"^import \* as (\w+)", text, re.MULTILINE) + [name for some, _ in imports for name in some.split(", ")]
        check(len(names) == len(set(names)), "%s declares twice: %s" % (path, {name for name in names if names.count(name) > 1}))
        declared[os.path.basename(path)] = set(re.findall(r"^export (?:async )?(?:const|let|function|class) +([\w$]+)", text, re.MULTILINE)), imports
    for path, (_, imports) in declared.items():
        for some, where in imports:
            check(set(some.split(", ")) <= declared[where][0], "%s imports from %s what is not there: %s" % (path, where, some))


def command_line(bench):
    from webclient import SONARD_WEB
    for arguments, why in ((["--listen", "x"], "ADDRESS:PORT"), (["--listen", "127.0.0.1:0"], "ADDRESS:PORT"),
                           (["--listen", "127.0.0.1:99999"], "ADDRESS:PORT"), (["word"], "no option"), (["--settings", "/tmp/x"], "together"), (["--nonsense"], "nonsense")):
        out = bench.run(SONARD_WEB, *arguments)
        check(out.returncode == 3 and why in out.stderr, "%s: %d %s" % (arguments, out.returncode, out.stderr))
    web = Web(bench)
    out = bench.run(SONARD_WEB, "--listen", "127.0.0.1:%d" % web.port)
    check(out.returncode == 1 and "cannot listen" in out.stderr, "%d %s" % (out.returncode, out.stderr))
    check(bench.run(SONARD_WEB, "--version").stdout.startswith("sonard-web "), "no version")


run([("web_" + f.__name__, f) for f in (answers, only_questions, settings, settings_guessed, settings_in_a_flood, settings_lost, settings_refused, replays, settings_of_strangers, who_may_ask, no_paths, hostile, metrics, openapi, live, slow, crowd, foxglove, foxglove_traffic, foxglove_by_hand,
                                        recovers, silent_daemon, page_names, command_line)],
    gate=("web_only_questions", "web_settings", "web_settings_lost", "web_settings_refused", "web_settings_of_strangers", "web_foxglove_by_hand", "web_recovers", "web_who_may_ask", "web_no_paths", "web_openapi", "web_page_names", "web_command_line"))
