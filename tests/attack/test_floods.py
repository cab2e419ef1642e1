# SPDX-License-Identifier: GPL-3.0-or-later
"""Floods: each requests so much that the pilot, the board or its flash would suffer."""

import json
from contextlib import ExitStack
from pathlib import Path

import pytest

from protocols.mavlink.dialect import Message
from tests.support.attack_pilot import HELLO, Attack, Stranger, Watch, assert_uploads, m
from tests.support.benches import Bench, Starter
from tests.support.plain_station import udp_station
from tests.support.plan import plain_plan
from tests.support.programs import comes, until

#: Requests that write to flash: MSP_EEPROM_WRITE, and the mission extension's RADIUS with the id that follows its size.
_WRITES = (b"$M<\x00\xfa", b"$M<\x04\xc4")


class Line:
    """The bytes that the daemon wrote to the board, from its recording."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def most_requests(self, seconds: float) -> int:
        """The number of requests in the busiest period of that length."""
        times = [at for at, data in self._lines() for _ in range(data.count(b"$M<"))]
        return max(len([at for at in times if began <= at < began + seconds]) for began in times)

    def flash_writes(self) -> int:
        written = b"".join(data for _, data in self._lines())
        return sum(written.count(request) for request in _WRITES)

    def _lines(self) -> list[tuple[float, bytes]]:
        lines = [json.loads(line) for line in self._path.read_text().splitlines() if line.endswith("}")]
        return [(line["t"], bytes.fromhex(line["write"])) for line in lines if "write" in line]


@pytest.fixture
def line(tmp_path: Path) -> Line:
    return Line(tmp_path / "naze.uart")


@pytest.fixture
def bench(start: Starter, tmp_path: Path) -> Bench:
    return start.bench(daemon_options=("--record-uart", str(tmp_path / "naze.uart")))


def command(number: int, p1: float = 0.0, p2: float = 0.0) -> Message:
    return m.MAVLink_command_long_message(1, 1, number, 0, p1, p2, 0, 0, 0, 0, 0)


def test_texts(bench: Bench, stack: ExitStack) -> None:
    """Texts caused by a stranger go only to the stranger."""
    stranger = Stranger(bench.daemon.address)
    stack.callback(stranger.close)
    loud = (command(42428), command(400, 1.0), m.MAVLink_set_mode_message(1, 1, 3), command(22, 1.0))
    with udp_station(bench.daemon.address) as pilot:
        pilot.send(HELLO)
        pilot.wait_for("HEARTBEAT")
        with Watch(bench.daemon) as witness, Attack(lambda: stranger.send(*loud), per_s=125) as attack:
            assert comes(lambda: attack.count > 600)
            assert_uploads(pilot, bench.board, plain_plan(20))
        assert witness.frames[m.MAVLINK_MSG_ID_STATUSTEXT] <= 4
        assert len([heard for heard in stranger.heard() if heard.get_type() == "STATUSTEXT"]) <= 400


def test_rates(bench: Bench, stack: ExitStack) -> None:
    """Thirty strangers want everything a hundred times a second: 16,000 datagrams a second were sent."""
    strangers = [Stranger(bench.daemon.address, f"127.0.1.{number}") for number in range(1, 31)]
    for stranger in strangers:
        stack.callback(stranger.close)
    wanted = [command(511, msgid, 10_000) for msgid in (24, 27, 30, 33, 35, 65, 74, 1, 147, 245, 251, 252)]

    def ask_for_all() -> None:
        for stranger in strangers:
            stranger.send(HELLO, *wanted)

    def sent() -> int:
        return sum(len(stranger.heard()) for stranger in strangers)

    with Watch(bench.daemon) as witness:
        ask_for_all()
        until(lambda: len(witness.gaps_s) >= 1, "a heartbeat")
        sent()
        beats = len(witness.gaps_s)
        until(lambda: len(witness.gaps_s) >= beats + 5, "five seconds of it")
        heard = sent()
    assert heard <= 5.5 * 2400
    with udp_station(bench.daemon.address) as pilot:
        assert_uploads(pilot, bench.board, plain_plan(20))


def test_questions_to_an_armed_board(bench: Bench, line: Line, stack: ExitStack) -> None:
    """MISSION_CLEAR_ALL while armed made the board answer eight times as much as it does for the telemetry."""
    stranger = Stranger(bench.daemon.address)
    stack.callback(stranger.close)
    bench.board.set("armed 1")
    until(lambda: bench.daemon.ask({"do": "status"})["armed"], "the armed state")
    asked = (
        m.MAVLink_mission_clear_all_message(1, 1),
        m.MAVLink_mission_request_int_message(1, 1, 0),
        m.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", 300, 9),
        command(241, 0, 1),
        command(245, 1),
    )
    with Watch(bench.daemon) as witness:
        until(lambda: len(witness.gaps_s) >= 2, "heartbeats")
        with Attack(lambda: stranger.send(*asked), per_s=100):
            beats = len(witness.gaps_s)
            until(lambda: len(witness.gaps_s) >= beats + 4, "four seconds of attack")
    assert bench.daemon.end() == 0
    # It was 342 a second, and is 44 without an attack; finding the board takes more in its first second.
    assert line.most_requests(4.0) <= 4 * 100


def test_flash_writes(bench: Bench, line: Line, stack: ExitStack) -> None:
    """Six a second: its pages last 10,000, which was half an hour."""
    strangers = [Stranger(bench.daemon.address, f"127.0.1.{number}", sysid=number) for number in range(1, 11)]
    for stranger in strangers:
        stack.callback(stranger.close)
    with udp_station(bench.daemon.address) as pilot:
        pilot.send(HELLO)
        pilot.wait_for("HEARTBEAT")
        before = line.flash_writes()
        radius = 200

        def write() -> None:
            nonlocal radius
            for stranger in strangers:
                radius = 200 + (radius + 1) % 500
                stranger.send(m.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", radius, 9), command(245, 1))

        with Watch(bench.daemon), Attack(write, per_s=10) as attack:
            assert comes(lambda: attack.count > 80)
        # 300 at most for ten peers without a limit for all of them together; 60 with it, and one every 20 s.
        assert line.flash_writes() - before <= 70
        assert comes(lambda: pilot.upload(plain_plan(20)) == 0)
