# SPDX-License-Identifier: GPL-3.0-or-later
"""Several missions in one store of INAV: one after another, each ended by the flag LAST."""

from collections.abc import Sequence
from itertools import accumulate

from protocols.msp.nav import LAST, NavRecord

Mission = tuple[NavRecord, ...]


def split_missions(records: Sequence[NavRecord]) -> list[Mission]:
    """The missions in a store; records after the last flag belong to none."""
    missions: list[Mission] = []
    start = 0
    for end, record in enumerate(records, 1):
        if record.flag == LAST:
            missions.append(tuple(records[start:end]))
            start = end
    return missions


def flown(missions: Sequence[Mission], selected: int) -> Mission:
    """The mission with that number, from 1; the first one if there is none, as INAV does."""
    if not missions:
        return ()
    return missions[selected - 1 if 1 <= selected <= len(missions) else 0]


def erased(others: Sequence[Mission], room: int) -> tuple[Mission, ...]:
    """The last of `others`, as many as do not fit into `room` records; the order of the rest is kept."""
    return tuple(mission for mission, end in zip(others, accumulate(map(len, others)), strict=True) if end > room)
