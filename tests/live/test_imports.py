#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Imported recordings play as they are: with the configuration that the import attached, without a socket, and with the
same times whatever the baud rate of a configuration says. Recordings without a licence are read where they are."""
import glob
import json
import math
import os
import re
import struct

from made_capture import MadeCapture
from lib import ALL, SONARCTL, SONARD, Skipped, check, run
from mavlink_frame import ATTITUDE, HEARTBEAT, SCALED_PRESSURE, SCALED_PRESSURE2, SCALED_PRESSURE3, frame

DATA = os.environ.get("SONARD_DATA", "../shared/data")


def recording(pattern):
    found = glob.glob(os.path.join(DATA, pattern))
    if not found:
        raise Skipped("no recording %s" % pattern)
    return found[0]


def imported(bench, source, *options):
    capture = bench.path("capture.mcap")
    done = bench.run(SONARCTL, "capture", "import", *options, source, capture)
    check(done.returncode == 0, done.stderr)
    return capture, done.stdout


def answers(bench, capture, *options):
    done = bench.run(SONARD, "--replay", capture, "--answers", "-", *options)
    check(done.returncode == 0, done.stderr)
    return [json.loads(line) for line in done.stdout.splitlines()], done.stderr


def plays(source, device):
    def case(bench):
        capture, told = imported(bench, recording(source))
        check("configuration attached: device = " + device in told, told)
        lines, log = answers(bench, capture)
        check(lines and lines[-1]["event"] == "end", str(lines)[:200])
        check("capture_unheard" not in log and "no ping" not in log, log)
        pings = [s for s in lines[-1]["sectors"]["sectors"] if s["age_s"] is not None]
        check(pings, "no direction was ever pinged")
    return case


def baud_rate_does_not_move_pings(bench):
    capture, _ = imported(bench, "tests/replay/box-head.txt", "--sensor", "box")
    seen = []
    for baud in (9600, 921600):
        conf = bench.write("%d.conf" % baud, "[sonar box]\ndevice = ping360\nport = serial:/dev/null:%d\nrange = 2 m\n" % baud)
        seen.append(answers(bench, capture, "-c", conf)[0])
    check(seen[0] == seen[1], "other answers at another baud rate")
    check(any(s["age_s"] is not None for s in seen[0][-1]["sectors"]["sectors"]), "no ping")


def dates_are_kept(bench):
    """A capture has the date of the recording where that has one, in it or, as Ping-Viewer's, in its name."""
    for source, since, meaning in (("imagenex852-echosounder/19_26_51-*.852", "2016-11-18T19:29:10.170Z", "dates taken as UTC"),
                                   ("ping360-openwater-pingviewer/20240814-094253162.bin", "2024-08-14T09:42:53.486Z", "date in the file's name taken as UTC")):
        capture, _ = imported(bench, recording(source))
        info = bench.run(SONARCTL, "capture", "info", capture).stdout
        check("time " + since in info and meaning in info, info)
        os.remove(capture)


def capture_of_another_program_names_the_import(bench):
    log = bench.write("log.bin", b"\0\0\0\x34\0P\0i\0n\0g\0V\0i\0e\0w\0e\0r" + bytes(100))
    done = bench.run(SONARD, "--replay", log)
    check(done.returncode == 1 and done.stderr.count(log) == 1 and "`sonarctl capture import`" in done.stderr, done.stderr)
    path = bench.path("device.mcap")
    made = MadeCapture(path, ("/device_0f8e/Ping360", "json"))
    made.write([(1, 1000, b"{}")])
    made.end()
    done = bench.run(SONARD, "--replay", path)
    check(done.returncode == 1 and "no channel of a sonar" in done.stderr and "`sonarctl capture import`" in done.stderr, done.stderr)


def stay_without_a_socket_says_which_option(bench):
    capture, _ = imported(bench, "tests/replay/box-head.txt")
    conf = bench.write("far.conf", "[sonar sonar]\ndevice = ping360\nport = serial:/dev/null:115200\n[server]\nsocket = /nowhere/s\n")
    done = bench.run(SONARD, "--replay", capture, "-c", conf, "--stay")
    check(done.returncode == 1 and "choose another with --socket PATH" in done.stderr, done.stderr)
    done = bench.run(SONARD, "--replay", capture, "-c", conf)
    check(done.returncode == 0 and "as with --socket none" in done.stderr, done.stderr)


def add_pose(bench, capture, poses, *options):
    posed = bench.path("posed.mcap")
    done = bench.run(SONARCTL, "capture", "add-pose", *options, capture, poses, posed)
    return posed, done


