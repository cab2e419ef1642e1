# SPDX-License-Identifier: GPL-3.0-or-later
"""The source address of a datagram may be forged: what a station gets before it has shown that it receives anything."""

import itertools
import random
from collections.abc import Callable
from functools import partial

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.controllers import other
from bridge.gcs.rights import LinkAccess
from bridge.gcs.station import Peer
from protocols.mavlink.dialect import Message
from protocols.mavlink.signing import ticks
from protocols.mission_item import MissionResult
from tests.bridge.fc.states.test_pass_through import Autopilot
from tests.bridge.vehicle.test_incoming import KEY, NOON, signing
from tests.support.conversations import Upload, count_message, records_of, waypoints
from tests.support.world import GroundStation, World, ready_world

HELLO = m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
STREAMS = m.MAVLink_request_data_stream_message(1, 1, 0, 50, 1)
FAR, NEAR = ("198.51.100.7", 14550), ("192.168.4.7", 14550)


def is_near(host: str) -> bool:
    return host.startswith("192.168.4.")


def world_with(links: dict[str, LinkAccess] | None = None) -> World:
    return ready_world(links=links, is_near=is_near)


def sent_to(station: GroundStation) -> int:
    return sum(map(len, station.frames))


def keep_sending(station: GroundStation, message: Message = HELLO, interval_s: float = 1.0) -> None:
    station.send(message)
    station.world.after(interval_s, lambda: keep_sending(station, message, interval_s))


def is_served(station: GroundStation) -> bool:
    """True if it gets telemetry, and an answer to a request."""
    station.frames.clear()
    station.ask(m.MAVLink_param_request_read_message(1, 1, b"SYSID_THISMAV", -1), wait_s=1)
    kinds = {message.get_type() for message in station.messages()}
    return {"ATTITUDE", "PARAM_VALUE"} <= kinds


@pytest.mark.parametrize("address", [FAR, NEAR])
@pytest.mark.parametrize("has_key", [False, True])
@pytest.mark.parametrize("version", [1, 2])
def test_one_forged_datagram_causes_at_most_three_times_the_size(
    address: tuple[str, int], version: int, *, has_key: bool
) -> None:
    world = world_with({"udp": LinkAccess(signing())} if has_key else None)
    victim = GroundStation(world, address, version=version)
    datagram = victim.pack(HELLO) + victim.pack(STREAMS)
    world.receive_from(victim, datagram)
    world.run(60)
    assert 0 < sent_to(victim) <= 3 * len(datagram)


@pytest.mark.parametrize("version", [1, 2])
def test_a_forged_address_behind_a_router_never_gets_more(version: int) -> None:
    world = world_with()
    victim = GroundStation(world, FAR, version=version)
    keep_sending(victim)
    sent = 0
    for _ in range(60):
        world.run(1)
        sent += len(victim.pack(HELLO))
        assert sent_to(victim) <= 3 * (sent + len(victim.pack(HELLO)))
    assert {message.get_type() for message in victim.messages()} == {"HEARTBEAT", "PING", "TIMESYNC", "STATUSTEXT"}
    assert "Behind a router: use a key, or connect by TCP" in victim.texts()
    assert not is_served(victim)


def test_an_address_on_an_own_network_is_served_from_the_second_heartbeat_on() -> None:
    world = world_with()
    station, known = GroundStation(world, NEAR), GroundStation(world, "needs no proof", sysid=254)
    for each in (station, known):
        each.send(HELLO)
    world.run(0.01)
    assert [message.get_type() for message in station.messages()] == ["HEARTBEAT"]
    for each in (station, known):
        each.send(HELLO)
        each.frames.clear()
        each.take()
    world.run(3)
    counts = [[message.get_type() for message in each.messages()].count("ATTITUDE") for each in (station, known)]
    assert counts[0] == counts[1] > 20
    assert is_served(station)


@pytest.mark.parametrize("kind", ["PING", "TIMESYNC"])
def test_an_answer_that_only_the_address_can_know_is_a_proof(kind: str) -> None:
    """QGroundControl and MAVSDK answer PING, Mission Planner TIMESYNC."""
    world = world_with()
    station, forger = GroundStation(world, FAR), GroundStation(world, ("198.51.100.8", 14550), sysid=9)
    for each in (station, forger):
        keep_sending(each)
    world.run(1.5)
    (question,) = station.messages(kind)
    nonce = question.time_usec if kind == "PING" else question.ts1

    def answer(nonce: int) -> Message:
        if kind == "PING":
            return m.MAVLink_ping_message(nonce, question.seq, 1, 1)
        return m.MAVLink_timesync_message(1_795_262_400_000_000_000, nonce)

    wrong = [answer(nonce + 1), answer(0), question, m.MAVLink_ping_message(0, 0, 1, 1)]
    for message in wrong:
        station.send(message)
        assert not is_served(station)
    forger.send(answer(nonce))
    assert not is_served(forger)
    station.send(answer(nonce))
    assert is_served(station)


