# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of docs/rights.md, from protocols/rights/ and bridge/gcs/rights.py (`make rights-page`)."""

import sys
from collections.abc import Collection, Mapping
from pathlib import Path

from bridge.gcs.rights import RIGHTS
from protocols.mavlink.dialect import MESSAGE_FORMATS, command_name
from protocols.rights import Effect
from protocols.rights.mavlink import COMMANDS, MESSAGES, FieldRule
from protocols.rights.msp import MSP_RIGHTS, Firmware

_SENSOR = "a sensor's value"
_EFFECTS = (Effect.MOVE, Effect.UNKNOWN)


def msp_table() -> str:
    """A row for each effect and set of firmware, but for reads and changes: those are many."""
    rows: dict[tuple[Effect, tuple[Firmware, ...]], dict[int, str]] = {}
    for command in sorted({command for rights in MSP_RIGHTS.values() for command in rights}):
        alike: dict[tuple[Effect, str], list[Firmware]] = {}
        for firmware, rights in MSP_RIGHTS.items():
            if (right := rights.get(command)) and right.effect in _EFFECTS:
                alike.setdefault((right.effect, right.name), []).append(firmware)
        for (effect, request), firmware_list in alike.items():
            rows.setdefault((effect, tuple(firmware_list)), {})[command] = request
    lines = [_line(("effect", "firmware", "requests")), _line(["---"] * 3)]
    for effect in _EFFECTS:
        word = "refused" if effect is Effect.UNKNOWN else effect.value
        alike_firmware = sorted((key for key in rows if key[0] is effect), key=lambda key: [*map(_order, key[1])])
        lines += [_line((word, _names(key[1]), _requests(rows[key]))) for key in alike_firmware]
    return "\n".join(lines) + "\n"


def _order(firmware: Firmware) -> int:
    return [*Firmware].index(firmware)


def _names(firmware: Collection[Firmware]) -> str:
    return ", ".join(each.value for each in firmware if each is not Firmware.HARAKIRI_MISSIONS)


def _requests(texts: Mapping[int, str]) -> str:
    """The requests by name. A sensor's values, which have none, by their range."""
    sensors = [command for command, text in texts.items() if text == _SENSOR]
    named = [text for text in texts.values() if text != _SENSOR]
    return ", ".join([*named, *([f"{_SENSOR} (0x{min(sensors):04X}..0x{max(sensors):04X})"] if sensors else [])])


def _line(cells: Collection[str]) -> str:
    return f"| {' | '.join(cells)} |"


def standing_table() -> str:
    """A row for each standing of a ground station."""
    heads = ("ground station", *next(iter(RIGHTS.values()))._fields)
    lines = [_line(heads), _line(["---"] * len(heads))]
    for standing, rights in RIGHTS.items():
        lines.append(_line([standing.value, *map(_effect_names, rights)]))
    return "\n".join(lines) + "\n"


def _effect_names(effects: Collection[Effect]) -> str:
    missing = [effect for effect in Effect if effect not in effects]
    return f"all but {missing[0]}" if len(missing) == 1 else ", ".join(effects) or "nothing"


def mavlink_table() -> str:
    """A row for each effect of messages."""
    return _effects("messages", {MESSAGE_FORMATS[msgid].name: row for msgid, row in MESSAGES.items()})


def command_table() -> str:
    """A row for each effect of commands that are not moves."""
    return _effects("commands", {command_name(number): row for number, row in COMMANDS.items()})


def filled(page: str) -> str:
    """The page with its tables up to date."""
    for table in (msp_table, standing_table, mavlink_table, command_table):
        begin, end = (f"<!-- {word}: make rights-page: {table.__name__} -->\n" for word in ("begin", "end"))
        page = page.partition(begin)[0] + begin + table() + end + page.partition(end)[2]
    return page


def _effects(head: str, rows: Mapping[str, Effect | FieldRule]) -> str:
    alike: dict[str, list[str]] = {}
    for name, row in sorted(rows.items()):
        alike.setdefault(row.rule if isinstance(row, FieldRule) else row.value, []).append(name)
    lines = [_line(("effect", head)), _line(("---", "---"))]
    lines += [_line((effect, ", ".join(names))) for effect, names in alike.items()]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(filled(Path("docs/rights.md").read_text()))
