# SPDX-License-Identifier: GPL-3.0-or-later
"""Other MSP firmware: telemetry only, and never mistaken for one that navigates."""

from collections.abc import Callable

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.controllers import other
from protocols.mission_item import MissionResult
from protocols.msp.nav import Nav
from tests.bridge.controllers.nav.test_mission_store import found, plan
from tests.support.conversations import Upload
from tests.support.fake_controllers import HARAKIRI_CAPABILITY, MspFake, ident
from tests.support.fake_inav import FakeInav
from tests.support.world import World


@pytest.mark.parametrize("name", [b"BTFL", b"CLFL", b"INAV"])
def test_other_firmware_is_telemetry_only(name: bytes) -> None:
    board = FakeInav()
    board.answers = {1: b"\0\1\x2a", 2: name, 119: bytes((0, 1, 2)), 116: b"ARM;ANGLE;"}
    board.answer = lambda frame: (  # type: ignore[method-assign]
        bytes(6) + b"\1\0\0\0\0" if frame.command == 101 else board.answers.get(frame.command)
    )
    world, station = found(board)
    assert world.kind is (other.OTHER_MSP if name == b"INAV" else other.CLEANFLIGHT)
    world.run(1)
    assert world.bridge.vehicle.armed is True
    assert Upload(station, plan(5)).run() is MissionResult.UNSUPPORTED
    assert any("cannot store missions" in text for text in station.texts())
    assert not {Nav.SET_WP, Nav.SAVE, Nav.LOAD} & set(board.commands)


def test_the_arm_box_of_a_betaflight_whose_box_names_exceed_a_frame() -> None:
    board = FakeInav()
    board.answers = {2: b"BTFL", 119: bytes((0, 1, 46, 11))}
    board.answer = lambda frame: (  # type: ignore[method-assign]
        bytes(6) + b"\5\0\0\0\0" if frame.command == 101 else board.answers.get(frame.command)
    )
    _world, station = found(board)
    station.send(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3), wait_s=3)
    beat = station.messages("HEARTBEAT")[-1]
    assert beat.base_mode & messages.MAV_MODE_FLAG_SAFETY_ARMED
    assert beat.custom_mode == 6


BOXES = b"ANGLE;HORIZON;BARO;MAG;CAMSTAB;ARM;GPS HOME;GPS HOLD;"


OTHERS: dict[str, Callable[[], MspFake]] = {
    "MultiWii": lambda: MspFake({100: ident(241, 1 << 4), 116: BOXES, 101: bytes(11)}),
    "Baseflight": lambda: MspFake({100: ident(230, HARAKIRI_CAPABILITY), 116: BOXES + b"GTUNE;", 101: bytes(11)}),
    "no GTUNE": lambda: MspFake({100: ident(211, HARAKIRI_CAPABILITY), 116: BOXES, 101: bytes(11)}),
    "capability": lambda: MspFake({100: ident(211, 0), 116: BOXES + b"GTUNE;", 101: bytes(11)}),
    "INAV": lambda: MspFake({1: bytes((0, 2, 5)), 2: b"INAV", 116: BOXES, 101: bytes(11)}),
    "no boxes": lambda: MspFake({2: b"BTFL", 101: bytes(11)}),
    "long boxes": lambda: MspFake({2: b"INAV", 116: (BOXES * 5)[:255], 101: bytes(11)}),
}


@pytest.mark.parametrize("name", OTHERS)
def test_similar_firmware_is_not_mistaken_for_harakiri(name: str) -> None:
    fake = OTHERS[name]()
    world = World(peer=fake)
    world.wait_until(lambda w: w.is_found, 3)
    assert world.kind in (other.OTHER_MSP, other.CLEANFLIGHT, other.OLD_MULTIWII)
    world.run(10)
    assert world.kind in (other.OTHER_MSP, other.CLEANFLIGHT, other.OLD_MULTIWII)
    # These command numbers may mean something else to other firmware.
    assert not {190, 191, 192, 193, 194, 195, 196} & set(fake.asked)


def test_firmware_that_ignores_unknown_requests_is_not_identified() -> None:
    world = World(peer=MspFake({100: ident(240, 0), 116: BOXES, 101: bytes(11)}, silent_on_unknown=True))
    world.run(20)
    assert world.kind is None
