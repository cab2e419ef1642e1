# SPDX-License-Identifier: GPL-3.0-or-later
"""Ground stations come and go: which of them get messages, in which MAVLink version, for how long."""

from functools import partial

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.gcs.ground_station import GroundStation as GcsStation
from bridge.gcs.ground_station import Outbox
from bridge.gcs.message_rates import take_due
from bridge.gcs.rights import LinkAccess
from bridge.gcs.station import Peer
from bridge.voice import sentences
from protocols.mavlink.dialect import messages as own
from protocols.mavlink.frame import MavlinkSplitter
from protocols.mission_item import MissionResult
from tests.support.conversations import Upload, waypoints
from tests.support.world import GroundStation, World

m = messages


def versions(station: GroundStation, *, heartbeats: bool = True) -> set[int]:
    """The MAVLink versions of the received frames, by their first byte."""
    heartbeat_ids = {(0xFE, 0), (0xFD, 0)}
    frames = station.frames
    ids = [(frame[0], frame[5] if frame[0] == 0xFE else int.from_bytes(frame[7:10], "little")) for frame in frames]
    return {1 if magic == 0xFE else 2 for magic, msgid in ids if heartbeats or (magic, msgid) not in heartbeat_ids}


@pytest.mark.parametrize("version", [1, 2])
def test_each_station_is_answered_in_its_own_version(world: World, version: int) -> None:
    station = GroundStation(world, version=version)
    other = GroundStation(world, "other", sysid=250, version=3 - version)
    for one in (station, other):
        one.send(one.heartbeat)
    world.run(0.01)
    station.frames.clear()
    assert Upload(station, waypoints(5)).run() is MissionResult.ACCEPTED
    world.run(2.5)
    assert versions(station, heartbeats=False) == {version}
    assert versions(other, heartbeats=False) == {3 - version}
    # A MAVLink 1 station also gets MAVLink 2 heartbeats, which make Mission Planner switch.
    assert versions(station) == ({1, 2} if version == 1 else {2})


@pytest.mark.parametrize("first", ["heartbeat", "request"])
def test_the_first_frame_to_a_newcomer_is_mavlink_2(world: World, first: str) -> None:
    """QGroundControl begins in MAVLink 1, and stays in the version of the first frame that it gets."""
    station = GroundStation(world, version=1)
    station.send(station.heartbeat if first == "heartbeat" else m.MAVLink_param_request_list_message(1, 1), wait_s=3)
    assert station.frames[0][0] == 0xFD
    # One that knows only MAVLink 1 finds the vehicle, too.
    assert [frame[5] for frame in station.frames if frame[0] == 0xFE].count(m.MAVLINK_MSG_ID_HEARTBEAT) > 10


def test_a_station_that_switches_to_mavlink_2_is_answered_in_it(world: World) -> None:
    station = GroundStation(world, version=1)
    station.send(station.heartbeat, wait_s=1.5)
    station.version = 2
    station.send(station.heartbeat, wait_s=0.01)
    station.frames.clear()
    # It may still send an occasional MAVLink 1 frame.
    station.version = 1
    station.send(station.heartbeat, wait_s=2)
    assert versions(station) == {2}


def test_a_new_station_gets_faster_heartbeats_for_three_seconds(world: World) -> None:
    """Mission Planner needs two heartbeats before it continues connecting."""
    old, new = GroundStation(world, "old"), GroundStation(world, "new", sysid=254)
    old.send(old.heartbeat, wait_s=5)
    old.take()
    new.send(new.heartbeat, wait_s=3)
    assert 14 <= len(new.take("HEARTBEAT")) <= 19
    assert len(old.take("HEARTBEAT")) <= 4
    world.run(10)
    assert len(new.messages("HEARTBEAT")) == 10


