# SPDX-License-Identifier: GPL-3.0-or-later
"""Floods of requests, each enough to harm the pilot, the board or its flash."""

from contextlib import ExitStack

import pytest

from protocols.mavlink.dialect import Message
from tests.support.attack_pilot import HELLO, Attack, Stranger, Watch, assert_uploads, m
from tests.support.benches import Bench, Starter
from tests.support.plain_station import udp_station
from tests.support.plan import plain_plan
from tests.support.programs import happens


@pytest.fixture
def bench(start: Starter) -> Bench:
    return start.bench()


def command(number: int, p1: float = 0.0, p2: float = 0.0) -> Message:
    return m.MAVLink_command_long_message(1, 1, number, 0, p1, p2, 0, 0, 0, 0, 0)


def test_the_text_of_a_refusal_goes_only_to_its_station(bench: Bench, stack: ExitStack) -> None:
    """Refusals sent to a stranger do not reach the pilot."""
    stranger = Stranger(bench.daemon.address)
    stack.callback(stranger.close)
    loud = (command(42428), command(400, 1.0), m.MAVLink_set_mode_message(1, 1, 3), command(22, 1.0))
    with udp_station(bench.daemon.address) as pilot:
        pilot.send(HELLO)
        pilot.wait_for("HEARTBEAT")
        with Watch(bench.daemon) as monitor, Attack(lambda: stranger.send(*loud), per_s=125) as attack:
            assert happens(lambda: attack.count > 600)
            assert_uploads(pilot, bench.board, plain_plan(20))
        assert monitor.frames[m.MAVLINK_MSG_ID_STATUSTEXT] <= 4


def test_a_flood_to_the_open_port_does_not_lose_a_request_of_a_connected_station(
    bench: Bench, stack: ExitStack
) -> None:
    """For some seconds, 15,000 foreign datagrams a second: ten times what the kernel's queue of the port holds."""
    strangers = [Stranger(bench.daemon.address, f"127.0.1.{number + 1}") for number in range(50)]
    for stranger in strangers:
        stack.callback(stranger.close)
    foreign = bytes(HELLO.pack(m.MAVLink(None, srcSystem=99, srcComponent=190)))

    def flood() -> None:
        for stranger in strangers:
            stranger.send_bytes(foreign)

    with udp_station(bench.daemon.address) as pilot:
        for _ in range(3):
            pilot.send(HELLO)
            pilot.wait_for("HEARTBEAT")
        with Attack(flood, per_s=300) as attack:
            assert happens(lambda: attack.count > 100)
            for number in range(150):
                pilot.send(m.MAVLink_ping_message(0, number, 0, 0))
                assert pilot.wait_for("PING").seq == number
