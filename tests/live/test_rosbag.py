#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Bags of ROS 1 and ROS 2 become captures: recordings of real heads line by line as an independent decoder has them,
bags that are made up here in every form, and files that are none, cut off, or damaged."""
import bz2
import glob
import importlib.machinery
import importlib.util
import json
import math
import os
import random
import sqlite3
import struct
import zlib

from lib import SEED, SONARCTL, SONARD, Skipped, check, run
from made_capture import MAGIC, record, text

DATA = os.environ.get("SONARD_DATA", "../shared/data")
TOOL = os.path.abspath("python/sonard-rosbag")
START_NS = 1_700_000_000 * 10**9


def imported(bench, bag, *options, status=0):
    capture = bench.path("capture%d.mcap" % len(os.listdir(bench.path(""))))
    done = bench.run(TOOL, bag, capture, *options)
    check(done.returncode == status, "exit status %d: %s%s" % (done.returncode, done.stdout, done.stderr))
    check("Traceback" not in done.stderr, done.stderr)
    return capture, done


def replayed(bench, capture):
    done = bench.run(SONARD, "--replay", capture, "--answers", "-")
    check(done.returncode == 0, done.stderr)
    return json.loads(done.stdout.splitlines()[-1]), done.stderr


def rows(lines):
    return [line.strip().split(",") for line in lines if line[:1].isdigit()]


def messages(bench, capture, topic):
    """The bytes on that topic, as text."""
    done = bench.run(SONARCTL, "capture", "repair", capture, bench.path("again%d.mcap" % len(os.listdir(bench.path("")))))
    check(done.returncode == 0, done.stderr)
    with open(capture, "rb") as f:
        data = f.read()
    found, at, number, channels = [], len(MAGIC), None, {}
    todo = [(data, len(MAGIC))]
    while todo:
        data, at = todo.pop(0)
        while at + 9 <= len(data):
            op, n = struct.unpack_from("<BQ", data, at)
            body = data[at + 9:at + 9 + n]
            at += 9 + n
            if op == 4:
                number, _, length = struct.unpack_from("<HHI", body)
                channels[number] = body[8:8 + length].decode()
            elif op == 5 and channels[struct.unpack_from("<H", body)[0]] == topic:
                found.append((struct.unpack_from("<Q", body, 6)[0], body[22:].decode("latin-1")))
            elif op == 6:
                todo.append((body[struct.unpack_from("<I", body, 28)[0] + 40:], 0))
            elif op == 2:
                break
    return found


# ---- real recordings ----

def same_lines(bag, oracle, beams):
    """Every line has the bearing of the independent decoder's, and every sample where that has it."""
    def case(bench):
        found = glob.glob(os.path.join(DATA, bag))
        if not found:
            raise Skipped("no recording %s" % bag)
        capture, done = imported(bench, found[0])
        check("%d pings" % beams in done.stdout and "no pose: every sonar counts as fixed" in done.stdout, done.stdout)
        got = rows(bench.run(SONARCTL, "capture", "export", "--csv", capture).stdout.splitlines())
        with open(os.path.join(DATA, oracle), encoding="ascii") as f:
            want = rows(f)
        check(len(got) == len(want) == beams, "%d of %d lines" % (len(got), len(want)))
        for g, w in zip(got, want):
            turn = math.remainder(float(g[1]) - float(w[1]), 360)
            check(abs(turn) < 0.03 and abs(float(g[0]) - float(w[0])) < 0.05, "%s instead of %s" % (g[:3], w[:3]))
            size, of = float(g[2]) / int(g[3]), float(w[2]) / int(w[3])
            for i, sample in enumerate(w[4:]):
                k = int((i + 0.5) * of / size)
                check(sample in g[max(4, 3 + k):6 + k], "%s: no %s at %.2f m" % (g[0], sample, (i + 0.5) * of))
        end, log = replayed(bench, capture)
        check(all(s["age_s"] is not None for s in end["sectors"]["sectors"]) and "garbage" not in log, log)
    return case


def heading_of_the_head_is_no_pose(bench):
    """The tank's PoseStamped is where the sonar's head looks: taken for the vehicle's it would turn the walls."""
    found = glob.glob(os.path.join(DATA, "micron-tank-rosbag/static_sonar.bag"))
    if not found:
        raise Skipped("no recording of a tank")
    capture, _ = imported(bench, found[0])
    check("/pose" not in bench.run(SONARCTL, "capture", "info", capture).stdout, "poses")
    capture, done = imported(bench, found[0], "--pose", "/tritech_micron/heading")
    check("/tritech_micron/heading: 553 poses" in done.stdout, done.stdout)


# ---- made-up bags ----

class Writer:
    """Message bytes in CDR or as ROS 1 has them."""

    def __init__(self, ros1):
        self.ros1, self.out = ros1, b""

    def put(self, code, *values):
        for value in values:
            if not self.ros1:
                self.out += bytes(-len(self.out) % struct.calcsize(code))
            self.out += struct.pack("<" + code, value)
        return self

    def string(self, s):
        s = s.encode() + (b"" if self.ros1 else b"\0")
        self.put("I", len(s))
        self.out += s
        return self

    def many(self, code, values):
        self.put("I", len(values))
        return self.put(code, *values)

    def header(self, t_ns, frame="sonar"):
        if self.ros1:
            self.put("I", 7)
        return self.put("I", t_ns // 10**9, t_ns % 10**9).string(frame)

    def done(self):
        return self.out if self.ros1 else b"\0\1\0\0" + self.out


def scan(ros1, t_ns, ranges, echoes=False):
    w = Writer(ros1).header(t_ns).put("f", -0.5, 0.5, 0.25, 0.01, 0.1, 0.5, 20)
    if not echoes:
        return w.many("f", ranges).many("f", []).done()
    w.put("I", len(ranges))
    for each in ranges:
        w.many("f", each)
    return w.put("I", 0).done()


def odometry(ros1, t_ns, yaw_rad, at, speed, variances=(0, 0)):
    """variances: of the position, of the velocity; on the diagonals of their covariances."""
    diagonals = [[v if i % 7 == 0 else 0 for i in range(36)] for v in variances]
    w = Writer(ros1).header(t_ns, "odom").string("base_link").put("d", *at)
    w.put("d", 0, 0, math.sin(yaw_rad / 2), math.cos(yaw_rad / 2)).put("d", *diagonals[0])
    return w.put("d", speed, 0, 0, 0, 0, 0).put("d", *diagonals[1]).done()


def imu(ros1, t_ns, quaternion, known=True):
    w = Writer(ros1).header(t_ns, "base_link").put("d", *quaternion).put("d", 0 if known else -1, *[0] * 8)
    return w.put("d", *[0] * 24).done()


def cloud(ros1, t_ns, points):
    w = Writer(ros1).header(t_ns).put("I", 1, len(points), 3)
    for i, name in enumerate("xyz"):
        w.string(name).put("I", 4 * i).put("B", 7).put("I", 1)
    data = b"".join(struct.pack("<fff", *p) for p in points)
    w.put("B", 0).put("I", 12, 12 * len(points), len(data))
    w.out += data
    return w.put("B", 1).done()


def ros1_fields(**pairs):
    return b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k.encode() + b"=" + v for k, v in pairs.items())


