"""Grey images and float grids in plain Python: PNG, PGM, PFM and the TIFF files that `map` writes."""
import array
import struct
import sys
import zlib


def _swapped(values):
    """16-bit values between PNG's byte order and this machine's."""
    if sys.byteorder == "little":
        values.byteswap()
    return values


def _unfilter(kind, row, above, step):
    if kind == 1:
        for i in range(step, len(row)):
            row[i] = (row[i] + row[i - step]) & 255
    elif kind == 2:
        for i in range(len(row)):
            row[i] = (row[i] + above[i]) & 255
    elif kind == 3:
        for i in range(len(row)):
            left = row[i - step] if i >= step else 0
            row[i] = (row[i] + (left + above[i]) // 2) & 255
    elif kind == 4:
        for i in range(len(row)):
            a = row[i - step] if i >= step else 0
            b, c = above[i], above[i - step] if i >= step else 0
            p = a + b - c
            pa, pb, pc = abs(p - a), abs(p - b), abs(p - c)
            row[i] = (row[i] + (a if pa <= pb and pa <= pc else b if pb <= pc else c)) & 255


def read_png(data):
    """width, height, pixels (array 'H' or 'B') of a grey image."""
    at, body, width, height, depth = 8, b"", 0, 0, 8
    while at < len(data):
        size, name = struct.unpack(">I4s", data[at:at + 8])
        if name == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", data[at + 8:at + 18])
            if colour != 0 or depth not in (8, 16):
                raise ValueError("a grey PNG of 8 or 16 bits is expected")
        elif name == b"IDAT":
            body += data[at + 8:at + 8 + size]
        at += 12 + size
    raw, step = zlib.decompress(body), depth // 8
    above, out = bytearray(width * step), bytearray()
    for v in range(height):
        start = v * (width * step + 1)
        row = bytearray(raw[start + 1:start + 1 + width * step])
        _unfilter(raw[start], row, above, step)
        out += row
        above = row
    pixels = array.array("H" if depth == 16 else "B")
    pixels.frombytes(bytes(out))
    return width, height, _swapped(pixels) if depth == 16 else pixels


def write_png(width, height, pixels):
    step = pixels.itemsize
    data = pixels
    if step == 2:
        data = _swapped(array.array("H", pixels))
    raw, line = data.tobytes(), width * step
    rows = b"".join(b"\0" + raw[v * line:(v + 1) * line] for v in range(height))
    out = b"\x89PNG\r\n\x1a\n"
    head = struct.pack(">IIBBBBB", width, height, 8 * step, 0, 0, 0, 0)
    for name, body in ((b"IHDR", head), (b"IDAT", zlib.compress(rows, 1)), (b"IEND", b"")):
        out += struct.pack(">I", len(body)) + name + body
        out += struct.pack(">I", zlib.crc32(name + body))
    return out


def read_pgm(path):
    """width, height, bytes; row 0 on top."""
    data = path.read_bytes()
    fields, at = [], 0
    while len(fields) < 4:
        end = at
        while data[end:end + 1] not in (b" ", b"\n"):
            end += 1
        fields.append(data[at:end])
        at = end + 1
    return int(fields[1]), int(fields[2]), data[at:]


def read_pfm(path):
    """width, height, values; the first row is the one of least y, as the simulator writes it."""
    data = path.read_bytes()
    kind, size, scale, body = data.split(b"\n", 3)
    width, height = map(int, size.split())
    if kind != b"Pf":
        raise ValueError(f"{path}: not a grey PFM")
    order = "<" if float(scale) < 0 else ">"
    return width, height, struct.unpack(f"{order}{width * height}f", body[:4 * width * height])


def read_tiff(path):
    """width, height, values (row 0 on top) of a one-channel float TIFF in deflated strips."""
    data = path.read_bytes()
    order = "<" if data[:2] == b"II" else ">"
    (at,) = struct.unpack(order + "I", data[4:8])
    (count,) = struct.unpack(order + "H", data[at:at + 2])
    tags = {}
    for i in range(count):
        entry = data[at + 2 + 12 * i:at + 14 + 12 * i]
        tag, kind, number = struct.unpack(order + "HHI", entry[:8])
        letter, size = {3: ("H", 2), 4: ("I", 4)}.get(kind, (None, 0))
        if letter is None:
            continue
        where = entry[8:8 + number * size]
        if number * size > 4:
            (start,) = struct.unpack(order + "I", entry[8:12])
            where = data[start:start + number * size]
        tags[tag] = struct.unpack(f"{order}{number}{letter}", where)
    width, height = tags[256][0], tags[257][0]
    raw = b""
    for start, size in zip(tags[273], tags[279]):
        strip = data[start:start + size]
        raw += strip if tags[259][0] == 1 else zlib.decompress(strip)
    return width, height, struct.unpack(f"{order}{width * height}f", raw)


