# SPDX-License-Identifier: GPL-3.0-or-later
"""A bridge whose board holds a list, and a ground station that writes another one message by message."""

from collections.abc import Sequence

from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.line.conversation import Conversation, Pause
from bridge.transfers.upload_states import Receiving, UploadState
from protocols.mavlink.dialect import Message
from protocols.mission_item import MissionItem, MissionResult
from simulator.board.options import Faults, SimOptions
from tests.support.conversations import Upload, count_message, item_message, records_of, waypoints
from tests.support.world import GroundStation, World, flash_holding, ready_world

OLD = waypoints(20, seed=77)
OLD_RECORDS = records_of(OLD)
OLD_FLASH = flash_holding(OLD_RECORDS)
A = MissionResult


def holding(options: SimOptions | None = None, faults: Faults | None = None) -> tuple[World, GroundStation]:
    """A bridge connected to a board that holds the old list, and one known ground station."""
    world = ready_world(options, faults, flash=OLD_FLASH)
    assert world.stored == OLD_RECORDS
    return world, GroundStation(world)


def state(world: World) -> type[UploadState] | None:
    """The state of the first upload; None if there is none."""
    uploads = list(world.inside.uploads._uploads)
    return type(uploads[0].state) if uploads else None


def receiving(world: World, station: GroundStation, items: list[MissionItem], sent: int) -> None:
    """Begin an upload and send its first items."""
    station.send(count_message(len(items)))
    world.wait_until(lambda w: state(w) is Receiving, 1)
    for seq in range(sent):
        station.send(item_message(seq, items[seq]))
    world.run(0.001)
    station.take()


def begun(items: list[MissionItem], sent: int, options: SimOptions | None = None) -> tuple[World, GroundStation]:
    """A bridge whose board holds the old list, and a station that has sent the first items of an upload."""
    world, station = holding(options)
    receiving(world, station, items, sent)
    return world, station


def finish(world: World, station: GroundStation, items: list[MissionItem], sent: int = 0) -> None:
    """Send the items from number `sent` on; the list is accepted and stored."""
    before = acks(station)
    for seq in range(sent, len(items)):
        station.send(item_message(seq, items[seq]))
    world.run(1)
    assert acks(station) == [*before, A.ACCEPTED]
    assert world.stored == records_of(items)


def assert_written(station: GroundStation, items: Sequence[MissionItem]) -> None:
    """The station's upload is accepted, and the board holds the items."""
    assert Upload(station, items).run() is A.ACCEPTED
    assert station.world.stored == records_of(items)


def acks(station: GroundStation) -> list[MissionResult]:
    return [MissionResult(message.type) for message in station.messages("MISSION_ACK")]


def requested(station: GroundStation) -> list[int]:
    assert station.messages("MISSION_REQUEST_INT") == []
    return [message.seq for message in station.messages("MISSION_REQUEST")]


def partial_list_message(mission_type: int = 0) -> Message:
    return messages.MAVLink_mission_write_partial_list_message(1, 1, 0, 0, mission_type)


def assert_refusal_is_repeated(world: World, station: GroundStation, result: MissionResult) -> None:
    """Mission Planner continues after any ack to its count; its further messages get the same refusal."""
    for seq in (0, 1, 0, 999):
        station.ask(item_message(seq, OLD[1]), wait_s=0.05)
        assert acks(station) == [result]
        assert requested(station) == []
    station.ask(partial_list_message(), wait_s=0.05)
    assert acks(station) == [result]
    assert A.INVALID_SEQUENCE not in acks(station)
    assert state(world) is None


def refused(world: World, station: GroundStation, count: int, result: MissionResult, words: str) -> None:
    """Announce a list; it is refused with this result and text, and the old list stays."""
    station.send(count_message(count))
    world.wait_until(lambda _: bool(acks(station)), 3)
    assert acks(station) == [result]
    assert any(words in text for text in station.texts()), station.texts()
    assert requested(station) == []
    assert_refusal_is_repeated(world, station, result)
    if world.naze.stored:
        assert world.stored == OLD_RECORDS


def hanging_push(world: World) -> None:
    """A push from the command line that waits 3 s for the line."""

    def waiting() -> Conversation[None]:
        yield Pause(3.0)

    world.inside.runner.start(waiting(), lambda *_: None, world.now)
    world.push(waypoints(3))
