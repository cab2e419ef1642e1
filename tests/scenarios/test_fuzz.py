# SPDX-License-Identifier: GPL-3.0-or-later
"""Arbitrary input over UDP, TCP, the UART and in files: nothing raises.

`make fuzz` draws more. Failing seeds are kept in .hypothesis/fuzz and tried first next time.
"""

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, example, given, settings
from hypothesis import strategies as st
from hypothesis.database import DirectoryBasedExampleDatabase
from pymavlink.dialects.v20 import ardupilotmega as messages

from payloads.mission_data import to_json
from protocols.mission_file import MissionFileError, read_mission_file
from reports.vehicle_groups import Group
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.board.simulated_board import SimulatedBoard
from simulator.commands.fc_kinds import KINDS, make_board
from simulator.naze.board import SimulatedNaze
from storage.mission_store import open_store
from storage.store_error import StoreError
from tests.support.corrupting_board import CorruptingBoard, RandomAutopilot
from tests.support.fuzz_inputs import FuzzInputs
from tests.support.sample_missions import mission
from tests.support.world import GroundStation, World, ready_world

REPOSITORY = Path(__file__).parents[2]
EXAMPLES = int(os.environ.get("FUZZ_EXAMPLES", "15"))
#: Inputs per example, so that one input's side effects meet the next.
AT_ONCE = 200
#: Inputs between two runs of the bridge.
TOGETHER = 10


def _fuzz(test: Callable[..., Any]) -> Callable[..., Any]:
    options = settings(
        max_examples=EXAMPLES,
        database=DirectoryBasedExampleDatabase(".hypothesis/fuzz"),
        phases=(Phase.explicit, Phase.reuse, Phase.generate),  # shrinking a seed simplifies nothing
        suppress_health_check=list(HealthCheck),
        deadline=None,
    )
    return options(given(seed=st.integers(0, (1 << 64) - 1))(test))


@_fuzz
def test_arbitrary_ground_station_input_never_raises(seed: int) -> None:
    inputs = FuzzInputs(seed)
    world = ready_world()
    stations = [GroundStation(world, str(number), sysid=250 + number) for number in range(4)]
    for number in range(AT_ONCE):
        station = inputs.random.choice(stations)
        world.receive_from(station, inputs.from_a_ground_station(), datagram=inputs.random.random() < 0.5)
        if number % TOGETHER == 0:
            world.run(0.01)
    world.run(1)


@_fuzz
def test_arbitrary_uart_input_never_raises(seed: int) -> None:
    inputs = FuzzInputs(seed)
    world = World(speeds=(115200,))
    if inputs.random.random() < 0.7:
        world.wait_ready()
    for number in range(AT_ONCE):
        world.receive_from_fc(inputs.from_the_uart())
        if number % TOGETHER == 0:
            world.run(0.01)
    world.run(1)


@example(1383)  # an angle in rad that is no float in degrees
@_fuzz
def test_arbitrary_replies_never_raise(seed: int) -> None:
    """Frames in place of a board's own: a right checksum around wrong contents."""
    inputs = FuzzInputs(seed)
    faults = Faults()
    world = World(peer=_corrupting_board(inputs, faults), faults=faults, speeds=(115200, 9600, 57600))
    world.bridge.watch(Group)
    station = GroundStation(world)
    for _ in range(AT_ONCE // 20):
        station.send(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
        station.send(messages.MAVLink_mission_request_list_message(1, 1))
        world.run(0.5)
        faults.armed = inputs.random.random() < 0.5
        for group in world.take_published():
            to_json(asdict(world.bridge.group(group, world.now)))
    world.run(1)


@_fuzz
def test_arbitrary_mission_files_never_raise(seed: int) -> None:
    inputs = FuzzInputs(seed)
    for _ in range(AT_ONCE):
        with suppress(MissionFileError):
            read_mission_file(inputs.like(mission_files()), "fuzz")


def _corrupting_board(inputs: FuzzInputs, faults: Faults) -> CorruptingBoard | RandomAutopilot:
    kind = inputs.random.choice(("harakiri", "harakiri", "autopilot", *KINDS))
    if kind == "autopilot":
        return RandomAutopilot(inputs)
    board: SimulatedBoard = SimulatedNaze(SimOptions(tele_prot=inputs.random.choice(tuple(TelemetryProtocol))), faults)
    if kind != "harakiri":
        board = make_board(kind, faults=faults)
    return CorruptingBoard(board, inputs, inputs.random.choice((0.02, 0.3)))


@pytest.fixture(scope="module")
def store_file(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("store") / "missions.db"
    with open_store(path, 0.0).store as store:
        for tag in range(1, 6):
            store.conclude(store.add(mission(tag)), "VERIFIED", "", 2.0)
    return path.read_bytes()


@_fuzz
def test_arbitrary_database_files_never_raise(store_file: bytes, seed: int) -> None:
    inputs = FuzzInputs(seed)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "missions.db"
        for _ in range(AT_ONCE // 100):
            path.write_bytes(inputs.like([store_file]))
            with suppress(StoreError), open_store(path, 0.0).store as store:
                for line in store.list(100):
                    with suppress(StoreError):
                        store.get(line.number)


@cache
def mission_files() -> list[bytes]:
    return [path.read_bytes() for kind in ("*.plan", "*.waypoints") for path in (REPOSITORY / "examples").glob(kind)]
