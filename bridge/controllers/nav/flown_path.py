# SPDX-License-Identifier: GPL-3.0-or-later
"""Effects of a whole list in flight on INAV and MultiWii that no single record shows (docs/inav.md).

Records are given by their place, from 0; a JUMP's p1 is a number, from 1.
"""

from collections.abc import Sequence

from protocols.msp.nav import NavAction, NavRecord

_ENDLESS = -1


def flown_size(records: Sequence[NavRecord]) -> int:
    """The number of records up to the RTH that ends the mission: later ones that no jump reaches are not counted."""
    starts, end = {0}, -1
    while True:
        before, end = end, max(_reached(records, starts))
        if end == before:
            break
        # Even a jump that is never flown needs a target, or INAV does not arm.
        starts |= {record.p1 - 1 for record in records[: end + 1] if record.action == NavAction.JUMP}
    return end + 1 if records[end].action == NavAction.RTH else len(records)


def _reached(records: Sequence[NavRecord], starts: set[int]) -> set[int]:
    reached: set[int] = set()
    ahead = list(starts)
    while ahead:
        place = ahead.pop()
        if place in reached or place >= len(records):
            continue
        reached.add(place)
        record = records[place]
        if record.action == NavAction.JUMP and record.p2:
            ahead.append(record.p1 - 1)
        if record.action != NavAction.RTH and (record.action, record.p2) != (NavAction.JUMP, _ENDLESS):
            ahead.append(place + 1)
    return reached


def lands_after_rth(records: Sequence[NavRecord]) -> bool:
    """True if an INAV lands after any RTH of the list: the last record's p1 decides, regardless of its action.

    INAV keeps a JUMP's target as an index, so one to the first record counts as 0.
    """
    last = records[-1]
    return last.p1 > (1 if last.action == NavAction.JUMP else 0)


def jump_within_jump(records: Sequence[NavRecord]) -> int | None:
    """The place of a JUMP whose loop contains another: MultiWii counts both with one counter, and never ends."""
    jumps = [place for place, record in enumerate(records) if record.action == NavAction.JUMP]
    for outer in jumps:
        if any(records[outer].p1 - 1 <= inner < outer for inner in jumps):
            return outer
    return None
