# SPDX-License-Identifier: GPL-3.0-or-later
"""Pending replies never exceed the flight controller's send ring, stalled or not."""

import random

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.line.conversation import Send
from bridge.line.msp_link import RESYNC, MspLink
from bridge.model.vehicle import Orientation
from protocols.msp.commands import Msp
from protocols.msp.frame import FRAME_OVERHEAD, Direction, MspFrame, MspParser, request
from simulator.board.options import Faults, SimOptions
from tests.support.conversations import Download, records_of, waypoints
from tests.support.seeds import seeds
from tests.support.world import GroundStation, World, flash_holding, ready_world

#: Bytes of its send ring, and of the heartbeat that may join them.
HARAKIRIS_RING, HEARTBEAT = 255, 25

FULL_RECORDS = records_of(waypoints(146, 3))
FULL_FLASH = flash_holding(FULL_RECORDS)


def _taken(link: MspLink) -> list[bytes]:
    taken = [*link.output]
    link.output.clear()
    return taken


def question(command: int, reply_payload: int, *, exclusive: bool = False) -> Send:
    return Send(request(command), command, reply_payload + FRAME_OVERHEAD, exclusive)


def reply(command: int, size: int = 7) -> bytes:
    return MspFrame(Direction.REPLY, command, bytes(size)).encode()


def sent(link: MspLink) -> list[int]:
    return [frame.command for data in _taken(link) for frame in MspParser().feed(data)]


