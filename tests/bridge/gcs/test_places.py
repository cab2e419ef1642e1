# SPDX-License-Identifier: GPL-3.0-or-later
"""Floods from thousands of forged addresses and from a single one."""

import gc
import itertools
import random
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from unittest.mock import Mock

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import GroundStation as GcsStation
from bridge.gcs.places import MAX_PEERS
from bridge.gcs.rights import LinkAccess
from bridge.gcs.station import Peer, Station
from bridge.transfers import upload_states
from bridge.transfers import uploads as uploads_module
from bridge.transfers.upload_answers import UploadAnswers
from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.dialect import Message
from protocols.mavlink.frame import MavlinkFrame
from protocols.mission_item import MissionResult
from tests.support.conversations import Upload, count_message, item_message, records_of, waypoints
from tests.support.packing import pack
from tests.support.world import GroundStation, Radio, World, ready_world

HELLO = m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
SECONDS, PER_S = 4, 2000

Address = tuple[str, int]


def new_hosts(draw: random.Random) -> Callable[[], Address]:
    """Forged: each datagram comes from another machine."""
    return lambda: (f"10.{draw.randrange(256)}.{draw.randrange(256)}.{draw.randrange(256)}", 14550)


def new_ports(_draw: random.Random) -> Callable[[], Address]:
    """One machine with a new port for each datagram."""
    ports = itertools.count(1024)
    return lambda: ("10.0.0.9", next(ports))


def same_again(draw: random.Random) -> Callable[[], Address]:
    """Ninety addresses of three machines; each keeps sending, like a ground station."""
    return lambda: (f"10.0.0.{draw.randrange(3)}", draw.randrange(30))


def many_hosts(draw: random.Random) -> Callable[[], Address]:
    """Most addresses of a network, each sending repeatedly."""
    return lambda: (f"10.0.0.{draw.randrange(200)}", 14550)


def attack(world: World, spoken: list[Message], address: Callable[[], Address], per_s: int, seconds: float) -> None:
    stranger = GroundStation(world, "stranger", sysid=99)
    frames = itertools.cycle([stranger.pack(message) for message in spoken])

    def send() -> None:
        world.bridge.gcs_received(Peer("udp", address()), next(frames), world.now, datagram=True)

    for number in range(int(seconds * per_s)):
        world.after(number / per_s, send)


def hear(ground: Ground, station: Station, now: float) -> None:
    """Let a station send heartbeats until it is steady."""
    frame = MavlinkFrame(FrameWriter(station.sysid, station.compid).frame(pack(HELLO), 2))
    for beat in range(3):
        sender = ground.station(station.peer) or ground.sender(station.peer, now + beat, datagram=False)
        assert sender is not None
        ground.heard(sender, frame, frame.sender, now + beat)


def longest_gap_s(pilot: GroundStation, since: float) -> float:
    heartbeats = [at for at, message in pilot.received if message.get_type() == "HEARTBEAT"]
    return max(after - before for before, after in pairwise([since, *heartbeats, pilot.world.now]))


def remembered() -> int:
    """The stations and addresses that are still somewhere in memory."""
    gc.collect()
    return sum(type(each) in (GcsStation, Peer) for each in gc.get_objects())


def test_a_flood_does_not_affect_a_pilot_who_connected_before_it() -> None:
    world = ready_world()
    pilot = GroundStation(world, "pilot", radio=Radio(delay_s=0.01))
    pilot.send(HELLO)
    world.run(1)
    pilot.take()
    began = world.now
    attack(world, [HELLO, count_message(9)], new_hosts(random.Random(1)), PER_S, SECONDS)
    assert Upload(pilot, waypoints(20)).run(2) is MissionResult.ACCEPTED
    world.run(began + SECONDS - world.now)
    assert world.stored == records_of(waypoints(20))
    assert longest_gap_s(pilot, began) <= 1.1
    # Few of them are remembered.
    assert len(world.events("gcs.found")) < 3 * MAX_PEERS
    assert len(world.inside.ground.peers()) <= MAX_PEERS
    assert remembered() < 1500


