#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""sonarctl capture export: what a viewer is shown of a capture is what sonard answers when it replays it."""
import math
import os
import shutil
import signal
import struct
import subprocess
import sys

from voyage import ping360

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "python"))
import mcap_file  # pylint: disable=wrong-import-position
import cdr
import protobuf
from lib import SONARCTL, check, run, until

TURN = 100  # pings
ENDS = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


def round_trip(bench):
    """A turn and a half in a box, and the path of its capture."""
    bench.conf(sonar={"step": "3.6 deg"}, map={"voxel": "0.5 m", "memory": "8 MiB"}, pose={"max_age": "60 s"})
    trip = ping360(bench)
    for _ in range(TURN * 3 // 2 // 5):
        trip.place(1, 2, 5, yaw_deg=30)
        trip.pings(5)
    return trip, trip.end()


def schemas_of(path):
    """Name, encoding and bytes of each schema, by its number, and the number of each topic's."""
    with open(path, "rb") as f:
        data = f.read()
    schemas, channels, at = {}, {}, len(mcap_file.MAGIC)
    while at < len(data) - len(mcap_file.MAGIC):
        opcode, content, at = mcap_file.record_at(data, at)
        number = struct.unpack_from("<H", content)[0]
        if opcode == 3:
            name, here = mcap_file.blob(content, 2)
            encoding, here = mcap_file.blob(content, here)
            schemas[number] = name.decode(), encoding.decode(), mcap_file.blob(content, here)[0]
        elif opcode == mcap_file.CHANNEL:
            topic, _ = mcap_file.blob(content, 4)
            channels[topic.decode()] = struct.unpack_from("<H", content, 2)[0]
    return {topic: schemas[number] for topic, number in channels.items()}


def messages_of(path, decode):
    """topic: [(time in ns, message)], decoded by the schemas of the file."""
    out, schemas = {topic: [] for topic in schemas_of(path)}, schemas_of(path)
    with open(path, "rb") as f:
        for topic, encoding, t_ns, data in mcap_file.Reader(f.read(), lambda problem: check(False, problem)).messages():
            out[topic].append((t_ns, decode(encoding, schemas[topic], data)))
    return out


def of_protobuf(encoding, schema, data):
    check(encoding == schema[1] == "protobuf", "%s: %s" % (schema[0], encoding))
    return protobuf.Schema(schema[2]).read(schema[0], data)


def of_cdr(encoding, schema, data):
    check((encoding, schema[1]) == ("cdr", "ros2msg"), "%s: %s" % (schema[0], encoding))
    return cdr.Schema(schema[0], schema[2]).read(data)


def exported(bench, capture, form, name="out.mcap"):
    path = bench.path(name)
    ran = bench.run(SONARCTL, "capture", "export", form, capture, path)
    check(ran.returncode == 0 and ran.stderr == "", ran.stderr)
    return path


def foxglove(bench):
    trip, capture = round_trip(bench)
    got = messages_of(exported(bench, capture, "--foxglove"), of_protobuf)
    check(len(got["/sonar/ping"]) == trip.made, "%d of %d pings" % (len(got["/sonar/ping"]), trip.made))
    times = [t for t, _ in got["/sonar/ping"]]
    check(times == sorted(set(times)), "pings out of order")
    client = trip.client()
    now_s = client.call("status")["t_unix"]
    check(0 <= now_s - times[-1] * 1e-9 < 1 and abs((times[-1] - times[0]) * 1e-9 - trip.now_s) < 2, "other times")
    t_ns, ping = got["/sonar/ping"][-1]
    check(ping["timestamp"] == {"seconds": t_ns // 10**9, "nanos": t_ns % 10**9} and ping["frame_id"] == "vehicle", ping["timestamp"])
    last = got["/sonard/sectors"][-1][1]
    for asked in (client.call("sectors")["sectors"],):
        check(all(s["state"] == t["state"] and abs(s["free_to_m"] - t["free_to_m"]) < 0.1 for s, t in zip(asked, last["sectors"])), "other sectors")
    check(sum(r < 12 for r in got["/sonard/scan"][-1][1]["ranges"]) > 20, got["/sonard/scan"][-1])
    moved = got["/tf"][-1][1]
    check(moved["translation"] == {"x": 2, "y": 1, "z": -5} and moved["parent_frame_id"] == "map", moved)
    check(abs(2 * math.degrees(math.atan2(moved["rotation"]["z"], moved["rotation"]["w"])) - 60) < 1e-6, moved)
    check(got["/sonar/image"][-1][1]["data"].startswith(b"\x89PNG") and len(got["/sonar/echoes"][-1][1]["data"]) > 17 * 50, "no image or echoes")
    check(2 in got["/map/slice"][-1][1]["data"], "a map without walls")
    check(len(got["/sonard/ring"][-1][1]["entities"][0]["triangles"]) == 3, "no ring")
    check([log["name"] for _, log in got["/sonard/log"]][:2] == ["data", "sonar head"], got["/sonard/log"])


def ros2(bench):
    """The same as messages of ROS 2: what is unknown stays so, and clear water ends where it was judged."""
    trip, capture = round_trip(bench)
    path = exported(bench, capture, "--ros2")
    names = {topic: schema[0] for topic, schema in schemas_of(path).items()}
    check(names == {"/sonar/ping": "sensor_msgs/msg/PointCloud2", "/sonar/echoes": "sensor_msgs/msg/PointCloud2",
                    "/sonar/image": "sensor_msgs/msg/CompressedImage", "/map/slice": "nav_msgs/msg/OccupancyGrid",
                    "/vehicle/pose": "geometry_msgs/msg/PoseStamped", "/tf": "tf2_msgs/msg/TFMessage",
                    "/sonard/scan": "sensor_msgs/msg/LaserScan", "/sonard/log": "rcl_interfaces/msg/Log"}, names)
    got, same = messages_of(path, of_cdr), messages_of(exported(bench, capture, "--foxglove", "again.mcap"), of_protobuf)
    for topic in got:
        check([t for t, _ in got[topic]] == [t for t, _ in same[topic]], "other times of " + topic)
    for (_, cloud), (_, other) in zip(got["/sonar/ping"], same["/sonar/ping"]):
        points = list(struct.iter_unpack("<ffBf", cloud["data"]))
        check([p[:3] for p in points] == list(struct.iter_unpack("<ffB", other["data"])) and all(p[3] == 0 for p in points), "other points")
    check([(f["name"], f["offset"], f["datatype"], f["count"]) for f in cloud["fields"]] ==
          [("x", 0, 7, 1), ("y", 4, 7, 1), ("intensity", 8, 2, 1), ("z", 9, 7, 1)], cloud["fields"])
    check((cloud["height"], cloud["width"], cloud["point_step"], cloud["row_step"]) == (1, len(points), 13, len(cloud["data"])), cloud["width"])
    check(not cloud["is_bigendian"] and cloud["header"]["frame_id"] == "vehicle", cloud["header"])
    stamp = other["timestamp"]
    check(cloud["header"]["stamp"] == {"sec": stamp["seconds"], "nanosec": stamp["nanos"]}, cloud["header"])
    echoes = got["/sonar/echoes"][-1][1]
    check(echoes["point_step"] == 17 and [f["name"] for f in echoes["fields"]] == ["x", "y", "z", "confidence", "doubt"], echoes["fields"])
    t_ns, sectors = same["/sonard/sectors"][-1]
    scan = min(got["/sonard/scan"], key=lambda timed: abs(timed[0] - t_ns))[1]
    check(len(scan["ranges"]) == 72 and abs(scan["angle_min"] + (72 - 1) * scan["angle_increment"] - scan["angle_max"]) < 1e-5, scan["angle_max"])
    check(abs(scan["range_max"] - sectors["distance_m"]) < 1e-5, scan["range_max"])
    for k, sector in enumerate(sectors["sectors"]):
        range_m = scan["ranges"][(72 + 36 - k) % 72]
        check(range_m == math.inf if sector["state"] == "clear" else math.isnan(range_m) if sector["state"] == "unknown"
              else abs(range_m - min(sector["range_m"], sectors["distance_m"])) < 1e-3, "%s: %s" % (sector, range_m))
    grid, other = got["/map/slice"][-1][1], same["/map/slice"][-1][1]
    check(grid["data"] == [(-1, 0, 100)[c] for c in other["data"]] and 100 in grid["data"], "another map")
    check((grid["info"]["width"], grid["info"]["height"]) == (other["column_count"], len(other["data"]) // other["column_count"]), grid["info"])
    check(abs(grid["info"]["resolution"] - 0.5) < 1e-6 and grid["info"]["origin"] == other["pose"], grid["info"])
    moved = got["/tf"][-1][1]["transforms"][0]
    check(moved["transform"]["translation"] == {"x": 2, "y": 1, "z": -5} and moved["child_frame_id"] == "vehicle", moved)
    check(got["/vehicle/pose"][-1][1]["pose"]["orientation"] == moved["transform"]["rotation"], moved)
    check(got["/sonar/image"][-1][1]["format"] == "png" and got["/sonar/image"][-1][1]["data"] == same["/sonar/image"][-1][1]["data"], "image")
    check({log["level"] for _, log in got["/sonard/log"]} <= {20, 30} and got["/sonard/log"][0][1]["name"] == "data", got["/sonard/log"])
    check(len(got["/sonar/ping"]) == trip.made, len(got["/sonar/ping"]))


def refused(bench):
    """What cannot be exported leaves no file, and says why."""
    _, capture = round_trip(bench)
    path = bench.path("out.mcap")
    for arguments, status, why in (([bench.write("text", "no capture"), path], 1, "see above"), (["nowhere.mcap", path], 1, "nowhere.mcap"),
                                   (["--conf", "nowhere.conf", capture, path], 1, "nowhere.conf"), ([capture], 2, "two files"),
                                   ([capture, capture], 1, "File exists; remove it first")):
        ran = bench.run(SONARCTL, "capture", "export", "--foxglove", *arguments)
        check(ran.returncode == status and why in ran.stderr, "%s: %d %s" % (arguments, ran.returncode, ran.stderr))
        check(not os.path.exists(path), "%s leaves a file" % arguments)
    ran = bench.run(SONARCTL, "capture", "export", capture, path)
    check(ran.returncode == 2 and "--foxglove" in ran.stderr, ran.stderr)
    ran = bench.run(SONARCTL, "capture", "export", "--ros2", "--foxglove", capture, path)
    check(ran.returncode == 2 and "only one of" in ran.stderr and not os.path.exists(path), ran.stderr)


def cut_off(bench):
    """Of a capture that is cut all that can be read is exported, and it is said that it is not all."""
    _, capture = round_trip(bench)
    with open(capture, "rb") as f:
        cut = bench.path("cut.mcap")
        with open(cut, "wb") as g:
            g.write(f.read(os.path.getsize(capture) * 9 // 10))
    path = bench.path("out.mcap")
    ran = bench.run(SONARCTL, "capture", "export", "--foxglove", cut, path)
    check(ran.returncode == 1 and "cut.mcap: still being written, or cut off: what can be read is exported" in ran.stderr, ran.stderr)
    check(messages_of(path, of_protobuf)["/sonar/ping"], "what could be read is not there")


def heed_signals():
    """What runs in the background may ignore them."""
    for number in ENDS:
        signal.signal(number, signal.SIG_DFL)


def killed(bench):
    """A signal ends an export: nothing of it is left, neither half a file nor a folder nor a sonard."""
    _, capture = round_trip(bench)
    alone, folder, path = bench.path("alone"), bench.path("tmp"), bench.path("out.mcap")
    for made in (alone, folder):
        os.mkdir(made)
    shutil.copy(SONARCTL, alone)
    with open(os.path.join(alone, "sonard"), "w", encoding="ascii") as f:
        f.write("#!/bin/sh\necho $$ >'%s/pid'\nexec sleep 1000\n" % alone)
    os.chmod(os.path.join(alone, "sonard"), 0o755)
    for number in ENDS:
        with subprocess.Popen((os.path.join(alone, "sonarctl"), "capture", "export", "--ros2", capture, path),
                              env=dict(os.environ, TMPDIR=folder), preexec_fn=heed_signals) as process:  # pylint: disable=subprocess-popen-preexec-fn
            try:
                until(lambda: os.path.exists(os.path.join(alone, "pid")) and os.path.getsize(os.path.join(alone, "pid")), "its sonard")
                check(len(os.listdir(folder)) == 1 and os.path.exists(path + ".part"), os.listdir(folder))
                process.send_signal(number)
                check(process.wait(60) == -number, process.returncode)
            finally:
                process.kill()
        check(os.listdir(folder) == [] and not os.path.exists(path + ".part") and not os.path.exists(path), os.listdir(folder))
        with open(os.path.join(alone, "pid"), encoding="ascii") as f:
            check(not os.path.exists("/proc/" + f.read().strip()), "its sonard is left")
        os.unlink(os.path.join(alone, "pid"))


run([("export_" + f.__name__, f) for f in (foxglove, ros2, refused, cut_off, killed)])
