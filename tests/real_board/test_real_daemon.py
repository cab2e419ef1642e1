# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon and the image as two programs, in real time: the power fails, or the board resets, during an upload."""

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
from tests.support.programs import Daemon, comes, control
from tests.support.real_bench import Figure

_OLD, _NEW = plain_plan(20), plain_plan(146, start=40)
#: In the middle of the new list's records: eight half-words each.
_OPERATION = 600
#: A computer that is too slow for the emulator gets a slow board.
_PATIENCE_S = 300.0
_KEPT, _ARRIVED = "The mission did not arrive: old mission kept, write it again", "The mission did arrive: 146 records"


class RealProgram:
    """`naze-bridge sim --image` and a daemon on it."""

    def __init__(self, start: Starter, flash: bytes) -> None:
        folder = start.directory
        link, self._control = folder / "naze", folder / "naze.sock"
        (folder / "flash").write_bytes(flash)
        options = ("--flash", str(folder / "flash"), "--link", str(link), "--control", str(self._control))
        board = start.program("board.log", "sim", "--image", os.environ["NAZE_IMAGE"], *options)
        assert comes(lambda: "Simulated " in board.printed or not board.is_alive, _PATIENCE_S)
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
        assert comes(lambda: (self.daemon.status() or {}).get("state") == "MSP", _PATIENCE_S), self.daemon.printed


@pytest.fixture
def program(tmp_path: Path, flash: bytes) -> Iterator[RealProgram]:
    with ExitStack() as stack:
        yield RealProgram(Starter(tmp_path, stack), flash)


@pytest.mark.parametrize("interruption", ["power cut", "reset"])
def test_the_last_word_about_an_interrupted_upload_is_true(
    program: RealProgram, figure: Figure, interruption: str
) -> None:
    daemon = program.daemon
    daemon.push(_OLD)
    enough = program.stats["flash_programs"] + _OPERATION
    if interruption == "power cut":
        program.line(f"power_cut_at_flash_operation {_OPERATION}")
    with ThreadPoolExecutor() as pool:
        pushed = pool.submit(daemon.push, _NEW)
        if interruption == "power cut":
            assert comes(lambda: program.stats["power"] == "OFF", _PATIENCE_S)
            program.line("power on")
        else:
            assert comes(lambda: program.stats["flash_programs"] >= enough, _PATIENCE_S)
            program.line("reset")
        began = time.monotonic()
        pushed.exception()  # which says that nobody knows yet
    assert comes(lambda: latest(daemon)["outcome"] in ("FAILED", "VERIFIED"), _PATIENCE_S)
    seconds, found, records = time.monotonic() - began, latest(daemon), program.stats["records"]
    has_arrived = records == records_of(judge(_NEW))
    assert has_arrived or records == records_of(judge(_OLD))
    assert found["detail"] == (_ARRIVED if has_arrived else _KEPT)
    figure(f"the daemon, {interruption} in mid upload: '{found['detail']}'", f"after {seconds:.1f} s")
    program.wait_ready()
    daemon.push(_NEW)
    assert program.stats["records"] == records_of(judge(_NEW))


def latest(daemon: Daemon) -> dict[str, Any]:
    return daemon.missions()[0]