def poses_are_added_and_replayed(bench):
    """The ping's attitude is that of the line; poses of other times stay out; the configuration comes along."""
    capture, _ = imported(bench, "tests/replay/box-head.txt")
    lines = ['{"t_unix":%g,"attitude_deg":[0,0,%d]}' % (t, 90) for t in (1000, 1000.02, 1000.05, 1000.08, 1000.09, 1100)]
    poses = bench.write("poses.jsonl", "\n".join(lines) + "\n")
    posed, done = add_pose(bench, capture, poses)
    check(done.returncode == 1 and "no pose falls into the capture" in done.stderr and "--offset" in done.stderr, done.stderr)
    posed, done = add_pose(bench, capture, poses, "--offset", "-1000")
    check(done.returncode == 0 and "5 poses added, 1 are of other times" in done.stdout, done.stdout + done.stderr)
    seen, log = answers(bench, posed)
    age_s = seen[-1]["sectors"]["pose_age_s"]
    check(age_s is not None and age_s < 0.1, "a pose of %s s: %s" % (age_s, log))
    info = bench.run(SONARCTL, "capture", "info", posed)
    check(info.returncode == 0 and "channel /pose (json): 5 messages" in info.stdout, info.stdout)
    before, _ = answers(bench, capture)
    check(before[-1]["sectors"]["pose_age_s"] is None, "it had poses before")
    again, done = bench.path("again.mcap"), bench.run(SONARCTL, "capture", "add-pose", "--offset", "-1000", posed, poses, bench.path("again.mcap"))
    check(done.returncode == 1 and "has poses of its own" in done.stderr and not os.path.exists(again), done.stderr)
    for text, wanted in (("{}", ":1: expected a JSON object with t_unix"), ("x", ":1: expected"), (lines[1] + "\n" + lines[0], ":2: t_unix is before"),
                         ('{"t_unix":1e300,"depth_m":1}', ":1: t_unix and --offset make"), ("", "no pose in it")):
        _, done = add_pose(bench, capture, bench.write("bad.jsonl", text))
        check(done.returncode == 1 and wanted in done.stderr, "%s: %s" % (text, done.stderr))


def poses_meet_a_capture_whose_clock_was_set(bench):
    """It began in 1970, and the clock was set after 40 s: poses of a right clock meet all of it, those of this computer as well."""
    def made_capture(*notes):
        path = bench.path("late%d.mcap" % len(notes))
        made = MadeCapture(path, ("/head/rx", "octet-stream"), ("/clock", "json"))
        for second in range(100):
            made.write([(1, second * 10**9, b"x")] + [(2, second * 10**9, note.encode()) for at, note in notes if at == second])
        made.end()
        return path
    ahead = 1790000000
    capture = made_capture((40, '{"ahead_ns":%d,"was_ahead_ns":0}' % (ahead * 10**9)))
    info = bench.run(SONARCTL, "capture", "info", capture).stdout
    check("the computer's clock was set at 1970-01-01T00:00:40.000Z by +1790000000.000 s, to 2026-09-21T14:14:00.000Z" in info, info)
    for name, whose, times in (("right", "a clock that was right all the time", [ahead + t for t in range(100)]),
                               ("own", "this computer's clock", list(range(40)) + [ahead + t for t in range(40, 100)])):
        poses = bench.write(name + ".jsonl", "".join('{"t_unix":%d,"depth_m":%d}\n' % (t, i) for i, t in enumerate(times)))
        posed = bench.path(name + ".mcap")
        done = bench.run(SONARCTL, "capture", "add-pose", capture, poses, posed)
        check("100 poses added, 0 are of other times" in done.stdout and "clock was set, by +1790000000.000 s in all" in done.stdout and whose in done.stdout, done.stdout + done.stderr)
        rows = bench.run(SONARCTL, "capture", "export", "--csv", posed).stdout.splitlines()
        got = [(float(t), json.loads(bytes.fromhex(text))) for topic, t, text in (r.split(",") for r in rows if r.startswith("/pose,"))]
        check(len(got) == 100 and all(abs(t - i) < 1e-5 and abs(pose["t_unix"] - i) < 1e-6 and pose["depth_m"] == i for i, (t, pose) in enumerate(got)), str(rows)[:300])
    never = made_capture()
    check("clock was set" not in bench.run(SONARCTL, "capture", "info", never).stdout, "a step from nowhere")
    done = bench.run(SONARCTL, "capture", "add-pose", never, poses, bench.path("never.mcap"))
    check("40 poses added, 60 are of other times" in done.stdout, done.stdout)


def a_log_has_one_clock_all_along(bench):
    """Set by 30 s after 40 s: what a log has of the time before the capture, or of before the step, does not come between."""
    capture = bench.path("stepped.mcap")
    made = MadeCapture(capture, ("/head/rx", "octet-stream"), ("/clock", "json"))
    made.write([(1, (1000 + t) * 10**9, b"x") for t in range(40)] + [(2, 1040 * 10**9, b'{"ahead_ns":30000000000,"was_ahead_ns":0}')] +
               [(1, (1000 + t) * 10**9, b"x") for t in range(40, 101)])
    made.end()
    for whose, times, wanted in (("a clock that was right all the time", range(900, 1300), [(t - 30, t) for t in range(1029, 1131)]),
                                 ("a clock that was right all the time", range(1030, 1131), [(t - 30, t) for t in range(1030, 1131)]),
                                 ("this computer's clock", [*range(900, 1040), *range(1070, 1300)], [(t, t) for t in range(999, 1040)] + [(t - 30, t) for t in range(1070, 1131)]),
                                 ("the capture's own times", range(1000, 1100), [(t, t) for t in range(1000, 1100)])):
        poses = bench.write("poses.jsonl", "".join('{"t_unix":%d,"depth_m":%d}\n' % (t, t) for t in times))
        posed = bench.path("posed%d.mcap" % len(times))
        done = bench.run(SONARCTL, "capture", "add-pose", capture, poses, posed)
        check(whose in done.stdout, "%s: %s" % (whose, done.stdout + done.stderr))
        rows = bench.run(SONARCTL, "capture", "export", "--csv", posed).stdout.splitlines()
        got = [(json.loads(text)["t_unix"], json.loads(text)["depth_m"]) for text in (bytes.fromhex(r.split(",")[2]) for r in rows if r.startswith("/pose,"))]
        check(got == wanted, "%s: %s" % (whose, got))
    poses = bench.write("poses.jsonl", '{"t_unix":5,"depth_m":1}\n{"t_unix":2000,"depth_m":1}\n')
    done = bench.run(SONARCTL, "capture", "add-pose", capture, poses, bench.path("none.mcap"))
    check(done.returncode == 1 and "it is from 1000.000 to 1100.000 s, they are from 5.000 to 2000.000 s" in done.stderr, done.stderr)


