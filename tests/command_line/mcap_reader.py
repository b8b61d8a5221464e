"""Reads MCAP from its bytes alone, by the format's specification: independent of the program's own writer."""
import ctypes
import ctypes.util
import json
import struct
import zlib

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END = 1, 2, 3, 4, 5, 6, 15


def unpacked(compression, data, size):
    """What a chunk holds: its own crc is checked by the caller."""
    if compression == "":
        return data
    if compression != "zstd":
        raise AssertionError(f"a chunk that is compressed by {compression!r}")
    zstd = ctypes.CDLL(ctypes.util.find_library("zstd") or "libzstd.so.1")
    zstd.ZSTD_decompress.restype = ctypes.c_size_t
    zstd.ZSTD_decompress.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]
    out = ctypes.create_string_buffer(size)
    if zstd.ZSTD_decompress(out, size, data, len(data)) != size:
        raise AssertionError("a chunk that isn't what it says")
    return out.raw


def records(data, at=0):
    """(opcode, content) of each record that stands whole in the bytes."""
    while at < len(data):
        code, length = struct.unpack_from("<BQ", data, at)
        yield code, data[at + 9:at + 9 + length]
        at += 9 + length


def text_at(data, at):
    length, = struct.unpack_from("<I", data, at)
    return data[at + 4:at + 4 + length].decode(), at + 4 + length


def _data_records(data):
    """Those of the data section, chunks opened."""
    for code, content in records(data[len(MAGIC):-len(MAGIC)]):
        if code == DATA_END:
            return
        if code != CHUNK:
            yield code, content
            continue
        _, _, size, crc = struct.unpack_from("<QQQI", content)
        compression, at = text_at(content, 28)
        length, = struct.unpack_from("<Q", content, at)
        whole = unpacked(compression, content[at + 8:at + 8 + length], size)
        if crc and zlib.crc32(whole) != crc:
            raise AssertionError("a chunk's checksum is wrong")
        yield from records(whole)


def messages(file):
    """{topic: [(time in ns, the message), …]} of a file whose messages are JSON."""
    data = file.read_bytes()
    if data[:8] != MAGIC or data[-8:] != MAGIC:
        raise AssertionError(f"{file} is no whole MCAP file")
    topics, found = {}, {}
    for code, content in _data_records(data):
        if code == CHANNEL:
            number, _ = struct.unpack_from("<HH", content)
            topics[number], _ = text_at(content, 4)
            found[topics[number]] = []
        elif code == MESSAGE:
            number, _, time_ns, _ = struct.unpack_from("<HIQQ", content)
            found[topics[number]].append((time_ns, json.loads(content[22:])))
    return found
