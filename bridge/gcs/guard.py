# SPDX-License-Identifier: GPL-3.0-or-later
"""Access control: the one place that every frame from a ground station passes first. Sans-IO.

bridge/gcs/rights.py has the policy; protocols/rights/mavlink.py has the effect of each message.
"""

from collections import Counter
from typing import NamedTuple

from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import GroundStation
from bridge.gcs.station import Station
from bridge.model.events import Emit, GcsRefused
from protocols.mavlink.command import CommandResult
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.mavlink.ftp import refuse
from protocols.mavlink.signing import Check
from protocols.mission_item import MissionResult
from protocols.rights.effect import Effect
from protocols.rights.mavlink import effect_of

_SETUP = "set the key in naze-bridge's settings"
_ADDRESS = "this address may only read"
#: At most 50 characters with "Refused: ".
_NOT_OVER_OPEN_LINK = "open link; see pass_through in settings"
#: Ground stations and radios repeat these.
_ROUTINE = Effect.RATE, Effect.SILENCE


class GuardRefusal(NamedTuple):
    """The reason for refusing a frame.

    `is_routine`: ground stations repeat it, so it is not reported. `is_forged`: the station has the key, but this frame
    is not signed with it, or is a copy. It gets no answer and has no effect, not even on the time the station was last
    heard.
    """

    why: str
    is_routine: bool
    is_forged: bool = False


class Guard:
    """Accepts or refuses frames; refusals are counted, and logged once for each station and reason."""

    def __init__(self, ground: Ground, emit: Emit) -> None:
        self._ground = ground
        self._emit = emit
        #: Refusals by (link, reason).
        self.refused: Counter[tuple[str, str]] = Counter()

    def judge(self, station: GroundStation, frame: MavlinkFrame) -> Effect | GuardRefusal:
        """The effect of a frame if it is accepted, else the reason for refusing it."""
        # Read requests are checked, too: each valid one invalidates older recordings.
        signing = station.access.signing
        check = Check.VALID if signing is None else signing.check(frame)
        effect = effect_of(frame)
        if signing is not None and check is Check.VALID:
            if not station.has_key:
                self._ground.has_shown_key(station)
        elif station.has_key:
            # A duplicate made by the network, or another sender posing as this station.
            return self._refuse(station, effect, str(check.value), is_forged=True)
        if effect in station.rights.own:
            return effect
        if effect is Effect.KEY:
            return self._refuse(station, effect, _SETUP)
        return self._refuse(station, effect, _ADDRESS if check is Check.VALID else str(check.value))

    def passing_refusal(self, station: GroundStation, effect: Effect) -> GuardRefusal | None:
        """The reason for not passing an accepted frame to an autopilot that speaks MAVLink itself."""
        if effect in station.rights.autopilot:
            return None
        if station.is_listener:
            return GuardRefusal(_ADDRESS, is_routine=True)
        return self._refuse(station, effect, _NOT_OVER_OPEN_LINK)

    def report(self, refused: GuardRefusal, station: GroundStation, frame: MavlinkFrame) -> bool:
        """Log a refusal of a connected station, if it is the first for this reason; True if so."""
        if refused.is_routine or refused.why in station.reported:
            return False
        station.reported.add(refused.why)
        name = Station(station.peer, *frame.sender)
        self._emit(GcsRefused(station=str(name), message=_name(frame), why=refused.why))
        return True

    def _refuse(self, station: GroundStation, effect: Effect, why: str, *, is_forged: bool = False) -> GuardRefusal:
        self.refused[station.peer.link, why] += 1
        return GuardRefusal(why, effect in _ROUTINE, is_forged)


def denial(message: Message, station: Station) -> Message | None:
    """The protocol's own negative reply to a refused message, if there is one."""
    match message.get_type():
        case "COMMAND_LONG" | "COMMAND_INT":
            denied = CommandResult.DENIED
            return m.MAVLink_command_ack_message(message.command, denied, 0, 0, station.sysid, station.compid)
        case "MISSION_COUNT" | "MISSION_ITEM" | "MISSION_ITEM_INT" | "MISSION_CLEAR_ALL" | "MISSION_WRITE_PARTIAL_LIST":
            denied_mission = MissionResult.DENIED
            return m.MAVLink_mission_ack_message(station.sysid, station.compid, denied_mission, message.mission_type)
        case "FILE_TRANSFER_PROTOCOL":
            payload = refuse(message.payload)
            if payload is not None:
                return m.MAVLink_file_transfer_protocol_message(0, station.sysid, station.compid, payload)
    return None


def _name(frame: MavlinkFrame) -> str:
    known = m.mavlink_map.get(frame.msgid)
    return str(frame.msgid) if known is None else str(known.msgname)
