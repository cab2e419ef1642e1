# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes received at another speed never contain one of the runs on which Harakiri acts.

`garble` samples the waveform of 8N1 bytes as the receiver does. The receiver's clock may be off by 2 %; a probe may
follow another at once or after a pause, from one speed or another, forever. Harakiri counts across frames, so what
matters is each byte sequence by itself and what any sequence can begin and end with.
"""

import itertools

import pytest

from bridge.fc.autosense import SPEEDS
from bridge.line.msp_link import PROBE, RESYNC
from protocols.msp.echo import RUB_OUT_LINE, typed_and_rubbed_out
from protocols.msp.hazards import HAZARDS, RUN_LENGTH, is_clean
from simulator.line import garble
from simulator.options import SimOptions
from simulator.traps import HazardWatch
from tests.support.world import World

SENT = sorted(set(SPEEDS))
#: What a CLI takes for `serial_baudrate`, and what other boards use.
READ = (1200, 2400, 4800, 7200, 9600, 14400, 19200, 28800, 38400, 57600, 76800, 100000, 115200, 230400, 250000, 1000000)
#: The receiver's clock against the sender's, in thousandths.
CLOCKS = (970, 985, 1000, 1015, 1030)


def heard(data: bytes, sent: int, read: int, clock: int = 1000) -> bytes:
    return garble(data, sent * 1000, read * clock)


def runs(data: bytes) -> int:
    return HazardWatch().runs_in(data)


def test_what_is_sent_is_clean_at_its_own_speed() -> None:
    assert is_clean(PROBE)
    assert is_clean(RESYNC)


@pytest.mark.parametrize("read", READ)
def test_no_run_within_a_probe(read: int) -> None:
    for sent, clock in itertools.product(SENT, CLOCKS):
        assert runs(heard(PROBE, sent, read, clock)) == 0
        assert runs(heard(RESYNC, sent, read, clock)) == 0
        assert runs(heard(RUB_OUT_LINE + typed_and_rubbed_out(PROBE) * 2, sent, read, clock)) == 0
        # The frames that follow without a pause, again and again: the sampling falls into many places.
        assert runs(heard(RESYNC * 4, sent, read, clock)) == 0


@pytest.mark.parametrize("read", READ)
def test_no_run_at_the_border_of_any_two_or_more_probes(read: int) -> None:
    """A run over a border needs a probe that ends in a hazard byte and one that begins with it, or is nothing else.

    There are none, so probes may follow each other in any order forever.
    """
    for clock in CLOCKS:
        words = {heard(frame, sent, read, clock) for sent in SENT for frame in (PROBE, RESYNC)} - {b""}
        for hazard in HAZARDS:
            most_at_end = max(len(word) - len(word.rstrip(bytes((hazard,)))) for word in words)
            most_at_start = max(len(word) - len(word.lstrip(bytes((hazard,)))) for word in words)
            assert not any(set(word) == {hazard} for word in words)
            assert most_at_end + most_at_start < RUN_LENGTH


@pytest.mark.parametrize("sent", SENT)
def test_no_run_where_a_receiver_begins_in_the_middle_of_a_probe(sent: int) -> None:
    """A receiver that is switched on, or finds its first falling edge, in the middle of what we send."""
    for read in (sent // 12, sent // 6, sent // 4, sent // 3, sent // 2, 2 * sent):
        for clock in CLOCKS:
            for cut in range(1, len(RESYNC)):
                assert runs(heard(RESYNC[cut:], sent, read, clock)) == 0


@pytest.mark.parametrize("read", [300, 14400, 31250, 250000])
def test_a_search_that_never_ends_enters_no_trap(read: int) -> None:
    """A board at a speed that is not in our list hears the search for a minute: ten rounds of it."""
    world = World(SimOptions(baud=read))
    world.run(60)
    assert world.events("fc.found") == []
    assert {speed for _, speed, _ in world.written} == set(SPEEDS)
    world.assert_line_was_clean()
    assert world.naze.counters.resets == 0


@pytest.mark.parametrize("read", [9600, 19200, 38400, 57600, 115200, 230400, 250000, 460800, 921600, 1000000])
def test_no_single_trap_byte_at_the_speeds_of_other_firmware(read: int) -> None:
    """INAV needs one '#' and silence to enter its command line, and one 'R' to reboot into its bootloader."""
    for sent, clock, probe in itertools.product(SENT, CLOCKS, (PROBE, RESYNC)):
        assert not {0x23, 0x52} & set(heard(probe, sent, read, clock))
