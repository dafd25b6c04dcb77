#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Broken configurations, bytes, captures and requests: each is refused in words that say what, where and what
would be right, and the daemon runs on."""
import json
import os
import pty
import struct
import subprocess
import time
import tty

from lib import PATIENCE, SONARCTL, SONARD, check, expect_refusal, note, run, until

# ---- configurations ----

HEAD = "[sonar head]\ndevice = ping360\nport = serial:/dev/ttyUSB0:115200\n"

# name, text, what each message must have: file and line, then words
CONFIGURATIONS = (
    ("empty", "", ["no sonar; expected 1 to 8 sections [sonar NAME]"]),
    ("unknown_section", HEAD + "[gird]\n", [":4: [gird]: unknown section; did you mean [grid]"]),
    ("unknown_key", HEAD + "rnage = 5 m\n", [":4: [sonar head] rnage = 5 m: unknown key; did you mean range"]),
    ("duplicate_key", HEAD + "range = 5 m\nrange = 6 m\n",
     [":5: [sonar head] range = 6 m: duplicate key (first set on line 4)"]),
    ("duplicate_section", HEAD + HEAD, [":4: [sonar head]: duplicate section (first defined on line 1)"]),
    ("wrong_kind", HEAD + "gain = loud\n", [":4: [sonar head] gain = loud", "is not a whole number; expected 0 to", "or auto"]),
    ("out_of_range", HEAD + "range = 900 m\n",
     [":4: [sonar head] range = 900 m: out of range; expected 0.75 to 200 m"]),
    ("missing_unit", HEAD + "range = 20\n",
     [":4: [sonar head] range = 20: the unit is missing; expected 0.75 to 200 m"]),
    ("wrong_unit", HEAD + "range = 20 kHz\n", ["unknown unit 'kHz'", "m, cm, mm, km"]),
    ("not_a_word", HEAD + "mode = push\n", ["'push' is not one of the words", "auto, transmit or request"]),
    ("too_few_numbers", HEAD + "mount = 1 2 m\n", [":4:", "2 of 3 numbers", "3 numbers and one unit"]),
    ("too_many_numbers", HEAD + "mount = 1 2 3 4 m\n", [":4:", "more than 3 numbers", "3 numbers and one unit"]),
    ("not_a_number", HEAD + "range = nan m\n", ["'nan m' is not a number"]),
    ("no_value", HEAD + "range =\n", [":4: [sonar head] range", "no value after ="]),
    ("no_section", "range = 5 m\n" + HEAD, [":1: range = 5 m: no section before it"]),
    ("no_bracket", HEAD + "[grid\nrange = 5 m\n", [":4: [grid: no ] at the end of the section"]),
    ("no_equals", HEAD + "range 5 m\n", [":4: range 5 m: not a key and its value; expected key = value"]),
    ("no_device", "[sonar a]\nport = serial:/dev/null:9600\n", [":1: [sonar a] device: missing; expected"]),
    ("no_such_device", HEAD.replace("ping360", "ping361"), [":2:", "unknown device; did you mean ping360? Supported:", "ping360"]),
    ("no_such_port", HEAD.replace("serial:", "parallel:"), [":3:", "parallel", "serial"]),
    ("no_such_baud", HEAD.replace("115200", "12345"), [":3:", "baud rate '12345': must be one of", "921600"]),
    ("relative_port", HEAD.replace("/dev/", ""),
     [":3:", "must be a path and a baud rate, as /dev/ttyUSB0:115200"]),
    ("name_of_sonar", HEAD.replace("head", "he/ad"),
     [":1: [sonar he/ad]: bad name of a sonar", "letters, digits"]),
    ("hash_comment", HEAD + "range = 5 m # far\n", [":4:", "a # after a value; start a comment with ;"]),
    ("not_utf8", HEAD.encode() + b"range = 5 \xff\n", [":4:", "byte 0xff in column 11; expected text in UTF-8"]),
    ("nul_byte", HEAD.encode() + b"range = 5 \0 m\n", [":4:", "byte 0x00 in column 11"]),
    ("long_line", HEAD + "range = " + "5" * 5000 + " m\n", [":4:", "bytes in this line; expected at most"]),
    ("contradiction", HEAD + "[grid]\nclear_for = 90 s\nforget = 60 s\n",
     [":6: [grid] forget = 60 s: does not go with [grid] clear_for = 90 s; expected forget not shorter"]),
    ("device_cannot", HEAD + "mode = auto\ngain = 7\n",
     [":5: [sonar head] gain = 7: ping360 takes gain 0 to 2 (0 low, 1 normal, 2 high; auto: 1)"]),
    ("not_for_the_device", HEAD.replace("ping360", "ping1d") + "range = 9 m\nsector = 300 60 deg\n",
     [":5: [sonar head] sector = 300 60 deg: ping1d does not use this key; remove it"]),
    ("device_cannot_by_default", HEAD.replace("ping360", "imagenex881a") + "range = 150 m\n",
     [":4: [sonar head] range = 150 m: imagenex881a takes range 0.75 to 100 m"]),
    ("mirror_word", HEAD + "mirror = maybe\n", [":4: [sonar head] mirror = maybe: 'maybe' is not one of the words; expected no or yes"]),
    ("mirror_of_an_axis", HEAD.replace("ping360", "ping1d") + "mirror = yes\n",
     [":4: [sonar head] mirror = yes: a ping1d has one beam along its axis, and no sides to swap"]),
    ("device_on_the_wrong_wire", HEAD.replace("ping360", "dronecan"),
     [":2: [sonar head] device = dronecan: does not work over serial:", "it needs a CAN bus, as port = can:can0"]),
    ("device_in_the_wrong_water", HEAD.replace("ping360", "imagenex852") + "range = 60 m\n[water]\nsound_speed = 1400 m/s\n",
     [":4: [sonar head] range = 60 m: imagenex852 takes range 0.75 to 50 m"]),
    ("range_beyond_the_head", HEAD + "range = 80 m\n",
     [":4: [sonar head] range = 80 m: ping360 takes range 0.75 to 50 m"]),
    ("relative_socket", HEAD + "[server]\nsocket = run/sock\n", [":5:", "does not begin with a slash"]),
    ("map_tolerance", HEAD + "[map]\nvoxel = 0.02 m\ntolerance = 0.5 m\n",
     [":6: [map] tolerance: 0.5 m; expected at most one voxel, 0.02 m"]),
    ("map_memory", HEAD + "[map]\nvoxel = 5 m\nmemory = 1 MiB\n", [":6: [map] memory: expected at least one tile"]),
    ("map_extent", HEAD + "[map]\nvoxel = 0.02 m\nextent = 1400 m\n",
     [":6: [map] extent: a submap has more than 4096 tiles", "larger voxels than 0.02 m"]),
    ("grids_memory", HEAD + "[grids]\nmemory = 1 MiB\n",
     [":5: [grids] memory: with grid main all grids together", "at most 1 MiB"]),
    ("all_at_once", HEAD + "range = 5\nstep = x\n[pose]\nmax_age = 0 s\n", [":4:", ":5:", ":7:"]),
)


def configurations(bench):
    wrong = []
    for name, text, words in CONFIGURATIONS:
        path = bench.write(name + ".conf", text)
        for way in (("--check", path), ("-c", path)):
            result = bench.run(SONARD, *way)
            missing = [word for word in words if word not in result.stderr]
            wanted = 1 if way[0] == "--check" else 3 # a service is not restarted for it
            if result.returncode != wanted or missing or path not in result.stderr:
                wrong.append("%s %s: status %d, no %s in: %s" % (way[0], name, result.returncode, missing,
                                                                result.stderr.strip()))
    for name, words in (("missing.conf", "No such file"), (".", "Is a directory")):
        result = bench.run(SONARD, "--check", bench.path(name))
        if result.returncode != 1 or words not in result.stderr:
            wrong.append("%s: %s" % (name, result.stderr.strip()))
    note("%d broken configurations" % (len(CONFIGURATIONS) + 2))
    check(not wrong, " || ".join(wrong))


# arguments, words of the message
OPTIONS = (
    (("--nonsense",), "no option --nonsense; see `sonard --help`"),
    (("--chekc",), "no option --chekc; did you mean --check?"),
    (("stray",), "stray: expected options only; a configuration is given as -c stray"),
    (("--check", "-c", "x"), "--check needs a configuration, without -c: --check FILE"),
    (("--answers", "--stay"), "--answers needs a file, or -: --answers FILE"),
    (("--threads", "3"), "--threads '3': wanted 0, 1 or 2"),
    (("--speed", "fast", "--replay", "x"), "--speed 'fast': wanted a factor from 0.001 to 1e6"),
    (("--speed", "1e-300", "--replay", "x"), "--speed '1e-300': wanted a factor from 0.001 to 1e6"),
    (("--speed", "1"), "needs --replay"),
    (("--stay",), "needs --replay"),
    (("--replay", "x", "--record", "y"), "a replay records nothing"),
    (("--socket", "/" + "x" * 107), "--socket '/xxx"),
    (("--socket", "/" + "x" * 107), "wanted a path of at most 107 bytes"),
    (("--record", "/" + "x" * 5000), "wanted a path of at most"),
)


def options(bench):
    """Wrong usage: status 2; what only shows at the start: status 1."""
    for arguments, words in OPTIONS:
        result = bench.run(SONARD, *arguments)
        check(result.returncode == 2 and words in result.stderr,
              "%s: status %d, %s" % (arguments, result.returncode, result.stderr.strip()))
    conf = bench.conf()
    blocked = bench.write("file", "")
    for arguments, words in (
            (("--record", bench.path("no/such/folder")), "recording to %s" % bench.path("no/such/folder")),
            (("--record", blocked), "recording to %s: " % blocked),
            (("--socket", bench.path("no/sock")), "the directory %s: No such file" % bench.path("no")),
            (("--socket", blocked), "%s exists and is not a socket; remove it or choose another path" % blocked),
            (("--answers", bench.path("no/answers")), "%s: No such file" % bench.path("no/answers"))):
        result = bench.run(SONARD, "-c", conf, *arguments)
        check(result.returncode == 1 and words in result.stderr,
              "%s: status %d, %s" % (arguments, result.returncode, result.stderr.strip()))
    check(os.path.getsize(blocked) == 0, "a file that was in the way was written to")


def full(bench):
    """What goes to a full disk is no success, whichever program prints it."""
    conf = bench.conf()
    capture = "tests/replay/box.mcap"
    replay = ("--replay", capture, "--socket", "none", "--answers")
    for program, *arguments in ((SONARD, "--help"), (SONARD, "--version"), (SONARD, "--sample"), (SONARD, "--check", conf),
                                (SONARD, "-c", conf, "--print"), (SONARD, "-c", conf, "--explain"),
                                (SONARD, "-c", conf, "--explain=json"), (SONARD, *replay, "-"), (SONARD, *replay, "/dev/full"),
                                (SONARCTL, "--help"), (SONARCTL, "--version"), (SONARCTL, "help", "blocked"),
                                (SONARCTL, "capture", "--help"), (SONARCTL, "capture", "info", capture),
                                (SONARCTL, "capture", "export", "--csv", capture)):
        with open("/dev/full", "w", encoding="ascii") as disk:
            result = subprocess.run([program, *arguments], stdout=disk, stderr=subprocess.PIPE, text=True, check=False,
                                    stdin=subprocess.DEVNULL, timeout=60 * PATIENCE)
        own = 1 if program == SONARD or arguments[0] == "capture" else 7
        check(result.returncode == own and result.stderr.strip(), "%s: status %d, %s" % (arguments, result.returncode, result.stderr))
    lines = bench.run(SONARD, *replay, "-").stdout.splitlines()
    check([json.loads(line)["event"] for line in lines][-1] == "end", "answers on standard output: %s" % lines)


# ---- captures ----

def captures(bench):
    """Read by sonard --replay and by sonarctl capture info: refused, or played as far as they are good."""
    with open("tests/replay/box.mcap", "rb") as f:
        whole = f.read()
    conf_at = whole.index(b"sonard.conf")
    flipped = bytearray(whole)
    flipped[60000] ^= 0x10
    other = whole.replace(b"/box/rx", b"/bix/rx")
    broken_conf = whole.replace(b"range = 2 m", b"range = 2 x")
    # name, bytes, exit statuses of the replay and of info, words of the replay's messages
    table = (
        ("empty", b"", 1, 1, ["the file is empty"]),
        ("no_capture", b"no capture at all", 1, 1, ["not a capture: an MCAP file begins with 89 4D 43 41 50"]),
        ("only_magic", whole[:8], 1, 1, ["no attachment sonard.conf; give a configuration with -c"]),
        ("cut_head", whole[:30], 1, 1, ["no attachment sonard.conf"]),
        ("no_configuration", whole.replace(b"sonard.conf", b"sonarx.conf"), 1, 1, ["attachment", "-c"]),
        ("changed_configuration", broken_conf, 1, 1, ["attachment sonard.conf: its checksum is wrong", "-c"]),
        ("cut_in_the_middle", whole[:60000], 0, 1, ["the file ends within a chunk", "offset"]),
        ("cut_end", whole[:-100], 0, 1, ["the file does not end with a footer", "pings played; --answers -"]),
        ("flipped_bit", bytes(flipped), 1, 1, ["chunk at offset", "is left out", "most of it is lost: 0 messages could be read"]),
        ("wrong_channel", other, 1, 1, []),
    )
    for name, data, replayed, told, words in table:
        path = bench.write(name + ".mcap", data)
        result = bench.run(SONARD, "--replay", path, "--socket", "none")
        info = bench.sonarctl("capture", "info", path)
        missing = [word for word in words if word not in result.stderr]
        check(not missing, "%s: no %s in: %s" % (name, missing, result.stderr))
        check(result.returncode == replayed and info.returncode == told,
              "%s: statuses %d, %d: %s" % (name, result.returncode, info.returncode, result.stderr + info.stderr))
    for path, words in ((bench.path("missing.mcap"), "No such file"), (bench.folder, "not a file")):
        result = bench.run(SONARD, "--replay", path, "--socket", "none")
        check(result.returncode == 1 and words in result.stderr and path in result.stderr, result.stderr)
    said = bench.run(SONARD, "--replay", bench.path("missing.mcap"), "--socket", "none").stderr
    check(said.count("missing.mcap") == 1 and said.count("\n") == 1, "more than one sentence: " + said)
    check(conf_at > 0 and len(table) >= 10, "the table is too short")
    note("%d broken captures" % (len(table) + 2))


def keys_without_effect(bench):
    """A rule for profiles where no sonar sends any, and the like: it is said, and is no fault."""
    for device, rule, idle in (("ping1d", "range", True), ("ping1d", "heard", False), ("ping360", "range", False)):
        conf = bench.write("%s.conf" % device, "[sonar a]\ndevice = %s\nport = serial:/dev/null:115200\nrange = 20 m\n"
                           "[extract]\nno_echo = %s\nminimum_range = 3 m\n" % (device, rule))
        result = bench.run(SONARD, "--check", conf)
        said = "[extract] no_echo = %s has no effect without a sonar that sends intensities" % rule
        check(result.returncode == 0 and "no faults" in result.stdout, result.stderr)
        check((said in result.stdout) == idle, result.stdout)


def keys_that_do_not_fit(bench):
    """Settings with which little is ever clear: they are said, and are no fault."""
    conf = bench.write("gaps.conf", "[sonar a]\ndevice = ping360\nport = serial:/dev/null:115200\nstep = 3.6 deg\n"
                       "[vehicle]\nnear = 1.5 m\n")
    result = bench.run(SONARD, "--check", conf)
    check(result.returncode == 0 and "no faults" in result.stdout, result.stderr)
    check(conf + ": [sonar a] step = 3.6 deg is wider than the beam of 2 deg" in result.stdout, result.stdout)
    check(conf + ": [vehicle] near = 1.5 m ends before 3.3 m" in result.stdout, result.stdout)


def nothing_in_it(bench):
    """A capture without a message was not played, and one of which nothing is left not repaired: a script is told."""
    with open("tests/replay/box.mcap", "rb") as f:
        whole = f.read()
    begun = bench.write("begun.mcap", whole[:whole.index(b"range = 2 m") + 80])
    result = bench.run(SONARD, "--replay", begun, "--socket", "none", "-c", bench.conf())
    check(result.returncode == 1 and "nothing in it that could be played" in result.stderr, result.stderr)
    changed = bytearray(whole)
    changed[60000] ^= 0x10
    repaired = bench.path("repaired.mcap")
    result = bench.sonarctl("capture", "repair", bench.write("changed.mcap", bytes(changed)), repaired)
    check(result.returncode == 1 and "most of it is lost: 0 messages could be read" in result.stderr, result.stderr)
    check(os.path.exists(repaired), "what can be read was not written")


def no_sonar_of_it(bench):
    """A capture whose channels no configured sonar has is played, and that is said: it is an error."""
    conf = bench.conf()
    out = bench.path("answers")
    result = bench.run(SONARD, "--replay", "tests/replay/box.mcap", "-c", conf, "--socket", "none",
                       "--answers", out)
    check(result.returncode == 1, result.stderr)
    check("head: the capture has no message of this sonar, but has /box/rx: wrong name?" in result.stderr, result.stderr)
    check("101 messages on channels that no configured sonar has" in result.stderr, result.stderr)
    with open(out, encoding="ascii") as f:
        last = json.loads(f.readlines()[-1])
    check(all(s["state"] == "unknown" for s in last["sectors"]["sectors"]), "answers out of nothing")


def no_ping_of_it(bench):
    """Bytes that are nothing to the configured device."""
    conf = bench.write("micron.conf", "[sonar box]\ndevice = micron\nport = serial:/nowhere:115200\n")
    result = bench.run(SONARD, "--replay", "tests/replay/box.mcap", "-c", conf, "--socket", "none")
    check(result.returncode == 1 and "bytes of the capture hold no ping of a micron: wrong device?" in result.stderr,
          "status %d: %s" % (result.returncode, result.stderr))


def gap_in_a_log(bench):
    """Ten years without a message are skipped, and the watches of a client do not fire through them; what says
    that it is later than a time can be is left out."""
    log = bench.write("bus.log", "(1000000000.000000) can0 123#00\n(1000000004.000000) can0 123#00\n"
                                 "(1315360004.000000) can0 123#00\n(9999999999.000000) can0 123#00\n")
    conf = bench.write("can.conf", "[sonar a]\ndevice = dronecan\nport = can:can0\n")
    daemon = bench.sonard("--replay", log, "--speed", "1", "--stay", "--socket", bench.socket_path, conf=conf)
    daemon.expected = 1  # no frame of it is a sonar's
    client = daemon.client()
    client.call("watch", method="version", rate_hz=50)
    until(lambda: client.call("status")["mode"] == "replay, ended", "the end of the replay")
    check(0 < len(client.notifications) < 1000, "%d notifications" % len(client.notifications))
    check(client.call("status")["t_unix"] == 1315360004, "the clock stands at %s" % client.call("status")["t_unix"])
    check("skipped 315360000 s without a message" in daemon.log(), "the gap is not said")
    check("after the year 2262 is left out" in daemon.log(), "the time that cannot be is not said")


# ---- requests ----

def request(method="version", /, **params):
    return json.dumps({"jsonrpc": "2.0", "id": 7, "method": method, "params": params}).encode()


# name, line, code of the error, words of its message
REQUESTS = (
    ("not_json", b"hello", -32700, ["not JSON at byte"]),
    ("half_json", b'{"jsonrpc":"2.0","id":1,', -32700, ["not JSON at byte"]),
    ("not_utf8", b'{"jsonrpc":"2.0","id":1,"method":"\xff\xfe"}', -32700,
     ["not JSON at byte 34: unable to decode byte 0xff"]),
    ("nul", b'{"jsonrpc":"2.0"\0}', -32700, ["not JSON at byte"]),
    ("key_twice", b'{"jsonrpc":"2.0","id":1,"id":2,"method":"version"}', -32700, ["duplicate"]),
    ("number", b"42", -32600, ["a request is an object, found a number"]),
    ("empty_batch", b"[]", -32600, ["a batch must hold at least one request"]),
    ("no_version", b'{"id":1,"method":"version"}', -32600, ["'jsonrpc' must be the string '2.0'"]),
    ("no_method", b'{"jsonrpc":"2.0","id":1}', -32600, ["'method' must be a string", "missing"]),
    ("method_number", b'{"jsonrpc":"2.0","id":1,"method":5}', -32600, ["'method' must be a string", "a number"]),
    ("id_object", b'{"jsonrpc":"2.0","id":{},"method":"version"}', -32600,
     ["'id' must be a string, a number or null"]),
    ("unknown_member", b'{"jsonrpc":"2.0","id":1,"method":"version","extra":1}', -32600, ["'extra' is not known"]),
    ("params_text", b'{"jsonrpc":"2.0","id":1,"method":"version","params":"x"}', -32600,
     ["'params' must be an object"]),
    ("params_by_position", b'{"jsonrpc":"2.0","id":1,"method":"blocked","params":[1,2]}', -32602, ["go by name"]),
    ("unknown_method", request("explode"), -32601, ["no method 'explode'; see sonard-protocol(7)"]),
    ("misspelt_method", request("sectros"), -32601, ["no method 'sectros'; did you mean sectors?"]),
    ("unknown_parameter", request("sectors", number=5), -32602,
     ["'number' is not known here, allowed: count, frame"]),
    ("no_parameter_wanted", request("version", verbose=True), -32602, ["allowed: no parameters"]),
    ("missing", request("blocked", azimuth_deg=5), -32602, ["parameter 'distance_m' is missing"]),
    ("wrong_type", request("blocked", azimuth_deg="5", distance_m=1), -32602,
     ["is a string, expected a number from -360"]),
    ("out_of_range", request("blocked", azimuth_deg=5, distance_m=-1), -32602,
     ["is -1, expected a number from 0 to 10000"]),
    ("infinite", b'{"jsonrpc":"2.0","id":1,"method":"blocked","params":{"azimuth_deg":1e999,"distance_m":1}}',
     -32700, ["real number overflow"]),
    ("not_whole", request("sectors", count=7.5), -32602, ["is not whole, expected a whole number from 1 to 720"]),
    ("too_large", request("sectors", count=100000), -32602, ["is 100000, expected a whole number from 1 to 720"]),
    ("wrong_word", request("sectors", frame="world"), -32602, ["is world, expected one of: body, ned"]),
    ("wrong_band", request("sectors", elevation_deg=[5, -5]), -32602, ["the first must be below the second"]),
    ("short_array", request("sectors", elevation_deg=[5]), -32602, ["has 1 elements, expected 2 numbers"]),
    ("both", request("blocked", azimuth_deg=0, distance_m=1, radius_m=1, half_angle_deg=1), -32602,
     ["exclude each other"]),
    ("pose_empty", request("pose"), -32602, ["empty pose: expected attitude_deg"]),
    ("pose_quaternion", request("pose", quaternion=[1, 1, 0, 0]), -32602, ["quaternion is not of length 1"]),
    ("pose_old", request("pose", attitude_deg=[0, 0, 0], t_unix=1000), -32602, ["off this computer's clock"]),
    ("no_such_sensor", request("image", sensor="side"), -32602, ["is side, expected one of: head"]),
    ("watch_watch", request("watch", method="watch"), -32602, ["method 'watch' cannot be watched"]),
    ("watch_nothing", request("watch", method="explode"), -32601, ["no method 'explode'"]),
    ("azimuth_beyond_a_turn", request("blocked", azimuth_deg=400, distance_m=1), -32602, ["azimuth_deg", "360"]),
    ("watch_rate", request("watch", method="version", rate_hz=1000), -32602, ["expected a number from 0.1 to 50"]),
    ("unwatch", request("unwatch", watch=3), -32602, ["this client has no watch 3"]),
    ("too_deep", b"[" * 40 + b"]" * 40, -32000, ["nested deeper than 16"]),
    ("too_many", b"[" + b",".join([request()] * 17) + b"]", -32000, ["17 requests in a batch, at most 16"]),
)


def requests(bench):
    sim = bench.sim()
    bench.conf(server={"max_clients": 4})
    daemon = bench.sonard()
    client = daemon.client()
    for name, line, code, words in REQUESTS:
        client.send(line + b"\n")
        reply = client.reply()
        check(reply is not None, "%s: the connection was closed" % name)
        check("error" in reply and reply["error"]["code"] == code, "%s: %s, not %d" % (name, reply, code))
        missing = [word for word in words if word not in reply["error"]["message"]]
        check(not missing, "%s: no %s in: %s" % (name, missing, reply["error"]["message"]))
        check(client.call("version")["protocol"] == 1, "%s: no answer afterwards" % name)
    note("%d broken requests" % len(REQUESTS))

    client.send(b'{"jsonrpc":"2.0","method":"explode"}\n\n')
    check(client.reply()["error"]["code"] == -32700, "an empty line is no JSON; a notification is not answered")
    many_watches(client)
    many_clients(daemon, client)
    long_line(daemon)
    half_lines(daemon)
    not_reading(daemon)
    before = client.sensor()["pings"]
    until(lambda: client.sensor()["pings"] > before, "pings after all that")
    check(client.sensor()["lost_frames"] == 0 and sim.status is None, "the sonar was neglected")
    errors = client.call("status")["server"]["errors"]
    check(errors >= len(REQUESTS), "only %d errors counted" % errors)


def many_watches(client):
    for _ in range(16):
        client.call("watch", method="version", rate_hz=0.1)
    expect_refusal(client, "watch", {"method": "version"}, "at most 16 watches", -32000)
    for number in range(1, 17):
        client.call("unwatch", watch=number)


def many_clients(daemon, client):
    others = [daemon.client() for _ in range(4)]  # one of them in the place that is kept for the owner
    one_more = daemon.client()
    error = one_more.reply()["error"]
    check("at most 4 clients are served at a time" in error["message"], str(error))
    check(one_more.line() is None, "the sixth client is not closed")
    for other in others + [one_more]:
        other.close()
    until(lambda: client.call("status")["server"]["clients_now"] == 1, "the clients to be gone")


def long_line(daemon):
    client = daemon.client()
    client.send(b" " * 70000)
    error = client.reply()["error"]
    check(error["code"] == -32000 and "longer than 65536 bytes" in error["message"], str(error))
    check(client.line() is None, "the connection goes on")
    check("client cut off (process %d of user %d, " % (os.getpid(), os.getuid()) in daemon.log(), "who it was")
    check("): a line longer" in daemon.log(), "why")
    client.close()


def half_lines(daemon):
    """A request byte by byte is answered; half a request and then nothing harms nobody."""
    client = daemon.client()
    for byte in request() + b"\n":
        client.send(bytes([byte]))
    check(client.reply()["id"] == 7, "byte by byte: no answer")
    client.send(request()[:20])
    client.close()


def not_reading(daemon):
    """A client that asks and asks and never reads is held, not the others."""
    client = daemon.client()
    client.socket.setblocking(False)
    lines = (request("image") + b"\n") * 2000
    try:
        while lines:
            lines = lines[client.socket.send(lines):]
    except BlockingIOError:
        pass
    other = daemon.client()
    check(other.call("version")["protocol"] == 1, "a client that does not read blocks another")
    other.close()
    client.close()


# ---- bytes on the line ----

def frame(message, payload=b"", length=None, checksum=None, source=2):
    data = b"BR" + struct.pack("<HHBB", len(payload) if length is None else length, message, source, 0) + payload
    return data + struct.pack("<H", sum(data) & 0xffff if checksum is None else checksum)


def ping(angle=200, period=444, samples=600, data=None, data_length=None):
    data = bytes([20] * samples) if data is None else data
    length = len(data) if data_length is None else data_length
    return frame(2300, struct.pack("<BBHHHHHH", 1, 1, angle, 50, period, 750, samples, length) + data)


# name, bytes, counters that must grow, words of the log
LINE = (
    ("noise", os.urandom(3000).replace(b"B", b"C"), ("garbage_bytes",), ()),
    ("zeros", bytes(5000), ("garbage_bytes",), ()),
    ("starts_only", b"B" * 1000, ("garbage_bytes",), ()),
    ("false_starts", b"BR" * 1000, ("garbage_bytes",), ()),
    ("checksum", frame(2300, bytes(100), checksum=1), ("bad_checksum",), ()),
    ("longest_length", frame(2300, bytes(50), length=65535), ("garbage_bytes",), ()),
    ("length_too_large", frame(2300, bytes(50), length=1000), ("garbage_bytes",), ()),
    ("length_too_small", frame(2300, bytes(50), length=10), ("bad_checksum",), ()),
    ("cut_frame", ping()[:300], ("garbage_bytes",), ()),
    ("empty_data_message", frame(2300), ("bad_frame",), ()),
    ("short_data_message", frame(2300, bytes(13)), ("bad_frame",), ()),
    ("angle_beyond_turn", ping(angle=400), ("bad_frame",), ()),
    ("period_zero", ping(period=0), ("bad_frame",), ()),
    ("period_beyond", ping(period=65535), ("bad_frame",), ()),
    ("data_length_beyond", ping(data_length=65535), ("pings",), ()),
    ("samples_beyond", ping(samples=65535, data=bytes(10)), ("pings",), ()),
    ("saturated", ping(data=bytes([255] * 600)), ("pings",), ()),
    ("all_zero", ping(data=bytes(600)), ("pings",), ()),
    ("no_samples", ping(samples=0), ("frames",), ()),
    ("unknown_message", frame(9999, b"who am I"), ("frames",), ()),
    ("short_ack", frame(1), ("bad_frame",), ()),
    ("short_nack", frame(2, b"\1"), ("bad_frame",), ()),
    ("nack_with_escapes", frame(2, struct.pack("<H", 2600) + b"\x1b[2J\xff%n%s"), ("nacks",),
     (r"refused message 2600: \x1b[2J\xff%n%s",)),
    ("text_with_newline", frame(3, b"sonard: error: lies\nand more\r\0"), ("frames",),
     (r"says: sonard: error: lies\x0aand more" + "\n",)),
    ("short_identity", frame(4, bytes(2)), ("bad_frame",), ()),
    ("other_device", frame(4, struct.pack("<BBBBBB", 1, 0, 3, 29, 0, 0)), ("frames",),
     ("the device is of type 1, not a Ping360 (2)",)),
)


def terminal(bench):
    """A sonard whose sonar is the test: that, a client of it and the line's far end."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    os.symlink(os.ttyname(slave), bench.port_path)
    bench.conf()
    daemon = bench.sonard()
    client = daemon.client()
    os.close(slave)
    until(lambda: client.sensor()["state"] != "no port", "the port")
    return daemon, client, master


