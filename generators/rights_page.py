# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of docs/rights.md, from protocols/rights/ (`make rights-page`)."""

import sys
from collections.abc import Collection

from protocols.rights.effect import Effect
from protocols.rights.msp import MSP_RIGHTS, Firmware, MspRight

_FIRMWARE = tuple(Firmware)
#: A longer list of payload lengths is given by its ends.
_LISTED = 4


def msp_table() -> str:
    """A row for each command, a column for each firmware."""
    heads = ("command", *(firmware.value for firmware in _FIRMWARE))
    lines = [_line(heads), _line(["---"] * len(heads))]
    for command in sorted({command for rights in MSP_RIGHTS.values() for command in rights}):
        rights = [MSP_RIGHTS[firmware].get(command) for firmware in _FIRMWARE]
        name = next(right.name for right in rights if right)
        number = str(command) if command < 256 else f"0x{command:04X}"
        lines.append(_line([f"{number} {name}", *(_cell(right, name) for right in rights)]))
    return "\n".join(lines) + "\n"


def _cell(right: MspRight | None, name: str) -> str:
    if right is None:
        return ""
    own_name = "" if right.name == name else f"{right.name}: "
    match right.effect:
        case Effect.READ:
            return f"{own_name}read{_payload(right)}, reply {right.reply}"
        case Effect.CHANGE:
            return f"{own_name}change{_payload(right)}"
        case Effect.MOVE:
            return f"{own_name}move"
    return f"{own_name}refused"


def _payload(right: MspRight) -> str:
    if right.only:
        return " " + " or ".join(payload.hex(" ") for payload in sorted(right.only))
    return "" if set(right.lengths) == {0} else f" {_lengths(right.lengths)}"


def _lengths(lengths: Collection[int]) -> str:
    found = sorted(lengths)
    return ", ".join(map(str, found)) if len(found) <= _LISTED else f"{found[0]}..{found[-1]}"


def _line(cells: Collection[str]) -> str:
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    sys.stdout.write(msp_table())
