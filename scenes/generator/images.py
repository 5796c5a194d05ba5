"""PNG and Radiance HDR files whose bytes do not depend on any compression library."""

import math
import struct
import zlib


def srgb(linear):
    """A linear value in 0 … 1 as an 8-bit code of IEC 61966-2-1."""
    low = linear <= 0.0031308
    return round(255 * (12.92 * linear if low else 1.055 * linear ** (1 / 2.4) - 0.055))


def unit(value):
    """A value in 0 … 1 as a linear 8-bit code."""
    return round(255 * value)


def png(width, height, texel):
    """8-bit PNG; `texel(x, y)` gives three or four codes, row 0 on top."""
    rows = [[texel(x, y) for x in range(width)] for y in range(height)]
    channels = len(rows[0][0])
    raw = b"".join(b"\0" + bytes(code for t in row for code in t) for row in rows)
    color_type = {3: 2, 4: 6}[channels]
    header = struct.pack(">IIBBBBB", width, height, 8, color_type, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", _stored(raw)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )


def _stored(data):
    """A zlib stream of stored blocks (RFC 1950 and 1951)."""
    size = 65535
    blocks = [data[i : i + size] for i in range(0, len(data), size)]
    stream = b"\x78\x01"
    for i, block in enumerate(blocks):
        last = i == len(blocks) - 1
        stream += struct.pack("<BHH", last, len(block), len(block) ^ 0xFFFF) + block
    return stream + struct.pack(">I", zlib.adler32(data))


def hdr(width, height, texel):
    """Radiance RGBE without run lengths; `texel(x, y)` gives linear Rec. 709, row 0 on top."""
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode()
    return head + b"".join(_rgbe(texel(x, y)) for y in range(height) for x in range(width))


def _rgbe(color):
    largest = max(color)
    assert largest > 0
    # The largest mantissa becomes 128 … 255, so no texel looks like a run-length mark.
    _, exponent = math.frexp(largest)
    codes = [round(c * 2.0 ** (8 - exponent)) for c in color]
    if max(codes) > 255:
        exponent += 1
        codes = [round(c * 2.0 ** (8 - exponent)) for c in color]
    return bytes([*codes, exponent + 128])