def test_messages_of_one_moment_share_datagrams(world: World) -> None:
    """Up to 280 bytes, in order; MAVROS cuts longer ones."""
    station = GroundStation(world)
    station.send(station.heartbeat, wait_s=5)
    ground = world.inside.ground
    ground.outbox.take()
    values = [own.MAVLink_named_value_int_message(0, b"number", number) for number in range(1, 21)]
    for value in values:
        ground.broadcast(value)
    datagrams = [data for peer, data in ground.outbox.take() if peer == station.peer]
    assert all(len(data) <= 280 for data in datagrams)
    assert len(datagrams) <= 3
    frames = MavlinkSplitter().feed(b"".join(datagrams))
    assert [frame.payload[4] for frame in frames] == [value.value for value in values]


def test_a_station_silent_for_a_minute_stops_getting_messages(world: World) -> None:
    station = GroundStation(world)
    for _ in range(2):
        station.send(station.heartbeat, wait_s=59)
        assert station.take("HEARTBEAT")
    assert (len(world.events("gcs.found")), world.events("gcs.silent")) == (1, [])
    world.run(3)
    station.take()
    world.run(5)
    assert station.received == []
    assert world.inside.ground.peers() == []
    station.send(station.heartbeat, wait_s=2)
    assert station.messages("HEARTBEAT")


def test_a_default_peer_always_gets_messages_in_both_versions(world: World) -> None:
    station = GroundStation(world, "fixed")
    world.bridge.add_default_peer(station.peer, until_answered=False)
    world.run(5)
    assert versions(station) == {1, 2}
    assert len(station.messages("ATTITUDE")) >= 4
    station.send(station.heartbeat, wait_s=65)
    station.take()
    world.run(5)
    assert len(station.messages("ATTITUDE")) >= 4
    world.bridge.remove_default_peer(station.peer)
    station.take()
    world.run(3)
    assert station.received == []


def test_a_broadcast_address_is_used_until_a_station_answers(world: World) -> None:
    everyone = GroundStation(world, "broadcast")
    world.bridge.add_default_peer(everyone.peer, until_answered=True)
    world.run(3)
    assert everyone.messages("HEARTBEAT")
    station = GroundStation(world, "answers")
    station.send(station.heartbeat, wait_s=0.01)
    everyone.take()
    world.run(5)
    assert everyone.received == []
    assert station.messages("HEARTBEAT")
    world.run(60)
    assert everyone.messages("HEARTBEAT")


def test_local_strangers_do_not_displace_a_station_with_heartbeats(world: World) -> None:
    """Two thousand datagrams a second, from ports of one machine and from two hundred machines."""
    pilot, late = (GroundStation(world, (f"192.168.4.{each}", 14550)) for each in (2, 3))
    stranger = GroundStation(world, "stranger", sysid=9).pack(pilot.heartbeat)

    def flood(number: int) -> None:
        for address in (("192.168.4.9", number), (f"192.168.4.{10 + number % 200}", number % 7)):
            for _ in range(2):
                world.bridge.gcs_received(Peer("udp", address), stranger, world.now, datagram=True)

    for second in range(12):
        world.after(second, partial(pilot.send, pilot.heartbeat))
    world.run(2)
    for number in range(5000):
        world.after(number / 500, partial(flood, number))
    world.run(8)
    assert len(world.inside.ground.peers()) <= 32
    assert pilot.peer in world.inside.ground.peers()
    world.run(5)
    late.send(late.heartbeat)
    late.send(late.heartbeat, wait_s=1.5)
    assert late.messages("HEARTBEAT", "ATTITUDE")


def test_more_talkers_than_places_do_not_displace_a_station_with_heartbeats(world: World) -> None:
    """Fifty machines, each heard 50 times a second and thus later than the pilot."""
    pilot = GroundStation(world, ("192.168.4.2", 14550))
    stranger = GroundStation(world, "stranger", sysid=9).pack(pilot.heartbeat)

    def talk() -> None:
        for number in range(50):
            peer = Peer("udp", (f"192.168.4.{10 + number}", 14550))
            world.bridge.gcs_received(peer, stranger, world.now, datagram=True)

    for second in range(20):
        world.after(second, partial(pilot.send, pilot.heartbeat))
    world.run(2)
    for turn in range(900):
        world.after(turn / 50, talk)
    for _ in range(17):
        world.run(1)
        assert pilot.peer in world.inside.ground.peers()
    assert len(world.inside.ground.peers()) == 32


