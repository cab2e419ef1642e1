# SPDX-License-Identifier: GPL-3.0-or-later
"""One ground station, from arrival to departure. Sans-IO."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from math import inf

from bridge.gcs.budget import Budget, Cost
from bridge.gcs.message_rates import MessageRates
from bridge.gcs.return_path import ReturnPath
from bridge.gcs.rights import FrameRefusal, LinkAccess, Standing
from bridge.gcs.station import RECORDER, Datagrams, Peer
from bridge.model.events import Emit, GcsText
from bridge.model.missions import Refusal, TransferMemory
from bridge.voice.happening import Happening, Severity
from bridge.voice.stations import BadNews, Behaviour, Kind, pieces, rendered
from protocols.mavlink.codec import FrameWriter, Packed, pack
from protocols.mavlink.dialect import CommandResult, Message, messages
from protocols.mavlink.frame import MAGIC_V2, MavlinkFrame, MavlinkSplitter
from protocols.mavlink.signing import Check
from protocols.mission_item import MissionResult
from protocols.rights import Effect

_MAX_TEXT_ID = 0xFFFF
#: Mission Planner, QGroundControl, MAVSDK and MAVProxy read several frames in a datagram; MAVROS cuts at 296 bytes.
_MAX_DATAGRAM_SIZE = 280
#: After such a silence a station may have been restarted: all send a heartbeat each second.
_RETURNS_S = 3.0
#: Ids remembered for one address: a router may carry a fleet, but forged ids must not fill the memory.
_MAX_SENDERS = 64
_SETUP = "set the key in naze-bridge's settings"
_ADDRESS = "this address may only read"
#: At most 50 characters with "Refused: ".
_NOT_OVER_OPEN_LINK = "needs a key, or pass_through = everything"
#: Ground stations and radios repeat these.
_ROUTINE = Effect.RATE, Effect.SILENCE
#: A frame whose number is at most this far behind the newest one was delayed by the network.
_MOST_LATE = 32
#: After such a silence a sender may have been restarted, and numbers the frames from 0 again.
_RESTARTED_S = 1.0


class Outbox:
    """Frames to be sent to ground stations. `recorded`: for the telemetry log, each once, or None without a log."""

    def __init__(self, emit: Emit, *, is_recorded: bool = False) -> None:
        self._emit = emit
        self.recorded: list[bytes] | None = [] if is_recorded else None
        #: The telemetry log as a receiver, during a flight.
        self.recorder: GroundStation | None = None
        self.outgoing: defaultdict[GroundStation, list[bytes]] = defaultdict(list)
        #: The vehicle's ids and last heartbeat.
        self.heartbeat: tuple[tuple[int, int], Packed] | None = None
        self._text_id = 0

    def take(self) -> Datagrams:
        """The datagrams to send. Those of one station are in order."""
        datagrams = Datagrams()
        for station, frames in self.outgoing.items():
            if station.return_path is not None:
                frames = [*filter(station.return_path.allows, frames)]
            together = b"".join(frames)
            if len(together) <= _MAX_DATAGRAM_SIZE:
                datagrams.append((station.peer, together))
            else:
                datagrams += ((station.peer, datagram) for datagram in _in_datagrams(frames, together))
        self.outgoing.clear()
        return datagrams

    def send(self, receiver: "GroundStation", together: Iterable[Message], writer: FrameWriter | None = None) -> None:
        """Send messages in one datagram. `writer`: of other ids than the vehicle's."""
        version, writer, frames = receiver.frame_version, writer or receiver.writer, []
        for message in together:  # a loop: a comprehension is a call
            frames.append(writer.frame(pack(message), version))  # noqa: PERF401
        self.outgoing[receiver] += frames
        if self.recorded is not None and not receiver.is_listener:
            self.recorded += frames

    def multicast(self, packed: Packed, receivers: Iterable["GroundStation"]) -> None:
        """Send a packed message to several stations that can read it."""
        frame = None
        # A flight is logged at the default rates, independent of the stations' requests.
        is_logged = self.recorder is None
        for receiver in receivers:
            if receiver.frame_version == 1 and packed.is_v2_only:
                continue
            frame = receiver.writer.frame(packed, receiver.frame_version)
            if receiver.peer is RECORDER:
                is_logged = True
            else:
                self.outgoing[receiver].append(frame)
        if self.recorded is not None and frame is not None and is_logged:
            self.recorded.append(frame)

    def beat(
        self, heartbeat: Message, for_qgc: Message, ids: tuple[int, int], receivers: Iterable["GroundStation"]
    ) -> None:
        """Send the heartbeat in MAVLink 2, then in MAVLink 1 too, to stations that have not sent MAVLink 2.

        QGroundControl talks to the vehicle in the version of the first frame that it gets, and a ground station that
        knows only MAVLink 1 would not see the vehicle otherwise. Signed links do not need MAVLink 1.
        """
        packed, packed_for_qgc = pack(heartbeat), pack(for_qgc)
        self.heartbeat = ids, packed
        logged: bytes | None = None
        for station in receivers:
            shown = packed_for_qgc if station.behaviour.kind is Kind.QGROUNDCONTROL else packed
            frames = [station.writer.frame(shown, version) for version in ((2,) if station.reads_v2_only else (2, 1))]
            logged = frames[0]  # the log itself is the last receiver
            if station.peer is not RECORDER:
                self.outgoing[station] += frames
        if self.recorded is not None and logged is not None:
            self.recorded.append(logged)

    def forward(self, frames: Sequence[bytes], receivers: Iterable["GroundStation"]) -> None:
        """Send whole frames unchanged."""
        for receiver in receivers:
            self.outgoing[receiver] += frames

    def show(self, happening: Happening, receivers: Sequence["GroundStation"]) -> None:
        """Show a happening on these stations, as each kind needs it."""
        self._emit(GcsText(text=happening.text))
        if receivers and self.recorder is not None and self.recorder not in receivers:
            receivers = [*receivers, self.recorder]  # the log also has the texts for one station
        alike: dict[Kind, list[GroundStation]] = {}
        for receiver in receivers:
            alike.setdefault(receiver.behaviour.kind, []).append(receiver)
        for kind, stations in alike.items():
            for severity, text in rendered(happening, kind):
                self._send_pieces(severity, pieces(text, kind), stations)

    def _send_pieces(self, severity: Severity, texts: Sequence[str], receivers: Sequence["GroundStation"]) -> None:
        self._text_id = self._text_id % _MAX_TEXT_ID + 1
        for chunk, piece in enumerate(texts):
            # With an id, MAVSDK, MAVProxy and QGroundControl join the pieces. Mission Planner shows each separately.
            text_id = self._text_id if len(texts) > 1 else 0
            message = messages.MAVLink_statustext_message(severity, piece.encode("ascii", "replace"), text_id, chunk)
            self.multicast(pack(message), receivers)


