# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of docs/rights.md, from protocols/rights/ and bridge/gcs/rights.py (`make rights-page`)."""

import sys
from collections.abc import Collection, Mapping
from pathlib import Path

from bridge.gcs.rights import RIGHTS
from protocols.mavlink.command import command_name
from protocols.mavlink.dialect import messages
from protocols.rights.effect import Effect
from protocols.rights.mavlink import COMMANDS, MESSAGES, FieldRule
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
            others = "" if right.otherwise is Effect.UNKNOWN else f", else {right.otherwise.value}"
            return f"{own_name}read{_payload(right)}{others}, reply {right.reply}"
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


def standing_table() -> str:
    """A row for each standing of a ground station."""
    heads = ("ground station", *next(iter(RIGHTS.values()))._fields)
    lines = [_line(heads), _line(["---"] * len(heads))]
    for standing, rights in RIGHTS.items():
        lines.append(_line([standing.value, *(", ".join(effects) or "nothing" for effects in rights)]))
    return "\n".join(lines) + "\n"


def mavlink_table() -> str:
    """A row for each message, then for each command."""
    return _effects("message", {messages.mavlink_map[msgid].msgname: row for msgid, row in MESSAGES.items()})


def command_table() -> str:
    """A row for each command that is not a move."""
    return _effects("command", {command_name(number): row for number, row in COMMANDS.items()})


def filled(page: str) -> str:
    """The page with its tables up to date."""
    for table in (msp_table, standing_table, mavlink_table, command_table):
        begin, end = (f"<!-- {word}: make rights-page: {table.__name__} -->\n" for word in ("begin", "end"))
        page = page.partition(begin)[0] + begin + table() + end + page.partition(end)[2]
    return page


def _effects(head: str, rows: Mapping[str, Effect | FieldRule]) -> str:
    lines = [_line((head, "effect")), _line(("---", "---"))]
    lines += [_line((name, row.rule if isinstance(row, FieldRule) else row)) for name, row in sorted(rows.items())]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(filled(Path("docs/rights.md").read_text()))
