# SPDX-License-Identifier: GPL-3.0-or-later
"""Fences and rally points of ground stations are an INAV's geozones and safehomes: written, read back and saved."""

import struct
from dataclasses import replace

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.mission_item import Command, MissionItem, MissionResult
from protocols.msp.frame import Direction, MspFrame
from protocols.msp.inav_places import GEOZONE, GEOZONE_FEATURE, SAFEHOME, SET_GEOZONE, SET_GEOZONE_VERTEX, SET_SAFEHOME
from simulator.board.msp_board import MspBoard
from simulator.board.options import Faults
from simulator.commands.fc_kinds import make_board
from simulator.inav.places import SET_FEATURE
from tests.bridge.controllers.inav.test_mission_store import ACCEPTED, board_with
from tests.bridge.controllers.nav.test_mission_store import plan
from tests.support.conversations import Download, Upload, clear_message
from tests.support.qgc_upload import FatedLink, QgcStation, QgcUpload
from tests.support.seeds import seeds
from tests.support.world import GroundStation, World

FENCE, RALLY, ALL = 1, 2, 255
LAT, LON = 453838000, 84733000


def place(command: int, north: int = 0, east: int = 0, p1: float = 0.0, alt_m: float = 0.0) -> MissionItem:
    """North and east in units of 1e-5 degrees."""
    return MissionItem(0, command, 3, p1, 0.0, 0.0, 0.0, LAT + 100 * north, LON + 100 * east, alt_m)


def polygon(command: int, *corners: tuple[int, int]) -> list[MissionItem]:
    return [place(command, north, east, float(len(corners))) for north, east in corners]


CIRCLE = place(Command.FENCE_CIRCLE_EXCLUSION, 500, 500, 75.5)
#: Anticlockwise.
FIELD = polygon(Command.FENCE_POLYGON_INCLUSION, (-900, -900), (-900, 900), (900, 900), (900, -900))
FENCE_ITEMS = [*FIELD, CIRCLE]
RALLY_ITEMS = [place(Command.RALLY_POINT, north) for north in (100, 200, 300)]


def numbered(items: list[MissionItem]) -> list[MissionItem]:
    return [replace(item, seq=seq) for seq, item in enumerate(items)]


def read(station: GroundStation, kind: int) -> list[MissionItem]:
    return Download(station, mission_type=kind).run()


@pytest.mark.parametrize(("kind", "items"), [(FENCE, FENCE_ITEMS), (RALLY, RALLY_ITEMS)])
@pytest.mark.parametrize("version", ["8.0.1", "9.1.0"])
def test_a_list_is_written_read_and_survives_a_restart(kind: int, items: list[MissionItem], version: str) -> None:
    board, world, station = board_with(version=version)
    assert read(station, kind) == []
    assert Upload(station, items, mission_type=kind).run() is ACCEPTED
    assert read(station, kind) == numbered(items)
    board.power_off(world.now)
    board.power_on_booted(world.now)
    world.run(5)
    assert read(station, kind) == numbered(items)
    assert Download(station).run()[1:] == []


@pytest.mark.parametrize("seed", seeds(2))
def test_qgroundcontrol_uploads_mission_fence_and_rally_points_over_a_lossy_link(seed: int) -> None:
    """One after the other, as its Upload button does; each list takes only the messages of its own type."""
    _, world, station = board_with()
    qgc = QgcStation(world, FatedLink(world, seed, loss=0.05), "qgc")
    for kind, items in ((0, plan(4)), (FENCE, FENCE_ITEMS), (RALLY, RALLY_ITEMS)):
        upload = qgc.upload = QgcUpload(world, qgc.send, items, kind)
        world.run_until(lambda _, upload=upload: upload.is_over, 60)  # type: ignore[misc]
        assert (upload.result, upload.gave_up) == (ACCEPTED, False)
    assert (read(station, FENCE), read(station, RALLY)) == (numbered(FENCE_ITEMS), numbered(RALLY_ITEMS))


def test_unchanged_lists_are_not_written_again() -> None:
    _, _, station = board_with()
    assert Upload(station, FENCE_ITEMS, mission_type=FENCE).run() is ACCEPTED
    assert Upload(station, FENCE_ITEMS, mission_type=FENCE).run() is ACCEPTED
    assert "Fence verified: 5 items, unchanged, warnings: 1" in station.texts()


