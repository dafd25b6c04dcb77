#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The formats that sonard-import reads, made here and broken here: which bytes come out of them at which time, what is left out and
how that is told. Recordings that ship in tests/live/recordings are broken at random: the import never fails but with a sentence."""
import contextlib
import glob
import gzip
import importlib.machinery
import importlib.util
import io
import json
import os
import random
import re
import shutil
import struct
import sys
import types
import zlib

from made_capture import MadeCapture
from lib import ALL, SEED, SONARCTL, check, run

TOOL = os.path.abspath("python/sonard-import")


def loaded():
    loader = importlib.machinery.SourceFileLoader("sonard_import", TOOL)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("sonard_import", loader))
    loader.exec_module(module)
    return module


tool = loaded()
MS = 10**6


class Heard:
    """What a recording hands on: records (time, bytes), poses, sentences; and the pings in them."""

    def __init__(self, data, name="x", zone=None):
        self.records, self.poses, self.problems, self.left_out_bytes = [], [], [], 0
        self.kind = tool.kind_of(data)
        self.recording = self.kind(data, name, zone) if self.kind else None
        if self.recording:
            self.recording.read(self)
        times = self.times()
        check(times == sorted(times), "times fall")

    def bytes(self, t_ns, data, _goes_on=False):
        self.records.append((t_ns, bytes(data)))

    def pose(self, t_ns, line):
        self.poses.append((t_ns, line))

    def problem(self, sentence):
        self.problems.append(sentence)

    def times(self):
        return [t for t, _ in self.records]

    def joined(self):
        return b"".join(data for _, data in self.records)

    def pings(self):
        """The angles of the Ping360's messages in it."""
        parser = tool.PingParser(1300)
        return [struct.unpack_from("<H", payload, 2)[0] for message, payload, _ in parser.feed(self.joined()) if message == 2300]


class Refusing(Heard):
    """With the sentence with which it refuses."""

    def __init__(self, data):
        self.refused = ""
        try:
            super().__init__(data)
        except tool.Refused as fault:
            self.refused = str(fault)


def times_of_day(_bench):
    for zero in (0x30, 0x660, 0x6f0, 0x966, 0xff10, 0x11136, 0x1e950):
        text = "".join(chr(zero + int(c)) if c.isdigit() else c for c in "01:23:45.679")
        check(tool.clock_ns(text) == ((1 * 60 + 23) * 60 + 45) * 10**9 + 679 * MS, "%x" % zero)
    for text in ("", "00:00:00", "00:00:00.1", "24:00:00.000", "00:60:00.000", "00:00:60.000", "a", "000000.000", "00:00:00.0000", "0:00:00.000 ",
                 "-1:00:00.000", "000000000000"):
        check(tool.clock_ns(text) is None, text)


# ---- text dumps ----

HEAD = "ID: 2300 - device_data\nHeader: payload_length: 17 src_device_id: 2 dst_device_id: 0\n"
FIELDS = ("  - mode: 1\n  - gain_setting: 0\n  - angle: 200\n  - transmit_duration: 11\n  - sample_period: 88\n"
          "  - transmit_frequency: 750\n  - number_of_samples: 3\n")
LENGTH = "  - data_length: 3\n"


def text_dumps(_bench):
    with open("tests/replay/box-head.txt", "rb") as f:
        text = f.read()
    heard = Heard(text)
    check(heard.pings() == [150, 151, 152] and len(heard.records) == 3 and not heard.problems, heard.problems)  # checksums are those of the dump
    check(heard.times()[2] - heard.times()[0] == 2 * (1200 * 90 * 25 + tool.PACE_NS) and heard.recording.times_made_up, heard.times())
    for cut in range(len(text) - 20000, len(text), 173):
        check(len(Heard(text[:cut]).pings()) == text[:cut].count(b"\nChecksum: "), "cut at %d" % cut)
    for text, pings, problem in (
            (HEAD + FIELDS + LENGTH + "  - data: ['0x01', '0xff', '0x3']\nChecksum: ", 1, ""),
            ("timestamp: '\\x000\\x000:00:02.103'\n" + HEAD + FIELDS + LENGTH + "  - data: []\nChecksum: ", 1, ""),
            (HEAD + FIELDS + LENGTH + "Checksum: 1", 0, "message at offset 0 is left out (262 bytes): a field is missing, not a number, or too large"),
            (HEAD + FIELDS + "  - data_length: 65536\n  - data: []\nChecksum: 1", 0,
             "message at offset 0 is left out (279 bytes): a field is missing, not a number, or too large"),
            (HEAD + FIELDS + LENGTH + "  - data: []\nChecksum: 1", 1, "message at offset 0: the dump does not hold all its bytes, its checksum differs"),
            (HEAD + FIELDS + LENGTH + "  - data: ['0x", 0, "message at offset 0 is left out (265 bytes): the file ends within it"),
            (HEAD + FIELDS + LENGTH + "  - data: []\n" + HEAD + FIELDS + LENGTH + "  - data: []\nChecksum: ", 1,
             "message at offset 0 is left out (264 bytes): it has no checksum line"),
            ("ID: 4 - device_information\nChecksum: 1\n" + HEAD + FIELDS + LENGTH + "  - data: []\nChecksum: ", 1,
             "1 messages that are not device_data are left out"),
            (HEAD + FIELDS + LENGTH + "  - data: [" + "'0x11', " * 3000 + "]\nChecksum: 1\n", 0, "a field is missing, not a number, or too large")):
        heard = Heard(text.encode())
        check(len(heard.pings()) == pings and (problem in heard.problems[0] if problem else not heard.problems), (text[:300], heard.problems))
    check(Heard((HEAD + FIELDS + LENGTH + "  - data: ['0x01', '0xff', '0x3']\nChecksum: ").encode()).records[0][1][-5:-2] == b"\x01\xff\x03", "samples")


