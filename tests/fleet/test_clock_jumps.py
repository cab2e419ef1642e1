# SPDX-License-Identifier: GPL-3.0-or-later
"""The wall clock of a vehicle, or of the watching machine, steps by hours: values and their ages stay true."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.support.fleet_bench import Fleet
from tests.support.forked import CLOCK_FILE
from tests.support.plan import plain_plan
from tests.support.programs import until

_STEPS_S = (6 * 3600.0, -6 * 3600.0, 0.0)


class WallClock:
    """The clock of the processes started while this is in the environment."""

    def __init__(self, file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self._file = file
        self.step(0.0)
        monkeypatch.setenv(CLOCK_FILE, str(file))

    def step(self, wrong_by_s: float) -> None:
        new = self._file.with_suffix(".new")
        new.write_text(str(wrong_by_s))
        new.rename(self._file)


@pytest.fixture
def clock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> WallClock:
    return WallClock(tmp_path / "clock", monkeypatch)


@pytest.fixture
def fleet(tmp_path: Path) -> Iterator[Fleet]:
    with ExitStack() as stack:
        yield Fleet(tmp_path, stack)


def test_a_vehicles_clock_steps(fleet: Fleet, clock: WallClock) -> None:
    """It flies on, is seen as it is, and takes missions."""
    board = fleet.board("kite")
    kite = fleet.start("kite", fc=board.fc)
    fleet.wait("kite")
    is_armed = False
    for number, step_s in enumerate(_STEPS_S):
        clock.step(step_s)
        is_armed = not is_armed
        board.set(f"armed {is_armed:d}")
        until(lambda armed=is_armed: fleet.listed()["kite"]["armed"] is armed, f"the arming after a step of {step_s} s")  # type: ignore[misc]
        board.set("armed 0")
        is_armed = False
        until(lambda: fleet.listed()["kite"]["armed"] is False, "disarmed")
        kite.push(plain_plan(5 + number))
        until(lambda count=5 + number: fleet.listed()["kite"]["mission_count"] == count, "the mission")  # type: ignore[misc]
    assert [mission["outcome"] for mission in kite.missions()] == ["VERIFIED"] * len(_STEPS_S)