def feed(daemon, client, master, case):
    """What no sonar should send, and a good ping after it."""
    name, data, counters, words = case
    before = client.sensor()
    logged = len(daemon.log())
    write_all(master, data)
    for angle in (198, 200):
        write_all(master, ping(angle))
    until(lambda: client.sensor()["pings"] >= before["pings"] + 1, "%s: a good ping afterwards" % name)
    until(lambda: all(client.sensor()[key] > before[key] for key in counters),
          "%s: %s in %s" % (name, counters, client.sensor()))
    def said():
        new = daemon.log()[logged:]
        return all(word in new for word in words) or write_all(master, data)

    until(said, "%s: %s in the log" % (name, words), every_s=0.2)
    new = daemon.log()[logged:]
    check("\x1b" not in new and "\nand more" not in new, "%s: the log is taken in" % name)
    check(client.call("sectors")["frame"] == "body", "%s: no answer afterwards" % name)


def line(bench):
    """The test is the sonar."""
    daemon, client, master = terminal(bench)
    for case in LINE:
        if not case[3]:
            feed(daemon, client, master, case)
    note("%d kinds of broken bytes" % len(LINE))
    daemon.stop()
    os.close(master)


def without_a_sonar(bench):
    """A compass alone can be tried: its heading is the pose, and nothing is clear."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    os.symlink(os.ttyname(slave), bench.port_path)
    conf = bench.write("compass.conf", "[nmea]\nport = serial:%s:4800\n[map]\nvoxel = 0.2 m\n[server]\nsocket = %s\n"
                       % (bench.port_path, bench.socket_path))
    check(bench.run(SONARD, "--check", conf).returncode == 0, "refused")
    daemon = bench.sonard(conf=conf)
    client = daemon.client()
    os.close(slave)
    until(lambda: client.call("status")["nmea"]["state"] == "open", "the port")
    write_all(master, b"$HEHDT,123.4,T*2B\r\n")
    until(lambda: client.call("status")["pose"]["attitude_deg"] == [0, 0, 123.4], "the heading")
    check(client.call("status")["data"] == "no sonar is configured" and client.call("sensors")["sensors"] == [], "it has a sonar")
    for method, params in (("blocked", {"azimuth_deg": 0, "distance_m": 0.5}), ("nearest", {}),
                           ("point", {"position_m": [0, 0, 0]}), ("time_to_collision", {"velocity_mps": [1, 0, 0]})):
        check(client.call(method, **params)["state"] == "unknown", method)
    for method in ("image", "background", "background_learn"):
        expect_refusal(client, method, {}, "no sonar is configured")
    check(client.call("reload") == {"applied": [], "needs_restart": []}, "a reload of the same changes something")
    check("no sonar is configured: depth and heading are read, every answer is unknown" in daemon.log(), daemon.log())
    daemon.stop()
    os.close(master)


def words_of(case):
    """What the log says of it, with a daemon to itself, which has suppressed no such message yet."""
    def words(bench):
        daemon, client, master = terminal(bench)
        feed(daemon, client, master, case)
        daemon.stop()
        os.close(master)
    return words


def write_all(fd, data):
    while data:
        data = data[os.write(fd, data):]


run([("configurations", configurations), ("options", options), ("full", full), ("captures", captures),
     ("keys_without_effect", keys_without_effect), ("keys_that_do_not_fit", keys_that_do_not_fit), ("nothing_in_it", nothing_in_it), ("without_a_sonar", without_a_sonar), ("no_sonar_of_it", no_sonar_of_it), ("no_ping_of_it", no_ping_of_it), ("gap_in_a_log", gap_in_a_log),
     ("requests", requests), ("line", line),
     *(("line_" + case[0], words_of(case)) for case in LINE if case[3])], parallel=3,
    gate=("configurations", "options", "full", "captures", "keys_without_effect", "keys_that_do_not_fit", "nothing_in_it", "without_a_sonar", "no_sonar_of_it", "no_ping_of_it", "gap_in_a_log"))
