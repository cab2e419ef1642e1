# SPDX-License-Identifier: GPL-3.0-or-later
"""A pilot at QGroundControl's own code (tests/real_qgroundcontrol)."""

from collections.abc import Sequence
from pathlib import Path

from tests.support.plan import PlanRow
from tests.support.real_station import RealStation, Shown, items_of, row_words


class RealQgc(RealStation):
    """Waits for a vehicle at `port`, as with its automatic UDP connection."""

    def __init__(self, program: Path, folder: Path, port: int) -> None:
        super().__init__([str(program)], folder / "qgc.log", {}, port)

    def write(self, rows: Sequence[PlanRow], *, tab: str = "MISSION") -> list[Shown]:
        """Upload a list; the first row of a mission is home."""
        return self.do("write", tab, *(row_words(row) for row in rows), end="ended")

    def read(self, tab: str = "MISSION") -> tuple[list[Shown], list[list[float]]]:
        """What was shown, and the list."""
        shown = self.do("read", tab, end="ended")
        return [each for each in shown if each.kind not in ("item", "ended")], items_of(shown)
