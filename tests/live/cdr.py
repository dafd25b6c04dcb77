# SPDX-License-Identifier: MIT
"""cdr - reads messages of ROS 2 by the "ros2msg" text that comes with them: written from the rules of CDR, and sharing nothing
with the program that writes them."""
import struct

NUMBERS = {"float64": "d", "float32": "f", "int64": "q", "int32": "i", "uint32": "I", "bool": "?", "uint8": "B", "int8": "b"}


class Schema:
    def __init__(self, name, text):
        parts = text.decode().split("=" * 80 + "\n")
        self.name, self.types = name, {None: parts[0]}
        for part in parts[1:]:
            head, _, rest = part.partition("\n")
            assert head.startswith("MSG: "), head
            self.types[head[5:]] = rest
        self.types = {k: [line.split(" ") for line in v.splitlines()] for k, v in self.types.items()}

    def read(self, data):
        assert data[:4] == b"\0\1\0\0", data[:4]
        self.data, self.at = data[4:], 0
        out = self.fields(None)
        assert self.at == len(self.data), "%d bytes are left" % (len(self.data) - self.at)
        return out

    def fields(self, name):
        return {field: self.list(kind[:-2]) if kind.endswith("[]") else self.one(kind) for kind, field in self.types[name]}

    def number(self, form):
        size = struct.calcsize(form)
        self.at += -self.at % size
        value = struct.unpack_from("<" + form, self.data, self.at)[0]
        self.at += size
        return value

    def list(self, kind):
        count = self.number("I")
        if kind in ("uint8", "int8"):
            self.at += count
            assert self.at <= len(self.data), "cut off"
            raw = self.data[self.at - count:self.at]
            return raw if kind == "uint8" else list(struct.unpack("%db" % count, raw))
        return [self.one(kind) for _ in range(count)]

    def one(self, kind):
        if kind in NUMBERS:
            return self.number(NUMBERS[kind])
        if kind != "string":
            return self.fields(kind)
        size = self.number("I")
        self.at += size
        assert self.data[self.at - 1] == 0, "a text without its end"
        return self.data[self.at - size:self.at - 1].decode()
