# SPDX-License-Identifier: GPL-3.0-or-later
"""A pilot at Mission Planner's own code, run by mono (tests/real_mission_planner)."""

from collections.abc import Sequence
from pathlib import Path

from tests.support.plan import PlanRow
from tests.support.real_station import RealStation, Shown, items_of, row_words


class RealPlanner(RealStation):
    """Listens for a vehicle at `port`, as with its connection type UDP."""

    NOISE = ("done", "progress", "log", "link")

    def __init__(self, program: Path, sources: Path, folder: Path, port: int) -> None:
        names = {"PARAMETER_META_DATA": str(sources / "ParameterMetaDataBackup.xml")}
        super().__init__(["mono", "--debug", str(program)], folder / "planner.log", names, port)

    def press(self, handler: str, window: str = "FlightData") -> list[Shown]:
        """Press a button: the name of its handler."""
        return self.do("press", window, handler)

    def choose(self, control: str, value: str, window: str = "FlightData") -> None:
        self.do("choose", window, control, value)

    def write(self, rows: Sequence[PlanRow], *, tab: str = "MISSION", fast: bool = False) -> list[Shown]:
        """Write a list; the first row of a mission is home."""
        self.choose("cmb_missiontype", tab, "FlightPlanner")
        if tab == "MISSION":
            home, *rows = rows
            for field, value in (("TXT_homelat", home.lat), ("TXT_homelng", home.lng), ("TXT_homealt", home.alt)):
                self.choose(field, str(value), "FlightPlanner")
        self.do("plan", *(row_words(row) for row in rows))
        return self.press("but_writewpfast_Click" if fast else "BUT_write_Click", "FlightPlanner")

    def read(self, tab: str = "MISSION") -> tuple[list[Shown], list[list[float]]]:
        """What was shown, and the list."""
        self.choose("cmb_missiontype", tab, "FlightPlanner")
        shown = self.press("BUT_read_Click", "FlightPlanner")
        return [each for each in shown if each.kind != "item"], items_of(shown)
