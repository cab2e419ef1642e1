# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of boxes by their permanent ids, for flight controllers whose BOXNAMES outgrew a frame (INAV, Betaflight).

Only what the bridge looks for is named; the order of the ids is the order of the flags in STATUS.
"""

from collections.abc import Iterable, Mapping

_NAMES: Mapping[str, Mapping[int, str]] = {
    "INAV": {
        0: "ARM",
        1: "ANGLE",
        2: "HORIZON",
        3: "NAV ALTHOLD",
        10: "NAV RTH",
        11: "NAV POSHOLD",
        28: "NAV WP",
    },
    "BTFL": {0: "ARM", 1: "ANGLE", 2: "HORIZON", 3: "ALT HOLD", 11: "POS HOLD", 46: "GPS RESCUE"},
}


def box_names(variant: str, ids: Iterable[int]) -> tuple[str, ...]:
    """Return the names, "" for boxes that mean nothing here; () for a variant whose ids are not known."""
    names = _NAMES.get(variant)
    return () if names is None else tuple(names.get(number, "") for number in ids)
