# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes received at the wrong speed never contain a run of bytes on which Harakiri acts.

`garble` samples the waveform of 8N1 bytes like a receiver whose clock may be off by 2 %. Probes may follow each other
at once or after a pause, at any speeds. Harakiri counts across frames, so the tests check every byte sequence by
itself, and the bytes with which sequences can begin and end.
"""

import itertools

import pytest

from bridge.fc.states.searching import SPEEDS
from bridge.line.msp_link import PROBE, RESYNC
from protocols.msp.command_line import RUB_OUT_LINE, typed_and_rubbed_out
from protocols.msp.frame import HAZARDS, is_clean
from simulator.board.line import garble
from simulator.board.options import SimOptions
from simulator.board.traps import HazardWatch
from tests.support.world import World

SENT = sorted(set(SPEEDS))
#: Values of `serial_baudrate` in the CLI, and speeds of other boards.
READ = (1200, 2400, 4800, 7200, 9600, 14400, 19200, 28800, 38400, 57600, 76800, 100000, 115200, 230400, 250000, 1000000)
#: The receiver's clock relative to the sender's, in thousandths.
CLOCKS = (970, 985, 1000, 1015, 1030)


def as_read(data: bytes, sent: int, read: int, clock: int = 1000) -> bytes:
    return garble(data, sent * 1000, read * clock)


def runs(data: bytes) -> int:
    return HazardWatch().runs_in(data)


def test_probes_are_clean_at_their_own_speed() -> None:
    assert is_clean(PROBE)
    assert is_clean(RESYNC)


@pytest.mark.parametrize("read", READ)
def test_probes_are_free_of_runs(read: int) -> None:
    for sent, clock in itertools.product(SENT, CLOCKS):
        assert runs(as_read(PROBE, sent, read, clock)) == 0
        assert runs(as_read(RESYNC, sent, read, clock)) == 0
        assert runs(as_read(RUB_OUT_LINE + typed_and_rubbed_out(PROBE) * 2, sent, read, clock)) == 0
        # Frames without a pause, repeated, so that the sampling points vary.
        assert runs(as_read(RESYNC * 4, sent, read, clock)) == 0


@pytest.mark.parametrize("read", READ)
def test_probes_do_not_form_a_run_across_frames(read: int) -> None:
    """A run across probes needs one that ends with a hazard byte and one that begins with it. There are none."""
    for clock in CLOCKS:
        words = {as_read(frame, sent, read, clock) for sent in SENT for frame in (PROBE, RESYNC)} - {b""}
        for hazard in HAZARDS:
            most_at_end = max(len(word) - len(word.rstrip(bytes((hazard,)))) for word in words)
            most_at_start = max(len(word) - len(word.lstrip(bytes((hazard,)))) for word in words)
            assert not any(set(word) == {hazard} for word in words)
            assert most_at_end + most_at_start < 3


@pytest.mark.parametrize("sent", SENT)
def test_a_receiver_that_starts_within_a_probe_sees_no_run(sent: int) -> None:
    """A receiver that is switched on, or sees its first falling edge, in the middle of a probe."""
    for read in (sent // 12, sent // 6, sent // 4, sent // 3, sent // 2, 2 * sent):
        for clock in CLOCKS:
            for cut in range(1, len(RESYNC)):
                assert runs(as_read(RESYNC[cut:], sent, read, clock)) == 0


@pytest.mark.parametrize("read", [300, 14400, 31250, 250000])
def test_a_minute_of_searching_is_free_of_hazards(read: int) -> None:
    """Ten rounds of the search, received by a board at an unlisted speed."""
    world = World(SimOptions(baud=read))
    world.run(60)
    assert world.events("fc.found") == []
    assert {speed for _, speed, _ in world.written} == set(SPEEDS)
    world.assert_line_was_clean()
    assert world.naze.counters.resets == 0


@pytest.mark.parametrize("read", [9600, 19200, 38400, 57600, 115200, 230400, 250000, 460800, 921600, 1000000])
def test_no_hazard_byte_is_read_at_the_speeds_of_other_firmware(read: int) -> None:
    """INAV needs one '#' and silence to enter its command line, and one 'R' to reboot into its bootloader."""
    for sent, clock, probe in itertools.product(SENT, CLOCKS, (PROBE, RESYNC)):
        assert not {0x23, 0x52} & set(as_read(probe, sent, read, clock))
