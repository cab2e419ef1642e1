# SPDX-License-Identifier: GPL-3.0-or-later
"""A pilot at Mission Planner's own code, run by mono (tests/real_mission_planner)."""

import subprocess
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from tests.support.plan import PlanRow
from tests.support.programs import until


@dataclass(frozen=True)
class Shown:
    """Something that the pilot sees or hears: `line` (the HUD's), `dialog`, `voice`, `message`, ready, mode, ..."""

    at: float
    kind: str
    text: str


class RealPlanner:
    """Listens for a vehicle at `port`, as with its connection type UDP."""

    def __init__(self, program: Path, sources: Path, folder: Path, port: int) -> None:
        self.port = port
        self.shown: list[Shown] = []
        names = sources / "ParameterMetaDataBackup.xml"
        self._errors = (folder / "planner.log").open("w")
        self._process = subprocess.Popen(
            ["mono", "--debug", str(program)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            bufsize=1,
            env={"HOME": str(folder), "PATH": "/usr/bin:/bin", "PARAMETER_META_DATA": str(names), "LANG": "C.UTF-8"},
        )
        self._begun = time.monotonic()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait()
        self._reader.join()
        for each in (self._process.stdin, self._process.stdout, self._errors):
            assert each
            each.close()

    def _read(self) -> None:
        assert self._process.stdout
        for line in self._process.stdout:
            kind, tab, text = line.rstrip("\n").partition("\t")
            if tab:
                self.shown.append(Shown(self.now, kind, text.replace("\\n", "\n")))

    @property
    def now(self) -> float:
        """Seconds since the start."""
        return time.monotonic() - self._begun

    def begin(self, *words: object) -> int:
        """Begin something without waiting for its end; return the place of its first entry in `shown`."""
        assert self._process.stdin
        at = len(self.shown)
        self._process.stdin.write("\t".join(map(str, words)) + "\n")
        return at

    def do(self, *words: object) -> list[Shown]:
        """Do something to its end; return what was shown meanwhile, without the progress."""
        at = self.begin(*words)
        until(lambda: any(each.kind == "done" for each in self.shown[at:]), f"the end of {words[:3]}")
        errors = [each.text for each in self.shown[at:] if each.kind == "error"]
        assert not errors, errors[0]
        return [each for each in self.shown[at:] if each.kind not in ("done", "progress", "log", "link")]

    def connect(self) -> None:
        self.do("connect", self.port)
        assert self.seen("dialog") == []

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
        self.do("plan", *(_words(row) for row in rows))
        return self.press("but_writewpfast_Click" if fast else "BUT_write_Click", "FlightPlanner")

    def read(self, tab: str = "MISSION") -> tuple[list[Shown], list[list[float]]]:
        """What was shown, and the list."""
        self.choose("cmb_missiontype", tab, "FlightPlanner")
        shown = self.press("BUT_read_Click", "FlightPlanner")
        items = [[float(word) for word in each.text.split()] for each in shown if each.kind == "item"]
        return [each for each in shown if each.kind != "item"], items

    def parameters(self) -> dict[str, float]:
        pairs = [each.text.split() for each in self.do("parameters") if each.kind == "parameter"]
        return {name: float(value) for name, value in pairs}

    def seen(self, kind: str, since: float = 0.0) -> list[str]:
        """The texts of this kind, in order."""
        return [each.text for each in list(self.shown) if each.kind == kind and each.at >= since]

    def current(self, kind: str) -> str:
        return (self.seen(kind) or [""])[-1]

    def wait_for(self, kind: str, part: str, since: float = 0.0) -> str:
        """Wait for a text of this kind that contains `part`."""
        return until(lambda: next((text for text in self.seen(kind, since) if part in text), None), f"{kind}: {part}")


def _words(row: PlanRow) -> str:
    return f"{row.command} {row.frame} {row.p1} {row.p2} {row.p3} {row.p4} {row.lat} {row.lng} {row.alt}"
