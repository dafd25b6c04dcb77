# SPDX-License-Identifier: MIT
"""mcap_file - MCAP files (mcap.dev) for the tools beside sonard: the messages of any, and captures as sonard's own programs write
them, unpacked. What is read is not trusted: lengths are checked against what is there, and what is damaged is named and left out.
LZ4 and zstd are unpacked by the libraries that sonard itself uses.
"""
import ctypes
import os
import re
import shutil
import struct
import tempfile
import zlib

MAGIC = b"\x89MCAP0\r\n"
CHUNK_MAX = 64 << 20     # bytes of a chunk, unpacked: sonard refuses larger ones
UNPACKED_MAX = 1 << 30   # bytes of all chunks that are packed, and as many times those of the file:
RATIO_MAX = 256
STRINGS_MAX = 16 << 20   # bytes of a file's topics and encodings
CHUNK_BYTES = 256 << 10  # of a chunk that is written
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX, ATTACHMENT = 1, 2, 3, 4, 5, 6, 7, 8, 9
ATTACHMENT_INDEX, STATISTICS, SUMMARY_OFFSET, DATA_END = 10, 11, 14, 15


class Damaged(Exception):
    """A file, or a part of it, that cannot be read; the text says why."""


# ---- unpacking ----

def library(name):
    try:
        return ctypes.CDLL(name)
    except OSError:
        raise Damaged("it is packed, and %s is not installed" % name) from None


def unzstd(data, size):
    lib = library("libzstd.so.1")
    lib.ZSTD_decompress.restype = ctypes.c_size_t
    lib.ZSTD_decompress.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t)
    out = ctypes.create_string_buffer(max(size, 1))
    if lib.ZSTD_decompress(out, size, data, len(data)) != size:
        raise Damaged("it cannot be unpacked to the size it states")
    return out.raw[:size]


def unlz4(data, size):
    lib = library("liblz4.so.1")
    for name in ("LZ4F_createDecompressionContext", "LZ4F_decompress"):
        getattr(lib, name).restype = ctypes.c_size_t
    lib.LZ4F_freeDecompressionContext.argtypes = (ctypes.c_void_p,)
    lib.LZ4F_isError.argtypes = (ctypes.c_size_t,)
    context, out = ctypes.c_void_p(), ctypes.create_string_buffer(max(size, 1))
    source, done, used, hint = ctypes.create_string_buffer(data, max(len(data), 1)), 0, 0, 1
    if lib.LZ4F_isError(lib.LZ4F_createDecompressionContext(ctypes.byref(context), ctypes.c_uint(100))):
        raise Damaged("out of memory unpacking it")
    try:
        while hint and used < len(data):
            to, by = ctypes.c_size_t(size - done), ctypes.c_size_t(len(data) - used)
            hint = lib.LZ4F_decompress(context, ctypes.byref(out, done), ctypes.byref(to), ctypes.byref(source, used), ctypes.byref(by), None)
            if lib.LZ4F_isError(hint) or to.value == 0 and by.value == 0:
                break
            done, used = done + to.value, used + by.value
    finally:
        lib.LZ4F_freeDecompressionContext(context)
    if hint or done != size:
        raise Damaged("it cannot be unpacked to the size it states")
    return out.raw[:size]


# ---- reading ----

def fields(data, form, at=0):
    """Numbers of a form as struct has it, and the offset behind them."""
    size = struct.calcsize("<" + form)
    if at + size > len(data):
        raise Damaged("it is cut off")
    return (*struct.unpack_from("<" + form, data, at), at + size)


def blob(data, at, form="I"):
    size, at = fields(data, form, at)
    if size > len(data) - at:
        raise Damaged("it is cut off")
    return bytes(data[at:at + size]), at + size


def record_at(data, at):
    """(opcode, content, offset behind it)."""
    opcode, size, begin = fields(data, "BQ", at)
    if opcode == 0 or size > len(data) - begin:
        raise Damaged("it is cut off")
    return opcode, memoryview(data)[begin:begin + size], begin + size


NEXT_CHUNK = re.compile(rb"(?=\x06.{5}\0\0\0)", re.DOTALL)  # below a terabyte


