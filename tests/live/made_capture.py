# SPDX-License-Identifier: MIT
"""Captures that a test makes up: MCAP without compression, checksums and index, which sonard reads all the same."""
import struct

MAGIC = b"\x89MCAP0\r\n"


def record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


def text(s):
    return struct.pack("<I", len(s)) + s.encode()


class MadeCapture:
    """The file at the path, with the channels (topic, encoding), numbered from 1."""

    def __init__(self, path, *channels):
        self.file = open(path, "wb")
        self.file.write(MAGIC + record(1, text("") + text("made")))
        for number, (topic, encoding) in enumerate(channels, 1):
            self.file.write(record(4, struct.pack("<HH", number, 0) + text(topic) + text(encoding) + struct.pack("<I", 0)))

    def write(self, messages):
        """(channel's number, time in ns, bytes), in the order of their times."""
        t_ns = messages[0][1]
        body = b"".join(record(5, struct.pack("<HIQQ", number, 0, t, t) + data) for number, t, data in messages)
        self.file.write(record(6, struct.pack("<QQQI", t_ns, t_ns, len(body), 0) + text("") +
                               struct.pack("<Q", len(body)) + body))

    def end(self):
        self.file.write(record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + MAGIC)
        self.file.close()
