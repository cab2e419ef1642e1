# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a mission: docs/mission-rules.md, "Read-back"."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from bridge.missions.mission_service import HeldMission
from bridge.model.missions import PendingMission, Refusal
from protocols.mavlink.dialect import Message
from protocols.mission_item import Command, MissionItem, MissionResult, pack_records
from protocols.msp.mission import MissionCommand
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.commands.fc_kinds import make_board
from tests.support.conversations import (
    Download,
    Upload,
    ack_message,
    count_message,
    item_message,
    list_message,
    records_of,
    request_message,
    rounded,
    waypoints,
)
from tests.support.seeds import seeds
from tests.support.world import GroundStation, Radio, World, flash_holding, ready_world

OLD = waypoints(20, seed=77)
OLD_RECORDS = records_of(OLD)
OLD_FLASH = flash_holding(OLD_RECORDS)
A = MissionResult


def holding(options: SimOptions | None = None, flash: bytes = OLD_FLASH) -> tuple[World, GroundStation]:
    world = ready_world(options, flash=flash)
    world.run(2)
    return world, GroundStation(world)


@pytest.fixture
def world() -> World:
    return holding()[0]


def ask(station: GroundStation, message: Message, seconds: float = 0.2) -> list[Message]:
    """Send a message; return the mission messages addressed to the sender in reply."""
    station.ask(message, wait_s=seconds)
    return [message for message in station.messages() if station.is_target_of(message)]


def latitudes(items: Sequence[MissionItem]) -> list[int | None]:
    return [item.lat_e7 for item in items]


def reads(world: World) -> int:
    return sum(frame.command == MissionCommand.READ for frame in world.requests())


@pytest.mark.parametrize("as_int", [True, False])
def test_the_list_reads_back_as_it_is_stored(station: GroundStation, as_int: bool) -> None:
    download = Download(station, as_int=as_int)
    items = download.run()
    assert download.count == 20
    assert items == (OLD if as_int else rounded(OLD))
    assert {(m.autocontinue, m.current) for m in station.messages("MISSION_ITEM", "MISSION_ITEM_INT")} == {(1, 0)}
    kinds = [message.get_type() for message in station.messages("MISSION_ITEM", "MISSION_ITEM_INT")]
    assert kinds == ["MISSION_ITEM_INT" if as_int else "MISSION_ITEM"] * 20


def test_a_list_changed_on_the_board_is_read_again(world: World, station: GroundStation) -> None:
    """The bridge answers from its copy only while the board still holds the same list."""
    assert Download(station).run() != []
    before = reads(world)
    assert Download(station).run() != []
    assert reads(world) == before
    # The firmware itself saves a list: no line is lost, so only INFO's checksum shows that the copy is old.
    world.naze._firmware._missions.store(pack_records(records_of(waypoints(9, seed=3))))
    assert latitudes(Download(station).run()) == latitudes(waypoints(9, seed=3))
    # The flash is changed without the bridge, and the board reboots.
    world.power_off()
    world.naze._flash._memory[:] = flash_holding(records_of(waypoints(7, seed=5)))
    world.power_on()
    world.run(8)
    assert latitudes(Download(station).run()) == latitudes(waypoints(7, seed=5))


@pytest.mark.parametrize("remembered", [True, False])
def test_a_region_of_interest_reads_back_as_it_was_sent(world: World, station: GroundStation, remembered: bool) -> None:
    items = waypoints(6, 8)
    for seq, command in ((1, Command.DO_SET_ROI), (2, Command.DO_SET_ROI_LOCATION), (3, Command.NAV_ROI)):
        items[seq] = replace(items[seq], command=command, p2=0.0, alt_m=0.0)
    assert Upload(station, items).run() is A.ACCEPTED
    world.store.missions = world.store.missions if remembered else []
    # Later, without the bridge's copy.
    world.unplug()
    world.plug()
    world.wait_ready()
    commands = [item.command for item in Download(station).run()]
    assert commands == ([16, 201, 195, 80, 16, 16] if remembered else [16, 80, 80, 80, 16, 16])


