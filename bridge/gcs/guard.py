# SPDX-License-Identifier: GPL-3.0-or-later
"""Access control: the one place that every frame from a ground station passes first. Sans-IO.

Every peer that reaches a link may read. Everything else may change what the aircraft does, even a message that does
not exist yet: so the lists here name the messages allowed without proof, not those that need it.
"""

import struct
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import NamedTuple

from bridge.gcs.station import Peer, Station
from bridge.model.events import EventLog
from protocols.mavlink.command import CommandResult
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.mavlink.ftp import refuse
from protocols.mavlink.signing import Check, Signing
from protocols.mission_item import MissionResult

#: Messages that only report or ask. They include everything that Mission Planner sends before it knows that a key is
#: needed: heartbeats, three STATUSTEXTs (one signed with an empty key) and requests.
_READS = frozenset(
    {
        m.MAVLINK_MSG_ID_HEARTBEAT,
        m.MAVLINK_MSG_ID_PING,
        m.MAVLINK_MSG_ID_TIMESYNC,
        m.MAVLINK_MSG_ID_STATUSTEXT,
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
        m.MAV_CMD_GET_MESSAGE_INTERVAL,
        m.MAV_CMD_GET_HOME_POSITION,
        m.MAV_CMD_REQUEST_PROTOCOL_VERSION,
        m.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
        m.MAV_CMD_REQUEST_CAMERA_INFORMATION,
        m.MAV_CMD_DO_SEND_BANNER,
    }
)
#: Further messages that pass over an open link to an autopilot that speaks MAVLink itself: none of them arms, disarms,
#: steers or restarts it. Unknown messages do not pass.
_PASSES_OPEN = _READS | {
    m.MAVLINK_MSG_ID_RADIO,
    m.MAVLINK_MSG_ID_RADIO_STATUS,
    m.MAVLINK_MSG_ID_SYSTEM_TIME,
    m.MAVLINK_MSG_ID_COMMAND_ACK,
    m.MAVLINK_MSG_ID_MISSION_ACK,
    m.MAVLINK_MSG_ID_MISSION_COUNT,
    m.MAVLINK_MSG_ID_MISSION_CLEAR_ALL,
    m.MAVLINK_MSG_ID_MISSION_WRITE_PARTIAL_LIST,
    m.MAVLINK_MSG_ID_PARAM_SET,
    m.MAVLINK_MSG_ID_PARAM_EXT_REQUEST_LIST,
    m.MAVLINK_MSG_ID_PARAM_EXT_REQUEST_READ,
    m.MAVLINK_MSG_ID_PARAM_EXT_SET,
    m.MAVLINK_MSG_ID_FENCE_FETCH_POINT,
    m.MAVLINK_MSG_ID_FENCE_POINT,
    m.MAVLINK_MSG_ID_RALLY_FETCH_POINT,
    m.MAVLINK_MSG_ID_RALLY_POINT,
    m.MAVLINK_MSG_ID_LOG_REQUEST_LIST,
    m.MAVLINK_MSG_ID_LOG_REQUEST_DATA,
    m.MAVLINK_MSG_ID_LOG_REQUEST_END,
}
_ITEMS = frozenset({m.MAVLINK_MSG_ID_MISSION_ITEM, m.MAVLINK_MSG_ID_MISSION_ITEM_INT})
_SET_RATE = int(m.MAV_CMD_SET_MESSAGE_INTERVAL)
_REQUEST_STREAM = int(m.MAVLINK_MSG_ID_REQUEST_DATA_STREAM)
#: FTP: opcodes that read or end a session (https://mavlink.io/en/services/ftp.html); others write files.
_FTP_READS = frozenset({0, 1, 2, 3, 4, 5, 14, 15, 128, 129})

_FLOAT = struct.Struct("<f")
#: Offset of the command number in the payload of both command messages.
_COMMAND_AT = slice(28, 30)
#: Offset of the result in a MISSION_ACK.
_RESULT_AT = 2
#: Offset of `current` in both item messages; 2 and 3 are "fly to here" and "change altitude", not part of a list.
_CURRENT_AT = 35
#: Offset of the opcode in FILE_TRANSFER_PROTOCOL: three bytes of target, then the FTP header.
_OPCODE_AT = 6

#: Offsets of SET_MESSAGE_INTERVAL's param2, and of REQUEST_DATA_STREAM's rate and start_stop.
_INTERVAL_AT, _STREAM_RATE_AT, _STREAM_STARTS_AT = 4, slice(0, 2), 5
#: The longest interval that a station may set over an open link, us: like a stream's lowest rate.
_SLOWEST_US = 1e6

_SETUP = "set the key in naze-bridge's settings"
_ADDRESS = "this address may only read"
#: At most 50 characters with "Refused: ".
_NOT_OVER_OPEN_LINK = "open link; see pass_through in settings"


#: Returns the signature of a MAVLink 2 frame.
Signer = Callable[[bytes], bytes]


class Standing(Enum):
    """The rights that a peer has proven."""

    LISTENER = "may only read"
    OPEN = "its link requires nothing"
    PROVEN = "has the key or the address that its link requires"


@dataclass(frozen=True, slots=True)
class LinkAccess:
    """The conditions for writing over a link. `signing`: a signature with its key; `may_write`: the right address.

    None: not required. Everything the bridge sends over a link with `signing` is signed, too; `link_id` is the link's
    number in the signature.
    """

    signing: Signing | None = None
    link_id: int = 0
    may_write: Callable[[Peer], bool] | None = None


_OPEN = LinkAccess()