def a_later_segment_says_when_the_clock_was_set(bench):
    capture = bench.path("later.mcap")
    made = MadeCapture(capture, ("/head/rx", "octet-stream"), ("/clock", "json"))
    made.write([(1, 10**12, b"x"), (2, 10**12 + 1, b'{"ahead_ns":5000000000,"was_ahead_ns":5000000000}')])
    made.end()
    info = bench.run(SONARCTL, "capture", "info", capture).stdout
    check("the computer's clock had been set by +5.000 s before\n" in info and "clock was set at" not in info, info)


def recording_of_ping_viewer_2_plays_with_its_attitude(bench):
    """Fields as JSON, in another program's MCAP: pings that stand in the grid, each with the attitude of its time."""
    path = bench.path("device.mcap")
    made = MadeCapture(path, ("/device_0f8e/Ping360", "json"), ("/device_0f8e/VehicleData", "json"))
    messages = []
    for i in range(400):
        ping = {"mode": 1, "gain_setting": 1, "angle": i, "transmit_duration": 20, "sample_period": 222, "transmit_frequency": 750,
                "start_angle": 0, "stop_angle": 399, "num_steps": 1, "delay": 0, "number_of_samples": 1200, "data_length": 1200,
                "data": [10] * 600 + [200] * 20 + [10] * 580}
        t_ns = 1750000000 * 10**9 + i * 10**8
        messages += [(1, t_ns, json.dumps(ping).encode()),
                     (2, t_ns, json.dumps({"roll": 0.0, "pitch": 0.001 * i, "yaw": 1.0, "alt": -3.5, "lat": 52.5, "lon": 13.4}).encode())]
    made.write(messages)
    made.end()
    capture, told = imported(bench, path)
    check("device = ping360, range = 5.0 m" in told and "400 pings in 400 records, 39.900 s" in told and "400 poses" in told, told)
    seen, log = answers(bench, capture)
    check(seen[-1]["sectors"]["pose_age_s"] is not None and seen[-1]["sectors"]["pose_age_s"] < 0.2, log)
    check("blocked" in {s["state"] for s in seen[-1]["sectors"]["sectors"]}, "the wall at 2.5 m is not there")
    check("2025-06-15T15:06:40" in bench.run(SONARCTL, "capture", "info", capture).stdout, "the date is not kept")


def echosounder_of_ping_viewer_2_is_held_against_its_profile(bench):
    """It chose 8 m, ever so surely. What it was chosen in ends the free water, and a profile without that echo frees none. Water is told as
    far as sectors are judged, 3.7 m."""
    for echoes, free_to_m, range_m in (((150,), (3.7, 3.7), 8), ((50, 150), (2.8, 3), 3), ((), (0, 0), 8), ((150, 3), (0, 0), 0.7)):
        path, profile = bench.path("device.mcap"), [5] * 200
        for bin_of_it in echoes:
            profile[bin_of_it:bin_of_it + 5] = [250] * 5
        made = MadeCapture(path, ("/device_0f8e/Ping1D", "json"))
        made.write([(1, 1750000000 * 10**9 + i * 10**8, json.dumps({
            "distance": 8000, "confidence": 100, "transmit_duration": 100, "ping_number": 1 + i, "scan_start": 500, "scan_length": 10000,
            "gain_setting": 3, "profile_data_length": 200, "profile_data": profile}).encode()) for i in range(30)])
        made.end()
        capture, told = imported(bench, path)
        check("device = ping1d" in told and "30 pings in 30 records" in told, told)
        ahead = answers(bench, capture)[0][-1]["sectors"]["sectors"][0]
        check(free_to_m[0] <= (ahead["free_to_m"] or 0) <= free_to_m[1], "echoes in %s: %s" % (echoes, ahead))
        check(abs(ahead["range_m"] - range_m) < 0.2, "what it reports is kept: %s" % ahead)
        os.remove(path)
        os.remove(capture)


def cerulean(kind, payload):
    frame = b"BR" + struct.pack("<HHBB", len(payload), kind, 0, 0) + payload
    return frame + struct.pack("<H", sum(frame) & 0xFFFF)


def surveyor(bench, end_m, points, mirror="no"):
    """The sectors after ten pings of a level swath: points of angle (positive to port) and range, by Cerulean's pages."""
    records = b"".join(struct.pack("<ffII", math.radians(angle_deg), 2 * range_m / 1500, 0, 0) for angle_deg, range_m in points)
    atof = b"".join(cerulean(3012, struct.pack("<IQffIIfIHH", 5000 + 100 * k, 0, 2 * end_m / 1500, 1500, k + 1, 240000, 1e-4, 0, len(points), 0) +
                             records) for k in range(10))
    conf = bench.write("swath.conf", "[sonar swath]\ndevice = surveyor\nport = udp:10.0.0.2:1\nrange = 40 m\naperture = 1 20 deg\nmirror = %s\n" % mirror)
    capture, _ = imported(bench, bench.write("swath.svlog", cerulean(10, b"{}") + atof), "--sensor", "swath", "--conf", conf)
    lines, _ = answers(bench, capture)
    return {s["azimuth_deg"]: s for s in lines[-1]["sectors"]["sectors"]}


def surveyor_port_is_port(bench):
    """45 degrees to port are azimuth 315."""
    seen = [azimuth for azimuth, s in surveyor(bench, 30, [(45, 8)]).items() if s["range_m"] is not None]
    check(seen and all(abs(azimuth - 315) <= 10 for azimuth in seen), str(seen))


