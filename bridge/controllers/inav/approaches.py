# SPDX-License-Identifier: GPL-3.0-or-later
"""The approaches by which an INAV lands an aeroplane, and how they survive a mission's Write.

Each MSP_SET_WP erases one: that of the mission whose number is the count of missions written since the boot, and after
nine missions all of them, also those of the safehomes (fc_msp.c, 7.1.0 to 9.1.0). SAVE would store that.
"""

from collections.abc import Iterable, Sequence

from bridge.controllers.inav.place_store import take
from bridge.line.conversation import Conversation, ask
from protocols.msp.inav_places import (
    APPROACH_SIZE,
    FW_APPROACH,
    SET_FW_APPROACH,
    FwApproach,
    decode_approach,
    encode_read_approach,
)


def read_approaches(numbers: Iterable[int]) -> Conversation[tuple[FwApproach, ...] | None]:
    """Those of these numbers; none from a version before 7.1. None: no answer, or one about others."""
    found: list[FwApproach] = []
    for number in numbers:
        reply = yield from ask(encode_read_approach(number), FW_APPROACH, APPROACH_SIZE)
        if reply is None:
            return None
        approach = decode_approach(reply.payload)
        if approach is None:
            return ()
        if approach.number != number:
            return None
        found.append(approach)
    return tuple(found)


def write_approaches(wanted: Sequence[FwApproach], held: Sequence[FwApproach] = ()) -> Conversation[bool]:
    """Set those that the board lacks, and read them back; False if that fails.

    Of the empty ones only those are set that are not empty in `held`, the board's own.
    """
    filled = {each.number for each in (*wanted, *held) if not each.is_empty}
    for new in wanted:
        if new.number not in filled or (yield from read_approaches((new.number,))) == (new,):
            continue
        is_taken = yield from take(SET_FW_APPROACH, new.pack())
        if not is_taken or (yield from read_approaches((new.number,))) != (new,):
            return False
    return True


def approach_text(approach: FwApproach) -> str:
    """An approach with a heading."""
    level = "sea level" if approach.is_above_sea else "home"
    heights = f"from {approach.approach_cm / 100:g} m to the ground at {approach.ground_cm / 100:g} m above {level}"
    headings = " or ".join(map(str, approach.directions()))
    return f"FW approach {approach.number}: heading {headings}, {heights}"
