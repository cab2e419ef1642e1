# SPDX-License-Identifier: GPL-3.0-or-later
"""A new flight controller needs one profile and one line in the table (docs/design.md)."""

from bridge.controllers.table import PROFILES
from bridge.fc.interview import Interview
from bridge.fc.profile import FlightController, Profile
from bridge.line.conversation import Conversation
from bridge.model.refusal import Refusal
from protocols.mission_item import MissionResult
from tests.support.conversations import Upload, waypoints
from tests.support.fake_inav import FakeInav
from tests.support.world import GroundStation, World


def recognise(board: Interview) -> Conversation[FlightController | None]:
    if (yield from board.variant()) != "TOYS":
        return None
    return FlightController(TOY, "Toy 1.0", boxes=(yield from board.box_names()))


NO_MISSIONS = Refusal(MissionResult.UNSUPPORTED, "Toys do not navigate")
TOY = Profile("a toy", "Toy", recognise=recognise, missions=NO_MISSIONS)


def test_a_new_flight_controller_needs_only_a_profile() -> None:
    board = FakeInav()
    board.answers = {2: b"TOYS", 116: b"ANGLE;ARM;"}
    board.answer = lambda frame: (  # type: ignore[method-assign]
        bytes(6) + b"\2\0\0\0\0" if frame.command == 101 else board.answers.get(frame.command)
    )
    world = World(peer=board, speeds=(115200,), profiles=(TOY, *PROFILES))
    station = GroundStation(world)
    world.bridge.add_default_peer(station.peer, until_answered=False)
    world.wait_until(lambda w: w.kind is TOY, 5)
    world.run(2)
    assert "Found Toy 1.0" in station.texts()
    assert station.messages("HEARTBEAT")[-1].base_mode & 128, "its ARM box is the second one"
    assert Upload(station, waypoints(3)).run() is MissionResult.UNSUPPORTED
    assert "Toys do not navigate" in station.texts()
