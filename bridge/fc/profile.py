# SPDX-License-Identifier: GPL-3.0-or-later
"""The profile of a flight controller, everything specific to one kind of board, and the questions that identify it.

`bridge.controllers.table` lists the profiles. To add a flight controller, write the profile in a new file under
`bridge/controllers/` and add it to that list. No other code asks what kind of board it is.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from bridge.fc.fc_settings import FcSettings
from bridge.fc.mavlink_telemetry import MavlinkReadings
from bridge.line.conversation import Conversation, ask_surely
from bridge.line.poll_schedule import POLLS, Poll
from bridge.missions.fc_mission_store import AnyFcMissionStore
from bridge.missions.list_check import MissionRules
from bridge.missions.place_lists import NO_PLACES
from bridge.model import vehicle as v
from bridge.model.craft import ARM_BOX, Airframe
from bridge.model.missions import Refusal
from bridge.model.vehicle import Vehicle
from bridge.voice import sentences
from protocols.mission_item import MissionResult
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame, request
from protocols.msp.mission import Info
from protocols.msp.telemetry import Ident, decode_box_names, decode_ident
from protocols.plain_text import plain_text
from protocols.rights.msp import Firmware
from protocols.settings_file import SavedSettings

#: The poll whose reply carries a reading, unless a profile names another. The others are heard in MAVLink mode only.
POLL_FOR: Mapping[type[v.Reading], Msp] = {
    v.Orientation: Msp.ATTITUDE,
    v.GpsFix: Msp.RAW_GPS,
    v.GlobalPosition: Msp.RAW_GPS,
    v.Height: Msp.ALTITUDE,
    v.FlightState: Msp.STATUS,
    v.Mode: Msp.STATUS,
    v.Health: Msp.STATUS,
    v.Power: Msp.ANALOG,
    v.Charge: Msp.ANALOG,
    v.Signal: Msp.ANALOG,
    v.Sticks: Msp.RC,
    v.MissionLeg: Msp.NAV_STATUS,
}
_IDENT_SIZE = 7
_VARIANT_SIZE, _VERSION_SIZE = 4, 3
_MAX_REPLY_PAYLOAD = 200


class NoAnswer(Exception):
    """A request was not answered, so the board cannot be identified: a guess could be wrong."""


class Interview:
    """Asks a board about itself and remembers the replies. Every question may raise NoAnswer."""

    def __init__(self) -> None:
        self._replies: dict[int, MspFrame] = {}

    def ask(self, command: int, reply_payload: int, *, stable: int | None = None) -> Conversation[MspFrame]:
        """Ask `command`. The reply may be an error frame, which means that the board does not know it.

        stable: how many of the first bytes must agree, if the others may change at any moment.
        """
        if command not in self._replies:
            reply = yield from ask_surely(request(command), command, reply_payload, stable=stable)
            if reply is None:
                raise NoAnswer
            self._replies[command] = reply
        return self._replies[command]

    def ident(self) -> Conversation[Ident | None]:
        """IDENT, or None on boards that have dropped it (INAV, Betaflight)."""
        return decode_ident((yield from self.ask(Msp.IDENT, _IDENT_SIZE)).payload)

    def variant(self) -> Conversation[str | None]:
        """FC_VARIANT, four letters, or None on boards older than it."""
        reply = yield from self.ask(Msp.FC_VARIANT, _VARIANT_SIZE)
        return plain_text(reply.payload) if reply.direction is Direction.REPLY else None

    def version(self) -> Conversation[tuple[int, int, int] | None]:
        """FC_VERSION: major, minor and patch level."""
        reply = yield from self.ask(Msp.FC_VERSION, _VERSION_SIZE)
        if reply.direction is not Direction.REPLY or len(reply.payload) < _VERSION_SIZE:
            return None
        major, minor, patch = reply.payload[:_VERSION_SIZE]
        return major, minor, patch

    def box_names(self) -> Conversation[tuple[str, ...]]:
        """The box names, in the order of the status flags."""
        return decode_box_names((yield from self.ask(Msp.BOXNAMES, _MAX_REPLY_PAYLOAD)).payload)

    def boxes_by_id(self, names: Mapping[int, str]) -> Conversation[tuple[str, ...]]:
        """The same by permanent id, "" for ids not in `names`. With many boxes BOXNAMES outgrows a frame."""
        ids = (yield from self.ask(Msp.BOXIDS, _MAX_REPLY_PAYLOAD)).payload
        return tuple(names.get(number, "") for number in ids)


class Spoken(Enum):
    """The protocols that a flight controller may speak. In the command line it does not answer them."""

    MSP = "MSP"
    #: A Harakiri's own, while it is armed: the bridge represents it.
    MAVLINK = "MAVLink"
    #: An autopilot that represents itself to ground stations. The bridge does not send anything in its name.
    OTHER_MAVLINK = "MAVLink, passed through"
    CLI = "command line"


#: Fills the vehicle from the payload of a reply, heard at a time.
Decoder = Callable[[Vehicle, bytes, "FlightController", float], None]

MSP_SILENCE_S = 2.0
#: An STM32H743 erases the sector of the settings in up to 2.2 s.
SILENCE_WITH_H7_S = 2.5

NO_MISSIONS = Refusal(MissionResult.UNSUPPORTED, sentences.NO_MISSIONS())


@dataclass(frozen=True, slots=True)
class RuleSettings:
    """The inputs of the mission rules. saved: a board's settings; None for the firmware's defaults."""

    takeoff_max_m: int
    saved: SavedSettings | None = None


#: Opens the mission store of a board.
OpenStore = Callable[["FlightController", Vehicle, RuleSettings], AnyFcMissionStore]

#: Opens a board's store of fences or of rally points, or says that it has none.
OpenPlaces = Callable[["FlightController", Vehicle], AnyFcMissionStore | Refusal]

#: Opens the settings of a board.
OpenSettings = Callable[["FlightController"], FcSettings]


def _no_places(_board: "FlightController", _vehicle: Vehicle) -> Refusal:
    return NO_PLACES


@dataclass(frozen=True, slots=True)
class Profile:
    """One kind of flight controller, on one protocol.

    name: for people and logs. family: profiles of one firmware share it. A board that switches protocol stays in it.
    recognise: MSP only. Returns the flight controller if the interview shows that it is this kind.
    polls: the telemetry questions it answers. poll_for: by reading, the one whose reply carries it.
    decoders: by command, for replies in its own layout. The common decoders are in bridge.fc.msp_telemetry.
    has_2d_fix: its RAW_GPS says 1 for 2D and 2 for 3D. Others say 1 for any fix.
    currents_per_a: the unit of ANALOG's current is 1 A divided by this.
    accepts_any_byte: inside a frame its parser ignores hazard bytes. turn_s: it serves one request in this time.
    silence_s: after this long without a reply it is gone: unplugged, reset, or switched to another protocol.
    missions: how they are written to it, or the reply to any attempt.
    fences, rally: its stores of fences and of rally points.
    settings: how its own settings are read and changed, or None if not over this protocol.
    check_kind, rules: how `naze-bridge check --kind` calls it, and the rules it applies.
    mavlink_readings: the meaning of its MAVLink messages.
    mavlink_sender: MAVLink version, sysid and compid it sends with; None matches any.
    restarts_after_calibration: it reboots by itself when a calibration is done. calibrates_six_positions: its
    accelerometer needs one request in each of six positions.
    arming_blockers: the known reasons that prevent arming at a time, or None if not heard yet.
    """

    name: str
    family: str
    spoken: Spoken = Spoken.MSP
    recognise: Callable[[Interview], Conversation["FlightController | None"]] | None = None
    polls: tuple[Poll, ...] = POLLS
    poll_for: Mapping[type[v.Reading], Msp] = field(default_factory=lambda: POLL_FOR)
    decoders: Mapping[int, Decoder] = field(default_factory=dict)
    has_2d_fix: bool = False
    currents_per_a: int = 100
    accepts_any_byte: bool = False
    turn_s: float = 0.0
    silence_s: float = MSP_SILENCE_S
    missions: OpenStore | Refusal = NO_MISSIONS
    fences: OpenPlaces = _no_places
    rally: OpenPlaces = _no_places
    settings: OpenSettings | None = None
    check_kind: str | None = None
    rules: Callable[[RuleSettings], MissionRules] | None = None
    mavlink_readings: type[MavlinkReadings] = MavlinkReadings
    mavlink_sender: tuple[int, int, int] | None = None
    restarts_after_calibration: bool = False
    arming_blockers: Callable[[Vehicle, float], tuple[str, ...] | None] = lambda _vehicle, _now: ()
    calibrates_six_positions: bool = False


@dataclass(frozen=True, slots=True)
class FlightController:
    """The board on the line. `boxes` are in the order of the status flags; "" is a flag without a meaning here.

    airframe: None if unknown. info: Harakiri's mission extension. capacity: mission records, if the board reported it.
    version: the firmware's major, minor and patch level. firmware: the one whose rights apply to MSP requests.
    """

    profile: Profile
    name: str
    airframe: Airframe | None = None
    boxes: tuple[str, ...] = ()
    info: Info | None = None
    capacity: int = 0
    version: tuple[int, int, int] | None = None
    firmware: Firmware = Firmware.UNKNOWN

    @property
    def kind(self) -> str:
        """The firmware and the version."""
        version = "" if self.version is None else " " + ".".join(map(str, self.version))
        return self.name + version

    @property
    def arm_bit(self) -> int | None:
        """The place of the ARM box in the status flags."""
        return self.boxes.index(ARM_BOX) if ARM_BOX in self.boxes else None