class Sender:
    """A sysid and compid at a ground station's address, from which a message came and which gets the answers.

    It knows the order of the frames, and the mission transfers.
    Senders number their frames from 0 to 255 again and again: a gap shows that a frame was lost, an older number that a
    frame was delayed. A sender without numbers seems to lose a frame each time.
    """

    def __init__(self, station: "GroundStation", sysid: int, compid: int) -> None:
        self.station, self.sysid, self.compid = station, sysid, compid
        self._text = f"{station.peer} sysid {sysid} compid {compid}"
        self.heard_at = -inf
        #: The number of the last frame, and of the newest one with the bytes.
        self.number = 0
        self._newest = 0, b""
        #: The frames sent so far, as far as their numbers show. Those that have not arrived, and the last one of them.
        self.frames = 0
        self._missing: list[int] = []
        self.last_lost = -1
        #: is_late: the last frame was sent before one that arrived earlier. is_copy: the network delivered it twice.
        self.is_late = self.is_copy = False
        #: State kept after the last transfers, by MAV_MISSION_TYPE.
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

    @property
    def peer(self) -> Peer:
        return self.station.peer

    @property
    def name(self) -> str:
        """The kind of station and the host, for the pilots of others."""
        title, host = self.station.behaviour.kind.title, self.peer.host
        return " ".join(filter(None, (title, host if isinstance(host, str) else ""))) or "another station"

    @property
    def identity(self) -> str:
        """A name that survives a restart of either side, and a TCP reconnection, which changes the port."""
        return f"{self.peer.host} sysid {self.sysid} compid {self.compid}"

    def __str__(self) -> str:
        return self._text

    def to(self, *together: Message) -> None:
        """Answer with messages in one datagram, unless the station has left."""
        if not self.station.has_left:
            self.station.outbox.send(self.station, together)

    def say(self, happening: Happening, *, is_routine: bool = False) -> None:
        self.station.say(happening, is_routine=is_routine)

    def command_ack(self, command: int, result: CommandResult) -> None:
        self.to(messages.MAVLink_command_ack_message(command, result, 0, 0, self.sysid, self.compid))

    def mission_ack(self, result: MissionResult, mission_type: int = 0) -> None:
        self.to(messages.MAVLink_mission_ack_message(self.sysid, self.compid, result, mission_type))

    def refuse(self, refusal: Refusal, mission_type: int = 0) -> None:
        """Refuse a mission transfer: send the reason as a text, and a MISSION_ACK."""
        self.say(refusal.why)
        self.mission_ack(refusal.ack, mission_type)

    def is_older(self, number: int) -> bool:
        """True if the last frame is late, and was sent before the frame with this number."""
        return self.is_late and 0 < (number - self.number) & 0xFF <= _MOST_LATE


