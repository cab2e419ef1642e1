# SPDX-License-Identifier: GPL-3.0-or-later
"""A board in its CLI is recognised by its echo and reported; nothing is typed; it is found again afterwards."""

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import Any

import pytest

from bridge.fc.states.msp import Cli
from bridge.fc.states.searching import Searching
from protocols.mission_item import MissionResult
from protocols.msp.frame import request
from simulator.board.options import Faults, SimOptions, Tree
from simulator.commands.fc_kinds import make_board
from simulator.naze.board import SimulatedNaze
from tests.support.conversations import Upload, waypoints
from tests.support.world import GroundStation, World

BOARDS: dict[str, Callable[[], Any]] = {
    "testcode3": lambda: SimulatedNaze(SimOptions(tree=Tree.TESTCODE3)),
    "webstore1": lambda: SimulatedNaze(SimOptions(tree=Tree.WEBSTORE1)),
    "inav": lambda: make_board("inav", faults=Faults(boxes=0)),
}
TROUBLE = "Board in its CLI: type exit, or unplug it"


def is_in_cli(world: World) -> bool:
    return isinstance(world.inside.session.state, Cli)


def open_command_line(world: World) -> None:
    """From a terminal program on another port of the board, not through the bridge."""
    world.naze.receive(b"#" if world.naze.protocol is None else b"\r\r\r", world.now)
    # INAV needs silence after the key; on a busy machine the bridge may pause that long.
    world.now += 0.2
    world.run_until(lambda w: w.naze.counters.cli_entered, 1)
    assert world.naze.counters.cli_entered


def type_exit(world: World) -> bytes:
    """Type `exit` and return the echo."""
    world.run(0.1)
    received: list[bytes] = []
    receive = world.bridge.fc_received

    def listen(data: bytes, now: float) -> bool:
        received.append(data)
        return receive(data, now)

    world.bridge.fc_received = listen  # type: ignore[method-assign]
    world.naze.receive(b"exit\r", world.now)
    world.run(0.5)
    world.bridge.fc_received = receive  # type: ignore[method-assign]
    return b"".join(received)


def left_in_cli(board: Any) -> World:
    """The port is opened a minute after the board was left in its CLI."""
    world = World(peer=board, plugged=False)
    if world.naze.protocol is None:
        world.run(1)
    open_command_line(world)
    world.run(60)
    world.plug()
    return world


def assert_nothing_was_typed(world: World, since: float, until: float = inf) -> None:
    """No line was ended, and each request was deleted again."""
    written = b"".join(data for at, _, data in world.written if since <= at < until)
    assert not {0x0D, 0x0A, 0x04, 0x0C, ord("?")} & set(written)
    # A tab completes a command's name, which a request does not begin with; INAV's MSP2 polls have one.
    assert until < inf or 0x09 not in written


@pytest.mark.parametrize("kind", BOARDS)
def test_it_is_recognised_when_the_port_is_opened(kind: str) -> None:
    world = left_in_cli(BOARDS[kind]())
    station = GroundStation(world)
    world.bridge.add_default_peer(station.peer, until_answered=False)
    world.wait_until(is_in_cli, 2)
    (event,) = world.events("fc.in_command_line")
    assert event.facts["speed_baud"] == 115200
    world.run(30)
    assert is_in_cli(world)
    assert station.texts().count(TROUBLE) == 4
    assert world.bridge.fc_trouble == TROUBLE
    assert not world.events("fc.found")
    assert Upload(station, waypoints(5)).run() is MissionResult.DENIED
    assert station.texts()[-1] == TROUBLE
    assert_nothing_was_typed(world, 0)


@pytest.mark.parametrize("kind", BOARDS)
def test_it_is_recognised_in_mid_conversation_and_found_again_after_exit(kind: str) -> None:
    world = World(peer=BOARDS[kind]())
    station = GroundStation(world)
    world.bridge.add_default_peer(station.peer, until_answered=False)
    world.wait_ready(then_s=5)
    open_command_line(world)
    began = world.now
    world.wait_until(is_in_cli, 2)
    assert_nothing_was_typed(world, began, until=world.now)
    recognised = world.now
    world.run(20)
    assert is_in_cli(world)
    assert_nothing_was_typed(world, recognised)
    echo = type_exit(world)
    if kind == "webstore1":
        # It ignores DEL, so the first `exit` is appended to the requests.
        assert b"Rebooting" not in echo
        echo = type_exit(world)
    assert b"Rebooting" in echo
    world.wait_until(lambda w: w.is_found, 20, then_s=5)
    assert any("back after" in text for text in station.texts())
    assert Upload(station, waypoints(5)[kind == "inav" :]).run() is MissionResult.ACCEPTED


@pytest.mark.parametrize("kind", BOARDS)
def test_it_is_found_again_after_unplugging(kind: str) -> None:
    world = left_in_cli(BOARDS[kind]())
    world.wait_until(is_in_cli, 2, then_s=10)
    world.power_off()
    world.wait_until(lambda w: isinstance(w.inside.session.state, Searching), 10)
    assert world.bridge.fc_trouble == ""
    world.power_on()
    world.wait_until(lambda w: w.is_found, 20, then_s=1)


@pytest.mark.parametrize("kind", BOARDS)
def test_a_board_in_the_cli_is_probed_every_three_seconds(kind: str) -> None:
    world = left_in_cli(BOARDS[kind]())
    world.wait_until(is_in_cli, 2)
    began = world.now
    world.run(90)
    assert is_in_cli(world)
    assert len([at for at, _, _ in world.written if at > began]) <= 31
    assert_nothing_was_typed(world, 0)


def test_is_silent_while_a_person_types() -> None:
    world = left_in_cli(BOARDS["testcode3"]())
    world.wait_until(is_in_cli, 2, then_s=1)
    began = world.now
    for character in b"set looptime=3500":
        world.naze.receive(bytes((character,)), world.now)
        world.run(1)
    assert not [at for at, _, _ in world.written if at > began]
    world.run(10)
    world.naze.receive(b"\r", world.now)
    world.run(10)
    assert is_in_cli(world)


def test_a_list_that_looks_like_an_echo_is_still_a_list() -> None:
    """The coordinate 67.5040548 N contains a request's header, and the board sends it twice."""
    world = World()
    world.wait_ready()
    at = int.from_bytes(request(100)[:3] + b"(", "little")
    station = GroundStation(world)
    items = [replace(item, lat_e7=at) for item in waypoints(40)]
    assert Upload(station, items).run() is MissionResult.ACCEPTED
    world.inside.missions.held = None
    for _ in range(5):
        world.push(items)
        world.run(3)
    assert not world.events("fc.in_command_line")
    assert len(world.events("fc.found")) == 1
