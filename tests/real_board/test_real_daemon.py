# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon and the image as two processes, in real time: a power cut during an upload."""

import json
import os
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from tests.support.benches import Starter
from tests.support.plan import judge, plain_plan, records_of
from tests.support.programs import control, happens
from tests.support.real_bench import Figure

#: Short enough for the daemon's time limit even if a slow computer emulates the board at a tenth of its speed.
_OLD, _NEW = plain_plan(20), plain_plan(30, start=40)
#: During the new list's records, eight half-words each.
_OPERATION = 120
_TIMEOUT_S = 300.0


class RealProgram:
    """`naze-bridge sim --image` and a daemon on it."""

    def __init__(self, start: Starter, flash: bytes) -> None:
        folder = start.directory
        link, self._control = folder / "naze", folder / "naze.sock"
        (folder / "flash").write_bytes(flash)
        options = ("--flash", str(folder / "flash"), "--link", str(link), "--control", str(self._control))
        board = start.program("board.log", "sim", "--image", os.environ["NAZE_IMAGE"], *options)
        assert happens(lambda: "Simulated " in board.printed or not board.is_alive, _TIMEOUT_S)
        assert board.is_alive, board.printed
        self.daemon = start.daemon(str(link))
        self.wait_ready()

    def line(self, line: str) -> None:
        assert control(self._control, line) == "ok"

    @property
    def stats(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(control(self._control, "stats"))
        return found

    def wait_ready(self) -> None:
        assert happens(lambda: (self.daemon.status() or {}).get("state") == "MSP", _TIMEOUT_S), self.daemon.printed


@pytest.fixture
def program(tmp_path: Path, flash: bytes) -> Iterator[RealProgram]:
    with ExitStack() as stack:
        yield RealProgram(Starter(tmp_path, stack), flash)


def test_an_upload_interrupted_by_a_power_cut_is_settled(program: RealProgram, figure: Figure) -> None:
    daemon = program.daemon
    daemon.push(_OLD)
    program.line(f"power_cut_at_flash_operation {_OPERATION}")
    with ThreadPoolExecutor() as pool:
        pushed = pool.submit(daemon.push, _NEW)
        assert happens(lambda: program.stats["power"] == "OFF", _TIMEOUT_S)
        program.line("power on")
        began = time.monotonic()
        assert pushed.exception()
    assert happens(lambda: daemon.missions()[0]["outcome"] == "FAILED", _TIMEOUT_S), daemon.printed
    last_word = daemon.missions()[0]["detail"]
    figure(f"the daemon, power cut in mid upload: '{last_word}'", f"after {time.monotonic() - began:.1f} s")
    assert last_word == "No answer, old mission kept: write it again"
    assert program.stats["records"] == records_of(judge(_OLD))
    program.wait_ready()
    daemon.push(_NEW)
    assert program.stats["records"] == records_of(judge(_NEW))