def surveyor_mirrored(bench):
    seen = [azimuth for azimuth, s in surveyor(bench, 30, [(45, 8)], "yes").items() if s["range_m"] is not None]
    check(seen and all(abs(azimuth - 45) <= 10 for azimuth in seen), str(seen))


def head_mirrored(bench):
    """A head in a channel, mirrored: what was at an azimuth is at its opposite."""
    capture, _ = imported(bench, os.path.abspath("tests/replay/box-head.txt"), "--sensor", "box")
    seen = []
    for mirror in ("no", "yes"):
        conf = bench.write(mirror + ".conf", "[sonar box]\ndevice = ping360\nport = serial:/dev/null:115200\nrange = 2 m\nmirror = %s\n" % mirror)
        lines, _ = answers(bench, capture, "-c", conf)
        seen.append({s["azimuth_deg"] for s in lines[-1]["sectors"]["sectors"] if s["age_s"] is not None})
    check(seen[0] and seen[0] != seen[1] and {-azimuth % 360 for azimuth in seen[0]} == seen[1], str(seen))


def surveyor_hears_from_its_start(bench):
    """It records nothing nearer than 5 % of its end, 2 m of 40 m."""
    ahead = surveyor(bench, 40, [(angle / 2, 12) for angle in range(-120, 121)])[0]
    check(1.9 < ahead["blind_to_m"] < 2.3 and ahead["range_m"] == 12, str(ahead))


def poses_of_a_tlog(bench):
    """A vehicle that floats: attitudes at 20 Hz and positions, their times within the log."""
    log = recording("mavlink-bluerov2-tlog/small.tlog")
    done = bench.run("python/sonard-poses", log)
    check(done.returncode == 0, done.stderr)
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    attitudes = [line for line in lines if "attitude_deg" in line]
    check(len(attitudes) > 4000 and any("position_m" in line for line in lines), done.stderr)
    check(all(abs(a["attitude_deg"][0]) < 45 for a in attitudes), "it did not lie on its side")
    times = [line["t_unix"] for line in lines]
    check(times == sorted(times) and 250 < times[-1] - times[0] < 270, "%g s" % (times[-1] - times[0]))
    capture, _ = imported(bench, recording("ping360-openwater-pingviewer/20240814-094253162.bin"))
    posed, done = add_pose(bench, capture, bench.write("poses.jsonl", "".join(json.dumps(line) + "\n" for line in lines)),
                           "--offset", "%.6f" % -(times[0] - 1723628573.3))
    check(done.returncode == 0, done.stderr)
    seen, said = answers(bench, posed)
    check(seen[-1]["sectors"]["pose_age_s"] < 1 and "capture_pose" not in said and "/pose:" not in said, said)


def depths_of_a_tlog(bench):
    """Depth is from the barometer in the water: the one that reads what no hull holds, or the one that is named."""
    def depths(hpa, *options):
        data = struct.pack(">Q", 1700000000000000) + frame(HEARTBEAT, struct.pack("<IBBBBB", 0, 12, 3, 81, 4, 3), 0)
        for i in range(6):
            for message, reading in zip((SCALED_PRESSURE, SCALED_PRESSURE2, SCALED_PRESSURE3), hpa):
                data += struct.pack(">Q", 1700000001000000 + i * 100000) + frame(message, struct.pack("<Iffh", 100 * i, reading, 0, 2000), i)
        done = bench.run("python/sonard-poses", "--surface-pressure", "1013.25", *options, bench.write("log.tlog", data))
        return [json.loads(line)["depth_m"] for line in done.stdout.splitlines()], done.stderr

    for hpa, options, depth_m, said in (((1013, 1016, 1600), (), 5.8373, "depth from barometer 3"), ((1013, 1600), (), 5.8373, "depth from barometer 2"),
                                        ((1600,), (), 5.8373, "barometer 1"), ((1013, 1016, 1600), ("--barometer", "2"), 0.0274, ""),
                                        ((1013, 1016), ("--barometer", "2"), 0.0274, ""), ((1013, 1600, 1610), (), 5.8373, "barometer 2"),
                                        ((1013, 1016), (), None, "no depth: none of its barometers (1: up to 1013 hPa, 2: up to 1016 hPa) reads 1300 hPa"),
                                        ((1013, 1600, 2000), (), None, "no depth: barometers 2 and 3 are both in the water and disagree (up to 1600 and 2000 hPa)"),
                                        ((1013, 1016), ("--barometer", "3"), None, "barometer 3 sends nothing")):
        got, stderr = depths(hpa, *options)
        check(got == ([depth_m] * 6 if depth_m else []) and said in stderr, "%s %s: %s %s" % (hpa, options, got, stderr))