def test_thirty_stations_that_request_everything_share_1200_messages_a_second(world: World) -> None:
    stations = [GroundStation(world, str(number), sysid=number) for number in range(1, 31)]
    for station in stations:
        station.send(station.heartbeat)
        for msgid in (m.MAVLINK_MSG_ID_ATTITUDE, m.MAVLINK_MSG_ID_RC_CHANNELS, m.MAVLINK_MSG_ID_VFR_HUD):
            station.send(m.MAVLink_command_long_message(1, 1, 511, 0, msgid, 10_000, 0, 0, 0, 0, 0))
    world.run(3)
    for station in stations:
        station.frames.clear()
    world.run(2)
    assert 1000 < sum(len(station.frames) for station in stations) < 2 * 1800


def test_a_thousand_peers_all_get_telemetry() -> None:
    """Each one's share is below one message a second."""
    outbox = Outbox(print)
    stations = [GcsStation(Peer("udp", number), LinkAccess(), 1, 1, outbox) for number in range(1000)]
    taken: set[Peer] = set()
    for tenth in range(50):
        taken = taken if tenth > 10 else set()  # the first share is larger
        taken |= {each.peer for each in take_due(stations, m.MAVLINK_MSG_ID_ATTITUDE, 0.1, tenth / 10)}
    assert taken == {station.peer for station in stations}


def test_a_stream_may_be_split_over_reads_and_is_forgotten_at_the_end(world: World) -> None:
    station = GroundStation(world, "tcp")
    data = station.pack(station.heartbeat) + station.pack(
        m.MAVLink_command_long_message(1, 1, 511, 0, 0, 0, 0, 0, 0, 0, 0)
    )
    for byte in data:
        world.receive_from(station, bytes((byte,)), datagram=False)
    world.run(0.01)
    assert len(station.messages("COMMAND_ACK")) == 1
    world.receive_from(station, data[:9], datagram=False)
    world.bridge.gcs_gone(station.peer, world.now)
    # A new connection from the same address starts from scratch.
    world.receive_from(station, data, datagram=False)
    world.run(0.01)
    assert len(station.messages("COMMAND_ACK")) == 2
    world.bridge.gcs_gone(station.peer, world.now)
    assert world.inside.ground.peers() == []
    assert world.inside.ground.station(station.peer) is None


def test_a_truncated_datagram_does_not_affect_the_next(world: World) -> None:
    station = GroundStation(world)
    command = station.pack(m.MAVLink_command_long_message(1, 1, 511, 0, 0, 0, 0, 0, 0, 0, 0))
    for datagram in (command[:10], b"\xfd\xff" + command, command + command, b"\xfe\x09" + command[:5]):
        world.receive_from(station, datagram)
    world.run(0.01)
    assert len(station.messages("COMMAND_ACK")) == 3


def test_the_pieces_of_a_long_text_can_be_joined_or_read_alone(world: World) -> None:
    stations = [GroundStation(world, "new"), GroundStation(world, "old", version=1, sysid=254)]
    for station in stations:
        station.send(station.heartbeat)
    world.run(4)
    for station in stations:
        station.take()
    long = "Mission rejected: the first half of a sentence of more than fifty characters, and the rest of it"
    for text in (long, "short", long):
        world.inside.ground.say(sentences.CHANGED_ITEM(text))
    world.run(0.1)
    chunks = [(text.id, text.chunk_seq) for text in stations[0].messages("STATUSTEXT")]
    (first, _), (second, _) = chunks[0], chunks[3]
    assert chunks == [(first, 0), (first, 1), (0, 0), (second, 0), (second, 1)]
    assert 0 < first != second > 0
    for station in stations:
        pieces = [text.text for text in station.messages("STATUSTEXT")]
        assert " ".join("".join(pieces[:2]).split()) == long
        assert pieces[0].rstrip() == "Mission rejected: the first half of a sentence of"
