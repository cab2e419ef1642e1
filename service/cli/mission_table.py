# SPDX-License-Identifier: GPL-3.0-or-later
"""A mission as sent and as stored, side by side, for a terminal."""

import math
from collections.abc import Sequence

from rich import box
from rich.table import Table
from rich.text import Text

from bridge.model.finding import DROPPED, Finding, without_defaults
from protocols.mavlink.command import command_name
from protocols.mission_item import MissionItem
from service.daemon.mission_data import Json, mission_items

_CHANGED = "yellow"
_DROPPED = "red"
_ADDED = "green"
#: Names of stored commands are never shortened.
_LONGEST_STORED = len("RETURN_TO_LAUNCH")
#: Longer ones (coordinates, commands) take two lines, so that the table fits 80 columns.
_LONGEST_PAIR = 8


def mission_table(sent: Sequence[MissionItem], stored: Sequence[MissionItem], findings: Sequence[Finding]) -> Table:
    """One row per item sent, with "sent->stored" for each changed value or item number.

    `stored` is the list as it reads back, empty for a rejected or cleared one; `findings` name the items missing in it,
    and are printed below the table with their reasons, except filled-in defaults.
    """
    reasons = Text("".join(f"\n{finding.text()}" for finding in without_defaults(findings)))
    table = _empty_table(reasons)
    dropped = {finding.seq for finding in findings if finding.becomes == DROPPED}
    left = iter(stored)
    for item in sent:
        before = _values(item)
        if item.seq in dropped:
            table.add_row(f"{item.seq}->-", *before[1:], style=_DROPPED)
        else:
            held = next(left, None)
            table.add_row(*map(_cell, before, _values(held) if held else before))
    return table


def _empty_table(caption: Text) -> Table:
    table = Table(box=box.SIMPLE_HEAD, padding=0, show_edge=False, caption=caption, caption_justify="left")
    table.add_column("WP", justify="right", no_wrap=True)
    table.add_column("Command", min_width=_LONGEST_STORED, overflow="fold")
    for title in ("p1", "p2", "p3", "p4", "Latitude", "Longitude", "Height"):
        table.add_column(title, justify="right", overflow="fold", no_wrap=True)
    return table


def difference_table(rows: Sequence[Json], first: str, second: str) -> Table:
    """One row per item that differs (see service.web.comparison.difference), values as "first->second"."""
    table = _empty_table(Text(f"\n{first} -> {second}"))
    for row in rows:
        left, right = (None if row[side] is None else _values(_shown_item(row[side])) for side in ("left", "right"))
        if left is not None and right is not None:
            table.add_row(*map(_cell, left, right))
        elif left is not None:
            table.add_row(f"{left[0]}->-", *left[1:], style=_DROPPED)
        elif right is not None:
            table.add_row(f"-->{right[0]}", *right[1:], style=_ADDED)
    return table


def _shown_item(shown: Json) -> MissionItem:
    (item,) = mission_items([{key: value for key, value in shown.items() if key != "name"}])
    return item


def _values(item: MissionItem) -> list[str]:
    params = (item.p1, item.p2, item.p3, item.p4)
    place = (_degrees(item.lat_e7), _degrees(item.lon_e7), _number(item.alt_m))
    return [str(item.seq), command_name(item.command), *map(_number, params), *place]


def _cell(was: str, becomes: str) -> Text:
    if was == becomes or (was, becomes) == ("-", "0"):
        return Text(was)
    line_end = "\n" if len(was + becomes) > _LONGEST_PAIR else ""
    return Text(f"{was}{line_end}->{becomes}", style=_CHANGED)


def _number(value: float) -> str:
    return "-" if math.isnan(value) else f"{value + 0.0:g}"  # + 0.0: no "-0"


def _degrees(e7: int | None) -> str:
    return "-" if not e7 else f"{e7 / 1e7:.7f}"
