# SPDX-License-Identifier: GPL-3.0-or-later
"""Refused frames of ground stations: counted, logged, and answered as the protocol requires. Sans-IO.

bridge/gcs/rights.py has the policy, and bridge/gcs/ground_station.py applies it.
"""

from collections import Counter

from bridge.gcs.ground_station import GroundStation
from bridge.gcs.rights import FrameRefusal
from bridge.gcs.station import Station
from bridge.model.events import Emit, GcsRefused
from protocols.mavlink.command import CommandResult
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.mavlink.ftp import refuse
from protocols.mission_item import MissionResult


class Guard:
    """Counts refusals, and logs them once for each station and reason."""

    def __init__(self, emit: Emit) -> None:
        self._emit = emit
        #: Refusals by (link, reason).
        self.refused: Counter[tuple[str, str]] = Counter()

    def count(self, refused: FrameRefusal, station: GroundStation) -> None:
        self.refused[station.peer.link, refused.why] += 1

    def report(self, refused: FrameRefusal, station: GroundStation, frame: MavlinkFrame) -> bool:
        """Log a connected station's refusal once for each reason; True if it is the first."""
        if refused.is_routine or refused.why in station.reported:
            return False
        station.reported.add(refused.why)
        name = Station(station.peer, *frame.sender)
        self._emit(GcsRefused(station=str(name), message=_name(frame), why=refused.why))
        return True


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
