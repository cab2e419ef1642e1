# SPDX-License-Identifier: GPL-3.0-or-later
"""Item numbers in MISSION_CURRENT and MISSION_ITEM_REACHED: those of the list that each station sent or read last."""

from dataclasses import replace
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mission_item import Command, MissionItem, MissionResult
from tests.support.conversations import Download, Upload, waypoints
from tests.support.fake_inav import FakeInav
from tests.support.world import GroundStation, MemoryStore, World

FLIES_TO_RECORD = 1


def item(command: int, p1: float = 0.0, p2: float = 0.0) -> MissionItem:
    return MissionItem(0, command, 3, p1, p2, 0.0, 0.0, 0, 0, 10.0)


HOME, *LEGS = (replace(leg, p2=0.0) for leg in waypoints(6))
#: INAV drops the TAKEOFF: item 2 as sent is item 1 as read back.
WITH_TAKEOFF = [HOME, item(Command.NAV_TAKEOFF), *LEGS[:3]]
#: The jump goes to a leg without a speed, so it is read back with a DO_CHANGE_SPEED before it.
WITH_SPEED = [HOME, *LEGS[:2], item(Command.DO_CHANGE_SPEED, 1, 5.0), LEGS[2], item(Command.DO_JUMP, 1, 1), LEGS[3]]


def bench(board: FakeInav | None = None, store: MemoryStore | None = None) -> tuple[World, FakeInav]:
    board = board or FakeInav()
    world = World(speeds=(115200,), peer=board)
    world.store = store or world.store
    world.wait_ready(5)
    return world, board


def fly(world: World, board: FakeInav, *records: int) -> None:
    board.armed = True
    for number in records:
        board.nav = (3, 5, FLIES_TO_RECORD, number, 0, 0)
        world.run(2.5)


def land(world: World, board: FakeInav) -> None:
    board.armed, board.nav = False, (0, 0, 0, 0, 0, 0)
    world.run(2.5)


def current(station: GroundStation) -> tuple[int, int]:
    message: Any = station.messages("MISSION_CURRENT")[-1]
    return message.seq, message.total


def reached(station: GroundStation) -> list[int]:
    return [message.seq for message in station.messages("MISSION_ITEM_REACHED")]


def test_the_sender_counts_as_sent_and_others_as_read() -> None:
    world, board = bench()
    sender, other = GroundStation(world, "sender"), GroundStation(world, "other", sysid=254)
    assert Upload(sender, WITH_TAKEOFF).run() is MissionResult.ACCEPTED
    assert len(Download(other).run()) == 4
    fly(world, board, 1, 2, 3)
    assert (current(sender), current(other)) == ((4, 4), (3, 3))
    assert (reached(sender), reached(other)) == ([2, 3], [1, 2])


def test_reading_the_list_changes_to_the_numbers() -> None:
    world, board = bench()
    sender = GroundStation(world)
    assert Upload(sender, WITH_TAKEOFF).run() is MissionResult.ACCEPTED
    assert len(Download(sender).run()) == 4
    fly(world, board, 1, 2)
    assert current(sender) == (2, 3)
    land(world, board)
    assert Upload(sender, WITH_TAKEOFF).run() is MissionResult.ACCEPTED
    fly(world, board, 2)
    assert current(sender) == (3, 4)


def test_another_stations_list_is_counted_as_read_back() -> None:
    world, board = bench()
    first, second = GroundStation(world, "first"), GroundStation(world, "second")
    assert Upload(first, WITH_TAKEOFF).run() is MissionResult.ACCEPTED
    assert Upload(second, [HOME, item(Command.NAV_TAKEOFF), *LEGS]).run() is MissionResult.ACCEPTED
    fly(world, board, 2)
    assert (current(first), current(second)) == ((2, 5), (3, 6))


def test_an_inserted_change_of_speed_is_not_counted_by_the_sender() -> None:
    world, board = bench()
    sender, other = GroundStation(world, "sender"), GroundStation(world, "other", sysid=254)
    assert Upload(sender, WITH_SPEED).run() is MissionResult.ACCEPTED
    read = Download(other).run()
    assert [each.command for each in read] == [16, 178, 16, 16, 178, 16, 177, 16]
    fly(world, board, 1, 2, 3, 5)
    assert (current(sender), current(other)) == ((6, 6), (7, 7))
    assert (reached(sender), reached(other)) == ([1, 2, 4], [2, 3, 5])


def test_a_requested_mission_current_has_the_askers_numbers() -> None:
    world, board = bench()
    sender = GroundStation(world)
    assert Upload(sender, WITH_TAKEOFF).run() is MissionResult.ACCEPTED
    fly(world, board, 2)
    sender.ask(m.MAVLink_command_long_message(1, 1, m.MAV_CMD_REQUEST_MESSAGE, 0, 42, *[0.0] * 6))
    world.run_until(lambda _: bool(sender.messages("COMMAND_ACK")), 1)
    assert current(sender) == (3, 4)


def test_the_numbers_survive_a_restart_of_the_bridge() -> None:
    world, board = bench()
    names = {("10.0.0.2", 50001): 255, ("10.0.0.3", 50002): 254}
    sender, reader = (GroundStation(world, name, sysid=sysid) for name, sysid in names.items())
    for station in (sender, reader):
        assert Upload(station, WITH_TAKEOFF).run() is MissionResult.ACCEPTED
    Download(reader).run()
    world.run(1)
    restarted, _ = bench(board, world.store)
    # A TCP connection has another port now.
    names = {("10.0.0.2", 61000): 255, ("10.0.0.3", 50002): 254, ("10.0.0.4", 50001): 255}
    again = [GroundStation(restarted, name, sysid=sysid) for name, sysid in names.items()]
    for station in [*again, *again]:
        station.send(m.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    fly(restarted, board, 2)
    assert [current(station) for station in again] == [(3, 4), (2, 3), (2, 3)]