def test_an_empty_list_is_count_0_until_home_is_known() -> None:
    """After that it is home alone: DroneKit takes home from a download and waits forever without one."""
    world = World(speeds=(115200,))
    world.wait_until(lambda w: w.is_found, 5)
    station = GroundStation(world)
    (count,) = ask(station, list_message())
    assert count.count == int(world.bridge.vehicle.place() is not None)
    world.run(6)
    (home,) = Download(station).run(2)
    assert (home.seq, home.command, home.frame) == (0, 16, 0)
    assert (home.lat_e7, home.lon_e7) == world.bridge.vehicle.place()
    world.run(1.1)
    assert station.messages("MISSION_CURRENT")[-1].mission_state == 1


@pytest.mark.parametrize("as_int", [True, False])
def test_item_0_of_an_empty_list_is_the_flight_controllers_home(as_int: bool) -> None:
    world = ready_world()
    world.run(6)
    station = GroundStation(world)
    (item,) = ask(station, request_message(0, as_int=as_int))
    assert item.get_type() == ("MISSION_ITEM_INT" if as_int else "MISSION_ITEM")
    assert (item.seq, item.command, item.frame) == (0, 16, 0)
    assert item.x != 0


def test_a_seq_past_the_end_is_an_invalid_sequence(station: GroundStation) -> None:
    for seq in (20, 65535):
        (ack,) = ask(station, request_message(seq))
        assert (ack.get_type(), ack.type) == ("MISSION_ACK", A.INVALID_SEQUENCE)


@pytest.mark.parametrize("mission_type", [1, 2])
def test_a_list_that_is_not_stored_here_reads_as_empty(station: GroundStation, mission_type: int) -> None:
    """Mission Planner ignores a refusal, and shows a timeout instead."""
    (count,) = [each for each in ask(station, list_message(mission_type)) if each.get_type() != "STATUSTEXT"]
    assert (count.get_type(), count.count, count.mission_type) == ("MISSION_COUNT", 0, mission_type)
    assert station.texts() == ["Fences and rally points are not stored here"]


@pytest.mark.parametrize("mission_type", [1, 2, 7, 255])
def test_another_mission_type_is_unsupported(station: GroundStation, mission_type: int) -> None:
    for message in (
        *([list_message(mission_type)] if mission_type > 2 else []),
        request_message(0, mission_type=mission_type),
        request_message(3, as_int=False, mission_type=mission_type),
    ):
        (ack,) = ask(station, message)
        assert (ack.type, ack.mission_type) == (A.UNSUPPORTED, mission_type)


def test_item_0_alone_has_the_altitude_of_home_while_armed(world: World, station: GroundStation) -> None:
    """Mission Planner requests it on arming, and takes its ground level from it."""
    world.arm(then_s=1)
    home = world.bridge.vehicle.home
    assert home is not None
    for as_int in (True, False):
        (item,) = ask(station, request_message(0, as_int=as_int))
        assert (item.seq, item.z) == (0, home.altitude_m)
    assert item.x == pytest.approx((OLD[0].lat_e7 or 0) / 1e7)


def test_a_download_is_a_snapshot_unaffected_by_an_upload() -> None:
    world, reader = holding()
    writer = GroundStation(world, "writer", sysid=250)
    assert ask(reader, list_message())[0].count == 20
    read = [ask(reader, request_message(seq))[0].x for seq in range(10)]
    assert Upload(writer, waypoints(15, 4)).run() is A.ACCEPTED
    read += [ask(reader, request_message(seq))[0].x for seq in range(10, 20)]
    assert read == latitudes(OLD)
    # The next download returns the new list.
    assert latitudes(Download(reader).run()) == latitudes(waypoints(15, 4))


@pytest.mark.parametrize("ends", ["ack", "time", "new flight controller", "own upload"])
def test_a_snapshot_ends_with_the_download(world: World, station: GroundStation, ends: str) -> None:
    """Mission Planner asks for item 0 on arming, long after it read a list that has been replaced since."""
    writer = GroundStation(world, "writer", sysid=250)
    assert ask(station, list_message())[0].count == 20
    for seq in range(20):
        ask(station, request_message(seq), 0.05)
    new = waypoints(15, 4)
    assert Upload(station if ends == "own upload" else writer, new).run() is A.ACCEPTED
    match ends:
        case "ack":
            station.send(ack_message(A.ACCEPTED), wait_s=0.1)
        case "time":
            world.run(25)
        case "new flight controller":
            world.unplug()
            world.plug()
            world.wait_ready()
    assert ask(station, request_message(0))[0].x == new[0].lat_e7