# ---- Ping-Viewer logs ----

def wide(s):
    encoded = s.encode("utf-16-be")
    return struct.pack(">I", len(encoded)) + encoded


LOG_HEAD = wide("PingViewer sensor log file") + struct.pack(">i", 1) + 2 * wide("something") + wide("v2.1.0") + 2 * wide("something") + struct.pack(">ii", 1, 2)


def entry(clock, data, zero=0x30):
    return wide("".join(chr(zero + int(c)) if c.isdigit() else c for c in clock)) + struct.pack(">I", len(data)) + data


def ping(angle):
    return tool.ping360_frame(1, 0, angle, 11, 88, 750, 5, 5, b"\x09BR\x08\x07")


def viewer_logs(_bench):
    """Two frames cut over three records, in Persian digits; cut anywhere; past midnight, with a bad clock, with a lie about a length."""
    both = ping(135) + ping(136)
    log = LOG_HEAD + entry("00:00:01.250", both[:5], 0x6f0) + entry("00:00:01.260", both[5:-4], 0x6f0) + entry("00:01:00.007", both[-4:], 0x6f0)
    heard = Heard(log)
    check(heard.pings() == [135, 136] and heard.times() == [1250 * MS, 1260 * MS, 60007 * MS] and not heard.problems, (heard.times(), heard.problems))
    for n in range(1, len(log)):
        heard = Refusing(log[:n])
        check(len(heard.records) < 3 and (heard.refused or n >= len(LOG_HEAD) or not heard.kind), n)
    heard = Heard(LOG_HEAD + b"".join(entry(clock, b"") for clock in ("23:59:59.999", "00:00:00.001", "nonsense", "00:00:00.000")))
    check(len(heard.records) == 4 and heard.times()[3] - heard.times()[0] == 2 * MS, heard.times())
    check(heard.problems == ["1 records without a readable time have that of the one before"], heard.problems)
    heard = Heard(log + wide("00:01:01.000") + struct.pack(">I", 0x7FFFFFFF))
    check(heard.problems == ["offset %d: no whole record; the last 32 bytes are left out" % len(log)], heard.problems)