def test_clear_all_clears_missions_fences_and_rally_points_with_one_answer_for_missions() -> None:
    _, _world, station = board_with()
    assert Upload(station, plan(4)).run() is ACCEPTED
    assert Upload(station, FENCE_ITEMS, mission_type=FENCE).run() is ACCEPTED
    assert Upload(station, RALLY_ITEMS, mission_type=RALLY).run() is ACCEPTED
    before = len(station.messages("MISSION_ACK"))
    station.send(clear_message(ALL), wait_s=8)
    acks = station.messages("MISSION_ACK")[before:]
    assert {(ack.mission_type, ack.type) for ack in acks} == {(ALL, 0), (FENCE, 0), (RALLY, 0)}
    assert read(station, FENCE) == read(station, RALLY) == Download(station).run()[1:] == []


def test_one_type_is_cleared_alone() -> None:
    _, _world, station = board_with()
    assert Upload(station, FENCE_ITEMS, mission_type=FENCE).run() is ACCEPTED
    assert Upload(station, RALLY_ITEMS, mission_type=RALLY).run() is ACCEPTED
    station.send(clear_message(FENCE), wait_s=5)
    assert read(station, FENCE) == []
    assert read(station, RALLY) == numbered(RALLY_ITEMS)


def test_capabilities_are_those_of_the_board() -> None:
    fence, rally = messages.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE, messages.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
    for version, kind, bits in (("7.1.2", "inav", rally), ("9.1.0", "inav", fence | rally), ("9.1.0", "multiwii", 0)):
        _, _world, station = board_with(kind, version=version)
        station.send(messages.MAVLink_autopilot_version_request_message(1, 1), wait_s=1)
        (found,) = station.messages("AUTOPILOT_VERSION")[-1:]
        assert found.capabilities & (fence | rally) == bits


@pytest.mark.parametrize(("kind", "version"), [("inav", "7.1.2"), ("multiwii", "9.1.0")])
def test_a_board_without_geozones_refuses_a_fence(kind: str, version: str) -> None:
    _, _, station = board_with(kind, version=version)
    assert Upload(station, FENCE_ITEMS, mission_type=FENCE).run() is MissionResult.UNSUPPORTED
    assert "Fences and rally points are not stored here" in " ".join(station.texts())


@pytest.mark.parametrize(
    ("version", "text"),
    [("7.1.2", "This flight controller has no fence"), ("9.1.0", "Switch geozones on or off in INAV's settings")],
)
def test_a_fence_button_is_refused_according_to_the_board(version: str, text: str) -> None:
    _, world, station = board_with("inav", version=version)
    station.send(messages.MAVLink_command_long_message(1, 1, messages.MAV_CMD_DO_FENCE_ENABLE, 0, 1, *[0] * 6))
    world.run(1)
    assert station.texts()[-1] == text


def test_an_armed_craft_is_read_but_not_changed() -> None:
    _, world, station = board_with()
    assert Upload(station, RALLY_ITEMS, mission_type=RALLY).run() is ACCEPTED
    world.arm(then_s=3)
    assert Upload(station, RALLY_ITEMS[:1], mission_type=RALLY).run() is MissionResult.DENIED
    assert read(station, RALLY) == numbered(RALLY_ITEMS)


def test_a_lost_reply_to_a_corner_does_not_leave_a_corner_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    """INAV would keep it twice, and turn all zones off."""
    board, _, station = board_with()
    firmware = board._firmware
    answer, losses = firmware.answer, [True, False, True]  # type: ignore[union-attr]

    def losing(command: int, payload: bytes, now: float) -> bytes | None:
        found = answer(command, payload, now)
        return b"" if command == SET_GEOZONE_VERTEX and losses and losses.pop() else found

    monkeypatch.setattr(firmware, "answer", losing)
    assert Upload(station, FENCE_ITEMS, mission_type=FENCE).run() is ACCEPTED
    used = [vertex for vertex in firmware._places._vertices if vertex[0] != 0xFF]  # type: ignore[union-attr]
    assert len(used) == len(FIELD) + 2


def refuse(
    monkeypatch: pytest.MonkeyPatch, board: MspBoard, command: int, times: int, number: int | None = None
) -> None:
    """The board refuses the next requests with this command, and number as the first byte."""
    answer, left = board._firmware.answer, [times]  # type: ignore[union-attr]

    def answer_or_refuse(asked: int, payload: bytes, now: float) -> bytes | None:
        if asked != command or not left[0] or number not in (None, payload[0]):
            return answer(asked, payload, now)
        left[0] -= 1
        return MspFrame(Direction.ERROR, asked, b"", is_v2=True).encode()

    monkeypatch.setattr(board._firmware, "answer", answer_or_refuse)