def test_two_stations_read_at_once() -> None:
    world, first = holding()
    second = GroundStation(world, "second", sysid=250)
    downloads = [Download(first), Download(second, as_int=False)]
    world.wait_until(lambda _: all(download.is_over for download in downloads), 5)
    assert [len(download.items) for download in downloads] == [20, 20]


@pytest.mark.parametrize("seed", seeds(3))
def test_a_download_over_a_bad_radio_link_is_exact(seed: int) -> None:
    world = ready_world(flash=OLD_FLASH, seed=seed)
    station = GroundStation(world, radio=Radio(loss=0.1, repeat=0.1, delay_s=0.05, spread_s=0.1))
    assert Download(station, repeat_s=0.6, tries=20).run() == OLD


def test_a_station_that_floods_requests_does_not_delay_others(world: World, station: GroundStation) -> None:
    second = GroundStation(world, "second", sysid=250)
    for number in range(4000):
        station.send(list_message())
        station.send(request_message(number % 700))
        if number % 9 == 0:
            world.run(0.0001)
    world.run(1)
    assert len(Download(second).run()) == 20


def test_waiting_downloads_are_refused_when_the_link_is_lost() -> None:
    world, _ = holding()
    bridge = world.bridge
    answers: list[HeldMission | Refusal] = []
    for _ in range(600):
        bridge.missions.pull(answers.append, world.now)
    bridge.fc_closed(world.now, "unplugged")
    assert len(answers) == 600
    assert {answer.text for answer in answers if isinstance(answer, Refusal)} == {"No link to the flight controller"}


BOARDS = [*TelemetryProtocol, "inav", "multiwii"]


def disarmed(board: str | TelemetryProtocol) -> tuple[World, list[MissionItem]]:
    """A craft on the ground, and the mission that it holds."""
    items = [item if item.seq else replace(item, lat_e7=0, lon_e7=0) for item in waypoints(9)]
    if isinstance(board, TelemetryProtocol):
        items = OLD
        world = World(SimOptions(tele_prot=board), flash=OLD_FLASH)
    else:
        faults = Faults(boxes=0)
        world = World(peer=make_board(board, faults=faults), faults=faults)
    world.wait_ready(then_s=6)
    if not isinstance(board, TelemetryProtocol):
        assert Upload(GroundStation(world, "planner"), items).run() is A.ACCEPTED
    return world, items


def arm(world: World) -> None:
    world.faults.armed = True
    world.wait_until(lambda w: bool(w.bridge.vehicle.armed) and w.is_found, 20, then_s=3)


def legs(items: list[MissionItem]) -> list[tuple[object, ...]]:
    return [(item.seq, item.command, item.lat_e7, item.lon_e7, item.alt_m) for item in items[1:]]


@pytest.mark.parametrize("board", BOARDS)
def test_the_mission_is_readable_while_armed(board: str | TelemetryProtocol) -> None:
    """QGroundControl reads it when it connects, also in flight."""
    world, items = disarmed(board)
    arm(world)
    station = GroundStation(world, "new", sysid=254)
    assert legs(Download(station).run(20)) == legs(items)
    assert not any("Armed" in text for text in station.texts())


@pytest.mark.parametrize("board", BOARDS)
def test_a_mission_that_was_not_read_before_arming_is_read_or_missing(board: str | TelemetryProtocol) -> None:
    """The bridge was started in flight: only boards whose list can be read armed have one."""
    world = armed_before(board)
    world.wait_until(lambda w: bool(w.bridge.vehicle.armed), 15, then_s=5)
    station = GroundStation(world)
    items = Download(station).run(5)
    if board not in (TelemetryProtocol.MSP, TelemetryProtocol.FRSKY_9600, "inav"):  # these answer MSP, too
        assert len(items) <= 1
        assert "Armed, mission not known: disarm to read it" in " ".join(station.texts())


def test_another_boards_mission_is_not_served() -> None:
    """The port was opened again, and the board on it speaks no MSP."""
    world, _ = disarmed(TelemetryProtocol.MAVLINK)
    world.unplug()
    world.faults.armed = True
    world.run(3)
    world.plug()
    arm(world)
    station = GroundStation(world)
    assert len(Download(station).run(5)) <= 1


