# SPDX-License-Identifier: GPL-3.0-or-later
"""A mission as sent and as stored, side by side, for a terminal."""

import math
from collections.abc import Sequence

from rich import box
from rich.table import Table
from rich.text import Text

from payloads.comparison import sent_and_stored
from payloads.mission_data import correction_texts
from protocols.mavlink.dialect import command_name
from protocols.mission_item import MissionItem
from reports.finding import Finding

_CHANGED = "yellow"
_DROPPED = "red"
_ADDED = "green"
#: Names of stored commands are never shortened.
_LONGEST_STORED = len("RETURN_TO_LAUNCH")
#: Longer values (coordinates, commands) take two lines, so that the table fits 80 columns.
_LONGEST_PAIR = 8


def mission_table(
    sent: Sequence[MissionItem],
    stored: Sequence[MissionItem],
    findings: Sequence[Finding],
    sent_seqs: Sequence[int | None] = (),
) -> Table:
    """One row per item sent, with "sent->stored" for each changed value or item number, and one per inserted item.

    `stored` is the list as it reads back, empty for a rejected or cleared list. `findings` name the missing items,
    and are printed below the table with their reasons, except filled-in defaults. `sent_seqs`: see Verdict.
    """
    reasons = Text("".join(f"\n{text}" for text in correction_texts(findings)))
    table = Table(box=box.SIMPLE_HEAD, padding=0, show_edge=False, caption=reasons, caption_justify="left")
    table.add_column("WP", justify="right", no_wrap=True)
    table.add_column("Command", min_width=_LONGEST_STORED, overflow="fold")
    for title in ("p1", "p2", "p3", "p4", "Latitude", "Longitude", "Height"):
        table.add_column(title, justify="right", overflow="fold", no_wrap=True)
    for row in sent_and_stored(sent, stored, findings, sent_seqs):
        left, right = (item and _values(item) for item in (row.left, row.right))
        if left and row.kind == "dropped":
            table.add_row(f"{left[0]}->-", *left[1:], style=_DROPPED)
        elif left:
            table.add_row(*map(_cell, left, right or left))
        elif right:
            table.add_row(f"-->{right[0]}", *right[1:], style=_ADDED)
    return table


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