def chunk_fields(content):
    """Unpacked size, checksum, packing and bytes of a chunk."""
    size, crc, at = fields(content, "16xQI")
    packing, at = blob(content, at)
    if packing not in (b"", b"lz4", b"zstd"):
        raise Damaged("its compression is none of \"\", lz4, zstd")
    packed, _ = blob(content, at, "Q")
    return size, crc, packing, packed


def next_chunk(data, at):
    """Where the next chunk begins from there on, or the end."""
    for match in NEXT_CHUNK.finditer(data, at):
        try:
            opcode, content, _ = record_at(data, match.start())
            if opcode == CHUNK and chunk_fields(content):
                return match.start()
        except Damaged:
            continue
    return len(data)


class Reader:
    """The messages of the file whose bytes are given; problem(sentence) hears what is left out."""

    def __init__(self, data, problem):
        if data[:len(MAGIC)] != MAGIC:
            raise Damaged("no MCAP file")
        self.data, self.problem, self.channels, self.strings = data, problem, {}, STRINGS_MAX
        self.left, self.left_out_bytes = UNPACKED_MAX + RATIO_MAX * len(data), 0

    def channel(self, content):
        number, _, at = fields(content, "HH")
        topic, at = blob(content, at)
        encoding, _ = blob(content, at)
        self.strings -= len(topic) + len(encoding)
        if self.strings >= 0:
            self.channels.setdefault(number, (topic.decode("utf-8", "replace"), encoding.decode("utf-8", "replace")))

    def unpack(self, content):
        size, crc, packing, packed = chunk_fields(content)
        if size > CHUNK_MAX:
            raise Damaged("it says it unpacks to more than %d MiB" % (CHUNK_MAX >> 20))
        self.left -= size if packing else 0
        if self.left < 0:
            raise Damaged("the chunks of this file unpack to more than %d MiB" % (UNPACKED_MAX >> 20))
        out = unlz4(packed, size) if packing == b"lz4" else unzstd(packed, size) if packing else packed
        if len(out) != size:
            raise Damaged("it cannot be unpacked to the size it states")
        if crc and zlib.crc32(out) != crc:
            raise Damaged("its checksum is wrong")
        return out

    def of_record(self, opcode, content):
        """A message of a record outside of a chunk or in one, or None."""
        if opcode == CHANNEL:
            self.channel(content)
        elif opcode == MESSAGE:
            number, _, t_ns, _, at = fields(content, "HIQQ")
            if number in self.channels:
                return (*self.channels[number], t_ns, bytes(content[at:]))
        return None

    def of_chunk(self, content, start):
        at, records = 0, self.unpack(content)
        while at < len(records):
            try:
                opcode, inner, at = record_at(records, at)
                message = self.of_record(opcode, inner)
            except Damaged:
                self.problem("chunk at offset %d: truncated after its byte %d; the rest is skipped" % (start, at))
                self.left_out_bytes += len(records) - at
                return
            if message:
                yield message

    def messages(self):
        """(topic, encoding, time in ns, bytes) of each message, in the order of the file."""
        at = len(MAGIC)
        while at < len(self.data):
            start = at
            try:
                opcode, content, at = record_at(self.data, at)
                if opcode in (DATA_END, FOOTER):
                    return
                if opcode == CHUNK:
                    yield from self.of_chunk(content, start)
                    continue
                message = self.of_record(opcode, content)
            except Damaged as fault:
                if at == start:
                    at = next_chunk(self.data, start + 1)
                self.problem("offset %d: %d bytes are left out: %s" % (start, at - start, fault))
                self.left_out_bytes += at - start
                continue
            if message:
                yield message


# ---- writing ----

def record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


def text(s):
    return struct.pack("<I", len(s.encode())) + s.encode()


def sized(content):
    return struct.pack("<I", len(content)) + content