def test_a_mission_whose_write_was_interrupted_is_not_served() -> None:
    world, _ = disarmed(TelemetryProtocol.MAVLINK)
    world.inside.missions.pending.append(PendingMission(None, None))
    arm(world)
    assert len(Download(GroundStation(world)).run(5)) <= 1


def armed_before(board: str | TelemetryProtocol) -> World:
    """A bridge that starts while the craft is flying."""
    if not isinstance(board, TelemetryProtocol):
        faults = Faults(armed=True, boxes=0)
        return World(peer=make_board(board, faults=faults), faults=faults)
    world = World(SimOptions(tele_prot=board), Faults(armed=True), powered=False, plugged=False)
    world.power_on()
    world.run(6)
    world.plug()
    return world


@pytest.mark.parametrize("board", BOARDS)
def test_a_craft_that_is_armed_from_the_start_has_an_item_0(board: str | TelemetryProtocol) -> None:
    world = armed_before(board)
    world.wait_until(lambda w: bool(w.bridge.vehicle.armed), 15)
    station = GroundStation(world)
    world.run(2.3)
    (home_item,) = ask(station, request_message(0))
    assert home_item.z == pytest.approx(131, abs=1.5)  # the launch altitude; the craft is higher by now
    for home in station.messages("HOME_POSITION")[-1:]:
        assert (home_item.x, home_item.y) == (home.latitude, home.longitude)
        assert home_item.z == pytest.approx(home.altitude / 1000)
    assert not any("disarm to change" in text for text in station.texts())


@pytest.mark.parametrize("board", TelemetryProtocol)
def test_item_0_is_not_denied_while_the_craft_may_be_armed(board: TelemetryProtocol) -> None:
    """Mission Planner repeats its request; it is refused only once the craft is known to be disarmed."""
    world = armed_before(board)
    station = GroundStation(world)
    while not world.bridge.vehicle.armed:
        for reply in ask(station, request_message(0), 0.2):
            assert reply.get_type() != "MISSION_ACK"
        assert not any("link" in text or "disarm" in text for text in station.texts())
    world.run(2.3)
    (item,) = ask(station, request_message(0))
    assert item.get_type() == "MISSION_ITEM_INT"
    assert item.x != 0


def test_a_download_continues_during_another_stations_upload() -> None:
    world, reader = holding()
    writer = GroundStation(world, "writer", sysid=250, radio=Radio(delay_s=0.01))
    upload = Upload(writer, waypoints(60, 4))
    world.run(0.3)
    assert latitudes(Download(reader).run()) == latitudes(OLD)
    assert upload.run() is A.ACCEPTED


@pytest.mark.parametrize("sent", [0, 7, 20])
def test_a_download_ends_the_stations_own_silent_upload_without_an_ack(sent: int) -> None:
    """QGroundControl gives up an upload after 1.5 s of silence; an ack would be an error of its download."""
    world, station = holding()
    new = waypoints(20, 4)
    station.send(count_message(20), wait_s=0.1)
    if sent == 20:
        world.store.delay_s = 2.5
    for item in new[:sent]:
        station.send(item_message(item.seq, item))
    world.run(1.6)
    station.take()
    assert latitudes(Download(station).run()) == latitudes(new if sent == 20 else OLD)
    world.run(7)
    assert station.messages("MISSION_ACK") == []
    assert not any("silent" in text for text in station.texts())


def test_a_delayed_list_request_does_not_end_an_upload(world: World, station: GroundStation) -> None:
    """The network may deliver the list request of an earlier Read again."""
    items = waypoints(30, 4)
    station.radio = Radio(delay_s=0.02)
    upload = Upload(station, items)
    for later_s in (0.05, 0.2, 0.5):
        world.after(later_s, lambda: station.send(list_message()))
    assert upload.run() is A.ACCEPTED


def test_mission_current_has_the_number_of_items_held(world: World, station: GroundStation) -> None:
    station.send(count_message(1), wait_s=1.5)
    current = station.messages("MISSION_CURRENT")[-1]
    assert (current.seq, current.total, current.mission_state) == (0, 19, 2)
    Upload(station, waypoints(5)).run()
    world.run(1.5)
    assert station.messages("MISSION_CURRENT")[-1].total == 4
    # While the list is unknown, so is its length: that is not the same as no mission.
    world.power_off()
    world.run(5)
    current = station.messages("MISSION_CURRENT")[-1]
    assert (current.seq, current.total, current.mission_state) == (0, 0, 0)
