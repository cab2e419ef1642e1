# SPDX-License-Identifier: GPL-3.0-or-later
"""Mode ranges as texts, one for each mode: MODE_RANGES and SET_MODE_RANGE of Cleanflight and its descendants.

>>> ranges_text(bytes((1, 0, 16, 32)), number=1)
'AUX1 1300-1700'
"""

import re
from collections.abc import Iterator

#: Permanent id of the mode, aux channel, first and last step of the pulse.
RANGE_SIZE = 4
_STEP_US, _FIRST_US, _LAST_US = 25, 900, 2100
_MOST_AUX = 14
_RANGE = re.compile(r"AUX(\d{1,2}) (\d{3,4})-(\d{3,4})", re.ASCII)
#: For a refusal.
FORM = f"write AUX1 1300-1700 (several: with '; '), {_FIRST_US} to {_LAST_US} us in steps of {_STEP_US}"


def ranges_text(payload: bytes, number: int) -> str:
    """The ranges of a mode in a reply to MODE_RANGES, or empty if it has none."""
    ranges = sorted(each[1:] for _, each in _slots(payload) if _is_of(each, number))
    return "; ".join(f"AUX{aux + 1} {_us(first)}-{_us(last)}" for aux, first, last in ranges)


def range_writes(payload: bytes, number: int, text: str) -> list[bytes] | None:
    """The payloads of SET_MODE_RANGE that give a mode these ranges, each complete; none that is already there.

    payload: the reply to MODE_RANGES. None if the board has too few ranges. ValueError for another form of text.
    """
    ranges = [_range(each, number) for each in text.split("; ")] if text else []
    wanted = b"".join(ranges)
    if ranges_text(wanted, number) != text:
        raise ValueError(FORM)
    slots = []
    for slot, held in _slots(payload):
        if _is_of(held, number) and held in ranges:
            ranges.remove(held)
        elif _is_of(held, number):
            slots.append(slot)
    own = len(slots)
    slots += [slot for slot, held in _slots(payload) if held[2] >= held[3]]
    if len(ranges) > len(slots):
        return None
    ranges += [bytes(RANGE_SIZE)] * (own - len(ranges))
    return [bytes((slot,)) + each for slot, each in zip(slots, ranges, strict=False)]


def _range(text: str, number: int) -> bytes:
    found = _RANGE.fullmatch(text)
    aux, first, last = map(int, found.groups()) if found is not None else (0, 0, 0)
    if not (0 < aux <= _MOST_AUX and _FIRST_US <= first < last <= _LAST_US) or first % _STEP_US or last % _STEP_US:
        raise ValueError(FORM)
    return bytes((number, aux - 1, (first - _FIRST_US) // _STEP_US, (last - _FIRST_US) // _STEP_US))


def _slots(payload: bytes) -> Iterator[tuple[int, bytes]]:
    for at in range(0, len(payload) - RANGE_SIZE + 1, RANGE_SIZE):
        yield at // RANGE_SIZE, payload[at : at + RANGE_SIZE]


def _is_of(held: bytes, number: int) -> bool:
    """True if it is a range of this mode. An unused range is empty."""
    return held[0] == number and held[2] < held[3]


def _us(step: int) -> int:
    return _FIRST_US + _STEP_US * step