def poses_of_a_tlog_beside_a_viewer_log(bench):
    """The name of a Ping-Viewer log is its date, in a time zone that nothing says but the tlog of the same dive. An import that is told
    the zone is dated as the tlog is."""
    def tlog(name, begin, seconds):
        data = b""
        for i in range(101):
            stamp = struct.pack(">Q", round((begin + seconds * i / 100) * 1e6))
            data += stamp + frame(HEARTBEAT, struct.pack("<IBBBBB", 0, 12, 3, 81, 4, 3), i)
            data += stamp + frame(ATTITUDE, struct.pack("<Iffffff", i, 0, 0, 0.01 * i, 0, 0, 0), i)
        return bench.write(name, data)

    def text(s):
        return struct.pack(">I", 2 * len(s)) + s.encode("utf-16-be")
    payload = struct.pack("<BBHHHHHHH", 1, 1, 100, 11, 88, 750, 200, 200, 200) + bytes(200)
    ping = b"BR" + struct.pack("<HHBB", len(payload), 2300, 2, 0) + payload
    ping += struct.pack("<H", sum(ping))
    begun = 1723612373.0  # 2024-08-14 05:12:53 UTC
    name = "20240814-084253000.bin"  # at UTC+3:30, in the digits of the PC's language:
    for digits in (name, name.translate({ord("0") + i: 0x6f0 + i for i in range(10)})):
        log = bench.write(digits, text("PingViewer sensor log file") + struct.pack(">i", 1) + 5 * text("x") + struct.pack(">ii", 1, 2) +
                          b"".join(text("00:00:%02d.500" % i) + struct.pack(">I", len(ping)) + ping for i in range(20)))
        capture, _ = imported(bench, log)
        dive = tlog("dive.tlog", begun - 10, 40)
        done = bench.run("python/sonard-poses", "--beside", log, dive)
        check(done.returncode == 0 and "taken as UTC+3:30" in done.stderr, done.stderr)
        lines = [json.loads(line) for line in done.stdout.splitlines()]
        check(abs(lines[0]["t_unix"] - 1723624973) < 1e-3 and abs(lines[0]["attitude_deg"][2] - math.degrees(0.25)) < 1e-3, str(lines[0]))
        posed, done = add_pose(bench, capture, bench.write("poses.jsonl", "".join(json.dumps(line) + "\n" for line in lines)))
        check(done.returncode == 0, done.stderr)
        check(answers(bench, posed)[0][-1]["sectors"]["pose_age_s"] < 1, "the poses are of another time")
        os.remove(capture)
        os.remove(posed)
        capture, told = imported(bench, log, "--zone", "3:30")
        done = bench.run("python/sonard-poses", dive)
        posed, done = add_pose(bench, capture, bench.write("poses.jsonl", done.stdout))
        check(done.returncode == 0 and answers(bench, posed)[0][-1]["sectors"]["pose_age_s"] < 1, done.stderr)
        os.remove(capture)
        os.remove(posed)
    for begin, seconds, options, status, wanted in (
            (begun - 10, 40, ("--zone", "3:30"), 0, "taken as UTC+3:30"),
            (begun - 10, 40, ("--zone", "2"), 1, "was started at no time of this log, in UTC+2:00"),
            (begun - 4000, 40, (), 1, "was started at no time of this log, whatever the time zone"),
            (begun - 1800, 7200, (), 1, "may have been started in UTC+2:00, UTC+3:00, UTC+3:30"),
            (begun - 1800, 7200, ("--zone", "3:30"), 0, "taken as UTC+3:30"),
            (begun, 40, ("--zone", "east"), 2, "wanted hours from UTC")):
        done = bench.run("python/sonard-poses", "--beside", log, *options, tlog("dive.tlog", begin, seconds))
        check(done.returncode == status and wanted in done.stderr, "%s: %s" % (options, done.stderr))
    done = bench.run("python/sonard-poses", "--beside", "dive.bin", dive)
    check(done.returncode == 1 and "no date in its name" in done.stderr, done.stderr)


def poses_of_a_dataflash_log(bench):
    """A log written here as the format has it: FMT, GPS, ATT, XKF1, and garbage between them."""
    def fmt(kind, name, form, labels, length):
        return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, length, name, form, labels)
    data = (fmt(10, b"GPS", b"QBIH", b"TimeUS,Status,GMS,GWk", 18) + fmt(11, b"ATT", b"Qccc", b"TimeUS,Roll,Pitch,Yaw", 17) +
            fmt(12, b"XKF1", b"QBffffff", b"TimeUS,C,PN,PE,PD,VN,VE,VD", 36) +
            b"\xa3\x95\x0a" + struct.pack("<QBIH", 2000000, 3, 1000, 2200) + b"rubbish" +
            b"\xa3\x95\x0b" + struct.pack("<Qhhh", 3000000, 150, -250, 9000) +
            b"\xa3\x95\x0c" + struct.pack("<QBffffff", 4000000, 0, 1, 2, 3, 0.5, 0, 0) +
            b"\xa3\x95\x0c" + struct.pack("<QBffffff", 4000000, 1, 9, 9, 9, 9, 9, 9) + b"\xa3\x95\x0b\x00")
    log = bench.write("log.bin", data)
    done = bench.run("python/sonard-poses", log)
    zero = 315964800 + 2200 * 604800 + 1 - 18 - 2
    check(done.returncode == 0 and [json.loads(line) for line in done.stdout.splitlines()] == [
        {"t_unix": zero + 3.0, "attitude_deg": [1.5, -2.5, 90.0]},
        {"t_unix": zero + 4.0, "position_m": [1.0, 2.0, 3.0], "velocity_mps": [0.5, 0.0, 0.0]}], done.stdout + done.stderr)
    check("nothing tells whether its positions were measured" in done.stderr, done.stderr)
    done = bench.run("python/sonard-poses", "--no-position", log)
    check("position_m" not in done.stdout and "bytes are no message" in done.stderr, done.stderr)
    for text, wanted in ((b"hello, world", "neither a MAVLink"), (data[:89], "no pose in it")):
        done = bench.run("python/sonard-poses", bench.write("bad.bin", text))
        check(done.returncode == 1 and wanted in done.stderr, done.stderr)


