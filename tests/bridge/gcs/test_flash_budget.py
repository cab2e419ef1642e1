# SPDX-License-Identifier: GPL-3.0-or-later
"""During a day of writes by strangers on an open link the pilot can still write, and the flash survives."""

import itertools
from collections.abc import Callable, Iterator
from math import inf

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.gcs.ground import Ground
from bridge.gcs.rights import LinkAccess
from bridge.gcs.station import Peer, Station
from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.frame import MavlinkFrame
from protocols.mission_item import MissionResult
from simulator.board.options import SimOptions
from tests.support.conversations import Upload, records_of, waypoints
from tests.support.packing import pack
from tests.support.world import GroundStation, Radio, World, ready_world

HOUR_S = 3600.0
HELLO = m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
PILOT = Peer("udp", ("10.0.0.1", 14550))
#: At this rate a page's 10,000 erases last for a month of uninterrupted attack.
MOST_IN_A_DAY = 400 + 24 * 12 + 1


def host(number: int) -> Peer:
    return Peer("udp", (f"10.1.{number // 256}.{number % 256}", 14550))


class Link:
    """A link with its stations; counts the writes granted to each."""

    def __init__(self) -> None:
        self.now = 0.0
        self.ground = Ground(1, 1, lambda *_args, **_facts: None, lambda *_args: None, None, {}, LinkAccess())
        self.writes = 0

    def connect(self, *peers: Peer) -> None:
        frame = MavlinkFrame(FrameWriter(255, 190).frame(pack(HELLO), 2))
        for beat in range(3):
            for peer in peers:
                station = self.ground.station(peer) or self.ground.sender(peer, self.now + beat, datagram=False)
                assert station is not None
                self.ground.heard(station, frame, frame.sender, self.now + beat)
        self.now += 3

    def writes_now(self, peer: Peer) -> bool:
        allowed = self.ground.allows_write(Station(peer, 255, 190), self.now)
        self.writes += allowed
        return allowed


def steady(link: Link, hosts: int) -> Iterator[Callable[[], None]]:
    """An attack by the same hosts all day."""
    strangers = [host(number) for number in range(hosts)]
    link.connect(*strangers)

    def attack() -> None:
        for stranger in strangers:
            link.writes_now(stranger)

    while True:
        yield attack


def rotating(link: Link, hosts: int) -> Iterator[Callable[[], None]]:
    """An attack by as many hosts at a time, each replaced by a new one after its first write."""
    names = itertools.count()
    present: list[Peer] = []

    def attack() -> None:
        for stranger in present[:]:
            if link.writes_now(stranger):
                link.ground.gone(stranger)
                present.remove(stranger)
        new = [host(next(names)) for _ in range(hosts - len(present))]
        link.connect(*new)
        present.extend(new)

    while True:
        yield attack


@pytest.mark.parametrize("attack", [steady, rotating])
@pytest.mark.parametrize("hosts", [1, 15, 240])
def test_the_pilot_can_write_throughout_a_day_of_attacks(
    attack: Callable[[Link, int], Iterator[Callable[[], None]]], hosts: int
) -> None:
    link = Link()
    link.connect(PILOT)
    for strike in itertools.islice(attack(link, hosts), 24 * 6):
        strike()
        link.now += 600
    assert link.writes <= MOST_IN_A_DAY
    # The pilot, connected earlier, writes at once and then every two hours.
    assert link.writes_now(PILOT)
    for _ in range(2):
        for _ in range(24):
            strike()
            link.now += 300
        assert link.writes_now(PILOT)


def test_a_pilot_who_arrives_after_a_day_of_attacks_writes_at_once() -> None:
    """All 16 places with precedence are occupied."""
    link = Link()
    strikes = steady(link, 16)
    for strike in itertools.islice(strikes, 24 * 6):
        strike()
        link.now += 600
    link.connect(PILOT)
    assert not link.ground.has_own_budget(PILOT)
    assert link.writes_now(PILOT)


def test_a_single_pilot_leaves_a_reserve_to_newcomers() -> None:
    link = Link()
    link.connect(PILOT)
    assert [link.writes_now(PILOT) for _ in range(369)] == [True] * 368 + [False]
    for _ in range(60):
        link.now += 1030
        assert link.writes_now(PILOT)
    link.connect(host(1))
    assert link.writes_now(host(1))


def at(station: GroundStation) -> Station:
    return Station(station.peer, station.sysid, station.compid)


def writes_left(world: World, station: GroundStation) -> int:
    for _ in range(4):  # to get a seat
        station.send(HELLO)
        world.run(1)
    return sum(world.inside.ground.allows_write(at(station), world.now) for _ in range(500))


def test_an_unchanged_list_is_not_counted() -> None:
    world = ready_world()
    pilot = GroundStation(world)
    for _ in range(40):
        assert Upload(pilot, waypoints(3)).run(2) is MissionResult.ACCEPTED
    assert writes_left(world, pilot) == 367


def test_a_command_that_the_board_did_not_execute_is_not_counted() -> None:
    world = ready_world()
    pilot = GroundStation(world)
    world.faults.armed = True
    for message in (
        m.MAVLink_command_long_message(1, 1, m.MAV_CMD_PREFLIGHT_CALIBRATION, 0, 0, 1, *[0] * 5),
        m.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", 500, 9),
    ):
        # Before the bridge has noticed that it is armed.
        pilot.send(message)
        world.run(1)
    assert writes_left(world, pilot) == 368


@pytest.mark.parametrize(("hosts", "lists"), [(3, 4), (16, 1)])
def test_the_pilots_list_precedes_those_of_frequent_writers(hosts: int, lists: int) -> None:
    world = World(SimOptions(flash_erase_ms=400.0), speeds=(115200,))
    world.wait_ready()
    pilot = GroundStation(world, "pilot", radio=Radio(delay_s=0.01))
    strangers = [GroundStation(world, f"stranger {number}", sysid=number) for number in range(1, hosts + 1)]
    for station in strangers:
        station.send(m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    numbers = itertools.count()

    def write(station: GroundStation, former: Upload | None = None) -> None:
        if former is None or former.is_over:
            former = Upload(station, waypoints(3, seed=next(numbers)))
        world.after(0.05, lambda: write(station, former))

    for station in strangers:
        write(station)
    # All want to write their second list, in a queue of several seconds.
    world.wait_until(lambda world: all(0 < world.inside.ground.wrote_at(at(each)) < inf for each in strangers), 30)
    for seed in range(-lists, 0):
        began = world.now
        assert Upload(pilot, waypoints(20, seed), repeat_s=0.7).run(5) is MissionResult.ACCEPTED
        assert world.now - began <= 2.0
        assert world.stored == records_of(waypoints(20, seed))
        world.run(1)
