# Reads the scan-line EXR files that Tandem writes, without an image library. Loading a library takes longer than most tests do.
import itertools
import struct
import zlib

BLOCK = 16  # rows that are compressed together, by the method that the format calls ZIP
ZIP = b"\x03"
HALF = 1    # other kinds of values have 4 bytes


def attributes_of(data):
    """The header's attributes, and where it ends."""
    found, at = {}, 8
    while data[at] != 0:
        name, kind, _ = data[at:at + 512].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        size, = struct.unpack_from("<i", data, at)
        found[name.decode()] = data[at + 4:at + 4 + size]
        at += 4 + size
    return found, at + 1


def channels_of(entries):
    """Each channel's name and bytes a value, in the order of the file."""
    found = []
    while entries[0] != 0:
        name, rest = entries.split(b"\0", 1)
        found.append((name.decode(), 2 if struct.unpack_from("<i", rest)[0] == HALF else 4))
        entries = rest[16:]
    return found


def unpacked(packed, size):
    """A block's rows: bytes at even places come first, and each is told by its difference to the one before."""
    if len(packed) == size:
        return packed
    smooth = bytes(itertools.accumulate(zlib.decompress(packed), lambda before, step: (before + step - 128) & 255))
    rows = bytearray(size)
    rows[0::2], rows[1::2] = smooth[:(size + 1) // 2], smooth[(size + 1) // 2:]
    return bytes(rows)


def exr_channels(path):
    """The values of each channel, as the bytes that the file has."""
    data = path.read_bytes()
    header, at = attributes_of(data)
    assert header["compression"] == ZIP, header["compression"]
    left, top, right, bottom = struct.unpack("<4i", header["dataWindow"])
    width, height = right + 1 - left, bottom + 1 - top
    channels = channels_of(header["channels"])
    values = {name: bytearray() for name, _ in channels}
    for offset in struct.unpack_from(f"<{-(-height // BLOCK)}Q", data, at):
        first, size = struct.unpack_from("<ii", data, offset)
        rows = min(BLOCK, bottom + 1 - first)
        block = unpacked(data[offset + 8:offset + 8 + size], rows * width * sum(of for _, of in channels))
        place = 0
        for _ in range(rows):
            for name, of in channels:
                values[name] += block[place:place + width * of]
                place += width * of
    return {name: bytes(of) for name, of in values.items()}
