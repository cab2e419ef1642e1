# SPDX-License-Identifier: GPL-3.0-or-later
"""One ground station, from its arrival to its departure. Sans-IO."""

from collections import defaultdict
from math import inf

from bridge.gcs.budget import Budget
from bridge.gcs.cost import Cost
from bridge.gcs.message_rates import MessageRates
from bridge.gcs.return_path import ReturnPath
from bridge.gcs.rights import FrameRefusal, LinkAccess, Standing
from bridge.gcs.station import RECORDER, Peer
from bridge.gcs.texts import RecentTexts
from bridge.model.transfer_memory import TransferMemory
from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.frame import MAGIC_V2, MavlinkFrame, MavlinkSplitter
from protocols.mavlink.signing import Check
from protocols.rights.effect import Effect

#: After such a silence a station may have been restarted: all send a heartbeat each second.
_RETURNS_S = 3.0
#: Ids remembered for one address: a router may carry a fleet, but forged ids must not fill the memory.
_MAX_SPEAKERS = 64
_SETUP = "set the key in naze-bridge's settings"
_ADDRESS = "this address may only read"
#: At most 50 characters with "Refused: ".
_NOT_OVER_OPEN_LINK = "open link; see pass_through in settings"
#: Ground stations and radios repeat these.
_ROUTINE = Effect.RATE, Effect.SILENCE
#: A frame whose number is at most this far behind the newest one was delayed by the network.
_MOST_LATE = 32
#: After such a silence a sender may have been restarted, and numbers its frames from 0 again.
_RESTARTED_S = 1.0


class Speaker:
    """A sysid and compid at one address: the order of its frames, and its mission transfers.

    Senders number their frames from 0 to 255 again and again: a gap shows that a frame was lost, an older number that a
    frame was delayed. A sender without numbers seems to lose a frame each time.
    """

    __slots__ = (
        "_missing",
        "_newest",
        "frames",
        "heard_at",
        "is_copy",
        "is_late",
        "last_lost",
        "number",
        "transfers",
    )

    def __init__(self) -> None:
        self.heard_at = -inf
        #: The number of the last frame, and of the newest one with its bytes.
        self.number = 0
        self._newest = 0, b""
        #: The frames sent so far, as far as their numbers show; those that have not arrived, and the last one of them.
        self.frames = 0
        self._missing: list[int] = []
        self.last_lost = -1
        #: is_late: the last frame was sent before one that arrived earlier. is_copy: the network delivered it twice.
        self.is_late = self.is_copy = False
        #: State kept after its last transfers, by MAV_MISSION_TYPE.
        self.transfers: dict[int, TransferMemory] = defaultdict(TransferMemory)

    def heard(self, frame: MavlinkFrame, now: float) -> None:
        raw = frame.raw
        self.number = number = raw[4] if raw[0] == MAGIC_V2 else raw[2]  # frame.seq, for each frame
        newest, known = self._newest
        ahead = (number - newest) & 0xFF or 256
        self.is_copy = raw == known
        self.is_late = 256 > ahead >= 256 - _MOST_LATE and now < self.heard_at + _RESTARTED_S
        if self.is_copy:
            return
        if self.is_late:
            if (delayed := self.frames + ahead - 256) in self._missing:
                self._missing.remove(delayed)
                self.last_lost = self._missing[-1] if self._missing else -1
            return
        if ahead != 1:
            self._missing = [*self._missing, *range(self.frames + 1, self.frames + ahead)][-_MOST_LATE:]
            self.last_lost = self._missing[-1]
        self.frames += ahead
        self._newest, self.heard_at = (number, raw), now

    def is_older(self, number: int) -> bool:
        """True if the last frame is late, and was sent before the one with this number."""
        return self.is_late and 0 < (number - self.number) & 0xFF <= _MOST_LATE


