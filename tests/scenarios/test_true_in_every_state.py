# SPDX-License-Identifier: GPL-3.0-or-later
"""Every sentence that a pilot reads is true for the board and for its state.

Each board goes through all states of readiness. In each a station uses all its buttons, and every text that it gets is
found in the table of sentences and compared with the board.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.voice.sentences import table
from protocols.mavlink.dialect import Message
from simulator.board.msp_options import MspOptions
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.commands.fc_kinds import make_board
from tests.support.conversations import Upload, clear_message, count_message, list_message, waypoints
from tests.support.qgc_upload import QGC_HEARTBEAT
from tests.support.world import GroundStation, World

RC_LINK = 1 << 18
START_MAG_CAL = m.MAVLink_command_long_message(1, 1, m.MAV_CMD_DO_START_MAG_CAL, 0, 0, 1, 1, 0, 0, 0, 0)
COMMANDS = (
    m.MAV_CMD_COMPONENT_ARM_DISARM,
    m.MAV_CMD_MISSION_START,
    m.MAV_CMD_DO_SET_MISSION_CURRENT,
    m.MAV_CMD_NAV_TAKEOFF,
    m.MAV_CMD_DO_SET_HOME,
    m.MAV_CMD_DO_MOTOR_TEST,
    m.MAV_CMD_DO_FENCE_ENABLE,
    m.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN,
    m.MAV_CMD_PREFLIGHT_STORAGE,
    m.MAV_CMD_DO_PARACHUTE,
    m.MAV_CMD_RUN_PREARM_CHECKS,
    m.MAV_CMD_DO_SEND_BANNER,
)


@dataclass(slots=True)
class Board:
    """What the test knows of the board: `kind`, and its state."""

    kind: str
    is_on: bool = False
    was_on: bool = False
    is_armed: bool = False
    is_calibrating: bool = False
    is_blocked: bool = False

    @property
    def is_mute(self) -> bool:
        """Armed, in a protocol that carries neither missions nor settings."""
        return self.is_armed and self.kind in ("frsky", "mavlink")

    @property
    def stores_missions(self) -> bool:
        return self.kind not in ("unpatched", "betaflight")

    @property
    def flies_missions(self) -> bool:
        return self.kind in ("inav", "old inav", "multiwii")

    @property
    def may_arm(self) -> bool:
        return self.is_on and not (self.is_armed or self.is_calibrating or self.is_blocked)


#: The condition under which a sentence is true; the others are true whatever the board and its state are.
TRUE: dict[str, Callable[[Board], bool]] = {
    **dict.fromkeys(("NOT_FOUND",), lambda board: not board.was_on),
    **dict.fromkeys(("LOST",), lambda board: board.was_on and not board.is_on),
    **dict.fromkeys(("FOUND", "BACK"), lambda board: board.is_on),
    "READY": lambda board: board.may_arm,
    "NOT_READY": lambda board: not board.may_arm,
    **dict.fromkeys(("NO_BOARD_TO_COMMAND", "NO_LINK", "NO_SETTINGS"), lambda board: not board.is_on),
    **dict.fromkeys(
        ("ARM", "MODE", "REBOOT", "HOME", "FLY", "OUTPUTS", "JOYSTICK", "ORIGIN", "NO_EFFECT", "NOT_SET_TO_ITEM"),
        lambda board: board.is_on,
    ),
    **dict.fromkeys(("MISSION_SWITCH",), lambda board: board.is_on and board.flies_missions),
    "MISSION_START": lambda board: board.is_on and (board.flies_missions or board.is_mute),
    # The simulated Harakiri has no mission flight.
    "FLIES_NO_MISSIONS": lambda board: board.is_on and not board.flies_missions,
    "NO_FENCE": lambda board: board.is_on and board.kind != "inav",
    "FENCE_SWITCH": lambda board: board.is_on and board.kind == "inav",
    "SET_ON_NEWER_INAV": lambda board: board.is_on and board.kind == "old inav",
    **dict.fromkeys(("CALIBRATING_NOW",), lambda board: board.is_calibrating),
    **dict.fromkeys(
        ("SETTINGS_SAVED", "STORED", "STORED_WITH_LOSSES"), lambda board: board.is_on and not board.is_armed
    ),
    **dict.fromkeys(("ARMED", "SETTINGS_ARMED", "ARMED_AND_UNKNOWN"), lambda board: board.is_on and board.is_armed),
    "NO_MISSIONS": lambda board: board.is_on and board.kind == "betaflight",
    "NOT_PATCHED": lambda board: board.is_on and board.kind == "unpatched",
    **dict.fromkeys(
        ("ONLY_MISSIONS", "NO_PLACES", "EMPTY_PLAN"), lambda board: board.kind != "inav" or not board.is_on
    ),
    **dict.fromkeys(("CLEARED", "ALREADY_CLEAR"), lambda board: board.is_on and board.stores_missions),
}
TABLE = table()
#: The most specific first.
PATTERNS = sorted(
    (
        (re.sub(r"\\\{.*?\\\}", ".*", re.escape(text)), name)
        for name, sentence in TABLE.items()
        for text in {sentence.text, sentence.short, sentence.planner} - {""}
    ),
    key=lambda pattern: -len(pattern[0]),
)


def sentence_of(text: str) -> str:
    return next(name for pattern, name in PATTERNS if re.fullmatch(pattern, text))


def started(board: Board) -> tuple[World, Faults]:
    """A bridge, and a board without power."""
    faults = Faults(boxes=0)
    match board.kind:
        case "harakiri" | "mavlink" | "frsky" | "unpatched":
            protocols = {"mavlink": TelemetryProtocol.MAVLINK_57600, "frsky": TelemetryProtocol.FRSKY_9600}
            options = SimOptions(tele_prot=protocols.get(board.kind, TelemetryProtocol.MSP))
            faults.extension = board.kind != "unpatched"
            return World(options, faults, powered=False), faults
        case _:
            peer = make_board(
                board.kind.split()[-1], MspOptions(version="7.1.2" if "old" in board.kind else "9.1.0"), faults
            )
            return World(faults=faults, peer=peer, speeds=(115200,), powered=False), faults


def states(board: Board, world: World, faults: Faults) -> Iterator[str]:
    """Lead the board through all states."""
    world.run(2)
    yield "unknown"
    world.run(12)
    yield "never found"
    world.power_on()
    board.is_on = board.was_on = True
    world.run(25)
    yield "ready"
    if board.kind.endswith("inav"):
        faults.arming_blockers, board.is_blocked = RC_LINK, True
        world.run(3)
        yield "blocked"
        faults.arming_blockers, board.is_blocked = 0, False
        world.run(3)
    GroundStation(world, "page").send(START_MAG_CAL)
    world.run(10)
    board.is_calibrating = True
    yield "calibrating"
    world.run(65)
    board.is_calibrating = False
    faults.armed = board.is_armed = True
    world.run(10)
    yield "armed"
    faults.hang, board.is_on = True, False
    world.run(10)
    yield "lost in flight"
    faults.hang = faults.armed = board.is_armed = False
    board.is_on = True
    world.run(20)
    yield "back"
    world.power_off()
    board.is_on = False
    world.run(10)
    yield "lost on the ground"


def buttons() -> Iterator[Message]:
    yield list_message()
    yield m.MAVLink_param_request_list_message(1, 1)
    for number in COMMANDS:
        yield m.MAVLink_command_long_message(1, 1, number, 0, 1, 0, 0, 0, 0, 0, 0)
    yield m.MAVLink_command_long_message(1, 1, m.MAV_CMD_DO_SET_MODE, 0, 1, 3, 0, 0, 0, 0, 0)
    yield m.MAVLink_set_mode_message(1, 1, 5)
    yield m.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0)
    yield m.MAVLink_set_gps_global_origin_message(1, 1, 1, 1)
    yield m.MAVLink_mission_set_current_message(1, 1, 2)
    yield m.MAVLink_param_set_message(1, 1, b"RC_RATE", 97, 9)
    yield m.MAVLink_mission_count_message(1, 1, 2, 1)
    yield count_message(0)
    yield clear_message()


@pytest.mark.parametrize(
    "kind", ["harakiri", "mavlink", "frsky", "unpatched", "inav", "old inav", "multiwii", "betaflight"]
)
def test_every_text_matches_the_board_and_the_state(kind: str) -> None:
    board = Board(kind)
    world, faults = started(board)
    station = GroundStation(world)
    station.heartbeat = QGC_HEARTBEAT
    station.stay_connected()
    seen, false = 0, []
    for state in states(board, world, faults):
        seen = len(world.events("gcs.text"))
        for button in buttons():
            station.send(button)
            world.run(0.2)
        Upload(station, waypoints(5)).run()
        world.run(2)
        for event in world.events("gcs.text")[seen:]:
            name = sentence_of(str(event.facts["text"]))
            if name in TRUE and not TRUE[name](board):
                false.append((state, name, event.facts["text"]))
    assert false == []


def test_each_condition_belongs_to_a_sentence() -> None:
    assert TRUE.keys() <= TABLE.keys()