def test_a_signature_is_a_proof() -> None:
    world = world_with({"udp": LinkAccess(signing())})
    station = GroundStation(world, FAR)
    station.sign(KEY, ticks(NOON))
    station.send(HELLO, wait_s=0.1)
    assert is_served(station)


def test_connections_and_configured_addresses_do_not_need_to_prove_themselves() -> None:
    world = world_with()
    configured, connected = (GroundStation(world, (f"198.51.100.{each}", 14550)) for each in (8, 9))
    world.bridge.add_default_peer(configured.peer)
    world.receive_from(connected, connected.pack(HELLO), datagram=False)
    world.run(3)
    assert is_served(configured)
    assert configured.messages("ATTITUDE")
    assert connected.messages("ATTITUDE")


def test_a_passed_through_autopilot_asks_in_its_own_name() -> None:
    autopilot = Autopilot(7)
    world = World(peer=autopilot, is_near=is_near)
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 3, then_s=2)
    station = GroundStation(world, FAR)
    autopilot.received.clear()
    keep_sending(station)
    world.run(2)
    assert {message.get_srcSystem() for message in station.messages()} == {7}
    assert bytes(autopilot.received) == b""
    (ping,) = station.messages("PING")
    for message in (m.MAVLink_ping_message(ping.time_usec, ping.seq, 7, 1), count_message(9)):
        station.send(message)
    world.run(0.1)
    assert station.pack(count_message(9))[10:-2] in bytes(autopilot.received)


Address = tuple[str, int]


def new_hosts(draw: random.Random) -> Callable[[], Address]:
    """Forged: each datagram comes from another machine behind a router."""
    return lambda: (f"10.{draw.randrange(256)}.{draw.randrange(256)}.{draw.randrange(256)}", 14550)


def new_ports(_draw: random.Random) -> Callable[[], Address]:
    """One machine on an own network with a new port for each datagram."""
    ports = itertools.count(1024)
    return lambda: ("192.168.4.9", next(ports))


@pytest.mark.parametrize("addresses", [new_hosts, new_ports])
def test_a_flood_does_not_keep_a_pilot_from_writing(
    addresses: Callable[[random.Random], Callable[[], Address]],
) -> None:
    """Two thousand lists a second are announced. One pilot is connected before, another connects meanwhile."""
    world = world_with()
    pilot, late = (GroundStation(world, (f"192.168.4.{each}", 14550)) for each in (2, 3))
    keep_sending(pilot)
    world.run(2)
    stranger, draw = GroundStation(world, "stranger", sysid=99), addresses(random.Random(1))
    frames = itertools.cycle([stranger.pack(message) for message in (HELLO, count_message(9))])

    def attack() -> None:
        world.bridge.gcs_received(Peer("udp", draw()), next(frames), world.now, datagram=True)

    for number in range(16_000):
        world.after(number / 2000, attack)
    world.run(0.5)
    for seed, station in enumerate((pilot, late)):
        if station is late:
            keep_sending(late, interval_s=0.5)
            world.run(1.1)
        assert Upload(station, waypoints(20, seed), repeat_s=0.7).run(3) is MissionResult.ACCEPTED
        assert world.stored == records_of(waypoints(20, seed))
    assert len(world.inside.ground.peers()) == 2
    assert len(world.events("gcs.found")) == 2


def test_forged_addresses_are_soon_forgotten() -> None:
    world = world_with()
    frame = GroundStation(world, "stranger").pack(HELLO)

    def send(peer: Peer) -> None:
        world.bridge.gcs_received(peer, frame, world.now, datagram=True)

    for number in range(4000):
        peer = Peer("udp", (f"10.0.{number // 250}.{number % 250}", 14550))
        world.after(number / 1000, partial(send, peer))
    world.run(4)
    assert len(world.inside.ground._unproven) <= 20 + 5 * 10
    world.run(7)
    assert world.inside.ground._unproven == {}