@pytest.mark.parametrize(
    ("kind", "old", "new", "setter"),
    [
        (FENCE, FENCE_ITEMS, [CIRCLE, *FIELD], SET_GEOZONE_VERTEX),
        (RALLY, RALLY_ITEMS, [*RALLY_ITEMS[1:], place(Command.RALLY_POINT, 400)], SET_SAFEHOME),
    ],
)
def test_after_a_refusal_the_old_list_is_back(
    kind: int, old: list[MissionItem], new: list[MissionItem], setter: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    board, world, station = board_with()
    assert Upload(station, old, mission_type=kind).run() is ACCEPTED
    refuse(monkeypatch, board, setter, times=3 if kind == FENCE else 1)
    assert Upload(station, new, mission_type=kind).run() is MissionResult.DENIED
    assert "old kept" in " ".join(station.texts())
    assert read(station, kind) == numbered(old)
    world.run(1)


def test_heights_and_actions_of_unchanged_zones_stay_and_are_named() -> None:
    board, _, station = board_with()
    assert Upload(station, FENCE_ITEMS, mission_type=FENCE).run() is ACCEPTED
    firmware = board._firmware
    zone = struct.pack("<BBBiiBBB", 1, 0, 0, 0, 12000, 0, 3, 2)
    firmware._places.answer(SET_GEOZONE, zone)  # type: ignore[union-attr]
    circle = struct.pack("<BBiii", 1, 0, LAT + 50000, LON + 50000, 7550)
    firmware._places.answer(SET_GEOZONE_VERTEX, circle)  # type: ignore[union-attr]
    assert Upload(station, [CIRCLE, *FIELD], mission_type=FENCE).run() is ACCEPTED
    assert firmware._places.answer(GEOZONE, b"\0") == struct.pack(  # type: ignore[union-attr]
        "<BBBiiBBB", 0, 0, 0, 0, 12000, 0, 3, 2
    )
    assert "geozone 0 keeps ceiling 120 m above home, action RTH" in " ".join(station.texts())
    assert Upload(station, FIELD, mission_type=FENCE).run() is ACCEPTED
    assert "Geozone 0 is erased, with ceiling 120 m above home, action RTH" in " ".join(station.texts())


def test_a_zone_whose_corners_are_missing_turns_all_off_and_is_cleared_by_the_next_fence() -> None:
    """As after an upload that broke off: INAV then acts at no border, and flies missions as without zones."""
    board, world, station = board_with()
    places = board._firmware._places  # type: ignore[union-attr]
    places.answer(SET_FEATURE, GEOZONE_FEATURE.to_bytes(4, "little"))
    places.answer(SET_GEOZONE, struct.pack("<BBBiiBBB", 1, 1, 1, 0, 0, 0, 0, 3))
    places.answer(SET_GEOZONE, struct.pack("<BBBiiBBB", 5, 0, 0, 0, 0, 0, 0, 2))
    places.save()
    board.power_off(world.now)
    world.run(10)
    board.power_on_booted(world.now)
    world.run(10)
    assert read(station, FENCE) == []
    assert Upload(station, plan(3)).run() is ACCEPTED
    assert Upload(station, FENCE_ITEMS, mission_type=FENCE).run() is ACCEPTED
    assert board._firmware._places.answer(GEOZONE, b"\5")[-1] == 0  # type: ignore[union-attr]


def test_unchanged_safehomes_keep_their_number_and_so_their_landing_approach() -> None:
    board, _, station = board_with()
    assert Upload(station, RALLY_ITEMS, mission_type=RALLY).run() is ACCEPTED
    assert Upload(station, RALLY_ITEMS[1:], mission_type=RALLY).run() is ACCEPTED
    stored = [board._firmware._places.answer(SAFEHOME, bytes((n,))) for n in range(3)]  # type: ignore[union-attr]
    assert [answer[1] for answer in stored if answer] == [0, 1, 1]


def test_a_board_without_missions_refuses_rally_points() -> None:
    """Before a board is found, and on one without missions."""
    station = GroundStation(World(peer=make_board("betaflight", faults=Faults(boxes=0)), speeds=(115200,)))
    assert Upload(station, RALLY_ITEMS, mission_type=RALLY).run() is MissionResult.UNSUPPORTED