class GroundStation:
    """A ground station that the bridge sends to, because it was heard or is configured.

    It is one address, a UDP peer or a TCP connection, because rights, limits, MAVLink version and message rates belong
    to an address. Several MAVLink ids may speak from there, behind a radio or a router: `speakers` has them all, and
    the short-lived `Station` names one of them where a message must be addressed. All that is known about a station is
    here, so dropping this object forgets it, except for its `budget`, which is remembered longer.
    """

    def __init__(self, peer: Peer, access: LinkAccess, sysid: int, compid: int, budget: Budget | None = None) -> None:
        self.peer = peer
        self.access = access
        #: None until a datagram was accepted: forged addresses must cost no memory.
        self.budget = budget
        #: None once it is known that the station receives what is sent to its address.
        self.return_path: ReturnPath | None = None
        #: It has sent a valid signature.
        self.has_key = False
        self._settle_rights()
        self.splitter = MavlinkSplitter()
        self.signed = access.signed_peer(peer)
        #: Returns the signature of a MAVLink 2 frame.
        self.sign = None if self.signed is None else self.signed.sign
        self.writer = FrameWriter(sysid, compid, self.sign)
        self.is_heard = False
        #: The highest MAVLink version that it has sent, and the version of replies: everything signed is MAVLink 2.
        self.version = 0
        self.frame_version = 2
        self.came_at = self.heard_at = -inf
        #: The senders there, by sysid and compid.
        self.speakers: dict[tuple[int, int], Speaker] = {}
        #: It has sent REQUEST_DATA_STREAM; a command.
        self.uses_streams = False
        self.uses_commands = False
        self.rates = MessageRates()
        self.texts = RecentTexts()
        #: The reasons for refusals that were logged.
        self.reported: set[str] = set()
        #: A newcomer gets more heartbeats until this time, then home and the reasons not to arm.
        self.greeted_until = -inf
        self.is_informed = True
        #: One of its missions was accepted: it has been told that fences are not stored.
        self.has_written = False

    # Rights and limits.

    def refusal(self, frame: MavlinkFrame, effect: Effect) -> FrameRefusal | None:
        """The reason for refusing a frame with this effect; None if it is accepted. Every frame passes here first."""
        # Read requests are also checked: each valid one invalidates older recordings.
        check = Check.VALID if self.signed is None else self.signed.check(frame)
        if check is Check.EARLY and self.has_key:
            return FrameRefusal(str(check.value), effect in (*_ROUTINE, Effect.READ, Effect.DIALOGUE))
        if self.signed is not None and check is Check.VALID:
            if not self.has_key:
                self.has_key = True
                self._settle_rights()
        elif self.has_key:
            # A duplicate made by the network, or another sender posing as this station.
            return FrameRefusal(str(check.value), effect in _ROUTINE, is_forged=True)
        if effect in self.rights.own:
            return None
        why = _SETUP if effect is Effect.KEY else _ADDRESS if check is Check.VALID else str(check.value)
        return FrameRefusal(why, effect in _ROUTINE)

    def passing_refusal(self, effect: Effect) -> FrameRefusal | None:
        """The reason for not passing an accepted frame to an autopilot in pass-through; also used for Set WP."""
        if effect in self.rights.autopilot:
            return None
        if self.is_listener:
            return FrameRefusal(_ADDRESS, is_routine=True)
        return FrameRefusal(_NOT_OVER_OPEN_LINK, effect in _ROUTINE)

    def _settle_rights(self) -> None:
        self.standing = self.access.standing(self.peer, has_key=self.has_key)
        self.rights = self.access.rights(self.standing)
        self.is_listener = self.standing is Standing.LISTENER

    def allows(self, cost: Cost, now: float | None = None) -> bool:
        """Count work caused by the last message of the station, or at `now`; False if it exceeds the limit."""
        is_proven = self.standing is Standing.PROVEN
        return self.budget is None or self.budget.allows(
            cost, self.heard_at if now is None else now, is_proven=is_proven
        )

    def give_back(self, cost: Cost) -> None:
        """Take back work that was allowed, but not done."""
        if self.budget is not None:
            self.budget.give_back(cost, is_proven=self.standing is Standing.PROVEN)

    def heard(self, frame: MavlinkFrame, sender: tuple[int, int], now: float) -> bool:
        """Note a frame; True if the station is new, or returns after a silence, perhaps restarted."""
        is_new = now >= self.heard_at + _RETURNS_S
        if not self.is_heard:
            self.is_heard, self.came_at = True, now
        self.heard_at = now
        if self.version != 2:
            self.version = frame.version
            self.frame_version = 2 if self.access.signing is not None else self.version
        speaker = self.speakers.get(sender)
        if speaker is None and len(self.speakers) < _MAX_SPEAKERS:
            speaker = self.speakers[sender] = Speaker()
        if speaker is not None:
            speaker.heard(frame, now)
        return is_new

    # Sending.

    @property
    def reads_v2_only(self) -> bool:
        """True if heartbeats in MAVLink 2 are enough: it has sent that version, or must."""
        return self.version == 2 or self.access.signing is not None or self.peer is RECORDER

    @property
    def is_like_mavsdk(self) -> bool:
        """True for a station that requests messages only by commands, in MAVLink 2, as MAVSDK does."""
        return self.version == 2 and self.uses_commands and not self.uses_streams
