# SPDX-License-Identifier: GPL-3.0-or-later
"""The output of `fleet watch`: a screen for a person, lines for a program."""

import os
import select
import sys
import termios
import time
import tty
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from enum import IntEnum

import zenoh
from rich.console import Group
from rich.live import Live
from rich.text import Text

from fleet.conditions import Condition
from fleet.session import is_connected
from fleet.tables import watch_table
from fleet.vehicle import FleetVehicle
from fleet.watch import Watch
from terminal.printing import console, print_json

_REFRESH_S = 0.5
#: The slowest profile sends the state every 30 s. One may be lost.
SILENT_S = 70.0
#: Lines without a vehicle: counts, column titles and rule, the last line, and an empty one.
_OTHER_LINES = 5
_LINKED = ("MSP", "MAVLink")
_UNHEARD = "not heard yet"
#: Rows that a key scrolls. Pages are scrolled by `page` rows.
_ROWS = {b"j": 1, b"\x1b[B": 1, b"k": -1, b"\x1b[A": -1}
_PAGES = {b" ": 1, b"\x1b[6~": 1, b"b": -1, b"\x1b[5~": -1}


@dataclass(frozen=True, slots=True)
class ScreenRow:
    """A vehicle on the screen. `age_s`: of the newest state, None if there is none."""

    vehicle: FleetVehicle
    age_s: float | None

    @property
    def is_heard(self) -> bool:
        return self.vehicle.answers

    @property
    def problem(self) -> str:
        """The reason why it needs attention, or empty if it does not, or if it was not heard."""
        if self.vehicle.bridges > 1:
            return f"{self.vehicle.bridges} bridges use this name"
        if not self.is_heard:
            return ""
        if self.age_s is not None and self.age_s > SILENT_S:
            return "silent"
        return "" if self.vehicle.protocol in _LINKED else "no flight controller"


def show_screen(seen: Watch, session: zenoh.Session, conditions: Sequence[Condition]) -> None:
    """Draw the fleet until KeyboardInterrupt."""
    on = console()
    top, was_connected = 0, True
    with _scrolling(), Live(console=on, auto_refresh=False, vertical_overflow="crop") as live:
        while True:
            page = max(on.height - _OTHER_LINES, 1)
            rows = _rows(seen, conditions)
            top = max(0, min(top, len(rows) - page))
            seen.follow([row.vehicle.name for row in rows[top : top + page]])
            connected = is_connected(session)
            if connected and not was_connected:
                seen.call_roll()
            was_connected = connected
            live.update(screen(rows, top, page, is_connected=connected, is_listed=seen.is_listed), refresh=True)
            top += _wait_for_scroll(_REFRESH_S, page)


def screen(rows: Sequence[ScreenRow], top: int, page: int, *, is_connected: bool, is_listed: bool) -> Group | Text:
    """The screen: counts, then armed vehicles, those with problems, the others, and those not heard yet.

    `is_listed`: there are no more vehicles than these.
    """
    if not is_connected:
        return Text("The router is gone; waiting for it. Ctrl-C ends.", style="red")
    if not rows:
        return Text(
            "No such vehicle is alive. Ctrl-C ends." if is_listed else "Waiting for the router's list. Ctrl-C ends."
        )
    counts = Counter(map(_rank, rows))
    heard = len(rows) - counts[_Rank.UNHEARD]
    there = f"{len(rows):,} vehicles"
    if heard < len(rows) or not is_listed:
        there = f"Heard {heard:,} of {'' if is_listed else 'at least '}{there}"
    troubled = sum(bool(row.problem) for row in rows[: counts[_Rank.ARMED]]) + counts[_Rank.PROBLEM]
    head = f"{there}, {counts[_Rank.ARMED]:,} armed, {troubled:,} with problems"
    shown = rows[top : top + page]
    last = "Ctrl-C ends."
    if len(shown) < len(rows):
        last = f"{top + 1:,} to {top + len(shown):,} of {len(rows):,}; arrow keys and space scroll. {last}"
    table = watch_table([(row.vehicle, row.age_s, row.problem or _UNHEARD * (not row.is_heard)) for row in shown])
    return Group(Text(head, style="bold"), table, Text(last, style="dim"))


def print_changes(seen: Watch, conditions: Sequence[Condition]) -> None:
    """Print a line for each vehicle that appears, changes or disappears, until KeyboardInterrupt."""
    known: dict[tuple[str, str], FleetVehicle] = {}
    while True:
        now = {(row.vehicle.name, row.vehicle.session_id): row.vehicle for row in _rows(seen, conditions)}
        for bridge, vehicle in now.items():
            if (before := known.get(bridge)) is not vehicle and before != vehicle:
                print_json({"time_s": round(time.time(), 3), "alive": True, **asdict(vehicle)})
        for name, session_id in known.keys() - now.keys():
            print_json({"time_s": round(time.time(), 3), "alive": False, "name": name, "session_id": session_id})
        known = now
        time.sleep(_REFRESH_S)


def _rows(seen: Watch, conditions: Sequence[Condition]) -> list[ScreenRow]:
    rows = [ScreenRow(vehicle, age_s) for vehicle, age_s in seen.look()]
    if conditions:
        rows = [row for row in rows if all(condition(row.vehicle) for condition in conditions)]
    return sorted(rows, key=_rank)


class _Rank(IntEnum):
    """The order of the rows. Those of one rank are ordered by name."""

    ARMED = 0
    PROBLEM = 1
    FINE = 2
    UNHEARD = 3


def _rank(row: ScreenRow) -> _Rank:
    if row.vehicle.armed:
        return _Rank.ARMED
    if row.problem:
        return _Rank.PROBLEM
    return _Rank.FINE if row.is_heard else _Rank.UNHEARD


@contextmanager
def _scrolling() -> Iterator[None]:
    """Deliver keys as they are pressed, if standard input is a terminal."""
    if not sys.stdin.isatty():
        yield
        return
    before = termios.tcgetattr(sys.stdin)
    try:
        tty.setcbreak(sys.stdin)
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def _wait_for_scroll(timeout_s: float, page: int) -> int:
    """Wait for a key. The rows to scroll, 0 for none."""
    if not sys.stdin.isatty():
        select.select([], [], [], timeout_s)
        return 0
    ready, _, _ = select.select([sys.stdin], [], [], timeout_s)
    key = os.read(sys.stdin.fileno(), 16) if ready else b""
    return _ROWS.get(key, 0) + _PAGES.get(key, 0) * page