def kept(bench, log, *options):
    """What sonard-poses makes of the positions of a log: the parts that are there, by the second; and what it says."""
    done = bench.run("python/sonard-poses", *options, bench.write("kept.log", log))
    check(done.returncode == 0, done.stderr)
    poses = [json.loads(line) for line in done.stdout.splitlines()]
    return [(round(p["t_unix"]), "".join(sorted(k[0] for k in p if k != "t_unix"))) for p in poses if "attitude_deg" not in p], done.stderr


def unmeasured_positions_of_a_dataflash_log(bench):
    """XKF4.SS says what was measured, XKF4.PI whose estimate flies; a status that has stopped confirms nothing."""
    def fmt(kind, name, form, labels, length):
        return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, length, name, form, labels)

    def place(second, core, north=1):
        return b"\xa3\x95\x0c" + struct.pack("<QBffffff", second * 1000000, core, north, 2, 3, 0.5, 0, 0)

    def status(second, core, flags, primary):
        return b"\xa3\x95\x0d" + struct.pack("<QBIb", second * 1000000, core, flags, primary)
    head = (fmt(12, b"XKF1", b"QBffffff", b"TimeUS,C,PN,PE,PD,VN,VE,VD", 36) + fmt(13, b"XKF4", b"QBIb", b"TimeUS,C,SS,PI", 17))
    states = ((0x100A7, "d"), (0x1033F, "pv"), (0x2F, "pv"), (0x27, "dv"), (0x1033F | 0x80, "d"), (0x3D, "p"), (0x327, "dv"), (0, ""))
    log = head + b"".join(place(s, 0) + status(s, 0, flags, 0) for s, (flags, _) in enumerate(states, 1))
    seen, said = kept(bench, log, "--start", "0")
    check(seen == [(s, parts) for s, (_, parts) in enumerate(states, 1) if parts], (seen, said))
    check("left out 5 of 8 positions, which nothing measured (XKF4)" in said, said)
    both = head + b"".join(place(s, 0) + place(s, 1, 9) + status(s, 0, 0x33F if s < 3 else 0xA7, int(s > 1)) + status(s, 1, 0x33F, int(s > 1))
                           for s in range(1, 5))
    done = bench.run("python/sonard-poses", "--start", "0", bench.write("both.bin", both))
    check([json.loads(line)["position_m"][0] for line in done.stdout.splitlines()] == [1.0, 9.0, 9.0, 9.0], done.stdout + done.stderr)
    stopped = head + status(1, 0, 0x33F, 0) + b"".join(place(s, 0) for s in range(1, 9))
    check([s for s, _ in kept(bench, stopped, "--start", "0")[0]] == [1, 2, 3, 4], kept(bench, stopped, "--start", "0"))
    for north, parts, told in ((1, "d", "left out 12 positions, which never change"), (0.1, "pv", "nothing tells whether")):
        still = head + b"".join(place(s, 0, north if parts == "d" else north * s) for s in range(1, 13))
        seen, said = kept(bench, still, "--start", "0")
        check(seen == [(s, parts) for s in range(1, 13)] and told in said, (seen, said))


