# SPDX-License-Identifier: GPL-3.0-or-later
"""The ground side: connected stations, received frames, and the queue of datagrams to send. Sans-IO."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence

from bridge.gcs.budget import Budgets
from bridge.gcs.cost import Cost
from bridge.gcs.flash_budget import FlashBudget
from bridge.gcs.guard import Signer, Standing
from bridge.gcs.recent_texts import RecentTexts
from bridge.gcs.station import RECORDER, Peer, Severity, Station
from bridge.gcs.stations import Stations, displaced
from bridge.model.events import Emit, GcsFound, GcsSilent, GcsText
from bridge.model.refusal import Refusal
from protocols.mavlink.codec import FrameWriter, Packed, pack
from protocols.mavlink.dialect import Message, messages
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.mission_item import MissionResult

_TEXT_SIZE = 50
_MAX_TEXT_ID = 0xFFFF

#: A frame listener: called with all frames to and from ground stations, each once.
FrameListener = Callable[[Sequence[bytes]], None]


class Ground:
    """All ground stations together. `on_newcomer` is called for a peer that is new or returns after a silence.

    `standing`: a peer's rights (bridge.gcs.guard). One that may only read gets telemetry and answers, but no texts
    for everyone, and is not recorded.

    `signers` by link name: on such a link everything the bridge sends is signed, and so MAVLink 2.
    """

    def __init__(
        self,
        sysid: int,
        compid: int,
        emit: Emit,
        on_newcomer: Callable[[Peer], None],
        on_frames: FrameListener | None,
        standing: Callable[[Peer], Standing],
        signers: Mapping[str, Signer],
    ) -> None:
        self._sysid = sysid
        self._compid = compid
        self._emit = emit
        self._on_newcomer = on_newcomer
        #: Called for a peer that was forgotten after a silence.
        self.on_silent: Callable[[Peer], None] = lambda _peer: None
        self._logs_flights = on_frames is not None
        self.on_frames = on_frames or _drop
        self._standing = standing
        self._signers = signers
        self.stations = Stations()
        self.budgets = Budgets(self.has_standing)
        self.flash = FlashBudget(standing, self.stations)
        self._default_peers: dict[Peer, bool] = {}
        self._splitters: dict[Peer, MavlinkSplitter] = {}
        self._writers: dict[Peer, FrameWriter] = {}
        self._datagrams: list[tuple[Peer, bytes]] = []
        self._texts = RecentTexts()
        self._text_id = 0
        #: The time of the last input.
        self.now = 0.0
        #: Texts for each newcomer, about problems that began before it connected.
        self.notices: list[str] = []
        #: Frames from ground stations whose checksum was wrong.
        self.bad_frames = 0
        #: Whole frames from ground stations, by link and message id.
        self.frames_received: Counter[tuple[str, int]] = Counter()
        self._everyone: list[Peer] | None = None  # recomputed after each change

    # The connected stations.

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        """Send to `peer` before it is heard; `until_answered`: only while no peer is heard on its link (broadcast)."""
        self._default_peers[peer] = until_answered
        self._everyone = None

    def remove_default_peer(self, peer: Peer) -> None:
        self._default_peers.pop(peer, None)
        self._everyone = None
        self._writers.pop(peer, None)

    def remove_link(self, name: str) -> list[Peer]:
        """Forget all peers on a link; returns those that were heard."""
        for peer in [peer for peer in self._default_peers if peer.link == name]:
            self.remove_default_peer(peer)
        heard = [peer for peer in self.stations.peers() if peer.link == name]
        for peer in heard:
            self.gone(peer)
        return heard

    def everyone(self) -> Sequence[Peer]:
        """All peers that receive broadcasts."""
        if self._everyone is None:
            heard = self.stations.peers()
            unheard = (
                peer
                for peer in self.unheard()
                if not (self._default_peers[peer] and any(peer.link == other.link for other in heard))
            )
            self._everyone = [*heard, *unheard]
        return self._everyone

    def unheard(self) -> list[Peer]:
        """The default peers that are not connected: nothing may be listening there."""
        return [peer for peer in self._default_peers if self.stations.is_unknown(peer)]

    def gone(self, peer: Peer) -> None:
        self.stations.gone(peer)
        self._forget(peer)

    @property
    def due(self) -> float:
        """The time of the next `tick`."""
        return self.stations.due

    def tick(self, now: float) -> None:
        """Forget silent peers."""
        for peer in self.stations.expire(now):
            self._forget(peer)
            self._emit(GcsSilent(peer=str(peer)))
            self.on_silent(peer)

    def _forget(self, peer: Peer) -> None:
        self._everyone = None
        self.budgets.forget(peer)
        self._splitters.pop(peer, None)
        self._writers.pop(peer, None)

    # Received from them.

    def received(self, peer: Peer, data: bytes, now: float, *, datagram: bool) -> list[MavlinkFrame]:
        """Parse bytes from a peer into frames. A datagram holds whole frames only."""
        self.now = now
        splitter = self._splitters.get(peer)
        if splitter is None:
            splitter = MavlinkSplitter()
            if not datagram:
                self._splitters[peer] = splitter
        bad_before = splitter.bad_frames
        frames = splitter.feed(data)
        if datagram:
            frames += splitter.reset()
        self.bad_frames += splitter.bad_frames - bad_before
        # Our own frames come back from a broadcast, or from a router that floods.
        return [frame for frame in frames if frame.sender != (self._sysid, self._compid)]

    def admits(self, peer: Peer, now: float) -> bool:
        """False if a frame must be ignored, because it comes from one of too many new addresses."""
        standing = self._standing(peer)
        if standing is Standing.PROVEN or not self.stations.is_unknown(peer):
            return True
        has_room = self.stations.has_room_for(peer, is_listener=standing is Standing.LISTENER)
        return has_room and self.budgets.allows(Cost.ARRIVAL, peer, now)

    def heard(self, peer: Peer, frame: MavlinkFrame, now: float) -> None:
        """Note a frame from a peer, which counts as connected from now on."""
        self.frames_received[peer.link, frame.msgid] += 1
        station = Station(peer, frame.sysid, frame.compid)
        is_listener, is_unknown = self._standing(peer) is Standing.LISTENER, self.stations.is_unknown(peer)
        if self.stations.heard(station, frame.version, now, is_listener=is_listener):
            self._everyone = None
            self._on_newcomer(peer)
            if is_unknown:
                self._emit(GcsFound(station=str(station)))
                for notice in self.notices:
                    self.say(Severity.WARNING, notice, station)

    def record(self, peer: Peer, frame: MavlinkFrame, now: float) -> None:
        if not self.stations.is_listener(peer) and self.budgets.allows(Cost.RECORDED, peer, now):
            self.on_frames([frame.raw])

    def displaced(self, peers: Mapping[Peer, float]) -> Peer:
        """The connection of a full link to drop; one with standing only if there is no other."""
        others = {peer: at for peer, at in peers.items() if self._standing(peer) is not Standing.PROVEN}
        return displaced(others or peers, self.stations.steady)

    def has_standing(self, peer: Peer) -> bool:
        """True for a peer that has authenticated, or has precedence on its link: strangers cannot use its shares.

        An address that was never heard may be made up, even if it is listed.
        """
        if self.stations.is_unknown(peer):
            return False
        standing = self._standing(peer)
        return standing is Standing.PROVEN or (standing is Standing.OPEN and self.stations.has_standing(peer))

    @property
    def is_recording(self) -> bool:
        """True while a flight is logged at the default rates, independent of the stations' requests."""
        return RECORDER in self._default_peers

    def record_flight(self, *, on: bool) -> None:
        """Log everything that a connected ground station would get, even if there is none."""
        if on and self._logs_flights:
            self.add_default_peer(RECORDER, until_answered=False)
        else:
            self.remove_default_peer(RECORDER)

    # Sent to them.

    def take_datagrams(self) -> list[tuple[Peer, bytes]]:
        """The datagrams to send, in order; each holds whole frames."""
        datagrams, self._datagrams = self._datagrams, []
        return datagrams

    def to(self, station: Station, *together: Message) -> None:
        """Send messages in one datagram to one ground station."""
        self._send(station.peer, self._writer(station.peer), *together)

    def mission_ack(self, station: Station, result: MissionResult, mission_type: int = 0) -> None:
        """Send a MISSION_ACK."""
        self.to(station, messages.MAVLink_mission_ack_message(station.sysid, station.compid, result, mission_type))

    def refuse(self, station: Station, refusal: Refusal) -> None:
        """Refuse a mission transfer: send the reason as a text, and a MISSION_ACK."""
        self.say(Severity.ERROR, refusal.text, station)
        self.mission_ack(station, refusal.ack)

    def allows(self, station: Station, cost: Cost) -> bool:
        """Count work that a ground station causes; False if that exceeds its limit."""
        return self.budgets.allows(cost, station.peer, self.now)

    def to_as(self, ids: tuple[int, int], station: Station, message: Message) -> None:
        """Send a message to one ground station under the ids that it addressed."""
        self._send(station.peer, FrameWriter(*ids, self._signers.get(station.peer.link)), message)

    def _send(self, peer: Peer, writer: FrameWriter, *together: Message) -> None:
        frames = [writer.frame(pack(message), self._version(peer)) for message in together]
        self._datagrams.append((peer, b"".join(frames)))
        if not self.stations.is_listener(peer):
            self.on_frames(frames)

    def broadcast(self, message: Message) -> None:
        self.multicast(pack(message), self.everyone())

    def multicast(self, packed: Packed, peers: Iterable[Peer]) -> None:
        """Send a packed message to several peers that can read it."""
        frame = None
        is_logged = not self.is_recording
        for peer in peers:
            version = self._version(peer)
            if version == 1 and packed.is_v2_only:
                continue
            frame = self._writer(peer).frame(packed, version)
            if peer is RECORDER:
                is_logged = True
            else:
                self._datagrams.append((peer, frame))
        if frame is not None and is_logged:
            self.on_frames([frame])

    def beat(self, heartbeat: Message, peers: Iterable[Peer]) -> None:
        """Send the heartbeat in MAVLink 2, then in MAVLink 1 too, to peers that have not sent MAVLink 2.

        QGroundControl talks to the vehicle in the version of the first frame that it gets, and a ground station that
        knows only MAVLink 1 would not see the vehicle otherwise. Signed links need no MAVLink 1.
        """
        packed = pack(heartbeat)
        logged: bytes | None = None
        for peer in peers:
            writer = self._writer(peer)
            frames = [writer.frame(packed, version) for version in ((2,) if self._has_sent_v2(peer) else (2, 1))]
            logged = logged or frames[0]
            if peer is not RECORDER:
                self._datagrams += [(peer, frame) for frame in frames]
        if logged is not None:
            self.on_frames([logged])

    def _has_sent_v2(self, peer: Peer) -> bool:
        is_certain = peer is RECORDER or peer.link in self._signers
        return is_certain or not (self.stations.is_unknown(peer) or self.stations.version(peer) == 1)

    def say(self, severity: Severity, text: str, to: Station | None = None) -> None:
        """Show a text on one ground station or on all."""
        if to is None:
            self._say(severity, text, self._readers_of_texts())
        elif self.allows(to, Cost.TEXT):
            self._say(severity, text, [to.peer])

    def say_to_others(self, severity: Severity, text: str, station: Station) -> None:
        """Show a text on all ground stations but one."""
        self._say(severity, text, [peer for peer in self._readers_of_texts() if peer != station.peer])

    def _say(self, severity: Severity, text: str, peers: Sequence[Peer]) -> None:
        """Send a text in pieces that fit STATUSTEXT; a refusal only once per attempt."""
        self._emit(GcsText(text=text))
        if severity is Severity.ERROR:
            peers = self._texts.new_to(peers, text, self.now)
        if peers and self.is_recording and RECORDER not in peers:
            peers = [*peers, RECORDER]  # a text for one station is part of the flight's log, too
        self._text_id = self._text_id % _MAX_TEXT_ID + 1
        # MAVSDK joins the pieces with nothing in between, and shows padding as a gap.
        joining = [peer for peer in peers if self.stations.is_like_mavsdk(peer)]
        self._send_pieces(severity, cut_text(text), joining)
        self._send_pieces(severity, split_text(text), [peer for peer in peers if peer not in joining])

    def _send_pieces(self, severity: Severity, pieces: Sequence[str], peers: Sequence[Peer]) -> None:
        for chunk, piece in enumerate(pieces):
            # With an id, MAVSDK, MAVProxy and QGroundControl join the pieces; Mission Planner shows each by itself.
            text_id = self._text_id if len(pieces) > 1 else 0
            message = messages.MAVLink_statustext_message(severity, piece.encode("ascii", "replace"), text_id, chunk)
            self.multicast(pack(message), peers)

    def _readers_of_texts(self) -> list[Peer]:
        return [peer for peer in self.everyone() if self._standing(peer) is not Standing.LISTENER]

    def forward(self, frames: Sequence[bytes], peers: Iterable[Peer]) -> None:
        """Send datagrams of one or more whole frames unchanged."""
        for peer in peers:
            for frame in frames:
                self._datagrams.append((peer, frame))

    def _writer(self, peer: Peer) -> FrameWriter:
        writer = self._writers.get(peer)
        if writer is None:
            writer = FrameWriter(self._sysid, self._compid, self._signers.get(peer.link))
            # A late reply to a peer that has left must not keep a writer forever.
            if peer in self.everyone():
                self._writers[peer] = writer
        return writer

    def _version(self, peer: Peer) -> int:
        return 2 if peer.link in self._signers else self.stations.version(peer)


def cut_text(text: str) -> list[str]:
    """Cut into pieces of 50 characters; the last one is shorter, and may be empty, which ends the text."""
    if len(text) <= _TEXT_SIZE:
        return [text]
    return [text[at : at + _TEXT_SIZE] for at in range(0, len(text) + 1, _TEXT_SIZE)]


def split_text(text: str) -> list[str]:
    """Split at spaces into pieces of 50 characters, padded with at least one space; the last one is shorter.

    A piece shorter than 50 ends the text for clients that join them with nothing in between (STATUSTEXT.chunk_seq).
    """
    pieces: list[str] = []
    while len(text) > _TEXT_SIZE - bool(pieces):
        cut = text.rfind(" ", 1, _TEXT_SIZE)
        cut = cut if cut > 0 else _TEXT_SIZE
        pieces.append(text[:cut].ljust(_TEXT_SIZE))
        text = text[cut:].lstrip()
    return [*pieces, text]


def _drop(_frames: Sequence[bytes]) -> None:
    """The frame listener of a bridge without a log."""
