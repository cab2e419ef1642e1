# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests that a patched Harakiri refuses; tests/real_board/test_real_guard.py checks the image."""

import pytest

from protocols.msp.frame import Direction, request
from simulator.board.msp_sensors import MspCommand
from simulator.board.options import Faults
from tests.support.naze_bench import Bench

#: With the payload's length that they are accepted with on the ground.
_SETTERS = (
    (MspCommand.SET_RAW_RC, 16),
    (MspCommand.SET_RAW_GPS, 14),
    (MspCommand.SET_PID, 30),
    (MspCommand.SET_BOX, 30),
    (MspCommand.SET_RC_TUNING, 7),
    (MspCommand.SET_MISC, 2),
    (MspCommand.ACC_CALIBRATION, 0),
    (MspCommand.MAG_CALIBRATION, 0),
    (MspCommand.RESET_CONF, 0),
    (MspCommand.EEPROM_WRITE, 0),
)
#: The longest payload that Harakiri's own buffer holds, to leave bytes for a setter that gets none.
_FILL = request(MspCommand.ATTITUDE, b"\x01" * 64)


def is_refused(bench: Bench, command: int, payload: bytes = b"") -> bool:
    reply = bench.ask(request(command, payload))
    assert reply is not None
    return reply.direction is Direction.ERROR


@pytest.mark.parametrize(("command", "size"), _SETTERS)
@pytest.mark.parametrize("extension", [True, False])
def test_armed_the_patch_refuses_every_setter(command: MspCommand, size: int, extension: bool) -> None:
    bench = Bench(faults=Faults(armed=True, extension=extension))
    bench.run(0.1)
    assert not is_refused(bench, MspCommand.DEBUG)
    assert is_refused(bench, command, bytes(size)) is extension


@pytest.mark.parametrize("extension", [True, False])
def test_a_calibration_restarts_a_flying_craft_only_without_the_patch(extension: bool) -> None:
    bench = Bench(faults=Faults(armed=True, extension=extension))
    bench.run(0.1)
    bench.ask(request(MspCommand.ACC_CALIBRATION))
    bench.run(30.0)
    assert bool(bench.naze.counters.resets) is not extension


@pytest.mark.parametrize("setter", [MspCommand.SET_PID, MspCommand.SET_BOX, MspCommand.SET_RC_TUNING])
@pytest.mark.parametrize("extension", [True, False])
def test_an_empty_setter_stores_what_the_buffer_holds_only_without_the_patch(
    setter: MspCommand, extension: bool
) -> None:
    bench = Bench(faults=Faults(extension=extension))
    getter = {MspCommand.SET_PID: 112, MspCommand.SET_BOX: 113, MspCommand.SET_RC_TUNING: 111}[setter]
    before = bench.payload(request(getter))
    bench.ask(_FILL)
    assert is_refused(bench, setter) is extension
    assert (bench.payload(request(getter)) == before) is extension


def test_wp_needs_the_number() -> None:
    bench = Bench()
    assert is_refused(bench, MspCommand.WP)
    assert not is_refused(bench, MspCommand.WP, b"\0")
