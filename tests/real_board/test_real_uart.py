# SPDX-License-Identifier: GPL-3.0-or-later
"""The image's serial port: booting, arming, the CLI, Harakiri's own MAVLink upload."""

import re

import pytest

from protocols.mavlink.frame import MavlinkSplitter
from protocols.mission_item import identify
from protocols.msp.mission import INFO_REQUEST, decode_info
from simulator.board.options import TelemetryProtocol
from simulator.emulated_naze.image import Image
from tests.support.naze_bench import mission
from tests.support.real_bench import IDENT, Figure, RealBench


def has_frsky(received: bytes) -> bool:
    """True if there are consecutive values of the FrSky hub protocol."""
    return re.search(rb"(?:\x5e[\x00-\x3f][^\x5e]{2,4}\x5e?){3}", received) is not None


def test_it_boots_and_answers(bench: RealBench, figure: Figure) -> None:
    figure("boot to the first answer", f"{bench.power_cycle():.2f} s")
    begun = bench.now
    assert bench.ask(IDENT) is not None
    figure("IDENT answered after", f"{(bench.now - begun) * 1000:.1f} ms")


def test_requests_during_boot_are_answered_in_one_burst(bench: RealBench, figure: Figure) -> None:
    bench.naze.power_off(bench.now)
    bench.naze.power_on(bench.now)
    for _ in range(12):
        bench.run(0.5)
        bench.send(IDENT)
    received = bench.run(6.0).count(b"$M>")
    figure("requests during boot answered", f"{received} of 12")
    assert received >= 10


@pytest.mark.parametrize("protocol", TelemetryProtocol)
def test_arming_by_stick_selects_protocol_and_speed(
    image: Image, flash: bytes, figure: Figure, protocol: TelemetryProtocol
) -> None:
    bench = RealBench(image, flash)
    bench.configure(tele_prot=protocol.value)
    bench.arm()
    bench.run(3.0)
    expected = {TelemetryProtocol.FRSKY_9600: 9600, TelemetryProtocol.MAVLINK_57600: 57600}.get(protocol, 115200)
    assert bench.naze.baud == expected
    before = len(bench.received)
    answers = bench.ask(IDENT) is not None
    received = bytes(bench.received[before:]) + bench.run(1.0)
    mavlink = [frame.msgid for frame in MavlinkSplitter().feed(received)]
    figure(f"armed with tele_prot {protocol.value}", f"{bench.naze.baud} baud, {kind(answers, mavlink, received)}")
    # FrSky frames are sent in addition to the previous protocol.
    speaks_mavlink = protocol in (TelemetryProtocol.MAVLINK, TelemetryProtocol.MAVLINK_57600)
    assert answers is not speaks_mavlink
    assert bool(mavlink) is speaks_mavlink
    assert has_frsky(received) is (protocol is TelemetryProtocol.FRSKY_9600)
    bench.arm(False)
    bench.run(5.0)
    assert bench.naze.baud == 115200
    assert bench.ask(IDENT) is not None


def kind(answers: bool, mavlink: list[int], received: bytes) -> str:
    if mavlink:
        return f"MAVLink, messages {sorted(set(mavlink))}"
    return f"{'MSP' * answers}{', FrSky' * has_frsky(received)}"


def test_the_cli_works_and_saves(bench: RealBench, figure: Figure) -> None:
    bench.push(mission(5))
    assert b"#" in bench.enter_cli()
    assert "5 Datasets of 146 possible" in bench.type_line("status")
    assert bench.ask(IDENT) is None
    bench.type_line("")  # the characters of the request
    bench.type_line("wpflush")
    bench.type_line("save")
    bench.run(2.0)
    bench.wait_for_boot()
    assert bench.pull() == []
    figure("CLI", "status, wpflush and save work; only a reset ends it")


def test_three_letters_r_start_the_boot_loader_only_in_autosense(bench: RealBench) -> None:
    bench.send(b"RRR")
    assert bench.naze.counters.bootloader_entered is False
    bench.run(6.0)
    bench.send(b"RRR")
    bench.run(3.0)
    assert bench.naze.counters.bootloader_entered or bench.naze.counters.resets


def test_a_truncated_frame_is_dropped(bench: RealBench, figure: Figure) -> None:
    bench.send(b"$M<\xf3\xc0")
    bench.run(0.1)
    assert bench.ask(IDENT, 0.2) is not None
    figure("a truncated frame", "is dropped within 100 ms")


def test_info_reports_a_pushed_list(bench: RealBench) -> None:
    records = mission(146)
    bench.push(records)
    assert bench.pull() == records
    info = decode_info(bench.payload(INFO_REQUEST))
    assert info is not None
    assert info.stored == identify(records)
