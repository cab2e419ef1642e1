# SPDX-License-Identifier: GPL-3.0-or-later
"""harakiri_guard.c on the image: requests that are refused before Harakiri evaluates them."""

from itertools import product

import pytest

from protocols.msp.frame import Direction, MspFrame, request
from simulator.board.msp_sensors import MspCommand
from tests.support.mavlink_ground import MavlinkGround
from tests.support.real_bench import Figure, RealBench

#: Harakiri's reads that take any payload, and the extension's requests, which check the armed flag themselves.
_READS = {*range(100, 118), 254}
_EXTENSION = (179, *range(190, 199))
_LENGTHS = (0, 1, 2, 7, 16, 30, 64, 243)
#: The setters and MSP_WP, and the size that each needs (of SET_BOX with four switches).
_SIZES = {118: 1, 200: 16, 201: 14, 202: 30, 203: 30, 204: 7, 205: 0, 206: 0, 207: 2, 208: 0, 250: 0}
_WRONG_SIZES = (0, 1, 2, 7, 8, 16, 29, 31, 58, 60, 64, 243)
#: Longer than a calibration of the accelerometer takes to begin, and a write of the configuration to end.
_EFFECT_S = 1.0


def is_error(reply: MspFrame) -> bool:
    return reply.direction is Direction.ERROR


def is_refused(bench: RealBench, command: int, payload: bytes = b"") -> bool:
    reply = bench.ask(request(command, payload))
    assert reply is not None, f"no reply to {command} with {len(payload)} bytes"
    return is_error(reply)


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


def test_armed_only_reads_and_the_extension_pass_at_the_port(guarded: RealBench, figure: Figure) -> None:
    """Every command with eight payload lengths, sent to the UART, with the switches of every box on."""
    bench = guarded
    bench.arm()
    faults = bench.naze.faults
    faults.aux1 = faults.aux2 = faults.aux3 = faults.aux4 = 2000
    flash, settings, resets = bytes(bench.flash), configuration(bench), bench.naze.counters.resets
    extension = {command for command in _EXTENSION if (reply := bench.ask(request(command))) and not is_error(reply)}
    taken = 0
    for command, size in product(range(256), _LENGTHS):
        refused = is_refused(bench, command, (b"\x10" + b"\xff" * size)[:size])
        taken += not refused
        assert refused == (command not in extension and (command != 118 or size != 1) and command not in _READS), (
            f"{command} with {size} bytes"
        )
    bench.run(_EFFECT_S)
    assert bench.naze.armed
    assert (bytes(bench.flash), configuration(bench), bench.naze.counters.resets) == (flash, settings, resets)
    figure("armed: commands x lengths at the port", f"{256 * len(_LENGTHS)}, {taken} answered, nothing changed")


def test_a_setter_of_another_size_is_ignored(guarded: RealBench, figure: Figure) -> None:
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


def test_armed_a_mavlink_parameter_set_is_ignored(guarded: RealBench) -> None:
    guarded.configure(tele_prot=2)
    guarded.arm()
    assert MavlinkGround(guarded).set_parameter("p_roll", 44) == []
