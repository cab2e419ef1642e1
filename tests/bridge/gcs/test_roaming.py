# SPDX-License-Identifier: GPL-3.0-or-later
"""A ground station whose address changes (Wi-Fi roaming): same ids at a new address, silence at the old one."""

import random

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.gcs.rights import LinkAccess
from protocols.mavlink.dialect import Message
from protocols.mission_item import MissionResult
from tests.support.conversations import Download, Upload, item_message, records_of, waypoints
from tests.support.upload_bench import assert_written
from tests.support.world import GroundStation, Radio, World, ready_world

m = messages
PLAN = waypoints(40)
#: Enough items for a long upload.
WIFI = Radio(delay_s=0.02)


def send_heartbeats(station: GroundStation, is_there: list[GroundStation]) -> None:
    """Send a heartbeat a second while the station is in `is_there`."""

    def send() -> None:
        if station in is_there:
            station.send(heartbeat())
            station.world.after(1.0, send)

    send()


def heartbeat() -> Message:
    return m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


class Roamer:
    """One ground station that moves from address to address."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.present: list[GroundStation] = []
        self._number = 0
        self.move()

    @property
    def station(self) -> GroundStation:
        return self.present[0]

    def move(self, upload: Upload | None = None, *, speaks: bool = True) -> GroundStation:
        """Move to a new address; an upload continues there."""
        left = self.present[:]
        self._number += 1
        station = GroundStation(self.world, f"roams {self._number}", radio=WIFI)
        self.present[:] = [station]
        for former in left:
            former.on_message.clear()
        if upload is not None:
            upload.station = station
            station.on_message.append(upload._react)
        if speaks:
            send_heartbeats(station, self.present)
        self.world.run(0.03)
        return station


def test_the_new_address_is_served_at_once(world: World) -> None:
    roamer = Roamer(world)
    world.run(3)
    new = roamer.move()
    world.run(1.5)
    assert new.messages("HEARTBEAT", "ATTITUDE")
    world.run(60)
    assert world.inside.ground.peers() == [new.peer]


def test_two_stations_with_the_same_ids_stay_separate(world: World) -> None:
    """Two Mission Planners with their default ids."""
    both = [GroundStation(world, name) for name in ("one", "other")]
    for station in both:
        send_heartbeats(station, both)
        world.run(0.4)
    world.run(62)
    for station in both:
        station.take()
    world.run(3)
    assert all(station.messages("HEARTBEAT") for station in both)
    assert world.events("gcs.silent") == []


@pytest.mark.parametrize("seed", range(6))
def test_an_upload_continues_from_a_new_address(seed: int) -> None:
    """Moving once or twice at any moment, also after the last item and while the list is written."""
    chance = random.Random(seed)
    world = ready_world()
    roamer = Roamer(world)
    upload = Upload(roamer.station, PLAN)
    for _ in range(chance.choice((1, 1, 2))):
        world.run(chance.random() * 2)
        if not upload.is_over:
            roamer.move(upload, speaks=chance.random() < 0.5)
    assert upload.run() is MissionResult.ACCEPTED
    assert world.stored == records_of(PLAN)


def test_an_upload_restarted_from_a_new_address_replaces_the_old_upload() -> None:
    for count in (40, 30):
        world = ready_world()
        roamer = Roamer(world)
        old = Upload(roamer.station, PLAN)
        world.wait_until(lambda _, old=old: len(old.requested) > 20, 5)  # type: ignore[misc]
        old.stop()
        roamer.move()
        world.run(1.5)
        plan = waypoints(count, seed=7)
        assert_written(roamer.station, plan)


def test_a_restarted_station_is_not_asked_for_items_of_the_previous_list(world: World) -> None:
    """Its item 0 would complete the previous list of one item, and its own list would get that list's refusal."""
    roamer = Roamer(world)
    former = Upload(roamer.station, PLAN[:1])
    former.stop()
    world.run(1.5)
    roamer.move()
    world.run(3)
    assert roamer.station.messages("MISSION_REQUEST") == []
    assert_written(roamer.station, PLAN)


def test_the_result_of_an_upload_goes_to_the_new_address(world: World) -> None:
    roamer = Roamer(world)
    upload = Upload(roamer.station, PLAN)
    world.wait_until(lambda _: len(upload.requested) > 20, 5)
    upload.stop()
    new = roamer.move()
    world.run(8)
    assert [message.type for message in new.messages("MISSION_ACK")] == [MissionResult.OPERATION_CANCELLED]
    assert Upload(new, PLAN).run() is MissionResult.ACCEPTED


def test_a_second_station_with_the_same_ids_cannot_join_an_upload(world: World) -> None:
    """It was known before, or the first one is still active: its items are ignored."""
    first, second = GroundStation(world, "first", radio=WIFI), GroundStation(world, "second")
    second.send(heartbeat(), wait_s=0.5)
    upload = Upload(first, PLAN)
    world.wait_until(lambda _: len(upload.requested) > 10, 5)
    newcomer = GroundStation(world, "newcomer")
    for intruder in (second, newcomer):
        for seq, item in enumerate(waypoints(40, seed=9)):
            intruder.send(item_message(seq, item))
        world.run(0.05)
        assert intruder.messages("MISSION_ACK", "MISSION_REQUEST") == []
    assert upload.run() is MissionResult.ACCEPTED
    assert world.stored == records_of(PLAN)


def test_an_address_that_may_not_write_does_not_take_over_an_upload() -> None:
    """The first one is silent, and items come from an address that its link's rule does not allow."""
    allowed = LinkAccess(may_write=lambda peer: peer.key != "forged")
    world = ready_world(links={"udp": allowed})
    first = GroundStation(world, "first", radio=WIFI)
    upload = Upload(first, PLAN)
    world.wait_until(lambda _: len(upload.requested) > 10, 5)
    upload.stop()
    forged = GroundStation(world, "forged")
    for _ in range(3):
        world.run(0.6)
        for seq, item in enumerate(PLAN):
            forged.send(item_message(seq, item))
    world.run(5)
    assert forged.messages("MISSION_REQUEST") == []
    assert world.stored == ()


def test_a_download_continues_from_a_new_address(world: World) -> None:
    roamer = Roamer(world)
    assert Upload(roamer.station, PLAN).run() is MissionResult.ACCEPTED
    download = Download(roamer.station)
    world.wait_until(lambda _: len(download.items) > 20, 5)
    old = roamer.station
    new = roamer.move()
    old.on_message.clear()
    download.station = new
    new.on_message.append(download._react)
    assert [item.lat_e7 for item in download.run()] == [item.lat_e7 for item in PLAN]