class GroundStation:
    """A ground station that the bridge sends to, because it was heard or is configured.

    It is one address, a UDP peer or a TCP connection, because rights, limits, MAVLink version and message rates belong
    to an address. Several MAVLink ids may send from there, behind a radio or a router: `senders` has them. All that is
    known about a station is here, so dropping this object forgets it, except for its `budget`, which is remembered
    longer.
    """

    def __init__(
        self, peer: Peer, access: LinkAccess, sysid: int, compid: int, outbox: Outbox, budget: Budget | None = None
    ) -> None:
        self.peer = peer
        self.outbox = outbox
        self.has_left = False
        self.access = access
        #: None until a datagram was accepted: forged addresses must not use memory.
        self.budget = budget
        #: None once it is known that the station receives what is sent to its address.
        self.return_path: ReturnPath | None = None
        #: True once the station has sent a valid signature.
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
        #: It is new, or has returned after a silence, perhaps restarted.
        self.is_back = False
        #: By sysid and compid.
        self.senders: dict[tuple[int, int], Sender] = {}
        self.behaviour = Behaviour()
        self.rates = MessageRates()
        self.bad_news = BadNews()
        #: The reasons for refusals that were logged.
        self.reported: set[str] = set()
        #: A newcomer gets more heartbeats until this time, then home and the reasons not to arm.
        self.greeted_until = -inf
        self.is_informed = True
        #: One of the missions was accepted: it has been told that fences are not stored.
        self.has_written = False

    # Rights and limits.

    def refusal(self, frame: MavlinkFrame, effect: Effect) -> FrameRefusal | None:
        """The reason for refusing a frame with this effect, or None if it is accepted. All frames pass here first."""
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
        """The reason for not passing an accepted frame to an autopilot in pass-through. Also used for Set WP."""
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
        """Count work caused by the last message of the station, or at `now`. Returns False if it exceeds the limit."""
        is_proven = self.standing is Standing.PROVEN
        return self.budget is None or self.budget.allows(
            cost, self.heard_at if now is None else now, is_proven=is_proven
        )

    def heard(self, frame: MavlinkFrame, ids: tuple[int, int], now: float) -> Sender:
        """Note a frame. Returns the sender."""
        self.is_back = now >= self.heard_at + _RETURNS_S
        if not self.is_heard:
            self.is_heard, self.came_at = True, now
        self.heard_at = now
        if self.version != 2:
            self.version = frame.version
            self.behaviour.speaks_v2 = self.version == 2
            self.frame_version = 2 if self.access.signing is not None else self.version
        sender = self.senders.get(ids)
        if sender is None:
            if len(self.senders) >= _MAX_SENDERS:
                del self.senders[min(self.senders, key=lambda each: self.senders[each].heard_at)]
            sender = self.senders[ids] = Sender(self, *ids)
            self.behaviour.compid = sender.compid
        sender.heard(frame, now)
        return sender

    # Sending.

    def say(self, happening: Happening, *, is_routine: bool = False) -> None:
        """Show a happening on this station. A refusal only once for each attempt.

        `is_routine`: the program itself has made the request that was refused, and no pilot waits for the reason.
        """
        is_refusal = happening.sentence.severity is Severity.ERROR
        if is_refusal and self.bad_news.is_repeated(happening, self.heard_at, is_routine=is_routine):
            return
        if self.has_left or not self.allows(Cost.TEXT):
            return
        self.outbox.show(happening, [self])
        if is_refusal or happening.sentence.lasts:
            self._ask(None if is_routine else self.bad_news.said(happening, self.behaviour.kind, self.heard_at))

    def say_again(self, now: float) -> None:
        """Repeat the bad news that may not have arrived, or was replaced on the HUD. A silent station waits."""
        is_silent = now >= self.heard_at + _RETURNS_S
        for happening, question in () if is_silent else self.bad_news.again(self.behaviour.kind, now):
            self.outbox.show(happening, [self])
            self._ask(question)

    def _ask(self, question: Message | None) -> None:
        if question is not None:
            self.outbox.send(self, [question])

    def sent_sys_status(self, now: float, *, is_unhealthy: bool) -> None:
        """Repeat bad news where the pilot can read it: right after a SYS_STATUS, it stays until the next."""
        self.bad_news.is_replaced |= is_unhealthy
        self.say_again(now)

    @property
    def reads_v2_only(self) -> bool:
        """True if heartbeats in MAVLink 2 are enough: it has sent that version, or must."""
        return self.version == 2 or self.access.signing is not None or self.peer is RECORDER


def _in_datagrams(frames: Sequence[bytes], together: bytes) -> list[bytes]:
    """Join frames into datagrams of at most 280 bytes: the cost is per datagram, not per byte."""
    datagrams: list[bytes] = []
    start = end = 0
    for frame in frames:
        if end + len(frame) > start + _MAX_DATAGRAM_SIZE:
            datagrams.append(together[start:end])
            start = end
        end += len(frame)
    return [*datagrams, together[start:]]