class GuardRefusal(NamedTuple):
    """The reason for refusing a frame.

    `is_first`: the first one of this peer for this reason. `is_forged`: the peer has the key, but this frame is not
    signed with it, or is a copy. It gets no answer and has no effect, not even on the time the peer was last heard.
    """

    why: str
    is_first: bool
    is_forged: bool


class Guard:
    """Accepts or refuses frames; refusals are counted, and logged once for each peer and reason.

    `passes_everything`: an autopilot that speaks MAVLink itself gets all commands over open links, too.
    """

    def __init__(
        self, links: Mapping[str, LinkAccess], log_event: EventLog, *, passes_everything: bool = False
    ) -> None:
        self._links = links
        self._log_event = log_event
        self._passes_everything = passes_everything
        self._signed: set[Peer] = set()
        self._logged: dict[Peer, set[str]] = {}
        #: Refusals by (link, reason).
        self.refused: Counter[tuple[str, str]] = Counter()

    def standing(self, peer: Peer) -> Standing:
        access = self._links.get(peer.link, _OPEN)
        if access.signing is None and access.may_write is None:
            return Standing.OPEN
        has_key = access.signing is None or peer in self._signed
        has_address = access.may_write is None or access.may_write(peer)
        return Standing.PROVEN if has_key and has_address else Standing.LISTENER

    @property
    def signers(self) -> dict[str, Signer]:
        """The signers of the links that need one."""
        return {
            name: partial(access.signing.signature, link_id=access.link_id)
            for name, access in self._links.items()
            if access.signing is not None
        }

    def refusal(self, peer: Peer, frame: MavlinkFrame) -> GuardRefusal | None:
        """The reason for refusing a frame; None if it is accepted."""
        access = self._links.get(peer.link, _OPEN)
        # Read requests are checked, too: each valid one invalidates older recordings.
        check = Check.VALID if access.signing is None else access.signing.check(frame)
        if access.signing is not None and check is Check.VALID:
            self._signed.add(peer)
        if frame.msgid == m.MAVLINK_MSG_ID_SETUP_SIGNING:
            return self._refuse(peer, frame, _SETUP)
        if check is not Check.VALID and peer in self._signed:
            # A duplicate made by the network, or another sender posing as this peer.
            return self._refuse(peer, frame, str(check.value), is_forged=True)
        if only_reads(frame):
            return None
        if check is not Check.VALID:
            return self._refuse(peer, frame, str(check.value))
        if access.may_write is not None and not access.may_write(peer):
            return self._refuse(peer, frame, _ADDRESS)
        return None

    def command_refusal(self, peer: Peer, frame: MavlinkFrame) -> GuardRefusal | None:
        """The reason for not passing a frame to an autopilot that might arm, disarm, steer or restart on it.

        For frames that `refusal` accepted. A link without a key or addresses proves nothing.
        """
        if self._passes_everything or self.standing(peer) is Standing.PROVEN or not may_command(frame):
            return None
        return self._refuse(peer, frame, _NOT_OVER_OPEN_LINK)

    def forget(self, peer: Peer) -> None:
        self._signed.discard(peer)
        self._logged.pop(peer, None)

    def _refuse(self, peer: Peer, frame: MavlinkFrame, why: str, *, is_forged: bool = False) -> GuardRefusal:
        self.refused[peer.link, why] += 1
        logged = self._logged.setdefault(peer, set())
        is_first = why not in logged and not _asks_for_rates(frame)
        if is_first:
            logged.add(why)
            station = Station(peer, frame.sysid, frame.compid)
            self._log_event("warning", "gcs.refused", station=str(station), message=_name(frame), why=why)
        return GuardRefusal(why, is_first, is_forged)


def only_reads(frame: MavlinkFrame) -> bool:
    """True if a frame changes nothing."""
    msgid = frame.msgid
    if msgid in _COMMANDS:
        return _command(frame) in _QUESTIONS
    if msgid == m.MAVLINK_MSG_ID_MISSION_ACK:
        # ACCEPTED ends a download; any other result would cancel a station's transfer.
        return not any(frame.payload[_RESULT_AT : _RESULT_AT + 1])
    return msgid in _READS


def may_command(frame: MavlinkFrame) -> bool:
    """True if a frame might arm, disarm, steer or restart an autopilot that obeys it."""
    msgid, payload = frame.msgid, frame.payload
    if _asks_for_rates(frame):
        # An autopilot's rates apply to all ground stations: one may ask for more, but not silence the vehicle.
        return _silences(frame)
    if msgid in _COMMANDS:
        return _command(frame) not in _QUESTIONS
    if msgid in _ITEMS:
        return payload[_CURRENT_AT : _CURRENT_AT + 1] > b"\1"
    if msgid == m.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL:
        return int.from_bytes(payload[_OPCODE_AT : _OPCODE_AT + 1]) not in _FTP_READS
    return msgid not in _PASSES_OPEN


def _asks_for_rates(frame: MavlinkFrame) -> bool:
    if frame.msgid in _COMMANDS:
        return _command(frame) == _SET_RATE
    return frame.msgid == _REQUEST_STREAM


def _silences(frame: MavlinkFrame) -> bool:
    """True if a rate request stops a message or nearly so: an interval below 0 or above 1 s, a stream's end."""
    payload = frame.payload.ljust(_CURRENT_AT, b"\0")
    if frame.msgid in _COMMANDS:
        (interval_us,) = _FLOAT.unpack_from(payload, _INTERVAL_AT)
        return not 0 <= interval_us <= _SLOWEST_US  # NaN, too
    return not (any(payload[_STREAM_RATE_AT]) and payload[_STREAM_STARTS_AT])


def _command(frame: MavlinkFrame) -> int:
    # MAVLink 2 omits trailing zeros.
    return int.from_bytes(frame.payload[_COMMAND_AT], "little")


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
