# SPDX-License-Identifier: GPL-3.0-or-later
"""Who may write over which link: the one place that every frame from a ground station passes first. Sans-IO.

Reading is free for all who reach a link. Everything else may change what the aircraft does, be it a message that nobody
has thought of yet: so what passes without leave is listed here, and not what needs it.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from bridge.gcs.station import Peer, Station
from bridge.model.events import EventLog
from protocols.mavlink.command_result import CommandResult
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.mavlink.ftp import refuse
from protocols.mavlink.signing import Check, Signing
from protocols.mission_item import MissionResult

#: What only tells or asks. Among it is all that Mission Planner sends before it knows that a key is wanted: heartbeats,
#: three STATUSTEXTs (one signed with an empty key) and questions.
_READS = frozenset(
    {
        m.MAVLINK_MSG_ID_HEARTBEAT,
        m.MAVLINK_MSG_ID_PING,
        m.MAVLINK_MSG_ID_TIMESYNC,
        m.MAVLINK_MSG_ID_STATUSTEXT,
        m.MAVLINK_MSG_ID_RADIO,  # from a telemetry radio, which has no key
        m.MAVLINK_MSG_ID_RADIO_STATUS,
        m.MAVLINK_MSG_ID_REQUEST_DATA_STREAM,
        m.MAVLINK_MSG_ID_AUTOPILOT_VERSION_REQUEST,
        m.MAVLINK_MSG_ID_PARAM_REQUEST_LIST,
        m.MAVLINK_MSG_ID_PARAM_REQUEST_READ,
        m.MAVLINK_MSG_ID_MISSION_REQUEST_LIST,
        m.MAVLINK_MSG_ID_MISSION_REQUEST_PARTIAL_LIST,
        m.MAVLINK_MSG_ID_MISSION_REQUEST,
        m.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
    }
)
_COMMANDS = frozenset({m.MAVLINK_MSG_ID_COMMAND_LONG, m.MAVLINK_MSG_ID_COMMAND_INT})
#: Commands that only ask for messages.
_QUESTIONS = frozenset(
    {
        m.MAV_CMD_REQUEST_MESSAGE,
        m.MAV_CMD_SET_MESSAGE_INTERVAL,
        m.MAV_CMD_GET_MESSAGE_INTERVAL,
        m.MAV_CMD_GET_HOME_POSITION,
        m.MAV_CMD_REQUEST_PROTOCOL_VERSION,
        m.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
        m.MAV_CMD_REQUEST_CAMERA_INFORMATION,
        m.MAV_CMD_DO_SEND_BANNER,
    }
)
#: Where the number of the command stands in the payload of both command messages.
_COMMAND_AT = slice(28, 30)
#: Where the result stands in a MISSION_ACK.
_RESULT_AT = 2

_SETUP = "set the key in naze-bridge's settings"
_ADDRESS = "this address may only read"


@dataclass(frozen=True, slots=True)
class LinkAccess:
    """What is asked of who writes over a link. `signing`: a signature with its key; `may_write`: the right address.

    None: it is not asked for. What we send over a link with `signing` is signed, too; `link_id` is the number that the
    protocol gives a link.
    """

    signing: Signing | None = None
    link_id: int = 0
    may_write: Callable[[Peer], bool] | None = None


_OPEN = LinkAccess()


class GuardRefusal(NamedTuple):
    """Why a frame is not let in; `is_first`: for this reason, of this peer. `is_told`: whether the sender may know."""

    why: str
    is_first: bool
    is_told: bool


class Guard:
    """Lets in what may come in, counts the rest, and tells of it once for each peer and reason."""

    def __init__(self, links: Mapping[str, LinkAccess], log_event: EventLog) -> None:
        self._links = links
        self._log_event = log_event
        self._proven: set[Peer] = set()
        self._told: dict[Peer, set[str]] = {}
        #: How often something was refused: (link, why).
        self.refused: Counter[tuple[str, str]] = Counter()

    def refusal(self, peer: Peer, frame: MavlinkFrame) -> GuardRefusal | None:
        """Say why a frame is not let in; None: it is."""
        why = self._reason(peer, frame)
        if why is None:
            return None
        self.refused[peer.link, why] += 1
        told = self._told.setdefault(peer, set())
        is_first = why not in told
        if is_first:
            told.add(why)
            station = Station(peer, frame.sysid, frame.compid)
            self._log_event("warning", "gcs.refused", station=str(station), message=_name(frame), why=why)
        # Whoever has shown the key is not told of wrong signatures: this is the network's second copy of what he sent,
        # or somebody who sends in his name so that a refusal may end his upload.
        return GuardRefusal(why, is_first, is_told=peer not in self._proven or why in (_ADDRESS, _SETUP))

    def forget(self, peer: Peer) -> None:
        """A ground station is gone."""
        self._proven.discard(peer)
        self._told.pop(peer, None)

    def _reason(self, peer: Peer, frame: MavlinkFrame) -> str | None:
        if frame.msgid == m.MAVLINK_MSG_ID_SETUP_SIGNING:
            return _SETUP
        access = self._links.get(peer.link, _OPEN)
        # Frames that only ask are checked, too: each valid one makes older recordings worthless.
        check = Check.VALID if access.signing is None else access.signing.check(frame)
        if access.signing is not None and check is Check.VALID:
            self._proven.add(peer)
        if only_reads(frame):
            return None
        if check is not Check.VALID:
            return str(check.value)
        if access.may_write is not None and not access.may_write(peer):
            return _ADDRESS
        return None


def only_reads(frame: MavlinkFrame) -> bool:
    """Tell whether a frame changes nothing, whoever sent it."""
    msgid = frame.msgid
    if msgid in _COMMANDS:
        # MAVLink 2 leaves trailing zeros out.
        return int.from_bytes(frame.payload[_COMMAND_AT], "little") in _QUESTIONS
    if msgid == m.MAVLINK_MSG_ID_MISSION_ACK:
        # Thanks for a list that was read; any other result would end somebody's transfer.
        return not any(frame.payload[_RESULT_AT : _RESULT_AT + 1])
    return msgid in _READS


def denial(message: Message, station: Station) -> Message | None:
    """Return the protocol's own answer to what is refused, if there is one."""
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
