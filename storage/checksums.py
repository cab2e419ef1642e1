# SPDX-License-Identifier: GPL-3.0-or-later
"""The checksums of a stored mission. SQLite detects damaged page structures, but not a changed byte in a value."""

import zlib
from collections.abc import Iterable

#: The columns of `missions` that its crc32 covers.
SUMMARY = (
    "number, received_at, source, verdict, ack, item_count, finding_count, record_count, checksum, outcome, detail,"
    " concluded_at"
)
#: The columns of `mission_contents` that its crc32 covers.
CONTENTS = ("items", "findings", "stored_items", "roi_commands", "records")


def row_crc32(*values: object) -> int:
    """The checksum of a row of `missions`, over the columns of SUMMARY."""
    return zlib.crc32(repr(values).encode(errors="backslashreplace"))


def contents_crc32(contents: Iterable[object]) -> int:
    """The checksum of a row of `mission_contents`, over the columns of CONTENTS; a damaged one may have any type."""
    crc = 0
    for part in contents:
        crc = zlib.crc32(part if isinstance(part, bytes) else str(part).encode(errors="surrogateescape"), crc)
    return crc
