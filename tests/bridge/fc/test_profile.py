# SPDX-License-Identifier: GPL-3.0-or-later
"""A new flight controller needs one profile and one line in the table (docs/design.md)."""

import random
from functools import cache

import pytest

from bridge.controllers.harakiri import profile as harakiri
from bridge.controllers.table import PROFILES
from bridge.fc.profile import FlightController, Interview, Profile
from bridge.fc.states.msp import Identifying
from bridge.fc.states.searching import SPEEDS
from bridge.line.conversation import Conversation
from bridge.model.missions import Refusal
from bridge.voice import sentences
from protocols.mission_item import MissionResult
from simulator.board.options import SimOptions, TelemetryProtocol
from simulator.naze.firmware import Protocol
from tests.support.conversations import Upload, waypoints
from tests.support.fake_inav import FakeInav
from tests.support.seeds import seeds
from tests.support.world import GroundStation, World


def recognise(board: Interview) -> Conversation[FlightController | None]:
    if (yield from board.variant()) != "TOYS":
        return None
    return FlightController(TOY, "Toy 1.0", boxes=(yield from board.box_names()))


NO_MISSIONS = Refusal(MissionResult.UNSUPPORTED, sentences.NO_MISSIONS())
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
    world.wait_until(lambda w: w.kind is TOY, 5, then_s=2)
    assert "Found Toy 1.0" in station.texts()
    assert station.messages("HEARTBEAT")[-1].base_mode & 128, "its ARM box is the second one"
    assert Upload(station, waypoints(3)).run() is MissionResult.UNSUPPORTED
    assert sentences.NO_MISSIONS().text in station.texts()


#: Counted from when the board can be heard again.
FOUND_WITHIN_S = 8.0
ALL_SPEEDS = sorted(set(SPEEDS), reverse=True)


def begun(baud: int, protocol: TelemetryProtocol) -> World:
    """A world in which identification has just begun."""
    world = World(SimOptions(baud=baud, tele_prot=protocol))
    world.wait_until(lambda w: isinstance(w.inside.session.state, Identifying), 20)
    return world


@cache
def identification_s(baud: int, protocol: TelemetryProtocol) -> float:
    searches = "searching", "identifying"
    return begun(baud, protocol).wait_until(lambda w: w.inside.session.state.name not in searches, 20)


def identifying(baud: int, seed: int, protocol: TelemetryProtocol = TelemetryProtocol.MSP) -> World:
    """A world at some moment of identification."""
    world = begun(baud, protocol)
    if seed:
        world.run(identification_s(baud, protocol) * random.Random(seed).random())
    assert isinstance(world.inside.session.state, Identifying)
    return world


def is_known(world: World) -> bool:
    return world.inside.session.state.controller is not None


@pytest.mark.parametrize("baud", ALL_SPEEDS)
@pytest.mark.parametrize("protocol", TelemetryProtocol)
def test_a_board_that_arms_and_disarms_is_found_again(baud: int, protocol: TelemetryProtocol) -> None:
    for seed in seeds(3):
        world = identifying(baud, seed, protocol)
        world.faults.armed = True
        if (baud, protocol) != (1200, TelemetryProtocol.MAVLINK):
            world.wait_until(lambda w: is_known(w) and w.bridge.vehicle.armed is True, FOUND_WITHIN_S)
        world.run(random.Random(seed).random() * 6)
        world.faults.armed = False
        # Until 4 s after the last request it hears only MAVLink; then its ring must empty.
        world.wait_until(lambda w: w.naze.protocol is not Protocol.MAVLINK, FOUND_WITHIN_S)
        world.run(world.naze.options.tree.value * 10 / baud)
        world.wait_until(lambda w: w.kind is harakiri.PATCHED, FOUND_WITHIN_S)
