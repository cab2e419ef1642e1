# SPDX-License-Identifier: GPL-3.0-or-later
"""harakiri_guard.c on the image: requests that are refused before Harakiri evaluates them."""

import pytest

from protocols.msp.frame import Direction, request
from simulator.board.msp_sensors import MspCommand
from tests.support.real_bench import IDENT, Figure, RealBench

#: Calibrations, RESET_CONF and EEPROM_WRITE: nothing but a frame of six bytes each.
_GROUNDED = (205, 206, 208, 250)
#: The setters and MSP_WP, and the size that each needs (of SET_BOX with four switches).
_SIZES = {118: 1, 200: 16, 201: 14, 202: 30, 203: 30, 204: 7, 205: 0, 206: 0, 207: 2, 208: 0, 250: 0}
_WRONG_SIZES = (0, 1, 2, 7, 8, 16, 29, 31, 58, 60, 64, 243)
#: Longer than a calibration of the accelerometer takes to begin, and a write of the configuration to end.
_EFFECT_S = 1.0


def is_refused(bench: RealBench, command: int, payload: bytes = b"") -> bool:
    reply = bench.ask(request(command, payload))
    assert reply is not None, f"no reply to {command} with {len(payload)} bytes"
    return reply.direction is Direction.ERROR


def configuration(bench: RealBench) -> bytes:
    start = bench.image.symbols["cfg"]
    end = min(address for address in bench.image.symbols.values() if address > start)
    return bench.naze.peek(start, end - start)


@pytest.fixture
def guarded(bench: RealBench) -> RealBench:
    # HarakiriWebstore1 is linked with optimisation, which inlines GuardAccepts.
    if not {"GuardAccepts", "ConfigIsWritten"} & set(bench.image.symbols):
        pytest.skip("NOT RUN: an image without harakiri_guard.c")
    return bench


def test_armed_no_frame_calibrates_resets_or_writes(guarded: RealBench, figure: Figure) -> None:
    bench = guarded
    bench.arm()
    flash, settings, resets = bytes(bench.flash), configuration(bench), bench.naze.counters.resets
    for command in _GROUNDED:
        assert is_refused(bench, command)
        bench.run(_EFFECT_S)
    assert bench.naze.armed
    assert (bytes(bench.flash), configuration(bench), bench.naze.counters.resets) == (flash, settings, resets)
    assert bench.ask(IDENT) is not None
    figure("armed: calibrations, RESET_CONF, EEPROM_WRITE", "refused, still armed, nothing written")


def test_a_setter_of_another_size_changes_nothing(guarded: RealBench, figure: Figure) -> None:
    bench = guarded
    flash, settings = bytes(bench.flash), configuration(bench)
    tried = 0
    for command, size in _SIZES.items():
        for wrong in _WRONG_SIZES:
            if wrong == size or (command == 207 and wrong):
                continue
            # The longest read fills the buffer that the setter would take its values from.
            bench.ask(request(MspCommand.ATTITUDE, b"\x01" * 64))
            assert is_refused(bench, command, b"\x01" * wrong), f"{command} with {wrong} bytes"
            tried += 1
    assert (bytes(bench.flash), configuration(bench)) == (flash, settings)
    figure("setters of another size refused", tried)


def test_setters_of_the_right_size_still_work(guarded: RealBench) -> None:
    bench = guarded
    pids = bytearray(bench.payload(request(MspCommand.PID)))
    pids[0] += 1
    pids[::3] = bytes(max(p, 1) for p in pids[::3])  # HarakiriWebstore1 raises a P of 0
    assert not is_refused(bench, 202, bytes(pids))
    assert bench.payload(request(MspCommand.PID)) == bytes(pids)
    assert not is_refused(bench, 250)
    bench.power_cycle()
    assert bench.payload(request(MspCommand.PID)) == bytes(pids)
