# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes and reads PNG pictures of RGB pixels."""

import struct
import zlib


def png(rows: list[bytes]) -> bytes:
    """A picture of rows of RGB pixels."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", len(rows[0]) // 3, len(rows), 8, 2, 0, 0, 0)
    pixels = zlib.compress(b"".join(b"\0" + row for row in rows))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


def pixels(picture: bytes) -> list[bytes]:
    """The rows of RGB pixels of a picture that Chromium has made."""
    at, data, stride, channels = 8, b"", 0, 3
    while at < len(picture):
        (size,), kind = struct.unpack(">I", picture[at : at + 4]), picture[at + 4 : at + 8]
        chunk = picture[at + 8 : at + 8 + size]
        if kind == b"IHDR":
            channels = {2: 3, 6: 4}[chunk[9]]
            stride = struct.unpack(">I", chunk[:4])[0] * channels
        if kind == b"IDAT":
            data += chunk
        at += 12 + size
    flat, rows = zlib.decompress(data), []
    before = bytearray(stride)
    for start in range(0, len(flat), stride + 1):
        before = _unfiltered(flat[start], bytearray(flat[start + 1 : start + 1 + stride]), before, channels)
        rows.append(bytes(value for at, value in enumerate(before) if at % channels < 3))
    return rows


def _unfiltered(kind: int, row: bytearray, above: bytearray, step: int) -> bytearray:
    """Undo the filter of a PNG's row."""
    for at in range(len(row)):
        left, corner = (row[at - step], above[at - step]) if at >= step else (0, 0)
        up = above[at]
        guess = left + up - corner
        nearest = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2]
        row[at] = row[at] + (0, left, up, (left + up) // 2, nearest)[kind] & 255
    return row
