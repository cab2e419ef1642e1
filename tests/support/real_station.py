# SPDX-License-Identifier: GPL-3.0-or-later
"""A ground station's own code, run without a screen: commands on standard input, what the pilot sees on its output."""

import subprocess
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from tests.support.plan import PlanRow
from tests.support.programs import until


@dataclass(frozen=True)
class Shown:
    """Something that the pilot sees or hears: `line` (a HUD's), `dialog`, `voice`, `message`, ready, mode, ..."""

    at: float
    kind: str
    text: str


class RealStation:
    """The running program. `port`: where it waits for a vehicle, over UDP. `log`: its standard error."""

    #: Kinds that no test asks about.
    NOISE: tuple[str, ...] = ("done",)

    def __init__(self, command: Sequence[str], log: Path, environment: Mapping[str, str], port: int) -> None:
        self.port = port
        self.shown: list[Shown] = []
        self._errors = log.open("w")
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            bufsize=1,
            env={"HOME": str(log.parent), "PATH": "/usr/bin:/bin", "LANG": "C.UTF-8", **environment},
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

    def do(self, *words: object, end: str = "done") -> list[Shown]:
        """Do something until a text of the kind `end`; return what was shown meanwhile, without the noise."""
        assert self._process.stdin
        at = len(self.shown)
        self._process.stdin.write("\t".join(map(str, words)) + "\n")
        until(lambda: any(each.kind == end for each in self.shown[at:]), f"the end of {words[:3]}")
        errors = [each.text for each in self.shown[at:] if each.kind == "error"]
        assert not errors, errors[0]
        return [each for each in self.shown[at:] if each.kind not in self.NOISE]

    def connect(self) -> None:
        self.do("connect", self.port)
        assert self.seen("dialog") == []

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


def row_words(row: PlanRow) -> str:
    return f"{row.command} {row.frame} {row.p1} {row.p2} {row.p3} {row.p4} {row.lat} {row.lng} {row.alt}"


def items_of(shown: Sequence[Shown]) -> list[list[float]]:
    """Read items, as in `row_words`."""
    return [[float(word) for word in each.text.split()] for each in shown if each.kind == "item"]