def poses_of_the_recorder_of_blueos(bench):
    """Documents on the topic mavlink/out, flags in any of their forms; what another component says, or is no number, is no pose."""
    path, messages, start_ns = bench.path("blueos.mcap"), [], 1790000000 * 10**9

    def say(second, kind, component=1, **fields):
        o = {"header": {"system_id": 1, "component_id": component, "sequence": 0}, "message": {"type": kind, "time_boot_ms": 1000 * second, **fields}}
        messages.append((1, start_ns + second * 10**9, json.dumps(o).encode()))

    def turned(second, yaw, component=1):
        say(second, "ATTITUDE", component, roll=0.0, pitch=0.1, yaw=yaw, rollspeed=0.0, pitchspeed=0.0, yawspeed=0.0)
    say(0, "HEARTBEAT", 1, custom_mode=0, mavtype={"type": "MAV_TYPE_GCS"}, autopilot={"type": "MAV_AUTOPILOT_INVALID"})
    turned(0, 1.0)
    say(1, "HEARTBEAT", 1, custom_mode=0, mavtype={"type": "MAV_TYPE_SUBMARINE"}, autopilot={"type": "MAV_AUTOPILOT_ARDUPILOTMEGA"})
    turned(1, math.pi / 2)
    turned(2, 1.0, 154)  # a gimbal
    turned(2, None)
    messages.append((1, start_ns + 2 * 10**9, b"nonsense"))
    messages.append((2, start_ns + 2 * 10**9, b"{}"))
    for second, flags in ((3, 831), (4, {"bits": 167}), (5, "EKF_ATTITUDE | EKF_VELOCITY_HORIZ | EKF_VELOCITY_VERT | EKF_POS_HORIZ_ABS"), (6, "ESTIMATOR_CONST_POS_MODE")):
        say(second, "EKF_STATUS_REPORT", flags=flags)
        say(second, "LOCAL_POSITION_NED", x=1.0, y=second, z=3.0, vx=0.5, vy=0.0, vz=0.0)
        say(second, "SCALED_PRESSURE2", press_abs=1600.0, press_diff=0.0, temperature=2000)
        say(second, "SCALED_PRESSURE2", press_abs=1600.0, press_diff=0.0, temperature=2000)
    made = MadeCapture(path, ("mavlink/out", "json"), ("video", "json"))
    made.write(messages)
    made.end()
    done = bench.run("python/sonard-poses", "--surface-pressure", "1013.25", path)
    poses = [json.loads(one) for one in done.stdout.splitlines()]
    check(done.returncode == 0 and [p for p in poses if "attitude_deg" in p] == [{"t_unix": 1790000001.0, "attitude_deg": [0.0, 5.729578, 90.0]}], done.stdout + done.stderr)
    check([p["position_m"] for p in poses if "position_m" in p] == [[1.0, 3, 3.0], [1.0, 5, 3.0]] and "left out 2 of 4 positions" in done.stderr, done.stdout + done.stderr)
    check([p["depth_m"] for p in poses if "depth_m" in p] == [5.8373] * 4 and "bytes are no message" in done.stderr, done.stdout)
    with open(path, "rb") as f:
        whole = f.read()
    done = bench.run("python/sonard-poses", bench.write("cut.mcap", whole[:len(whole) // 2]))
    check(done.returncode in (0, 1) and "Traceback" not in done.stderr, done.stderr)


def drag_of_a_coasting_vehicle(bench):
    """Runs of a vehicle whose drag is known, pitched and with an accelerometer that is off: the drag found is no more, and not much
    less. What is no run is told, and gives no option."""
    head = b"".join(struct.pack("<BBBBB4s16s64s", 0xA3, 0x95, 128, kind, 3 + struct.calcsize("<" + form), name, code, labels)
                    for kind, name, form, code, labels in (
                        (130, b"ATT", "Qhhh", b"Qccc", b"TimeUS,Roll,Pitch,Yaw"), (131, b"RCOU", "Q4H", b"QHHHH", b"TimeUS,C1,C2,C3,C4"),
                        (132, b"IMU", "QB3f", b"QBfff", b"TimeUS,I,AccX,AccY,AccZ")))

    def log(square_n, runs, coast_s=30, mass=15.0):
        out, v, t = [head], 0.0, 0.0
        for at_s in [k * (8 + coast_s) for k in range(runs)]:
            while t < at_s + 8 + coast_s:
                driven = at_s + 6 <= t < at_s + 8
                a = ((80.0 if driven else 0.0) - square_n * v * abs(v)) / mass
                v, t = v + a * 0.04, t + 0.04
                pitch, us = math.radians(2), int(t * 1e6)
                out.append(struct.pack("<BBBQhhh", 0xA3, 0x95, 130, us, 0, 200, 0))
                out.append(struct.pack("<BBBQ4H", 0xA3, 0x95, 131, us, *[1650 if driven else 1500] * 4))
                out.append(struct.pack("<BBBQB3f", 0xA3, 0x95, 132, us, 0, (a + 0.03 + 0.001 * t) * math.cos(pitch) + 9.81 * math.sin(pitch), 0.05,
                                       -9.81 * math.cos(pitch) + a * math.sin(pitch)))
        return bench.write("coast.bin", b"".join(out))
    for square_n in (14, 30, 60):
        done = bench.run("python/sonard-poses", "--drag", "15", log(square_n, 2))
        found = re.search(r"^--drag 0,([0-9.]+)$", done.stdout, re.M)
        check(done.returncode == 0 and found and done.stdout.count("half of it after") == 2, done.stdout + done.stderr)
        check(0.6 * square_n <= float(found.group(1)) <= square_n, "%d N: %s" % (square_n, done.stdout))
    done = bench.run("python/sonard-poses", "--drag", "15", log(30, 1, coast_s=8))
    check(done.returncode == 1 and "left out, needs 5 s" in done.stdout and "no coasting run" in done.stderr, done.stdout + done.stderr)
    done = bench.run("python/sonard-poses", "--drag", "15", bench.write("x.bin", b"nonsense"))
    check(done.returncode == 1 and "no DataFlash log" in done.stderr, done.stderr)


def unmeasured_positions_of_a_tlog(bench):
    """EKF_STATUS_REPORT and PX4's ESTIMATOR_STATUS; a log without either is taken with a warning."""
    def packet(second, message, extra, payload):
        payload = payload.rstrip(b"\0") or b"\0"
        head = struct.pack("<BBBBBBB", len(payload), 0, 0, 0, 1, 1, message & 255) + (message >> 8).to_bytes(2, "little")
        crc = 0xFFFF
        for byte in head + payload + bytes([extra]):
            byte ^= crc & 0xFF
            byte ^= (byte << 4) & 0xFF
            crc = (crc >> 8) ^ (byte << 8) ^ (byte << 3) ^ (byte >> 4)
        return (second * 10 ** 6).to_bytes(8, "big") + b"\xfd" + head + payload + struct.pack("<H", crc)

    def place(second):
        return packet(second, 32, 185, struct.pack("<I6f", 1000 * second, 1, 2, 3, 0.5, 0, 0))
    beat = packet(1, 0, 50, struct.pack("<IBBBBB", 0, 12, 3, 0, 4, 3))
    for report in (lambda s, flags: packet(s, 193, 71, struct.pack("<5fHf", 0, 0, 0, 0, 0, flags, 1)),
                   lambda s, flags: packet(s, 230, 163, struct.pack("<Q8fH", 1, 0, 0, 0, 0, 0, 0, 0, 0, flags))):
        log = beat + b"".join(report(s, flags) + place(s) for s, flags in ((1, 831), (2, 167), (3, 0x27), (4, 0x3D), (5, 831)))
        log += b"".join(place(s) for s in (6, 8, 9, 12))
        seen, said = kept(bench, log)
        check(seen == [(1, "pv"), (3, "v"), (4, "p"), (5, "pv"), (6, "pv"), (8, "pv")], (seen, said))
        check("left out 4 of 9 positions" in said, said)
    seen, said = kept(bench, beat + place(1) + place(2))
    check(seen == [(1, "pv"), (2, "pv")] and "no EKF_STATUS_REPORT or ESTIMATOR_STATUS" in said, (seen, said))


def constant_position_of_a_real_log(bench):
    """ArduSub 4.1: the estimator held a constant position throughout; attitude and depth are all there is."""
    done = bench.run("python/sonard-poses", recording("ardusub-dataflash/small.BIN"))
    poses = [json.loads(line) for line in done.stdout.splitlines()]
    check(sum("attitude_deg" in p for p in poses) == 237 and sum("depth_m" in p for p in poses) == 237, done.stderr)
    check(not any("position_m" in p or "velocity_mps" in p for p in poses), "a position that nothing measured")
    check("left out 237 of 237 positions" in done.stderr, done.stderr)


ROV_HEAD = "2017.11.02 09.00.09.500;10.3.0.40;13102;"
ROV_LINE = "2017.11.02 09.00.%02d.500;10.3.0.40;13102;%s\r\n"


def poses_of_a_relay(bench):
    """The $ROV lines of the log that the sonar's bytes come from: they fit without an offset, and turn the picture."""
    def line(second, sentence):
        return ROV_LINE % (second, " ".join("%02X" % c for c in sentence.encode()))
    made = bench.write("relay.csv", line(1, "$ROV,72.4,-1.0,-3.7,341.6,0.0,61.5,2.2,*\r\n") + line(2, "$ROV,72.4,x,-3.7,341.6,*") + "nonsense\n" +
                       line(3, "$GPS,1") + line(4, "$ROV,72.5,nan,0,340,0,0,0,*"))
    done = bench.run("python/sonard-poses", made)
    zero = 1509613200.5  # 2017-11-02 09:00:00.5 UTC
    check([json.loads(one) for one in done.stdout.splitlines()] == [
        {"t_unix": zero + 1, "attitude_deg": [-1.0, -3.7, 72.4]}, {"t_unix": zero + 1, "depth_m": 341.6}, {"t_unix": zero + 4, "depth_m": 340.0}],
        done.stdout + done.stderr)
    check("bytes are no message" in done.stderr, done.stderr)
    for long in (" " * 300000 + "x", "20" * 9000, "20 " * 4096):
        done = bench.run("python/sonard-poses", bench.write("long.csv", line(1, "$ROV,72.4,-1.0,-3.7,341.6,*") + ROV_HEAD + long + "\n"), limit_s=20)  # no quadratic time
        check(done.returncode == 0 and "%d bytes are no message" % len(ROV_HEAD + long + "\n") in done.stderr, done.stderr)
    log = recording("tritech-seanet-rov-seabed/UdpHubLog*.csv")
    capture, _ = imported(bench, log)
    done = bench.run("python/sonard-poses", log)
    check(done.returncode == 0, done.stderr)
    posed, done = add_pose(bench, capture, bench.write("poses.jsonl", done.stdout))
    check(done.returncode == 0 and "588 poses added, 0 are of other times" in done.stdout, done.stdout + done.stderr)
    seen, said = answers(bench, posed)
    check(seen[-1]["sectors"]["pose_age_s"] < 1, said)


run([("poses_of_a_relay", poses_of_a_relay), ("poses_are_added_and_replayed", poses_are_added_and_replayed), ("poses_meet_a_capture_whose_clock_was_set", poses_meet_a_capture_whose_clock_was_set), ("a_log_has_one_clock_all_along", a_log_has_one_clock_all_along),
     ("a_later_segment_says_when_the_clock_was_set", a_later_segment_says_when_the_clock_was_set), ("poses_of_a_tlog", poses_of_a_tlog),
     ("depths_of_a_tlog", depths_of_a_tlog), ("poses_of_a_tlog_beside_a_viewer_log", poses_of_a_tlog_beside_a_viewer_log), ("poses_of_a_dataflash_log", poses_of_a_dataflash_log),
     ("unmeasured_positions_of_a_dataflash_log", unmeasured_positions_of_a_dataflash_log), ("poses_of_the_recorder_of_blueos", poses_of_the_recorder_of_blueos), ("drag_of_a_coasting_vehicle", drag_of_a_coasting_vehicle), ("unmeasured_positions_of_a_tlog", unmeasured_positions_of_a_tlog),
     ("constant_position_of_a_real_log", constant_position_of_a_real_log), ("text_dump", plays(os.path.abspath("tests/replay/box-head.txt"), "ping360")),
     ("ping_viewer", plays("ping360-openwater-pingviewer/20240814-094253162.bin", "ping360")),
     ("ping_viewer_at_60_m", plays("ping360-openwater-pingviewer/20240814-094407726.bin", "ping360, range = 50.0 m")),
     ("seanet_relay", plays("tritech-seanet-rov-seabed/UdpHubLog*.csv", "micron")),
     ("seanet_raw", plays("tritech-v4log-target/*.rebuilt.stream", "micron")),
     ("ping_viewer_2", recording_of_ping_viewer_2_plays_with_its_attitude),
     ("ping_viewer_2_echosounder", echosounder_of_ping_viewer_2_is_held_against_its_profile),
     ("dates_are_kept", dates_are_kept),
     ("surveyor_port_is_port", surveyor_port_is_port), ("surveyor_mirrored", surveyor_mirrored), ("head_mirrored", head_mirrored), ("surveyor_hears_from_its_start", surveyor_hears_from_its_start),
     ("imagenex", plays("imagenex852-echosounder/hydroball.852", "imagenex852")),
     ("baud_rate_does_not_move_pings", baud_rate_does_not_move_pings),
     ("capture_of_another_program_names_the_import", capture_of_another_program_names_the_import),
     ("stay_without_a_socket_says_which_option", stay_without_a_socket_says_which_option)], parallel=2, gate=ALL)
