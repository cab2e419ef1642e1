# SPDX-License-Identifier: GPL-3.0-or-later
"""A stranger that changes its address with every datagram, and one that sends as fast as it can."""

from itertools import pairwise

from bridge.gcs.guard import LinkAccess
from bridge.gcs.station import Peer
from bridge.gcs.stations import MAX_PEERS
from protocols.mavlink.dialect import messages as m
from protocols.mission_item import MissionResult
from tests.support.conversations import Upload, count_message, records_of, waypoints
from tests.support.world import Air, GroundStation, World

HELLO = m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
SECONDS, PER_S = 4, 2000


def attacked(*, is_late: bool) -> tuple[World, GroundStation]:
    """A world in which two thousand new addresses a second speak, and a pilot that was there before, or comes now."""
    world = World(speeds=(115200,))
    world.wait_ready()
    pilot = GroundStation(world, "pilot", air=Air(delay_s=0.01))
    if not is_late:
        pilot.send(HELLO)
        world.run(1)
    stranger = GroundStation(world, "stranger", sysid=99)
    spoken = [stranger.pack(HELLO), stranger.pack(count_message(9))]

    def speak(number: int) -> None:
        # Forged: each is another machine.
        peer = Peer("udp", (f"10.0.{number // 250}.{number % 250}", 14550))
        world.bridge.gcs_received(peer, spoken[number % 2], world.now, datagram=True)

    for number in range(SECONDS * PER_S):
        world.after(number / PER_S, lambda number=number: speak(number))  # type: ignore[misc]
    return world, pilot


def test_the_pilot_that_was_there_before_notices_nothing() -> None:
    world, pilot = attacked(is_late=False)
    began = world.now
    assert Upload(pilot, waypoints(20)).run(2) is MissionResult.ACCEPTED
    world.run(began + SECONDS - world.now)
    assert world.stored == records_of(waypoints(20))
    beats = [at for at, message in pilot.heard if message.get_type() == "HEARTBEAT"]
    assert len(beats) > SECONDS
    assert max(after - before for before, after in pairwise(beats)) <= 1.1
    # Few are noted, and nothing is kept of the others.
    assert len(world.events("gcs.found")) < 1200 + 1000 * SECONDS
    assert len(world.bridge.ground.peers()) <= MAX_PEERS
    assert len(world.bridge.ground.budgets._peers) < 2000


def test_nothing_is_kept_of_refused_addresses() -> None:
    world = World(speeds=(115200,), links={"udp": LinkAccess(may_write=lambda _peer: False)})
    stranger = GroundStation(world, "stranger")
    for number in range(2000):
        peer = Peer("udp", (f"10.0.{number // 250}.{number % 250}", 14550))
        world.bridge.gcs_received(peer, stranger.pack(count_message(9)), number / PER_S, datagram=True)
        world.bridge.tick(number / PER_S)
    assert len(world.bridge.guard._told) <= MAX_PEERS


def test_a_pilot_that_comes_now_gets_through() -> None:
    world, pilot = attacked(is_late=True)
    pilot.send(HELLO)
    assert Upload(pilot, waypoints(20), repeat_s=0.2, tries=50).run() is MissionResult.ACCEPTED
    assert world.stored == records_of(waypoints(20))


def test_who_sends_too_much_is_not_read() -> None:
    world = World(speeds=(115200,))
    world.wait_ready()
    stranger = GroundStation(world)
    data = stranger.pack(HELLO)
    for number in range(10_000):
        world.after(number / 10_000, lambda: world.spoken_by(stranger, data))
    world.run(1.1)
    read = world.bridge.ground.frames_received["udp", m.MAVLINK_MSG_ID_HEARTBEAT]
    assert 1000 < read < 5000
