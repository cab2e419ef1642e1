# SPDX-License-Identifier: GPL-3.0-or-later
"""The byte runs on which Harakiri acts outside any protocol (serialCom), with the exact behaviour of its counters."""

import pytest

from protocols.mission_item import identify, pack_records
from protocols.msp.frame import request
from protocols.msp.mission import INFO_REQUEST, decode_info, encode_begin, encode_chunk
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.board.simulated_board import Power
from simulator.naze.firmware import Protocol
from tests.support.naze_bench import BOOT_SECONDS, Bench, mission

IDENT = request(100)
# A frame that ends in a single 0D: size 1 ^ command 108 ^ payload 60.
ENDS_IN_CR = request(108, b"\x60")


def speaks_msp(bench: Bench) -> bool:
    return bench.ask(IDENT) is not None


def stock() -> Bench:
    """A board without the patch, which also counts bytes within frames."""
    return Bench(faults=Faults(extension=False))


def test_three_returns_spread_over_frames_enter_the_cli() -> None:
    bench = stock()
    assert ENDS_IN_CR[-1] == 0x0D
    assert bench.ask(ENDS_IN_CR) is not None
    bench.send(b"\r\r")
    received = bench.run(0.1)
    assert bench.naze.counters.cli_entered
    assert bench.naze.power is Power.CLI
    assert b"# " in received
    assert not speaks_msp(bench)
    bench.run(10)
    assert not speaks_msp(bench)
    assert bench.naze.counters.hazard_runs == 1


def test_three_returns_within_a_frame_enter_the_cli() -> None:
    bench = stock()
    assert speaks_msp(bench)
    assert bench.ask(request(250, b"\r\r\r"), timeout=0.1) is None
    assert bench.naze.counters.cli_entered


@pytest.mark.parametrize("run", [b"\r\r\r", b"###", b"RRR"])
def test_with_the_patch_a_run_within_a_frame_is_only_counted(run: bytes) -> None:
    bench = Bench()
    assert bench.ask(request(109, run)) is not None
    bench.send(run[:2])
    bench.run(0.1)
    assert speaks_msp(bench)
    assert bench.naze.counters.hazard_runs == 1


@pytest.mark.parametrize(
    ("sent", "armed", "runs"), [(b"\r\rx\r\r", False, 0), (b"\r\r$\r", False, 0), (b"\r\r\r\r", True, 1)]
)
def test_returns_are_harmless_while_armed_and_with_a_byte_between_them(sent: bytes, armed: bool, runs: int) -> None:
    bench = Bench(faults=Faults(armed=armed))
    bench.run(0.01)
    bench.send(sent)
    bench.run(0.1)
    assert not bench.naze.counters.cli_entered
    assert bench.naze.counters.hazard_runs == runs


@pytest.mark.parametrize(("run", "power"), [(b"###", Power.CLI), (b"RRR", Power.BOOTLOADER)])
def test_number_signs_and_letters_r_act_in_autosense_only(run: bytes, power: Power) -> None:
    quiet = Bench()
    assert speaks_msp(quiet)
    quiet.send(run * 4)
    quiet.run(0.1)
    assert quiet.naze.power is Power.RUNNING
    assert quiet.naze.counters.hazard_runs == 1
    bench = Bench()
    bench.send(run)
    bench.run(0.01)
    assert bench.naze.power is power


def test_a_reset_is_silent_for_two_seconds_and_loses_the_ram() -> None:
    bench = Bench()
    records = mission(20)
    bench.progress(encode_begin(identify(records)))
    bench.progress(encode_chunk(pack_records(records), 0, 15).frame)
    bench.run(4.1)
    assert bench.naze.protocol is Protocol.AUTOSENSE
    bench.naze.reset(bench.now)
    bench.received.clear()
    assert bench.ask(IDENT, timeout=BOOT_SECONDS - 0.1) is None
    assert bench.received == b""
    bench.run(0.1)
    info = decode_info(bench.payload(INFO_REQUEST))
    assert info is not None
    assert info.staged == 0
    assert not info.flags


def test_the_autosense_counters_are_kept_outside_of_it() -> None:
    """Two '#' before MSP is found and one four seconds after it is lost count as three."""
    bench = stock()
    bench.send(b"##")
    bench.run(0.01)
    assert speaks_msp(bench)
    bench.send(b"abc")
    bench.run(4.5)
    assert bench.naze.protocol is Protocol.AUTOSENSE
    assert not bench.naze.counters.cli_entered
    # The MSP frame's first byte was read in AUTOSENSE and cleared the count.
    bench.send(b"#")
    bench.run(0.1)
    assert not bench.naze.counters.cli_entered

    bench = stock()
    bench.send(IDENT[:-1] + b"##")  # a broken frame: AUTOSENSE continues and counts
    bench.run(0.01)
    bench.send(b"#")
    bench.run(0.01)
    assert bench.naze.counters.cli_entered


def test_signs_act_on_an_armed_craft_that_never_left_autosense() -> None:
    """With tele_prot 1 arming does not select a protocol."""
    options = SimOptions(tele_prot=TelemetryProtocol.FRSKY_9600)
    bench = Bench(options, Faults(armed=True))
    bench.run(0.5)
    assert bench.naze.protocol is Protocol.AUTOSENSE
    bench.send(b"###")
    bench.run(0.1)
    assert bench.naze.counters.cli_entered


def test_the_cli_echoes_and_a_power_cycle_ends_it() -> None:
    bench = Bench()
    bench.send(b"\r\r\r")
    bench.run(0.1)
    bench.send(b"\r nonsense\r")
    assert bench.run(0.1) == b"nonsense\r\nThat was Harakiri, try 'help'\r\n# "
    bench.naze.power_off(bench.now)
    bench.naze.power_on(bench.now)
    bench.run(BOOT_SECONDS + 0.1)
    assert speaks_msp(bench)


def in_cli(records: int = 0) -> Bench:
    bench = Bench()
    if records:
        bench.push(mission(records))
    bench.send(b"\r\r\r")
    assert bench.run(0.2).endswith(b"\r\n# ")
    return bench


def typed(bench: Bench, line: bytes, seconds: float = 0.3) -> bytes:
    bench.send(line + b"\r")
    return bench.run(seconds)


def test_the_cli_counts_the_records_and_wpflush_counts_after_save() -> None:
    bench = in_cli(5)
    assert b"5 Datasets of 146 possible" in typed(bench, b"status")
    assert b"0 Datasets" in typed(bench, b"wpflush")
    assert len(bench.naze.stored_records) == 5
    assert b"Rebooting" in typed(bench, b"save", 2.0)
    assert bench.naze.counters.resets == 1
    bench.run(BOOT_SECONDS)
    assert bench.pull() == []


def test_exit_restarts_the_board_without_saving() -> None:
    bench = in_cli(5)
    typed(bench, b"wpflush")
    typed(bench, b"exit", 2.0)
    bench.run(BOOT_SECONDS)
    assert bench.naze.counters.resets == 1
    assert bench.pull() == mission(5)