def test_refused_addresses_are_not_remembered() -> None:
    world = World(speeds=(115200,), links={"udp": LinkAccess(may_write=lambda _peer: False)})
    stranger = GroundStation(world, "stranger")
    for number in range(2000):
        peer = Peer("udp", (f"10.0.{number // 250}.{number % 250}", 14550))
        world.bridge.gcs_received(peer, stranger.pack(count_message(9)), number / PER_S, datagram=True)
        world.bridge.tick(number / PER_S)
    assert remembered() <= MAX_PEERS


def test_listed_addresses_that_send_no_frame_are_not_remembered() -> None:
    """Any host of the listed network may use any port."""
    world = World(speeds=(115200,), links={"udp": LinkAccess(may_write=lambda _peer: True)})
    for port in range(1024, 3024):
        world.bridge.gcs_received(Peer("udp", ("192.168.4.9", port)), b"\xfd", port / PER_S, datagram=True)
    assert remembered() < 10


@pytest.mark.parametrize("addresses", [new_hosts, new_ports, same_again, many_hosts])
def test_a_pilot_who_arrives_later_can_write(addresses: Callable[[random.Random], Callable[[], Address]]) -> None:
    """The flood announces 500 lists a second, sixty times the limit for all newcomers together."""
    world = ready_world()
    pilot = GroundStation(world, "pilot", radio=Radio(delay_s=0.01))
    attack(world, [count_message(9)], addresses(random.Random(7)), 500, 6.0)
    world.run(0.5)
    for beat in range(4):
        world.after(beat, lambda: pilot.send(HELLO))
    world.run(1.1)
    came_at = world.now
    world.run(1.5)
    # Mission Planner's MISSION_COUNT: 700 ms x 4.
    assert Upload(pilot, waypoints(20), repeat_s=0.7, tries=4).run(2) is MissionResult.ACCEPTED
    assert world.stored == records_of(waypoints(20))
    assert longest_gap_s(pilot, came_at) <= 1.1


@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize("addresses", [new_ports, many_hosts])
def test_a_lost_final_ack_is_repeated_in_a_flood(
    addresses: Callable[[random.Random], Callable[[], Address]], *, late: bool
) -> None:
    world = ready_world()
    pilot = GroundStation(world, "pilot", radio=Radio(delay_s=0.01))
    for beat in range(4):
        world.after(beat + 0.5 * late, lambda: pilot.send(HELLO))
    world.run(0.0 if late else 3.5)
    attack(world, [count_message(9)], addresses(random.Random(7)), 500, 8.0)
    world.run(3.5)
    plan = waypoints(20)
    assert Upload(pilot, plan, repeat_s=0.7).run(3) is MissionResult.ACCEPTED
    world.run(2)
    # The ack was lost: Mission Planner repeats its last item.
    pilot.take()
    pilot.send(item_message(19, plan[19]))
    world.run(0.1)
    assert [ack.type for ack in pilot.messages("MISSION_ACK")] == [MissionResult.ACCEPTED]


