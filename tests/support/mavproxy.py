# SPDX-License-Identifier: GPL-3.0-or-later
"""The real MAVProxy, driven through its standard input."""

import os
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from tests.support.plan import PlanRow
from tests.support.programs import TIMEOUT_S, happens

_LISTED = re.compile(
    r"^(?P<command>\d+) (?P<frame>\d+) (?P<lat>\S+) (?P<lon>\S+) (?P<alt>\S+) "
    r"p1=(?P<p1>\S+) p2=(?P<p2>\S+) p3=(?P<p3>\S+) p4=(?P<p4>\S+) cur=0 auto=1$",
    re.MULTILINE,
)


class MavProxy:
    """Connects to `port` when created; keeps its files in `directory`."""

    def __init__(self, directory: Path, port: int, *options: str) -> None:
        self._directory = directory
        self._output = directory / "mavproxy.log"
        self._seen = 0
        program = [sys.executable, str(Path(sys.executable).parent / "mavproxy.py")]
        modules = "--default-modules=wp,param,arm,cmdlong"
        with self._output.open("wb") as output:
            self._process = subprocess.Popen(
                [*program, f"--master=udpout:127.0.0.1:{port}", modules, f"--state-basedir={directory}", *options],
                cwd=directory,
                env=os.environ | {"HOME": str(directory), "PYTHONUNBUFFERED": "1"},
                stdin=subprocess.PIPE,
                stdout=output,
                stderr=output,
                text=True,
                bufsize=1,
            )

    def __enter__(self) -> Self:
        self.wait_for("online system 1")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._process.stdin is not None
        self._process.kill()
        self._process.stdin.close()
        self._process.wait(TIMEOUT_S)

    def type(self, line: str) -> None:
        """Type a line; earlier output is ignored from now on."""
        assert self._process.stdin is not None
        self._seen = len(self._printed())
        self._process.stdin.write(f"{line}\n")

    def wait_for(self, part: str) -> str:
        """Wait until `part` is printed; return all output since the last typed line."""
        text = self._answer(part, TIMEOUT_S)
        assert part in text, f"{part!r} was not printed, but:\n{text}"
        return text

    def load(self, plan: Sequence[PlanRow]) -> None:
        """Write a mission file and `wp load` it."""
        path = self._directory / "plan.waypoints"
        lines = ["QGC WPL 110"]
        for seq, row in enumerate(plan):
            numbers = (row.p1, row.p2, row.p3, row.p4, row.lat, row.lng, row.alt)
            fields = (seq, int(seq == 0), int(row.frame), int(row.command), *map(repr, numbers), 1)
            lines.append("\t".join(map(str, fields)))
        path.write_text("\n".join(lines) + "\n")
        self.type(f"wp load {path}")

    def list(self, count: int) -> list[tuple[float, ...]]:
        """`wp list`: seq, command, frame, param1..4, lat_e7, lon_e7, height of each item.

        MAVProxy requests the list once; if that is lost, its user types the command again.
        """
        for _ in range(3):
            self.type("wp list")
            text = self._answer(f"Saved {count} waypoints", TIMEOUT_S / 2)
            if f"Saved {count} waypoints" in text:
                break
        items = []
        for seq, found in enumerate(_LISTED.finditer(text)):
            command, frame = int(found["command"]), int(found["frame"])
            parameters = [float(found[name]) for name in ("p1", "p2", "p3", "p4")]
            place = [round(float(found[name]) * 1e7) for name in ("lat", "lon")]
            items.append((seq, command, frame, *parameters, *place, float(found["alt"])))
        return items

    def _answer(self, part: str, seconds: float) -> str:
        """The output since the last typed line, once it contains `part`."""
        happens(lambda: part in self._printed()[self._seen :], seconds)
        return self._printed()[self._seen :]

    def _printed(self) -> str:
        return self._output.read_text(errors="replace")
