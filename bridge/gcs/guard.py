# SPDX-License-Identifier: GPL-3.0-or-later
"""Access control: the one place that every frame from a ground station passes first. Sans-IO.

`RIGHTS` is the whole policy; protocols/rights/mavlink.py has the effect of each message.
"""

from collections import Counter
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import NamedTuple

from bridge.gcs.station import Peer, Station
from bridge.model.events import Emit, GcsRefused
from protocols.mavlink.command import CommandResult
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.mavlink.ftp import refuse
from protocols.mavlink.signing import Check, Signing
from protocols.mission_item import MissionResult
from protocols.rights.effect import Effect
from protocols.rights.mavlink import effect_of

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


class Rights(NamedTuple):
    """The effects that a peer may have on the bridge's own vehicle, a passed-through autopilot, and other stations."""

    own: Collection[Effect]
    autopilot: Collection[Effect]
    stations: Collection[Effect]


_ALL = tuple(effect for effect in Effect if effect is not Effect.KEY)
_NO_COMMANDS = Effect.READ, Effect.DIALOGUE, Effect.RATE, Effect.CHANGE
#: The own vehicle itself refuses to arm, to move and to restart; other stations hear what concerns only themselves.
RIGHTS: Mapping[Standing, Rights] = {
    Standing.LISTENER: Rights((Effect.READ, Effect.DIALOGUE), (Effect.READ,), ()),
    Standing.OPEN: Rights(_ALL, _NO_COMMANDS, (*_NO_COMMANDS, Effect.REPORT)),
    Standing.PROVEN: Rights(_ALL, _ALL, _ALL),
}
#: Ground stations and radios repeat these.
_ROUTINE = Effect.RATE, Effect.SILENCE


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

    `is_routine`: ground stations repeat it, so it is not reported. `is_forged`: the peer has the key, but this frame
    is not signed with it, or is a copy. It gets no answer and has no effect, not even on the time the peer was last
    heard.
    """

    why: str
    is_routine: bool
    is_forged: bool = False


class Guard:
    """Accepts or refuses frames; refusals are counted, and logged once for each peer and reason.

    `passes_everything`: an autopilot that speaks MAVLink itself gets all commands over open links, too.
    """

    def __init__(self, links: Mapping[str, LinkAccess], emit: Emit, *, passes_everything: bool = False) -> None:
        self._links = links
        self._emit = emit
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
        elif peer in self._signed:
            # A duplicate made by the network, or another sender posing as this peer.
            return self._refuse(peer, frame, str(check.value), is_forged=True)
        effect = effect_of(frame)
        if effect in RIGHTS[self.standing(peer)].own:
            return None
        if effect is Effect.KEY:
            return self._refuse(peer, frame, _SETUP)
        return self._refuse(peer, frame, _ADDRESS if check is Check.VALID else str(check.value))

    def passing_refusal(self, peer: Peer, frame: MavlinkFrame) -> GuardRefusal | None:
        """The reason for not passing a frame that `refusal` accepted to an autopilot that speaks MAVLink itself."""
        if effect_of(frame) in self._rights_beyond(peer).autopilot:
            return None
        if self.standing(peer) is Standing.LISTENER:
            return GuardRefusal(_ADDRESS, is_routine=True)
        return self._refuse(peer, frame, _NOT_OVER_OPEN_LINK)

    def may_reach_stations(self, peer: Peer, frame: MavlinkFrame) -> bool:
        """True if a frame that `refusal` accepted may be sent on to other ground stations: a vehicle may be there."""
        return effect_of(frame) in self._rights_beyond(peer).stations

    def _rights_beyond(self, peer: Peer) -> Rights:
        standing = self.standing(peer)
        is_trusted = self._passes_everything and standing is Standing.OPEN
        return RIGHTS[Standing.PROVEN if is_trusted else standing]

    def forget(self, peer: Peer) -> None:
        self._signed.discard(peer)
        self._logged.pop(peer, None)

    def report(self, refused: GuardRefusal, peer: Peer, frame: MavlinkFrame) -> bool:
        """Log a refusal of a connected peer, if it is the peer's first for this reason; True if so."""
        logged = self._logged.setdefault(peer, set())
        if refused.is_routine or refused.why in logged:
            return False
        logged.add(refused.why)
        station = Station(peer, frame.sysid, frame.compid)
        self._emit(GcsRefused(station=str(station), message=_name(frame), why=refused.why))
        return True

    def _refuse(self, peer: Peer, frame: MavlinkFrame, why: str, *, is_forged: bool = False) -> GuardRefusal:
        self.refused[peer.link, why] += 1
        return GuardRefusal(why, effect_of(frame) in _ROUTINE, is_forged)


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