@pytest.mark.parametrize("stall_ms", [150.0, 300.0])
def test_a_download_during_a_configuration_write_is_complete(stall_ms: float) -> None:
    """Mission Planner sets the radius after a Write; the board stalls a second later, perhaps during a Read."""
    for seed in seeds(3):
        draw = random.Random(seed)
        options = SimOptions(config_write_ms=stall_ms, config_write_delay_ms=draw.random() * 300)
        world = ready_world(options, flash=FULL_FLASH)
        world.inside.missions.held = None
        station = GroundStation(world)
        station.send(messages.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", 300.0 + seed, 9))
        world.run(draw.random() * 0.3)
        assert len(Download(station).run(20)) == 146
        world.assert_line_was_clean()
        assert world.naze.counters.max_outstanding_reply_bytes <= HARAKIRIS_RING - HEARTBEAT


@pytest.mark.parametrize("baud", [115200, 38400, 9600])
def test_a_push_with_downloads_and_telemetry_fits_the_ring(baud: int) -> None:
    world = World(SimOptions(baud=baud), speeds=(baud,), flash=FULL_FLASH)
    world.wait_ready(40)
    station = GroundStation(world)
    outcome = world.push(waypoints(60))
    for number in range(40):
        world.after(number * 0.1, lambda: station.send(messages.MAVLink_mission_request_list_message(1, 1, 0)))
        world.after(number * 0.1, lambda: setattr(world.inside.missions, "held", None))
    world.wait_until(lambda _: bool(outcome), 60, then_s=30)
    assert station.messages("MISSION_COUNT")
    assert world.bridge.vehicle.last(Orientation) is not None
    world.assert_line_was_clean()
    assert world.naze.counters.max_outstanding_reply_bytes <= HARAKIRIS_RING - HEARTBEAT


@pytest.mark.parametrize("extension", [True, False])
@pytest.mark.parametrize("rate", [1e-3, 1e-2])
def test_lost_bytes_do_not_overflow_the_ring(rate: float, extension: bool) -> None:
    """Truncated frames, repeats, and padding for a parser without a timeout."""
    for seed in seeds(2):
        world = World(SimOptions(seed=seed), Faults(lost_byte_rate=rate, extension=extension), speeds=(115200,))
        world.run(20)
        world.assert_line_was_clean()
        if not extension and rate == 1e-2:
            assert any(RESYNC in data for _, _, data in world.written)


@pytest.mark.parametrize("hang_s", [0.3, 1.6, 2.4])
@pytest.mark.parametrize("baud", [115200, 1200])
@pytest.mark.parametrize("extension", [True, False])
def test_the_backlog_of_a_stalled_board_fits_the_ring(hang_s: float, baud: int, extension: bool) -> None:
    """It answers everything at once when it resumes: requests, repeats and the probes of the new search."""
    for seed in range(2):
        draw = random.Random(seed)
        world = World(SimOptions(baud=baud, seed=seed), Faults(extension=extension))
        world.wait_ready(60)
        station = GroundStation(world)
        for msgid in (30, 24, 33, 74, 65, 27):
            station.send(messages.MAVLink_command_long_message(1, 1, 511, 0, msgid, 10000, 0, 0, 0, 0, 0))
        world.run(1 + draw.random())
        if extension and seed:
            world.push(waypoints(80))
            world.run(draw.random() * 0.25)
        world.faults.hang = True
        world.run(hang_s)
        world.faults.hang = False
        world.wait_ready(20, then_s=2)
        counters = world.naze.counters
        assert counters.tx_overflows == counters.hazard_runs == 0
        assert counters.max_outstanding_reply_bytes <= 255


# The link alone.


@pytest.fixture
def link() -> MspLink:
    return MspLink(115200, [], 0.0)


def test_requests_wait_for_room_for_their_replies(link: MspLink) -> None:
    for _ in range(5):
        link.send(question(195, 99), 0.0)
    assert sent(link) == [195, 195]
    assert link.outstanding_bytes == 210
    assert link.room < 20
    link.receive(reply(195, 99), 0.02)
    assert sent(link) == [195]


def test_a_timed_out_request_counts_until_the_reply_can_no_longer_come(link: MspLink) -> None:
    link.receiver_timeout_s = 0.05
    link.send(question(195, 99), 0.0)
    link.send(question(195, 99), 0.0)
    sent(link)
    for _ in range(2):
        now = link.due
        link.tick(now)
    assert not link.awaits(195)
    assert link.outstanding_bytes == 210
    link.send(question(195, 99), now)
    # There is no room for it; the reply to a short request shows that those two will not be answered.
    assert sent(link) == [1]
    link.receive(MspFrame(Direction.ERROR, 1).encode(), now + 0.01)
    assert sent(link) == [195]
    assert link.outstanding_bytes == 105


def test_an_unanswered_request_is_forgotten_after_the_longest_stall(link: MspLink) -> None:
    link.receiver_timeout_s = 0.05
    link.send(question(195, 99), 0.0)
    link.send(question(195, 99), 0.0)
    link.send(question(195, 99), 0.0)
    now = 0.0
    for _ in range(12):
        now = link.due
        link.tick(now)
    assert 3.0 < now < 8
    assert sent(link).count(195) == 3


def asked_again(message: Send) -> MspLink:
    """A line on which a request was lost and sent again."""
    link = MspLink(115200, [], 0.0)
    link.receiver_timeout_s = 0.05
    link.send(message, 0.0)
    link.tick(link.due)
    link.send(message, 0.2)
    return link


def test_a_late_reply_is_not_timed_or_counted_twice() -> None:
    link = asked_again(question(101, 11))
    before = link.round_trip_s
    link.receive(reply(101, 11), 0.201)
    assert link.round_trip_s == before
    # One of the two was answered; the other reply may still come.
    assert link.outstanding_bytes == 17
    link.receive(reply(101, 11), 0.202)
    assert link.outstanding_bytes == 0


def test_lost_requests_do_not_block_a_repeat_to_a_board_that_answers() -> None:
    """A regression: each reply to a repeated request left another one open, so requests were sent endlessly."""
    link = asked_again(question(195, 99))
    link.tick(link.due)  # the repeat is lost, too
    now, asked = 2.0, sent(link)
    for _ in range(200):
        now += 0.005
        link.tick(now)
        if Msp.API_VERSION in (fresh := sent(link)):
            link.receive(reply(Msp.API_VERSION, 0), now + 0.002)
        asked += fresh + sent(link)
    assert asked.count(195) == 2


def test_a_reply_ends_earlier_requests(link: MspLink) -> None:
    for command in (101, 106, 108):
        link.send(question(command, 11), 0.0)
    link.receive(reply(108, 11), 0.02)
    assert link.outstanding_bytes == 0
    assert link.requests_lost == 2


def test_an_exclusive_request_is_sent_alone(link: MspLink) -> None:
    link.send(question(191, 7, exclusive=True), 0.0)
    link.send(question(101, 11), 0.0)
    assert sent(link) == [191]
    assert link.room == 0
    link.receive(reply(191), 0.2)
    assert sent(link) == [101]


def test_a_resync_waits_for_the_reply_to_an_exclusive_request(link: MspLink) -> None:
    link.send(question(101, 11), 0.0)
    now = link.due
    link.tick(now)
    link.send(question(106, 18), now)
    link.send(question(191, 7, exclusive=True), now)
    now = link.due
    link.tick(now)
    assert link.requests_lost == 2
    assert RESYNC not in _taken(link)
    link.receive(reply(191), now + 0.1)
    assert RESYNC in _taken(link)


def test_our_own_echo_is_not_a_reply(link: MspLink) -> None:
    link.send(question(101, 11), 0.0)
    assert link.receive(request(101), 0.01) == []
    assert link.outstanding_bytes == 17
    assert link.last_heard_at == 0.0


def test_a_reply_behind_a_false_header_is_found_once_the_line_is_silent(link: MspLink) -> None:
    link.send(question(101, 11), 0.0)
    assert link.receive(b"$M>\xf0" + reply(101, 11), 0.005) == []
    (found,) = link.tick(link.due)
    assert found.command == 101
    assert link.requests_lost == 0


def test_half_a_reply_is_not_thrown_away_because_another_request_timed_out() -> None:
    link = MspLink(1200, [], 0.0)
    link.send(question(101, 11), 0.0)
    link.send(question(106, 18), 0.0)
    long_one = reply(106, 18)
    deadline = link.due
    assert link.receive(long_one[:10], deadline - 0.01) == []
    link.tick(deadline)
    (found,) = link.receive(long_one[10:], deadline + 0.1)
    assert found.command == 106


def test_a_frame_with_a_hazard_byte_is_never_sent(link: MspLink) -> None:
    with pytest.raises(AssertionError, match="hazard"):
        link.send(Send(request(100, b"\x0d"), 100, 13), 0.0)
    assert _taken(link) == []


def test_a_harmless_request_follows_a_frame_with_a_hazard_byte_if_the_board_accepts_them(link: MspLink) -> None:
    """INAV opens its command line after a '#' and 100 ms of silence."""
    link.any_byte = True
    link.send(Send(request(100, b"#"), 100, 13), 0.0)
    assert sent(link) == [100]
    now = link.due
    assert now < 0.1
    link.tick(now)
    assert sent(link) == [Msp.API_VERSION]
    link.tick(now + 0.001)
    assert sent(link) == []


def test_any_other_request_serves_as_a_follow_up(link: MspLink) -> None:
    link.any_byte = True
    link.send(Send(request(100, b"#"), 100, 13), 0.0)
    due = link.due
    link.send(question(101, 11), 0.01)
    link.tick(due)
    assert sent(link) == [100, 101]