def broken_viewer_logs(_bench):
    """Whatever bit is flipped of a record's two lengths, no ping is lost, and none behind it gets another time."""
    at, log = [], LOG_HEAD
    for i in range(20):
        at.append(len(log))
        log += entry("00:00:%02d.000" % i, ping(i))
    for bit in range(64):
        bad = bytearray(log)
        bad[at[7] + (0, 28)[bit // 32] + bit % 32 // 8] ^= 1 << bit % 8
        heard = Heard(bytes(bad))
        check(heard.pings() == list(range(20)) and heard.times()[-1] == 19000 * MS and heard.left_out_bytes == 0 and heard.problems, "bit %d" % bit)
    within = LOG_HEAD + struct.pack(">I", 40) + entry("00:00:01.000", ping(1)) + entry("00:00:02.000", ping(1))
    heard = Heard(within)
    check(heard.pings() == [1, 1] and heard.left_out_bytes == 4, heard.problems)
    heard = Heard(log[:at[4] + 30] + log[at[6] + 10:])
    check(len(heard.pings()) == 18 and heard.times()[-1] == 19000 * MS, heard.problems)


def the_name_of_a_viewer_log_is_its_date(_bench):
    log, name = LOG_HEAD + entry("00:00:01.250", ping(1)), "20240814-094253162.bin"
    zero = 1723628573162 * MS
    for shown in (name, "/data/" + name, name.translate({ord("0") + i: 0x6f0 + i for i in range(10)})):
        for zone, shift_s, meaning in ((None, 0, "taken as UTC"), (210, 12600, "taken as UTC+3:30"), (-60, -3600, "taken as UTC-1:00")):
            heard = Heard(log, shown, zone)
            check(heard.times() == [zero - shift_s * 10**9 + 1250 * MS], heard.times())
            check(heard.recording.meaning_of_times() == "Unix, the date in the file's name " + meaning, heard.recording.meaning_of_times())
    for shown in ("dive.bin", "20241314-094253162.bin", "20240814-250000000.bin"):
        heard = Heard(log, shown)
        check(heard.times() == [1250 * MS] and "counts from the start" in heard.recording.meaning_of_times(), shown)


# ---- SeaNet ----

RELAY = ("2017.11.02 23.59.59.900;10.3.0.40;13102;24 52 4F 56\r\n"
         "2017.11.02 23.59.59.950;10.3.0.40;4002;0F 11 0A 40 30 30 31 30 10 00 02 FF 0B 04 80 02 80\r\n"
         "2017.11.03 00.00.00.050;10.3.0.40;4002;40 e2 01 00 80 0c ca 0a\r\n"
         "2017.11.03 00.00.00.040;10.3.0.40;4002;07\n")


def relayed_datagrams(_bench):
    midnight = 1509667200000 * MS
    heard = Heard(RELAY.encode())
    check(heard.kind is tool.SeanetRelay and heard.times() == [midnight - 50 * MS, midnight + 50 * MS, midnight + 50 * MS], heard.times())  # never back
    check([len(data) for _, data in heard.records] == [17, 8, 1] and heard.joined()[3] == 0x40 and heard.joined()[24] == 10, heard.records)
    check(heard.problems == ["1 datagrams of other ports are left out"] and heard.left_out_bytes == 0, heard.problems)
    for bad in ("nonsense", "2017.11.02 23.59.59.950;10.3.0.40;4002;0", "2017.11.02 23.59.59.950;10.3.0.40;4002;0G",
                "2017.11.02 23.59.59.950;10.3.0.40;4002;01 0", "2017.11.02 23.59.59.950;10.3.0.40;4002;0102", "2017.11.02 24.59.59.950;10.3.0.40;4002;01",
                "2017.11.02 23.59.59.950;10.3.0.40;4002", "2017.11.02 23.59.59.950", "2017.13.02 23.59.59.950;10.3.0.40;4002;01",
                "2017-11-02 23.59.59.950;10.3.0.40;4002;01", "1917.11.02 23.59.59.950;10.3.0.40;4002;01", "",
                "2017.11.02 23.59.59.950;10.3.0.40;4002;" + "00 " * 2049):
        heard = Heard((RELAY + bad + "\n").encode())
        check(len(heard.records) == 3 and len(heard.problems) == 2 and heard.left_out_bytes == len(bad) + 1, (bad, heard.problems))
    check("no datagram of the log holds the head" in Refusing(RELAY.split("\n", 1)[0].encode() + b"\n").refused, "a log without a sonar")


def seanet(message, payload, packet=0x80, node=2):
    length = len(payload) + 8
    return b"@%04X" % length + struct.pack("<HBBBBBB", length, node, 255, length - 5 if length < 256 else 0, message, packet, node) + payload + b"\n"


def head_data(bearing, n=300, ticks=33):
    """mtHeadData with its echo, by the places that a reader looks at."""
    payload = bytearray(31 + n)
    struct.pack_into("<H", payload, 0, 31 + n)
    payload[2], payload[16] = 0x10, 81
    struct.pack_into("<H", payload, 20, ticks)
    struct.pack_into("<H", payload, 27, bearing)
    struct.pack_into("<H", payload, 29, n)
    return seanet(2, bytes(payload))


def raw_seanet_bytes(_bench):
    """Every byte arrives, a frame with what stood before it; a ping takes its listening time and a pace."""
    data = b"noise@0012" + head_data(100) + head_data(116) + b"xx" + head_data(132)[:-40] + head_data(148) + b"tail"
    heard = Heard(data)
    listened = 33 * 300 * 640 + tool.PACE_NS
    check(heard.kind is tool.Seanet and heard.joined() == data and heard.recording.times_made_up, len(heard.records))
    check(heard.times() == [listened, 2 * listened, 3 * listened, 3 * listened], heard.times())
    check(Heard(b"@hello, world" * 50).kind is None, "a text is no frame")


def v4log(frames, begun=38494.5, end=None, index=True):
    """A record a tenth of a second after the other."""
    head = bytearray(b"SeaNetV4 Log File V1           \x1a".ljust(80, b"\0"))
    records = b"".join(struct.pack("<Hd", len(f) - 14 + 15, begun + i * 0.1 / 86400) + f[7:9] + f[10:-1] for i, f in enumerate(frames))
    settings = b"REGEDIT4 and so on"
    struct.pack_into("<6I", head, 32, 16, 80, 80 + len(settings), len(frames), 0, 80 + len(settings) + len(records) if index else 0)
    struct.pack_into("<2d", head, 64, begun, begun + len(frames) / 864000 if end is None else end)
    return bytes(head) + settings + records + (b"index" if index else b"")


def logs_of_seanet_pro(_bench):
    frames = [seanet(4, bytes(8))] + [head_data(16 * i) for i in range(20)]
    begun_ns = 1116763200 * 10**9  # 2005-05-22 12:00
    for options in ({}, {"index": False}, {"end": 0.0}):
        heard = Heard(v4log(frames, **options))
        check(heard.kind is tool.V4Log and [data for _, data in heard.records] == frames and not heard.problems, (options, heard.problems))
        check(heard.times() == [begun_ns + 100 * MS * i for i in range(21)] and heard.recording.meaning_of_times() == "Unix, the log's dates taken as UTC", heard.times())
    check(Heard(v4log(frames), zone=120).times()[0] == begun_ns - 7200 * 10**9, "zone")
    good, size = v4log(frames, index=False), len(frames[-1]) + 1
    at = len(good) - 12 * size
    for bad, records, left_out in ((good[:at] + b"\xff\xff" + good[at + 2:], 20, size), (good[:at] + b"\0" + good[at + 1:], 20, size),
                                   (good[:at] + good[at + 30:], 20, size - 30), (good[:at + 9] + b"\0" + good[at + 10:], 20, size), (good[:-100], 20, size - 100),
                                   (good[:at] + b"between" + good[at:], 21, 7)):
        heard = Heard(bad)
        check(len(heard.records) == records and heard.left_out_bytes == left_out and len(heard.problems) == 1, (records, left_out, heard.problems))
    for options in ({"begun": 0.0}, {"begun": float("nan")}, {"begun": 1e300}):
        check("no date" in Refusing(v4log(frames, **options)).refused, options)


# ---- Imagenex ----

def block(clock, date=b"", reply=500):
    head = bytearray(100)
    head[:8] = b"852\3" + struct.pack(">HH", 640, 13 + reply)
    head[8:8 + len(date)] = date
    head[20:28], head[29:32] = clock[:8], clock[8:11]
    return bytes(head) + b"IMX\x11\0\0\0\x0f" + bytes(4) + bytes(reply) + b"\xfc" + bytes(27)


def imagenex_blocks(_bench):
    heard = Heard(b"".join(block(c) for c in (b"23:59:58.50", b"23:59:59.75", b"00:00:01.00", b"00:00:00.00", b"00:00:02.00")))
    check(heard.kind is tool.Imagenex and heard.times()[-1] == 4500 * MS and len(heard.records) == 5, heard.times())  # set back once: time stands
    check(all(data[:3] == b"IMX" and len(data) == 513 for _, data in heard.records), "replies")
    for date, midnight_s in ((b"18-Nov-2016", 1479427200), (b"31-Dec-2199", 7258032000), (b"01-Jan-1970", 0), (b"32-Nov-2016", None), (b"18-Nox-2016", None),
                             (b"18-Nov-9999", None), (b"18.Nov-2016", None), (b"1\xe8-Nov-2016", None)):
        times = Heard(block(b"23:59:59.50", date) + block(b"00:00:01.00", date)).times()
        check(times[-1] == (1500 * MS if midnight_s is None else (midnight_s + 86401) * 10**9), (date, times))
    heard = Heard(block(b"\x11Exgarbage!!") * 3)
    check(heard.times()[-1] == 3 * 70 * MS and heard.recording.times_made_up, heard.times())  # 15 m are listened to for 20 ms


def broken_imagenex_blocks(_bench):
    one = block(b"00:00:00.00")
    for at, value, size, records, left_out in (
            (0, 0x38, 1280, 2, 0), (0, 0x38, 1279, 1, 639), (0, 0x38, 690, 1, 50), (640, 0x37, 1280, 1, 640), (644, 0, 1280, 1, 640),
            (646, 9, 1280, 1, 640), (640, 0x37, 2560, 3, 640), (644, 0x42, 2560, 3, 640), (644, 3, 2560, 4, 0), (645, 0x70, 2560, 4, 16)):
        data = bytearray(one * 4)
        data[at] = value
        heard = Heard(bytes(data[:size]))
        check(len(heard.records) == records and heard.left_out_bytes == left_out and len(heard.problems) == (left_out > 0), (at, value, size, heard.problems))


# ---- Cerulean ----

def cerulean(kind, payload):
    frame = b"BR" + struct.pack("<HHBB", len(payload), kind, 0, 0) + payload
    return frame + struct.pack("<H", sum(frame) & 0xFFFF)


def points(ms, size=5000):
    return cerulean(3012, struct.pack("<I", ms) + bytes(size - 4))


JSON = cerulean(10, b'{"device": "Surveyor"}')


def svlog_times(_bench):
    data = JSON + points(7000) + cerulean(504, b"attitude") + points(7050) + points(7100) + points(20) + points(70)  # switched off and on
    heard = Heard(data)
    check(heard.times() == [t * MS for t in (0, 0, 0, 50, 100, 100, 150)] and heard.joined() == data, heard.times())
    older = JSON + b"".join(cerulean(3011, struct.pack("<I", 5000 + 100 * i) + bytes(104)) for i in range(30))
    check(Heard(older).times()[-1] == 2900 * MS, "points of the older form")
    for stamp, t_ns in ((b"2024-04-02T18:54:51.404Z", 1712084091404 * MS), (b"2024-04-02T18:54:51+00:00", 1712084091 * 10**9),
                        (b"2024-04-02T18:54:51.40400000000Z", 1712084091404 * MS), (b"2024-04-02T18:54:51+02:00", None), (b"2024-04-02 18:54:51Z", None),
                        (b"2024-13-02T18:54:51Z", None), (b"9999-04-02T18:54:51Z", None), (b"2024", None), (b"2024-04-02T18:54:51", None)):
        heard = Heard(cerulean(10, b'{"session_id": 1, "timestamp": "' + stamp + b'"}') + points(7000) + points(7050))
        check(heard.recording.start_ns == t_ns and heard.times() == [t_ns or 0, t_ns or 0, (t_ns or 0) + 50 * MS], (stamp, heard.times()))


class Pieces:
    """A file that comes in these pieces."""

    def __init__(self, pieces):
        self.all, self.n = pieces, sum(map(len, pieces))

    def pieces(self):
        yield from self.all

    def tell(self):
        pass

    def is_mostly_lost(self):
        return False


def svlog_in_any_pieces(_bench):
    """The same records at the same times, wherever it is cut; what is no frame is kept, however much there is."""
    draw = random.Random(SEED)
    bad = bytearray(points(7100))
    bad[-100] ^= 1
    data = JSON + points(7000) + b"BRnoise" + points(7050) + bytes(bad) + points(7200) + b"BR\x10\0the end"
    want = Heard(data)
    check(want.joined() == data and len(want.records) == 5, len(want.records))
    for most in (1, 7, 49, 343, 2401, 16807):
        cuts, at = [], 0
        while at < len(data):
            n = draw.randint(1, most)
            cuts.append(data[at:at + n])
            at += n
        heard = Heard.__new__(Heard)
        heard.records, heard.problems, heard.left_out_bytes = [], [], 0
        tool.Svlog(data, "x", None, Pieces(cuts)).read(heard)
        check(heard.records == want.records, "pieces of up to %d" % most)
    heard.records = []
    tool.Svlog(JSON, "x", None, Pieces([JSON] + [bytes(5000)] * 100)).read(heard)
    check(heard.joined() == JSON + bytes(500000) and max(len(d) for _, d in heard.records) <= tool.Svlog.HELD_MAX, "garbage fills the memory")


# ---- Ping Viewer 2 ----

def viewer2(bench, *messages, encoding="json", packing=""):
    path = bench.path("viewer2.mcap")
    if os.path.exists(path):
        os.remove(path)
    topics = ("/device_0f8e/Ping360", "/device_77aa/Ping360", "/device_0f8e/VehicleData", "/note", "/device_0f8e/Ping1D")
    made = MadeCapture(path, *((topic, encoding) for topic in topics))
    made.write([(channel, 1750000000 * 10**9 + i * 10**8, o if isinstance(o, bytes) else json.dumps(o).encode()) for i, (channel, o) in enumerate(messages)])
    made.end()
    with open(path, "rb") as f:
        return f.read()


def ping360(angle, sample):
    return {"mode": 1, "gain_setting": 2, "angle": angle, "transmit_duration": 107, "sample_period": 889, "transmit_frequency": 750, "start_angle": 0,
            "stop_angle": 399, "num_steps": 1, "delay": 0, "number_of_samples": 5, "data_length": 5, "data": [9, 66, 82, sample, 255]}


def vehicle(yaw):
    return {"roll": 0.1, "pitch": -0.2, "yaw": yaw, "alt": -3.5, "lat": 52.5, "lon": 13.4}


def files_of_ping_viewer_2(bench):
    heard = Heard(viewer2(bench, (1, ping360(0, 1)), (1, ping360(399, 8))))
    check(heard.kind is tool.Viewer2 and heard.pings() == [0, 399] and heard.times() == [1750000000 * 10**9, 1750000000 * 10**9 + 10**8], heard.times())
    check(heard.records[1][1] == tool.ping360_frame(1, 2, 399, 107, 889, 750, 5, 5, bytes((9, 66, 82, 8, 255))), heard.records[1])
    profile = {"distance": 4500, "confidence": 98, "transmit_duration": 100, "ping_number": 77, "scan_start": 500, "scan_length": 9500, "gain_setting": 3,
               "profile_data_length": 3, "profile_data": [1, 2, 255]}
    (_, frame), = Heard(viewer2(bench, (5, profile))).records
    check(frame[4:6] == b"\x14\x05" and struct.unpack_from("<IHHIIIIH", frame, 8) == (4500, 98, 100, 77, 500, 9500, 3, 3), frame)
    # The program repeats the last attitude beside every ping: once it has heard no more, the pose must grow old.
    heard = Heard(viewer2(bench, *(m for i in range(4) for m in ((1, ping360(i, 1)), (3, vehicle(1.5 if i == 0 else 1.5707963))))))
    check(len(heard.poses) == 2 and heard.poses[1] == (1750000000 * 10**9 + 3 * 10**8,
          '{"attitude_deg":[5.729578,-11.459156,89.999998],"t_unix":1750000000.300000000}'), heard.poses)
    heard = Heard(viewer2(bench, (1, ping360(7, 3)), (2, ping360(8, 3)), (4, {})))
    check(heard.pings() == [7] and heard.problems == ["2 messages of other devices or kinds are left out"], heard.problems)
    bad = ((1, ping360(-1, 3)), (1, ping360(70000, 3)), (1, ping360(7, 256)), (1, ping360(7, -1)), (1, {"mode": 1}), (1, b"nonsense"), (1, b"[]"),
           (3, vehicle("north")), (3, vehicle(1e300)), (3, b""), (5, {"distance": 1}), (1, b'{"mode":NaN}'), (1, ping360(True, 3)), (1, b"[" * 100000))
    heard = Heard(viewer2(bench, *bad, (1, ping360(5, 3))))
    check(heard.pings() == [5] and not heard.poses and heard.left_out_bytes > 0, heard.problems)
    check(heard.problems == ["%d messages with a field missing or out of range are left out" % len(bad)], heard.problems)
    check(Heard(viewer2(bench, (1, ping360(7, 3)), encoding="protobuf")).kind is None, "another encoding")


def packed_mcap(_bench):
    """Chunks as Rust's writer packs them, zstd, and as sonard does, LZ4; of a damaged one the others are read."""
    raw = tool.mcap_file.record(5, struct.pack("<HIQQ", 0, 0, 1, 1) + b"hello")

    def chunk(packing, packed, size, crc=zlib.crc32(raw)):
        return tool.mcap_file.record(6, struct.pack("<QQQI", 1, 1, size, crc) + tool.mcap_file.text(packing) + struct.pack("<Q", len(packed)) + packed)
    zstd = b"\x28\xb5\x2f\xfd\x20" + bytes([len(raw)]) + (1 | len(raw) << 3).to_bytes(3, "little") + raw  # a block that is not packed
    lz4 = b"\x04\x22\x4d\x18\x60\x40\x82" + struct.pack("<I", len(raw) | 1 << 31) + raw + bytes(4)
    head = tool.mcap_file.MAGIC + tool.mcap_file.record(4, struct.pack("<HH", 0, 0) + tool.mcap_file.text("/a") + tool.mcap_file.text("json") + bytes(4))
    for packing, packed in (("", raw), ("zstd", zstd), ("lz4", lz4)):
        for broken, want in ((b"", 1), (chunk(packing, packed, len(raw) + 1), 1), (chunk(packing, packed[:-1], len(raw)), 1), (chunk(packing, packed, 1 << 40), 1),
                             (chunk("xz", packed, len(raw)), 1), (chunk(packing, packed, len(raw), 7), 1), (b"\x06" + b"\xff" * 5 + bytes(3), 1)):
            said = []
            got = list(tool.mcap_file.Reader(head + broken + chunk(packing, packed, len(raw)), said.append).messages())
            check(len(got) == want and got[0] == ("/a", "json", 1, b"hello") and bool(said) == bool(broken), (packing, broken[:20], got, said))
    small = b"\x28\xb5\x2f\xfd\x20" + bytes([0])
    bomb = head + chunk("zstd", small, 64 << 20) * 40
    said = []
    check(not list(tool.mcap_file.Reader(bomb, said.append).messages()) and any("1024 MiB" in s for s in said), said[-1])


# ---- packed files ----

def unpacked(data):
    unpacking = tool.Unpacking(data, "x")
    with contextlib.redirect_stderr(io.StringIO()):
        pieces = list(unpacking.pieces())
    check(all(len(p) == tool.PIECE for p in pieces[:-1]), "pieces")
    return b"".join(pieces), unpacking


def gzip_files(_bench):
    draw = random.Random(SEED)
    whole, packed = b"", b""
    for size in (1, tool.PIECE, 3 * tool.PIECE, 2000000):
        part = draw.randbytes(min(size, 1000)) + bytes(max(0, size - 1000))
        whole, packed = whole + part, packed + gzip.compress(part, 1)
        out, unpacking = unpacked(packed)
        check(out == whole and not unpacking.damaged and unpacking.lost == 0, size)
    text = b"".join(b"%d %d\n" % (i, i * i) for i in range(60000))
    good = gzip.compress(text)
    bad = bytearray(good + gzip.compress(b"z" * 1000))
    bad[len(good) // 2:len(good) // 2 + 8] = b"\xff" * 8
    out, unpacking = unpacked(bytes(bad))
    check(unpacking.damaged and out.endswith(b"z" * 1000) and text.startswith(out[:len(text) // 3]), (len(out), unpacking.lost))
    out, unpacking = unpacked(good[:len(good) // 2])
    check(unpacking.damaged and unpacking.lost == 0 and text.startswith(out) and len(out) > len(text) // 4, len(out))
    out, unpacking = unpacked((gzip.compress(b"x" * 1000) + bytes(100000)) * 2)  # as gzip itself takes it
    check(out == b"x" * 2000 and not unpacking.damaged and unpacking.lost == 0, unpacking.lost)
    _, unpacking = unpacked(gzip.compress(b"x") + bytes(9) + b"\1")
    check(unpacking.lost == 1, unpacking.lost)


def a_bomb_is_not_unpacked_without_end(bench):
    """Neither into memory, nor, of a kind that comes in pieces, onto the disk."""
    member = gzip.compress(bytes(1 << 20))
    path = bench.write("bomb.gz", member * 70)
    done = bench.run(TOOL, path, bench.path("o.mcap"))
    check(done.returncode == 1 and "it unpacks to more than 64 MiB: unpack it with gunzip" in done.stderr, done.stderr)
    check(not os.path.exists(bench.path("o.mcap")), "a file is left")
    with open(TOOL, encoding="utf-8") as f:
        source = f.read()
    check("WHOLE_MAX = 64 << 20 " in source and "RATIO_MAX = 100 " in source, "other bounds")
    small = types.ModuleType("small")
    small.__dict__["__file__"] = TOOL
    exec(compile(source.replace("WHOLE_MAX = 64 << 20 ", "WHOLE_MAX = 1 << 20 "), TOOL, "exec"), small.__dict__)  # pylint: disable=exec-used
    path = bench.write("bomb.svlz", gzip.compress(JSON) + member * 4)
    said = io.StringIO()
    sys.argv = ["sonard-import", path, bench.path("o.mcap")]
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        status = small.main()
    check(status == 1 and "more than 1 MiB and 100 times its size" in said.getvalue() and not os.path.exists(bench.path("o.mcap")), said.getvalue())


# ---- the program ----

def imported(bench, data, *options, status=0):
    path = bench.path("o.mcap")
    if os.path.exists(path):
        os.remove(path)
    done = bench.run(TOOL, *options, data if isinstance(data, str) else bench.write("recording", data), path)
    check(done.returncode == status and "Traceback" not in done.stderr, done.stderr)
    return path, done.stdout + done.stderr


def surveyor_log(n=30):
    """Points of the older form only, 100 ms apart, heard up to 40 m."""
    return JSON + b"".join(cerulean(3011, struct.pack("<I", 5000 + 100 * i) + bytes(88) + struct.pack("<f", 40) + bytes(12)) for i in range(n))


def what_the_program_says(bench):
    box = os.path.abspath("tests/replay/box-head.txt")
    path, said = imported(bench, box, "--sensor", "box", "--conf", "tests/replay/box.conf")
    info = bench.run(SONARCTL, "capture", "info", path)
    check("3 pings in 3 records" in said and info.returncode == 0 and "channel /box/rx (octet-stream): 3 messages, 3672 bytes" in info.stdout, info.stdout)
    check("attachment sonard.conf (text/plain)" in info.stdout and "line = none" in info.stdout and "complete, no damage" in info.stdout, info.stdout)
    log = surveyor_log()
    _, said = imported(bench, log)
    check("device = surveyor, range = 40.0 m" in said and "30 pings in 31 records, 2.900 s" in said, said)
    _, said = imported(bench, gzip.compress(log) * 2)
    check("60 pings in 62 records, 5.800 s" in said and "damaged" not in said, said)
    _, said = imported(bench, gzip.compress(log)[:-20])
    check("packed, and cut off: " in said and " pings in " in said and "left out" not in said, said)
    path, said = imported(bench, JSON, status=1)
    check("no ping in it; the capture holds its bytes as they are" in said and bench.run(SONARCTL, "capture", "info", path).returncode == 0, said)
    _, said = imported(bench, log[:len(log) // 5] + b"\x55" * (len(log) * 4 // 5), status=1)
    check("bytes outside valid frames" in said and "most of it is lost: " in said, said)
    imported(bench, log[:len(log) * 4 // 5] + b"\x55" * (len(log) // 5))
    for data, wanted in ((os.path.abspath("tests/replay/box.mcap"), "is a capture of sonard already; play it with `sonard --replay`"),
                         (os.path.abspath("Makefile"), "neither a Ping-Viewer sensor log nor a text dump"), (b"", "the file is empty"), ("/dev/null", "not a file"),
                         ("/nonexistent", "No such file"), (LOG_HEAD[:-30], "the head of the Ping-Viewer log is cut off")):
        path, said = imported(bench, data, status=1)
        check(wanted in said and not os.path.exists(path), said)
    made = MadeCapture(bench.path("blueos.mcap"), ("mavlink/out", "json"))
    made.write([(1, 1000, b"{}")])
    made.end()
    check("sonard-poses(1) reads its poses" in imported(bench, bench.path("blueos.mcap"), status=1)[1], "a file of BlueOS")
    for name, data, wanted in (("a.bag", b"#ROSBAG V2.0\n" + bytes(40), "sonard-rosbag(1) makes a capture of it"),
                               ("a.BIN", b"\xa3\x95\x80\x80\x59FMT" + bytes(80), "DataFlash log"),
                               ("a.tlog", bytes(7) + b"\x01\xfd\x09" + bytes(20), "telemetry log")):
        check(wanted in imported(bench, bench.write(name, data), status=1)[1], name)
    for options in (("--sensor", "a/b"), ("--sensor", "x" * 32), ("--zone", "east"), ()):
        done = bench.run(TOOL, *options, box)
        check(done.returncode == 2, done.stderr)
    taken = bench.write("taken.mcap", b"precious")
    done = bench.run(TOOL, box, taken)
    with open(taken, "rb") as f:
        check(done.returncode == 1 and "File exists" in done.stderr and f.read() == b"precious", done.stderr)
    done = bench.run(SONARCTL, "capture", "import", "--help")
    check(done.returncode == 0 and "usage: sonard-import" in done.stdout, done.stdout)
    if os.path.exists(os.path.join(os.path.dirname(SONARCTL), "../python/sonard-import")):
        done = bench.run("env", "PATH=/usr/bin:/bin", SONARCTL, "capture", "import", "--help")
        check(done.returncode == 0 and "usage: sonard-import" in done.stdout, "not found from a source tree: " + done.stderr)
    alone = shutil.copy(SONARCTL, bench.path("sonarctl"))
    done = bench.run("env", "PATH=/nonexistent", alone, "capture", "import", box, path)
    check(done.returncode == 1 and "install sonard-tools" in done.stderr, done.stderr)


def half_a_capture_has_its_configuration(bench):
    """The attachment is the first record, so that whatever is cut off, what is left can be played."""
    path, _ = imported(bench, surveyor_log(600))
    with open(path, "rb") as f:
        whole = f.read()
    half = bench.write("half.mcap", whole[:len(whole) // 2])
    fixed = bench.path("fixed.mcap")
    done = bench.run(SONARCTL, "capture", "repair", half, fixed)
    info = bench.run(SONARCTL, "capture", "info", fixed).stdout
    check(done.returncode == 0 and "attachment sonard.conf" in info and re.search(r"channel /sonar/rx .*: [1-9]\d+ messages", info), info)


def broken_at_random(bench):
    draw = random.Random(SEED)
    shipped = sorted(glob.glob("tests/live/recordings/*")) + ["tests/replay/box-head.txt"]
    pool = []
    for name in shipped:
        with open(name, "rb") as f:
            pool.append(f.read())
    for i in range(150):
        bad = bytearray(draw.choice(pool))
        for _ in range(draw.choice((1, 3, 20))):
            at, kind = draw.randrange(len(bad)), draw.randrange(4)
            if kind == 0:
                bad[at] ^= 1 << draw.randrange(8)
            elif kind == 1:
                del bad[at:at + draw.choice((1, 7, 100))]
            elif kind == 2:
                bad[at:at] = draw.randbytes(draw.choice((1, 5, 70)))
            else:
                bad[at:at + 4] = b"\xff" * 4
            bad = bad or bytearray(b"x")
        source, out = bench.write("bad", bytes(bad)), bench.path("bad%d.mcap" % i)
        sys.argv = ["sonard-import", source, out]
        with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
            status = tool.main()
        check(status in (0, 1) and (status == 1 or os.path.exists(out)), status)


run([(case.__name__, case) for case in (
    times_of_day, text_dumps, viewer_logs, broken_viewer_logs, the_name_of_a_viewer_log_is_its_date, relayed_datagrams, raw_seanet_bytes, logs_of_seanet_pro, imagenex_blocks,
    broken_imagenex_blocks, svlog_times, svlog_in_any_pieces, files_of_ping_viewer_2, packed_mcap, gzip_files, a_bomb_is_not_unpacked_without_end,
    what_the_program_says, half_a_capture_has_its_configuration, broken_at_random)], gate=ALL)
