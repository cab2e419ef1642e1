# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface of all flight controllers' stored records: their bytes, and a list's checksum."""

import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol


class MissionRecord(Protocol):
    """One record as a flight controller stores it; its number is its position in the list."""

    def pack(self) -> bytes:
        """The bytes; struct.error if a field does not fit, which is a bug in the caller."""


@dataclass(frozen=True, slots=True)
class ListIdentity:
    """The identity of a stored list: number of records and CRC-32 over their bytes (0 for none)."""

    count: int
    checksum: int

    def __str__(self) -> str:
        return f"{self.count} records, checksum {self.checksum:08x}"


def pack_records(records: Iterable[MissionRecord]) -> bytes:
    return b"".join([record.pack() for record in records])


def identify(records: Sequence[MissionRecord]) -> ListIdentity:
    """The identity of a list; a Harakiri with the mission extension computes the same."""
    return ListIdentity(len(records), zlib.crc32(pack_records(records)))
