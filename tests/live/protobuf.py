# SPDX-License-Identifier: MIT
"""protobuf - reads messages of Protocol Buffers by the FileDescriptorSet that comes with them: written from the encoding's
rules, and sharing nothing with the program that writes them. A field that is not there has its default: 0, "", [] or None."""
import struct

# Fields of descriptor.proto that are needed, by the type that they are of: number: (name, repeated, type).
TEXT, COUNT = "text", "count"
SET = {1: ("file", True, "File")}
OF = {"File": {1: ("name", False, TEXT), 2: ("package", False, TEXT), 3: ("dependency", True, TEXT), 4: ("message", True, "Message"),
               12: ("syntax", False, TEXT)},
      "Message": {1: ("name", False, TEXT), 2: ("field", True, "Field"), 4: ("enum", True, "Enum")},
      "Field": {1: ("name", False, TEXT), 3: ("number", False, COUNT), 4: ("label", False, COUNT), 5: ("type", False, COUNT),
                6: ("type_name", False, TEXT)},
      "Enum": {1: ("name", False, TEXT), 2: ("value", True, "Value")},
      "Value": {1: ("name", False, TEXT), 2: ("number", False, COUNT)}}
DOUBLE, INT64, INT32, FIXED32, BOOL, STRING, MESSAGE, BYTES, ENUM = 1, 3, 5, 7, 8, 9, 11, 12, 14
DEFAULTS = {DOUBLE: 0.0, INT64: 0, INT32: 0, FIXED32: 0, BOOL: False, STRING: "", MESSAGE: None, BYTES: b"", ENUM: 0}


def varint(data, at):
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            return value, at


def records(data):
    """(number, wire type, value) of each field."""
    at = 0
    while at < len(data):
        tag, at = varint(data, at)
        number, wire = tag >> 3, tag & 7
        if wire == 0:
            value, at = varint(data, at)
        else:
            size = {1: 8, 5: 4}.get(wire)
            if size is None:
                assert wire == 2, "wire type %d" % wire
                size, at = varint(data, at)
            value, at = bytes(data[at:at + size]), at + size
            assert len(value) == size, "cut off"
        yield number, wire, value


def described(data, fields):
    out = {name: [] if repeated else None for name, repeated, _ in fields.values()}
    for number, _, value in records(data):
        if number in fields:
            name, repeated, kind = fields[number]
            value = value.decode() if kind == TEXT else value if kind == COUNT else described(value, OF[kind])
            out[name] = out[name] + [value] if repeated else value
    return out


class Schema:
    """The types of a FileDescriptorSet. Each file has the types that it uses before it, and names them."""

    def __init__(self, data):
        self.types, self.enums, files = {}, {}, set()
        for file in described(data, SET)["file"]:
            assert file["syntax"] == "proto3" and set(file["dependency"]) <= files, file["name"]
            files.add(file["name"])
            for message in file["message"]:
                name = ".%s.%s" % (file["package"], message["name"])
                self.types[name] = {f["number"]: f for f in message["field"]}
                assert len(self.types[name]) == len(message["field"]), "a number twice in " + name
                for e in message["enum"]:
                    self.enums["%s.%s" % (name, e["name"])] = {v["number"] or 0: v["name"] for v in e["value"]}

    def scalar(self, field, value):
        kind = field["type"]
        if kind == DOUBLE:
            return struct.unpack("<d", value)[0]
        if kind == FIXED32:
            return struct.unpack("<I", value)[0]
        if kind in (INT64, INT32):
            return value - (1 << 64) if value >> 63 else value
        return bool(value) if kind == BOOL else self.enums[field["type_name"]][value] if kind == ENUM else value.decode() if kind == STRING else value

    def values(self, field, wire, value):
        kind = field["type"]
        if kind == MESSAGE:
            return [self.read(field["type_name"][1:], value)]
        if wire != 2 or kind in (STRING, BYTES):
            return [self.scalar(field, value)]
        out, at = [], 0  # packed
        while at < len(value):
            if kind in (DOUBLE, FIXED32):
                size = 8 if kind == DOUBLE else 4
                one, at = value[at:at + size], at + size
            else:
                one, at = varint(value, at)
            out.append(self.scalar(field, one))
        return out

    def read(self, name, data):
        """A message of that type as a dictionary; a field that the type has not is a fault."""
        fields = self.types["." + name]
        out = {f["name"]: [] if f["label"] == 3 else self.enums[f["type_name"]][0] if f["type"] == ENUM else DEFAULTS[f["type"]]
               for f in fields.values()}
        for number, wire, value in records(data):
            field = fields[number]
            values = self.values(field, wire, value)
            if field["label"] == 3:
                out[field["name"]] += values
            else:
                out[field["name"]] = values[-1]
        return out