def ros1_record(body, **pairs):
    head = ros1_fields(**pairs)
    return struct.pack("<I", len(head)) + head + struct.pack("<I", len(body)) + body


def ros1_chunk(body, packing="none"):
    packed = {"none": lambda b: b, "bz2": bz2.compress, "lz4": lz4}[packing](body)
    return ros1_record(packed, op=b"\5", compression=packing.encode(), size=struct.pack("<I", len(body)))


def ros1_bag(topics, entries, packing="none"):
    """topics: (topic, type, definition); entries: (topic's number, time in ns, bytes)."""
    fields, rec = ros1_fields, ros1_record
    body = b"".join(rec(fields(topic=t.encode(), type=k.encode(), md5sum=b"x", message_definition=d.encode()),
                        op=b"\7", conn=struct.pack("<I", i), topic=t.encode()) for i, (t, k, d) in enumerate(topics))
    body += b"".join(rec(data, op=b"\2", conn=struct.pack("<I", i), time=struct.pack("<II", t // 10**9, t % 10**9)) for i, t, data in entries)
    return b"#ROSBAG V2.0\n" + rec(b" " * 99, op=b"\3", index_pos=bytes(8), conn_count=bytes(4), chunk_count=bytes(4)) + ros1_chunk(body, packing)


def lz4(body):
    """A frame of one block: literals, and matches of four bytes and more with what stood up to 64 KiB before."""
    out, at, start, seen = bytearray(), 0, 0, {}

    def sequence(literals, match):
        n = len(literals)
        out.append(min(n, 15) << 4 | (min(match - 4, 15) if match else 0))
        if n >= 15:
            out.extend(b"\xff" * ((n - 15) // 255) + bytes([(n - 15) % 255]))
        out.extend(literals)
    while at + 12 < len(body):
        key = body[at:at + 4]
        before = seen.get(key)
        seen[key] = at
        if before is None or at - before > 65535:
            at += 1
            continue
        n = 4
        while at + n + 5 < len(body) and body[before + n] == body[at + n]:
            n += 1
        sequence(body[start:at], n)
        out.extend(struct.pack("<H", at - before))
        if n - 4 >= 15:
            out.extend(b"\xff" * ((n - 19) // 255) + bytes([(n - 19) % 255]))
        at += n
        start = at
    sequence(body[start:], 0)
    return struct.pack("<IBBB", 0x184D2204, 0x60, 0x70, 0x73) + struct.pack("<I", len(out)) + bytes(out) + bytes(4)


def sqlite_bag(path, topics, entries):
    bag = sqlite3.connect(path)
    bag.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, offered_qos_profiles TEXT)")
    bag.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
    for i, (topic, kind) in enumerate(topics):
        bag.execute("INSERT INTO topics VALUES(?, ?, ?, 'cdr', '')", (i, topic, kind))
    bag.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", entries)
    bag.commit()
    bag.close()


def mcap_bag(topics, entries, packing="", tamper=lambda body: body):
    out = MAGIC + record(1, text("ros2") + text("made"))
    for i, (topic, kind, definition) in enumerate(topics, 1):
        out += record(3, struct.pack("<H", i) + text(kind) + text("ros2msg") + text(definition))
        out += record(4, struct.pack("<HH", i, i) + text(topic) + text("cdr") + struct.pack("<I", 0))
    body = b"".join(record(5, struct.pack("<HIQQ", i + 1, 0, t, t) + data) for i, t, data in entries)
    packed = {"": lambda b: b, "lz4": lz4, "zstd": lambda b: b"\x28\xb5\x2f\xfd" + b}[packing](body)
    chunk = struct.pack("<QQQI", 0, 0, len(body), 0) + text(packing) + struct.pack("<Q", len(packed)) + tamper(packed)
    return out + record(6, chunk) + record(15, bytes(4)) + record(2, bytes(20)) + MAGIC


SCAN, ECHOES, ODOMETRY, IMU, CLOUD = ("sensor_msgs/LaserScan", "sensor_msgs/MultiEchoLaserScan", "nav_msgs/Odometry", "sensor_msgs/Imu",
                                      "sensor_msgs/PointCloud2")
RANGES = [4.5, math.inf, math.nan, 0.2, 25.0]  # an echo, none, no measurement, below and above the limits


def checked_scan(lines):
    """Of RANGES: the echo ahead to the right, the beam without one, and nothing of the beams that measured nothing."""
    listened_ns = int(2e9 * 20 / 1500)
    check([line.split("*")[0] for _, line in lines] == ["$ECHO,28.6479,0.0000,1,6000.000,100", "$ECHO,14.3239,0.0000,0"], str(lines))
    times = [t - START_NS - listened_ns for t, _ in lines]
    check(times[0] == 0 and abs(times[1] - 10**7) < 1000, str(times))


def ros1_forms(bench):
    """Chunks that are not packed, bz2 and lz4; poses of an odometry that drives north, in the frames that sonard has."""
    for packing in ("none", "bz2", "lz4"):
        entries = []
        for i in range(40):
            t_ns = START_NS + i * 10**8
            entries += [(0, t_ns, scan(True, t_ns, RANGES)), (1, t_ns, odometry(True, t_ns, math.pi / 2, (1, 2 + 0.1 * i, -3), 0.5))]
        bag = bench.write(packing + ".bag", ros1_bag([("/sonar/scan", SCAN, ""), ("/odom", ODOMETRY, "")], entries, packing))
        capture, done = imported(bench, bag)
        check("/sonar/scan: 80 pings as [sonar scan], device = echolist" in done.stdout and "/odom: 40 poses" in done.stdout, done.stdout)
        checked_scan(messages(bench, capture, "/scan/rx")[:2])
        pose = json.loads(messages(bench, capture, "/pose")[0][1])
        check(pose == {"t_unix": START_NS * 1e-9, "attitude_deg": [0.0, 0.0, 0.0], "position_m": [2.0, 1.0, 3.0],
                       "velocity_mps": [0.5, 0.0, 0.0]}, str(pose))
        end, log = replayed(bench, capture)
        check(end["sectors"]["pose_age_s"] < 1 and "capture_pose" not in log, log)
        check(any(s["range_m"] is not None and 4 < s["range_m"] < 5 and 20 <= s["azimuth_deg"] <= 35 for s in end["sectors"]["sectors"]), str(end)[:900])
        capture, done = imported(bench, bag, "--no-position", "--pose", "/odom")
        check("position_m" not in messages(bench, capture, "/pose")[0][1], "a position")
        _, done = imported(bench, bag, "--topic", "/other", status=1)
        check("no sonar in it" in done.stderr and "/sonar/scan (sensor_msgs/LaserScan)" in done.stderr, done.stderr)


def covariances_say_what_was_measured(bench):
    """Huge, negative and NaN are no position; zeros are none where other messages of the topic are filled in."""
    def parts(*variances):
        entries = []
        for i, both in enumerate(variances):
            t_ns = START_NS + i * 10**8
            entries += [(0, t_ns, scan(True, t_ns, RANGES)), (1, t_ns, odometry(True, t_ns, 0, (1, 2, -3), 0.5, both))]
        capture, done = imported(bench, bench.write("c.bag", ros1_bag([("/scan", SCAN, ""), ("/odom", ODOMETRY, "")], entries)))
        poses = [json.loads(text) for _, text in messages(bench, capture, "/pose")]
        check(all("attitude_deg" in p for p in poses), str(poses))
        os.remove(capture)
        return ["".join(k[0] for k in ("position_m", "velocity_mps") if k in p) for p in poses], done.stdout
    seen, said = parts((0.01, 0.01), (99, 0.9), (1e6, 0.01), (1e6, 1e6), (-1, 0.01), (math.nan, math.nan), (0, 0), (101, 1.1), (0.01, 9999))
    check(seen == ["pv", "pv", "v", "", "v", "", "", "", "p"], (seen, said))
    check("/odom: left out 6 of 9 positions, whose covariance says that nothing measured them" in said, said)
    seen, said = parts((0, 0), (0, 0))
    check(seen == ["pv", "pv"] and "nothing tells whether its positions were measured" in said, (seen, said))


def ros2_sqlite(bench):
    """A .db3 and its folder: ranges, an IMU that rolls to the right and pitches up, a point cloud by cells."""
    folder = bench.path("bag")
    os.mkdir(folder)
    half = math.radians(10) / 2
    quaternions = {(10, 0, 90): (math.sin(half), 0, 0, math.cos(half)), (0, 10, 90): (0, -math.sin(half), 0, math.cos(half)),
                   (0, 0, 80): (0, 0, math.sin(half), math.cos(half))}
    entries = [(0, START_NS, scan(False, START_NS, RANGES)), (2, START_NS, cloud(False, START_NS, [(5, -5, 0), (10, -10.1, 0), (3, 0, 4), (math.nan, 0, 0)]))]
    entries += [(1, START_NS, imu(False, START_NS + i, q)) for i, q in enumerate(quaternions.values())]
    entries += [(1, START_NS, imu(False, START_NS + 9, (0, 0, 0, 1), known=False)), (1, START_NS, imu(False, START_NS + 9, (0, 0, 0, 0)))]
    sqlite_bag(os.path.join(folder, "bag_0.db3"), [("/a/scan", "sensor_msgs/msg/LaserScan"), ("/imu", "sensor_msgs/msg/Imu"),
                                                   ("/b/scan", "sensor_msgs/msg/PointCloud2")], entries)
    capture, done = imported(bench, folder)
    check("/imu: 3 poses" in done.stdout and "[sonar scan]" in done.stdout and "[sonar scan1]" in done.stdout, done.stdout)
    checked_scan(messages(bench, capture, "/scan/rx"))
    for (_, got), want in zip(messages(bench, capture, "/pose"), quaternions):
        check(all(abs(g - w) < 1e-4 for g, w in zip(json.loads(got)["attitude_deg"], want)), "%s instead of %s" % (got, want))
    lines = [line.split("*")[0].split(",") for _, line in messages(bench, capture, "/scan1/rx")]
    check([(line[1], line[2], line[3]) for line in lines] == [("0.0000", "53.1301", "1"), ("45.0000", "0.0000", "2")], str(lines))
    replayed(bench, capture)


SCAN_LINE = """std_msgs/Header header
float32 angle
uint8 KIND=3 # a constant
float32[<=2] unused
float32 bin_distance_step
IntensityBin[] bins
================================================================================
MSG: micron_driver_ros/IntensityBin
float32 distance
float32 intensity
"""


def scan_line(distances, intensities):
    line = Writer(False).header(START_NS).put("f", 90).many("f", []).put("f", 0.05).put("I", len(distances))
    for pair in zip(distances, intensities):
        line.put("f", *pair)
    return line.done()


def beams_that_are_none(bench):
    """No intensity becomes silence by what it is not, nor by where its bin is not; +inf is the strongest echo there is."""
    places, quiet = [0.05 * (i + 1) for i in range(200)], [3.0] * 200

    def read(distances, intensities, *options, status=0):
        bag = mcap_bag([("/scan_line", "micron_driver_ros/msg/ScanLine", SCAN_LINE)],
                       [(0, START_NS, scan_line(places, quiet))] * (status == 0) + [(0, START_NS, scan_line(distances, intensities))])
        return imported(bench, bench.write("bag.mcap", bag), *options, status=status)
    for odd in (math.nan, -math.inf):
        _, done = read(places, quiet[:99] + [odd] + quiet[100:])
        check("1 pings" in done.stdout and "1 messages left out (an intensity is not a number)" in done.stdout, done.stdout)
    capture, done = read(places, quiet[:99] + [math.inf] + quiet[100:])
    row = rows(bench.run(SONARCTL, "capture", "export", "--csv", capture).stdout.splitlines())[1]
    check(abs((row.index("255", 4) - 4 + 0.5) * float(row[2]) / int(row[3]) - 4.975) < 0.05, str(row)[:200])
    for distances in ([d + 5 for d in places], [d * d for d in places], [math.nan] * 200, places[:100] + places[99::-1], places[::-1]):
        _, done = read(distances, quiet)
        check("1 pings" in done.stdout and "1 messages left out (bins that do not lie evenly" in done.stdout, done.stdout)
    shares = [i / 200 for i in range(200)]
    capture, done = read(places, shares, status=1)
    check("no intensity of /scan_line is above 1: give --scale 255" in done.stderr and not os.path.exists(capture), done.stderr)
    check("2 pings" in read(places, shares, "--scale", "255")[1].stdout and "2 pings" in read(places, shares, "--scale", "1")[1].stdout, "with a scale")


def sonar_echo(ros1, t_ns, angle, samples, range_m=10, n=500, speed=1500):
    w = Writer(ros1).header(t_ns).put("f", angle).put("B", 1).put("H", n, 740, speed).put("B", range_m).put("I", len(samples))
    w.out += samples
    return w.done()


def echoes_of_a_ping360(bench):
    """A wall at 4 m to the left alone; the driver's angle grows to the left. What no Ping360 can have sent is left out."""
    quiet = bytes([255] * 12 + [8 + (k * 13) % 5 for k in range(488)])
    wall = quiet[:200] + b"\xdc" * 8 + quiet[208:]
    for kind, options, azimuth in (("ping360_sonar_msgs/msg/SonarEcho", (), 270), ("my_msgs/msg/SonarEcho", ("--clockwise",), 90)):
        definition = "std_msgs/Header header\nfloat32 angle\nuint8 gain\nuint16 number_of_samples\nuint16 transmit_frequency\nuint16 speed_of_sound\nuint8 range\nuint8[] intensities"
        entries = [(0, START_NS + i * 60 * 10**6, sonar_echo(False, START_NS + i * 60 * 10**6, (i - 200) * math.pi / 200, wall if 250 <= i <= 350 else quiet)) for i in range(400)]
        wrong = [sonar_echo(False, START_NS, *bad) for bad in ((0, b""), (math.nan, quiet), (0, quiet, 0), (0, quiet, 10, 0), (0, quiet, 10, 500, 0), (0, bytes(1287)),
                                                               (0, quiet, 255, 1), (0, quiet, 1, 1200))]
        bag = mcap_bag([("/scan_echo", kind, definition if "my" in kind else "")], entries + [(0, START_NS, w) for w in wrong])
        capture, done = imported(bench, bench.write("x.mcap", bag), *options)
        check("/scan_echo: 400 pings as [sonar scan_echo], device = ping360, range = 10.0 m; 8 messages left out" in done.stdout, done.stdout)
        done = bench.run(SONARD, "--replay", capture, "--answers", "-")
        sectors = {s["azimuth_deg"]: s for s in json.loads(done.stdout.splitlines()[-1])["sectors"]["sectors"]}
        near = [a for a, s in sectors.items() if s["range_m"] is not None and 3.9 < s["range_m"] < 4.3]
        check(near and all(abs(a - azimuth) <= 50 for a in near) and azimuth in near, "%s: %s" % (options, near))
        os.remove(capture)


def topics_of_one_name(bench):
    """A name that a topic has is not that of another one, whatever its number."""
    topics = [(t, SCAN, "") for t in ("/b/scan2", "/c/scan", "/d/scan", "/e/scan", "/f/scan1")]
    bag = ros1_bag(topics, [(i, START_NS, scan(True, START_NS, RANGES)) for i in range(len(topics))])
    _, done = imported(bench, bench.write("x.bag", bag))
    check(all("[sonar %s]" % name in done.stdout for name in ("scan2", "scan", "scan1", "scan3", "scan11")), done.stdout)


def ros2_mcap(bench):
    """A type that the file itself describes, several echoes a beam, chunks that are packed, damaged or cut off."""
    line = Writer(False).header(START_NS).put("f", 90).many("f", []).put("f", 0.05).put("I", 200)
    for i in range(200):
        line.put("f", 0.05 * i, 200 if i == 99 else 3)
    entries = [(0, START_NS, line.done()), (1, START_NS, scan(False, START_NS, [[4.5, 6], [math.inf], [], [math.nan], [0.1]], echoes=True))]
    topics = [("/micron/scan_line", "micron_driver_ros/msg/ScanLine", SCAN_LINE), ("/echoes", "sensor_msgs/msg/MultiEchoLaserScan", "")]
    for packing in ("", "lz4"):
        capture, _ = imported(bench, bench.write("bag.mcap", mcap_bag(topics, entries, packing)))
        row = rows(bench.run(SONARCTL, "capture", "export", "--csv", capture).stdout.splitlines())
        check(len(row) == 1 and row[0][1] == "90.000" and abs(float(row[0][2]) - 10) < 0.05, str(row)[:200])
        strongest = (row[0].index("200", 4) - 4 + 0.5) * float(row[0][2]) / int(row[0][3])
        check(abs(strongest - 4.975) < 0.05, "%g m" % strongest)
        check([m[1].split("*")[0].split(",")[3:] for m in messages(bench, capture, "/echoes/rx")] ==
              [["2", "6000.000", "100", "8000.000", "100"], ["0"]], str(messages(bench, capture, "/echoes/rx")))
    capture, _ = imported(bench, bench.write("bag.mcap", mcap_bag(topics, entries)), "--counterclockwise", "--topic", "/micron/scan_line")
    check(rows(bench.run(SONARCTL, "capture", "export", "--csv", capture).stdout.splitlines())[0][1] == "-90.000", "the angle's sign")
    _, done = imported(bench, bench.write("bag.mcap", mcap_bag(topics, entries, "zstd")), status=1)
    check("mcap compress --compression lz4" in done.stderr and "no sonar" in done.stderr, done.stderr)
    _, done = imported(bench, bench.write("bag.mcap", mcap_bag(topics, entries, "lz4", lambda b: b[:40] + b"\xff" * 9 + b[49:])), status=1)
    check("a chunk is left out" in done.stderr, done.stderr)


def damaged_chunks(bench):
    """A hole in one chunk of four costs no other, nor does a head; topics that are damaged are in the summary of an MCAP file."""
    ros1 = ros1_bag([("/scan", SCAN, "")], [(0, START_NS, scan(True, START_NS, RANGES))], "bz2")
    head = ros1[:13 + len(ros1_record(b" " * 99, op=b"\3", index_pos=bytes(8), conn_count=bytes(4), chunk_count=bytes(4)))]
    ros1_chunks = [ros1[len(head):]] * 4

    begin = MAGIC + record(1, text("ros2") + text("made"))
    topic = record(3, struct.pack("<H", 1) + text("sensor_msgs/msg/LaserScan") + text("ros2msg") + text("")) + \
        record(4, struct.pack("<HH", 1, 1) + text("/scan") + text("cdr") + struct.pack("<I", 0))
    body = record(5, struct.pack("<HIQQ", 1, 0, START_NS, START_NS) + scan(False, START_NS, RANGES))
    chunks = [record(6, struct.pack("<QQQI", 0, 0, len(body), zlib.crc32(body)) + text("") + struct.pack("<Q", len(body)) + body)] * 4
    data_end = record(15, bytes(4))
    start = len(begin + topic + b"".join(chunks) + data_end)
    footer = record(2, struct.pack("<QQI", start, 0, zlib.crc32(topic + record(2, struct.pack("<QQI", start, 0, 0))[:25])))
    end = data_end + topic + footer + MAGIC

    for head, chunk, tail in ((head, ros1_chunks, b""), (begin + topic, chunks, end)):
        whole = head + b"".join(chunk) + tail
        second = len(head) + len(chunk[0])
        for bag, pings in ((whole, 8), (whole[:second + 100] + whole[second + 140:], 6),
                           (whole[:second] + b"\xff" * 9 + whole[second + 9:], 6)):
            _, done = imported(bench, bench.write("x.bag", bag))
            check("/scan: %d pings" % pings in done.stdout and (pings == 8) != ("read on at the next chunk" in done.stderr),
                  "%d pings wanted: %s%s" % (pings, done.stdout, done.stderr))
    at = len(begin + topic) - len("/scan") - 4 - 3 - 4 - 4 - 13  # the channel's operation
    bag = begin + topic + b"".join(chunks) + end
    check(bag[at] == 4, "another byte")
    _, done = imported(bench, bench.write("x.bag", bag[:at] + b"\x84" + bag[at + 1:]))
    check("/scan: 8 pings" in done.stdout, done.stdout + done.stderr)


def hostile_tables(bench):
    """Rows that a file makes out of nothing, or that are too long, are not read; bytes beside the sonar's are no matter."""
    def made(script, *parameters):
        path = bench.path("x%d.db3" % len(os.listdir(bench.path(""))))
        sqlite_bag(path, [("/scan", "sensor_msgs/msg/LaserScan")], [(0, START_NS, scan(False, START_NS, RANGES))])
        bag = sqlite3.connect(path)
        for statement in script.split(";"):
            bag.execute(statement, parameters if "?" in statement else ())
        bag.commit()
        bag.close()
        return path
    rows_without_end = ("SELECT 0 AS topic_id, n AS timestamp, zeroblob(9) AS data FROM "
                        "(WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM c WHERE n < 3000000) SELECT n FROM c)")
    for script, wanted in (("DROP TABLE messages; CREATE VIEW messages AS " + rows_without_end, "messages is a view"),
                           ("DROP TABLE topics; CREATE VIEW topics AS SELECT 0 AS id, '/scan' AS name, 'x' AS type, 'cdr' AS serialization_format", "topics is a view"),
                           ("ALTER TABLE messages RENAME TO m; CREATE TABLE messages(topic_id, timestamp, data AS (zeroblob(99999999)))", "computed columns")):
        capture, done = imported(bench, made(script), status=1)
        check(wanted in done.stderr and not os.path.exists(capture), done.stderr)
    _, done = imported(bench, made("INSERT INTO messages(topic_id, timestamp, data) VALUES (7, 1, zeroblob(17000000))"))
    check("2 pings" in done.stdout and "a message of 17000000 bytes is left out" in done.stderr, done.stdout + done.stderr)
    _, done = imported(bench, made("INSERT INTO topics SELECT 9, name, zeroblob(400000000), 'cdr', '' FROM topics"), status=1)
    check("a row is too long" in done.stderr, done.stderr)
    pictures = "INSERT INTO messages(topic_id, timestamp, data) WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM c WHERE n < 60) SELECT 7, -n, zeroblob(6000000) FROM c"
    _, done = imported(bench, made(pictures))
    check("2 pings" in done.stdout and not done.stderr, done.stdout + done.stderr)
    topics = [("/t%d" % i, "sensor_msgs/msg/LaserScan") for i in range(4097)]
    sqlite_bag(bench.path("many.db3"), topics, [(0, START_NS, scan(False, START_NS, RANGES))])
    _, done = imported(bench, bench.path("many.db3"), status=1)
    check("more than 4096 connections" in done.stderr, done.stderr)


def smaller(bench, source):
    """The tool with smaller bounds, and what it imports beside it."""
    os.makedirs(bench.path("python"))
    os.symlink(os.path.join(os.path.dirname(TOOL), "sonard_tool.py"), bench.path("python/sonard_tool.py"))
    return bench.write("python/smaller", source)


def too_much(bench):
    """What a file can make the program hold is bounded: by message, by definitions, and in all."""
    good = (0, START_NS, scan(True, START_NS, RANGES))

    def left_out(topics, entries, why):
        _, done = imported(bench, bench.write("x.bag", ros1_bag(topics, entries, "bz2")))
        check("1 messages left out (%s" % why in done.stdout, done.stdout)
    topics = [("/scan", SCAN, "")]
    left_out(topics, [good, (0, START_NS, scan(True, START_NS, [5.0] * 65537))], "more than 65536 ranges")
    left_out(topics, [good, (0, START_NS, bytes(17 << 20))], "a message of 17825792 bytes")
    near, far = cloud(True, START_NS, [(1, 0, 0)]), cloud(True, START_NS, [(1, 0, 0)] * 65537)
    left_out([("/cloud", CLOUD, "")], [(0, START_NS, near), (0, START_NS, far)], "more than 65536 ranges")
    _, done = imported(bench, bench.write("x.bag", ros1_bag(topics, [(0, START_NS, scan(True, START_NS, [5.0] * 65536))])))
    check("65536 pings" in done.stdout and "left out" not in done.stdout, done.stdout)
    with open(TOOL, encoding="utf-8") as f:
        source = f.read()
    check("TAKEN_MAX = 1 << 30" in source, "no bound of all bytes")
    small = smaller(bench, source.replace("TAKEN_MAX = 1 << 30", "TAKEN_MAX = 1 << 20"))
    capture = bench.path("small.mcap")
    for entries in ([good] * 2000, [good] + [(1, START_NS, odometry(True, START_NS, 0, (0, 0, 0), 0))] * 600):
        bag = bench.write("x.bag", ros1_bag([("/scan", SCAN, ""), ("/odom", ODOMETRY, "")], entries))
        done = bench.run("python3", small, bag, capture)
        check(done.returncode == 1 and "more pings and poses than fit into 1 MiB: choose" in done.stderr and
              not os.path.exists(capture), done.stderr)
    _, done = imported(bench, bench.write("x.bag", ros1_bag([("/scan", SCAN, "")] * 4097, [good])), status=1)
    check("more than 4096 connections" in done.stderr, done.stderr)
    long = "float32 x\n" * 200000
    _, done = imported(bench, bench.write("x.bag", ros1_bag([("/scan", SCAN, "")] + [("/x", "A/B", long + " " * i) for i in range(9)], [good], "bz2")), status=1)
    check("more than 16 MiB of topics and definitions" in done.stderr, done.stderr)
    inner = ros1_bag(topics, [good])[13:]
    for _ in range(3):
        inner = ros1_chunk(inner)
    _, done = imported(bench, bench.write("x.bag", b"#ROSBAG V2.0\n" + inner), status=1)
    check("a chunk is left out: a chunk within a chunk" in done.stderr, done.stderr)


def work_of(tool, reader, data):
    """How many reads of bytes, and how many of these, it takes to go through a recording to its end."""
    class Counted(tool.Bytes):
        reads = read = 0

        def take(self, n):
            piece = super().take(n)
            Counted.reads += 1
            Counted.read += len(piece) if len(piece) <= 4096 else 0  # longer ones are not copied
            return piece
    plain, tool.Bytes = tool.Bytes, Counted
    notes = tool.Notes()
    try:
        for _ in reader(memoryview(data), notes):
            pass
    finally:
        tool.Bytes = plain
    check(len(notes) < 50, "%d notes" % len(notes))
    return Counted.reads + Counted.read / 64


def work_grows_with_the_file(bench):
    """Heads of chunks without end, chunks that hold each other, headers without end: four times the bytes take four times the work."""
    loader = importlib.machinery.SourceFileLoader("sonard_rosbag", TOOL)
    tool = importlib.util.module_from_spec(importlib.util.spec_from_loader("sonard_rosbag", loader))
    loader.exec_module(tool)

    def to_the_end(unit, tail, count, head):
        """Units that each begin with the head of a chunk whose body ends where all ends, and damage behind that."""
        size = len(head(0)) + len(unit)
        return b"".join(head(size * (count - i) - len(head(0))) + unit for i in range(count)) + tail

    def ros1_head(size, packing=b"none"):
        fields = ros1_fields(op=b"\5", compression=packing, size=struct.pack("<I", size & 0xFFFFFFFF))
        return struct.pack("<I", len(fields)) + fields + struct.pack("<I", size)

    def mcap_head(size, packing=b""):
        body = struct.pack("<QQQII", 0, 0, size, 0, len(packing)) + packing + struct.pack("<Q", size)
        return b"\x06" + struct.pack("<Q", len(body) + size) + body
    def hidden(wrap, count, head):
        """A chunk of records, each of which has the head of a chunk for its body: of one that holds the records behind it."""
        size = len(wrap(head(0)))
        return head(size * count) + b"".join(wrap(head(size * (count - 1 - i))) for i in range(count)) + b"\xff" * 9
    small = ros1_record(b"x", op=b"\2", conn=bytes(4), time=bytes(8))
    endless = struct.pack("<I", 0x7FFFFF00)
    ros1 = {"tokens": lambda n: b"\x04\0\0\0op=\x05" * n,
            "heads": lambda n: (struct.pack("<I", 70) + b"\x04\0\0\0op=\x05") * n,
            "other fields": lambda n: (struct.pack("<I", 200) + b"\x04\0\0\0op=\x05" + b"\1\0\0\0=" * 8) * n,
            "headers": lambda n: (ros1_record(b"x", op=b"\5", compression=b"none", size=bytes(4)) + struct.pack("<I", 3000) + b"\1\0\0\0=" * 4) * n,
            "endless headers": lambda n: (ros1_record(b"x", op=b"\5", compression=b"none", size=bytes(4)) + endless) * n,
            "chunks in chunks": lambda n: to_the_end(b"", b"\xff" * 9, n, ros1_head),
            "chunks of records": lambda n: to_the_end(small * 8, b"\xff" * 9, n, ros1_head),
            "hidden chunks": lambda n: hidden(lambda body: ros1_record(body, op=b"\2", conn=bytes(4), time=bytes(8)), n, ros1_head),
            "packed chunks in chunks": lambda n: to_the_end(b"", b"\xff" * 9, n, lambda size: ros1_head(size, b"lz4"))}
    mcap = {"tokens": lambda n: (b"\x06" + bytes(8)) * n,
            "names": lambda n: (b"\x06" + struct.pack("<Q", 1 << 20) + bytes(28) + struct.pack("<I", 1 << 19)) * n,
            "chunks in chunks": lambda n: to_the_end(b"", b"\xff" * 9, n, mcap_head),
            "chunks of records": lambda n: to_the_end(record(5, bytes(22)) * 8, b"\xff" * 9, n, mcap_head),
            "hidden chunks": lambda n: hidden(lambda body: record(5, bytes(22) + body), n, mcap_head),
            "packed chunks in chunks": lambda n: to_the_end(b"", b"\xff" * 9, n, lambda size: mcap_head(size, b"lz4"))}
    for reader, magic, shapes in ((tool.ros1_messages, tool.ROS1_MAGIC, ros1), (tool.mcap_messages, tool.MCAP_MAGIC, mcap)):
        for name, shape in shapes.items():
            once, more = (work_of(tool, reader, magic + shape(n)) for n in (200, 800))
            check(more <= 6 * once + 200, "%s of %s: %g, then %g" % (name, magic[:8], once, more))


def chunks_that_unpack_to_much(bench):
    """A small file cannot hold chunks that unpack to more than any recording of its size."""
    with open(TOOL, encoding="utf-8") as f:
        source = f.read()
    check("UNPACKED_MAX = 1 << 30" in source and "PIECE_MAX = 64 << 20" in source, "other bounds")
    small = smaller(bench, source.replace("UNPACKED_MAX = 1 << 30", "UNPACKED_MAX = 1 << 22").replace("RATIO_MAX = 256 ", "RATIO_MAX = 1 "))
    good = ros1_bag([("/scan", SCAN, "")], [(0, START_NS, scan(True, START_NS, RANGES))])
    bomb = ros1_chunk(bytes(1 << 20), "bz2")
    capture = bench.path("small.mcap")
    done = bench.run("python3", small, bench.write("x.bag", good + bomb * 8), capture)
    check(done.returncode == 1 and "its chunks unpack to more than 4 MiB" in done.stderr and not os.path.exists(capture), done.stderr)
    done = bench.run("python3", small, bench.write("x.bag", good + bomb * 3), capture)
    check(done.returncode == 0, done.stderr)
    tiny = ros1_chunk(ros1_record(b"", op=b"\2", conn=bytes(4)) * 5000, "bz2")
    done = bench.run("python3", small, bench.write("x.bag", good + tiny * 4), bench.path("tiny.mcap"))
    check(done.returncode == 1 and "its chunks unpack to more than 4 MiB" in done.stderr, done.stderr)
    huge = [ros1_record(b"x" * 99, op=b"\5", compression=b"bz2", size=struct.pack("<I", (64 << 20) + 1 + i)) for i in range(200)]
    _, done = imported(bench, bench.write("x.bag", good + b"".join(huge)))
    check(done.returncode == 0 and "a chunk is left out: a chunk of 67108865 bytes" in done.stderr, done.stderr)
    check("and more, for other reasons" in done.stderr and len(done.stderr.splitlines()) < 50, done.stderr)


def hostile_fields(bench):
    """Fields of other types than their names say: the message is left out and counted, the rest is taken."""
    no_header, no_covariance = "uint8 header\nfloat32[] ranges\n", "Header header\ngeometry_msgs/Quaternion orientation\nfloat64[] orientation_covariance\n"
    topics = [("/scan", SCAN, ""), ("/imu", IMU, no_covariance), ("/other/scan", SCAN, no_header),
              ("/late", SCAN, "A/H header\n" + "\n".join("float32 %s" % n for n in ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time",
                                                                                      "range_min", "range_max")) + "\nfloat32[] ranges\n===\nMSG: A/H\nuint64 stamp")]
    late = [Writer(True).put("Q", stamp).put("f", -0.5, 0.5, 0.25, 0.01, 0.1, 0.5, 20).many("f", RANGES).done() for stamp in (START_NS, 1 << 63, (1 << 64) - 1)]
    entries = [(0, START_NS, scan(True, START_NS, RANGES)), (1, START_NS, Writer(True).header(START_NS).put("d", 0, 0, 0, 1).many("d", []).done()),
               (2, START_NS, Writer(True).put("B", 1).many("f", RANGES).done())] + [(3, START_NS, m) for m in late]
    capture, done = imported(bench, bench.write("x.bag", ros1_bag(topics, entries)))
    check("/scan: 2 pings" in done.stdout and "/late: 2 pings" in done.stdout and "2 messages left out (a time that makes no sense)" in done.stdout, done.stdout)
    check("/imu: a pose is left out: its fields are not those of its type" in done.stderr, done.stderr)
    replayed(bench, capture)
    _, done = imported(bench, bench.write("x.bag", ros1_bag(topics, entries[2:3])), status=1)
    check("no message of /other/scan can be used: its fields are not those of its type" in done.stderr, done.stderr)


def names_that_write_on_the_terminal(bench):
    """Neither a topic nor a type nor a packing reaches the terminal with what it may take for a command."""
    evil, good = "\x1b]0;x\x07\r/scan\u202e", (0, START_NS, scan(True, START_NS, RANGES))
    odd = ros1_record(b"x", op=b"\5", compression=b"\x1b[2J", size=bytes(4))
    pose = (1, START_NS, odometry(True, START_NS, 0, (0, 0, 0), 0))
    broken = (2, START_NS, b"")
    for topics, entries, status in (([(evil, SCAN, ""), (evil + "o", ODOMETRY, ""), (evil + "p", ODOMETRY, "")], [good, pose, broken], 0),
                                    ([(evil, "A/" + evil, "")], [good], 1), ([(evil, SCAN, "")], [(0, 1, b"")], 1),
                                    ([(evil, "A/ScanLine", "A/%s x" % "B")], [good], 1)):
        _, done = imported(bench, bench.write("x.bag", ros1_bag(topics, entries) + odd), status=status)
        said = done.stdout + done.stderr
        check(all(c.isprintable() or c == "\n" for c in said) and "?]0;x??/scan?" in said, repr(said))


def refusals(bench):
    """What is no bag, what is cut off, and any bytes changed: a message, a status, never a trace and never a file left."""
    for name, content, wanted in (("x.bag", b"hello", "neither a ROS 1 bag"), ("x.bag", b"", "neither a ROS 1 bag"), ("x.bag", b"#ROSBAG V1.2\n", "rosbag fix"),
                                  ("x.db3", b"SQLite format 3\0" + bytes(100), "not a ROS 2 bag"), ("x.db3.zstd", b"\x28\xb5\x2f\xfd\0", "unzstd"),
                                  ("x.bag", ros1_bag([("/chatter", "std_msgs/String", "string data")], [(0, 1, b"\0\0\0\0")]), "/chatter (std_msgs/String)"),
                                  ("x.bag", ros1_bag([("/scan", SCAN, "")], [(0, 1, b"\xff" * 40)]), "no message of /scan can be used: it ends too early")):
        capture, done = imported(bench, bench.write(name, content), status=1)
        check(wanted in done.stderr and not os.path.exists(capture), done.stderr)
    endless = "".join("A0/ScanLine x%d\n" % i for i in range(9))
    deep = "\n===\n".join(["".join("A/T0 x%d\n" % i for i in range(50))] + [
        "MSG: A/T%d\n" % k + "".join("A/T%d x%d\n" % (k + 1, i) for i in range(50)) for k in range(9)] + ["MSG: A/T9\nuint8 A=1"])
    for definition in (endless, deep):
        _, done = imported(bench, bench.write("x.bag", ros1_bag([("/scan", "A0/ScanLine", definition)], [(0, 1, b"")])), status=1)
        check("holds too many others" in done.stderr, done.stderr)
    good = ros1_bag([("/scan", SCAN, ""), ("/odom", ODOMETRY, "")], [(0, START_NS, scan(True, START_NS, RANGES)), (1, START_NS, odometry(True, START_NS, 0, (0, 0, 0), 0))])
    taken = bench.write("taken.mcap", b"mine")
    done = bench.run(TOOL, bench.write("x.bag", good), taken)
    with open(taken, "rb") as f:
        check(done.returncode == 1 and "File exists" in done.stderr and f.read() == b"mine", done.stderr)
    _, done = imported(bench, bench.write("x.bag", good + good[13:-9]))
    check("cut off at byte" in done.stderr and "4 pings" not in done.stdout, done.stderr)
    draw = random.Random(SEED)
    more = mcap_bag([("/scan", "sensor_msgs/msg/LaserScan", "")], [(0, START_NS, scan(False, START_NS, RANGES))])
    for i in range(40):
        bad = bytearray(good if i % 2 else more)
        for _ in range(draw.choice((1, 3, 30))):
            bad[draw.randrange(len(bad))] = draw.choice((0, 255, draw.randrange(256)))
        capture = bench.path("fuzzed%d.mcap" % i)
        done = bench.run(TOOL, bench.write("bad", bytes(bad)), capture)
        check(done.returncode in (0, 1) and "Traceback" not in done.stderr, done.stderr)
        check((done.returncode == 0) == os.path.exists(capture), "exit status %d, and a capture or none" % done.returncode)


run([("quay_10_m", same_lines("micron-quay-rosbag/2014-07-18-20-59-31.bag", "micron-quay-rosbag/2014-07-18-20-59-31.csv", 3616)),
     ("quay_20_m", same_lines("micron-quay-rosbag/2014-07-18-21-11-13.bag", "micron-quay-rosbag/2014-07-18-21-11-13.csv", 1690)),
     ("tank", same_lines("micron-tank-rosbag/static_sonar.bag", "micron-tank-rosbag/static_sonar.csv", 553)),
     ("heading_of_the_head_is_no_pose", heading_of_the_head_is_no_pose), ("ros1_forms", ros1_forms), ("covariances_say_what_was_measured", covariances_say_what_was_measured), ("ros2_sqlite", ros2_sqlite),
     ("ros2_mcap", ros2_mcap), ("names_that_write_on_the_terminal", names_that_write_on_the_terminal), ("damaged_chunks", damaged_chunks), ("hostile_tables", hostile_tables), ("work_grows_with_the_file", work_grows_with_the_file), ("chunks_that_unpack_to_much", chunks_that_unpack_to_much), ("too_much", too_much),
     ("hostile_fields", hostile_fields), ("beams_that_are_none", beams_that_are_none),
     ("topics_of_one_name", topics_of_one_name), ("echoes_of_a_ping360", echoes_of_a_ping360), ("refusals", refusals)], parallel=2,
    gate=("tank", "heading_of_the_head_is_no_pose", "ros1_forms", "covariances_say_what_was_measured", "ros2_sqlite", "ros2_mcap", "names_that_write_on_the_terminal", "damaged_chunks", "hostile_tables", "work_grows_with_the_file", "chunks_that_unpack_to_much", "too_much", "hostile_fields", "beams_that_are_none", "topics_of_one_name", "echoes_of_a_ping360", "refusals"))