class Writer:
    """A new capture. Its attachment is the first thing in the file, so that a part of it has it too, though what it says may be known
    only when all messages are: these go to a file without a name before they follow it."""

    def __init__(self, path, library_name):
        self.path, self.library, self.file = path, library_name, open(path, "xb")
        try:
            self.body = tempfile.TemporaryFile(dir=os.path.dirname(os.path.abspath(path)))
        except BaseException:
            self.abandon()
            raise
        self.size, self.chunk, self.index, self.times = 0, bytearray(), {}, None
        self.channels, self.counts, self.chunks = [], [], []  # records; messages; (start, end, offset, length, indexes, size)

    def abandon(self):
        self.file.close()
        os.unlink(self.path)

    def put(self, data):
        self.body.write(data)
        self.size += len(data)

    def add_channel(self, topic, encoding, **metadata):
        self.flush()
        pairs = b"".join(text(k) + text(v) for k, v in metadata.items())
        self.channels.append(record(CHANNEL, struct.pack("<HH", len(self.channels), 0) + text(topic) + text(encoding) + sized(pairs)))
        self.counts.append(0)
        self.put(self.channels[-1])
        return len(self.channels) - 1

    def add(self, channel, t_ns, data):
        self.index.setdefault(channel, []).append((t_ns, len(self.chunk)))
        self.chunk += struct.pack("<BQHIQQ", MESSAGE, 22 + len(data), channel, self.counts[channel] & 0xFFFFFFFF, t_ns, t_ns)
        self.chunk += data
        self.counts[channel] += 1
        self.times = (min(self.times[0], t_ns), max(self.times[1], t_ns)) if self.times else (t_ns, t_ns)
        if len(self.chunk) >= CHUNK_BYTES:
            self.flush()

    def flush(self):
        if not self.chunk:
            return
        start, end = self.times
        offset, size, self.times = self.size, len(self.chunk), None
        self.put(record(CHUNK, struct.pack("<QQQI", start, end, size, zlib.crc32(self.chunk)) + text("") + struct.pack("<Q", size) + self.chunk))
        length, indexes = self.size - offset, []
        for channel, entries in sorted(self.index.items()):
            indexes.append((channel, self.size))
            self.put(record(MESSAGE_INDEX, struct.pack("<H", channel) + sized(b"".join(struct.pack("<QQ", *e) for e in entries))))
        self.chunks.append((start, end, offset, length, indexes, self.size - offset - length, size))
        self.chunk, self.index = bytearray(), {}

    def finish(self, name="", content=b""):
        """The file, with the attachment where there is one; abandon() where this fails."""
        self.flush()
        head = MAGIC + record(HEADER, text("sonard") + text(self.library))
        groups = {CHANNEL: b"".join(self.channels)}
        attached = b""
        if content:
            body = struct.pack("<QQ", 0, 0) + text(name) + text("text/plain") + struct.pack("<Q", len(content)) + content
            attached = record(ATTACHMENT, body + struct.pack("<I", zlib.crc32(body)))
            groups[ATTACHMENT_INDEX] = record(ATTACHMENT_INDEX, struct.pack("<QQQQQ", len(head), len(attached), 0, 0, len(content)) + text(name) + text("text/plain"))
        base = len(head) + len(attached)
        groups[CHUNK_INDEX] = b"".join(record(CHUNK_INDEX, struct.pack("<QQQQ", start, end, base + offset, length) + sized(
            b"".join(struct.pack("<HQ", channel, base + at) for channel, at in indexes)) + struct.pack("<Q", index_size) + text("") +
            struct.pack("<QQ", size, size)) for start, end, offset, length, indexes, index_size, size in self.chunks)
        groups[STATISTICS] = record(STATISTICS, struct.pack(
            "<QHIIIIQQ", sum(self.counts), 0, len(self.channels), 1 if content else 0, 0, len(self.chunks),
            min((c[0] for c in self.chunks), default=0), max((c[1] for c in self.chunks), default=0)) +
            sized(b"".join(struct.pack("<HQ", *pair) for pair in enumerate(self.counts))))
        self.file.write(head + attached)
        self.body.seek(0)
        shutil.copyfileobj(self.body, self.file, 1 << 20)
        end = record(DATA_END, struct.pack("<I", 0))
        start = base + self.size + len(end)
        summary, offsets, at = b"".join(groups.values()), b"", start
        for opcode, records in groups.items():
            offsets += record(SUMMARY_OFFSET, struct.pack("<BQQ", opcode, at, len(records))) if records else b""
            at += len(records)
        summary += offsets + struct.pack("<BQQQ", FOOTER, 20, start, at)
        self.file.write(end + summary + struct.pack("<I", zlib.crc32(summary)) + MAGIC)
        self.file.close()