@pytest.mark.parametrize("ids_of_one", [True, False])
def test_an_answer_to_a_peer_with_standing_is_kept(*, ids_of_one: bool) -> None:
    """Even a refusal. A peer with standing makes up ids, or other hosts get lists accepted."""
    ground = ready_world().inside.ground
    pilot, rival = (Station(Peer("udp", (f"10.0.0.{number}", 14550)), 255, 190) for number in (1, 2))
    others = (Peer("udp", (f"10.1.{number // 250}.{number % 250}", 14550)) for number in range(2000))
    for station in (pilot, rival, *(Station(Peer("udp", (f"10.0.1.{each}", 1)), 9, 9) for each in range(14))):
        hear(ground, station, 0.0)
    answers = UploadAnswers(ground, lambda _peer, _now: None)
    answers.end(pilot, MissionResult.DENIED, 9, 0.0)
    for number, other in enumerate(others):
        peer = rival.peer if ids_of_one else other
        answers.end(Station(peer, number % 250, number // 250), MissionResult.ACCEPTED, 9, 1.0)
    ground.take_datagrams()
    answers.late_item(pilot, 0, 2.0, is_lost=False)
    assert [peer for peer, _ in ground.take_datagrams()] == [pilot.peer]


def test_a_pilot_on_a_slow_radio_can_write_during_a_flood() -> None:
    """Between two of the pilot's items a hundred lists are announced."""
    world = ready_world()
    pilot = GroundStation(world, "pilot", radio=Radio(delay_s=0.7))
    for beat in range(4):
        world.after(beat, lambda: pilot.send(HELLO))
    world.run(4)
    attack(world, [HELLO, count_message(9)], many_hosts(random.Random(7)), 200, 4.0)
    world.run(1)
    assert Upload(pilot, waypoints(3), repeat_s=1.5).run() is MissionResult.ACCEPTED
    assert world.stored == records_of(waypoints(3))


def test_a_pilot_on_a_slow_radio_who_arrives_later_can_write() -> None:
    """Before the pilot's first item arrives, two hundred hosts have each announced a list and sent one item."""
    world = ready_world()
    for number in range(200):
        stranger = GroundStation(world, f"10.0.0.{number}", sysid=99)
        world.after(number / 50, partial(stranger.send, count_message(9)))
        world.after(number / 50 + 0.5, partial(stranger.send, item_message(0, waypoints(9)[0])))
    pilot = GroundStation(world, "pilot", radio=Radio(delay_s=0.8))
    world.run(0.2)
    pilot.send(HELLO)
    assert Upload(pilot, waypoints(3), repeat_s=1.7).run() is MissionResult.ACCEPTED
    assert world.stored == records_of(waypoints(3))


def test_a_sender_over_its_limit_is_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    world = ready_world()
    read = Mock(wraps=world.inside.ground.heard)
    monkeypatch.setattr(world.inside.ground, "heard", read)
    stranger = GroundStation(world)
    data = stranger.pack(HELLO)
    for number in range(10_000):
        world.after(number / 10_000, lambda: world.receive_from(stranger, data))
    world.run(1.1)
    assert 1000 < read.call_count < 5000


def test_made_up_ids_do_not_cancel_a_pilot_on_a_slow_radio() -> None:
    """Strangers that arrived first hold all precedence and announce many lists, each for another station."""
    world = ready_world()
    strangers = [GroundStation(world, f"stranger {number}") for number in range(16)]
    for beat in range(4):
        for stranger in strangers:
            world.after(beat, lambda stranger=stranger: stranger.send(HELLO))  # type: ignore[misc]
    world.run(3.5)
    pilot = GroundStation(world, "pilot", radio=Radio(delay_s=0.7))
    ids = itertools.count()

    def send_count() -> None:
        stranger = GroundStation(world, f"stranger {next(ids) % 16}", sysid=next(ids) % 250, compid=next(ids) % 250)
        world.receive_from(stranger, stranger.pack(count_message(9)))

    for number in range(200):
        world.after(number / 20, send_count)
    assert Upload(pilot, waypoints(3), repeat_s=1.5).run(9) is MissionResult.ACCEPTED
    assert world.stored == records_of(waypoints(3))


def test_of_too_many_uploads_the_oldest_without_standing_ends() -> None:
    pilot, *strangers = (Station(Peer("udp", (f"10.0.0.{number}", 14550)), 255, 190) for number in range(4))
    uploads = upload_states.UploadQueue()
    for at, station in enumerate((pilot, *strangers)):
        uploads.uploads.append(upload_states.Upload(station, 9, "", 0, at))
    assert uploads.least_worth(lambda peer: peer == pilot.peer).station == strangers[0]


def test_of_too_many_uploads_the_oldest_without_items_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """None of the stations has precedence, and each has announced one list."""
    monkeypatch.setattr(uploads_module, "_MOST_UPLOADS", 64)
    world = ready_world()
    for number in range(16):
        hear(world.inside.ground, Station(Peer("udp", f"first {number}"), 255, 190), world.now)
    stations = [GroundStation(world, f"host {number}", sysid=number + 1) for number in range(80)]
    for station in stations:
        station.send(count_message(3))
        world.run(0.05)
        if station is stations[8]:
            for early in stations[:8]:
                early.send(item_message(0, waypoints(3)[0]))
    ended = [station for station in stations if station.messages("MISSION_ACK")]
    assert ended == stations[8 : 8 + len(stations) - 64], "the oldest"
