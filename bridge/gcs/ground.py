# SPDX-License-Identifier: GPL-3.0-or-later
"""All ground stations, and the queue of datagrams to them. Sans-IO."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import inf

from bridge.gcs.budget import HostBudgets
from bridge.gcs.cost import Cost
from bridge.gcs.flash_budget import FlashBudget
from bridge.gcs.ground_station import GroundStation, Speaker
from bridge.gcs.places import MAX_LISTENERS, MAX_PEERS, Places
from bridge.gcs.rights import LinkAccess, Standing
from bridge.gcs.station import RECORDER, Peer, Severity, Station
from bridge.gcs.texts import cut_text, split_text
from bridge.model.events import Emit, GcsFound, GcsSilent, GcsText
from bridge.model.refusal import Refusal
from protocols.mavlink.codec import FrameWriter, Packed, pack
from protocols.mavlink.dialect import Message, messages
from protocols.mavlink.frame import MavlinkFrame
from protocols.mission_item import MissionResult

#: A UDP station that is silent for this long has left; a TCP station leaves with its connection.
EXPIRY_S = 60.0
#: This time applies to a station whose ids have all moved to another address, as after Wi-Fi roaming.
MOVED_S = 5.0
#: A connected station, whether or not it transfers a mission, is never silent for this long.
_STILL_S = 1.0
#: The interval between searches for silent stations.
_EXPIRY_INTERVAL_S = 1.0
_MAX_TEXT_ID = 0xFFFF
#: Mission Planner, QGroundControl, MAVSDK and MAVProxy read several frames in a datagram; MAVROS cuts at 296 bytes.
MAX_DATAGRAM_SIZE = 280

#: A frame listener: called with all frames to and from ground stations, each once.
FrameListener = Callable[[Sequence[bytes]], None]


class Ground:
    """The ground stations. `on_newcomer` is called for one that is new or returns after a silence.

    `access`: the rules of each link; a link without rules is `open_access`. A station that may only read gets telemetry
    and answers, but no texts for everyone, and is not recorded.
    """

    def __init__(
        self,
        sysid: int,
        compid: int,
        emit: Emit,
        on_newcomer: Callable[[GroundStation, float], None],
        on_frames: FrameListener | None,
        access: Mapping[str, LinkAccess],
        open_access: LinkAccess,
    ) -> None:
        self._ids = sysid, compid
        self._emit = emit
        self._on_newcomer = on_newcomer
        self._logs_flights = on_frames is not None
        self.on_frames = on_frames or _drop
        self._access = access
        self._open_access = open_access
        self._heard: dict[Peer, GroundStation] = {}  # in order of arrival
        #: Configured stations, and connections, that have not sent a frame.
        self._unheard: dict[Peer, GroundStation] = {}
        self._default_peers: dict[Peer, bool] = {}
        self._places: dict[tuple[str, bool], Places] = {}
        self.hosts = HostBudgets()
        self.flash = FlashBudget()
        #: Frames to be sent.
        self._outgoing: defaultdict[GroundStation, list[bytes]] = defaultdict(list)
        self._text_id = 0
        self.due = inf
        #: Texts for each newcomer, about problems that began before it connected.
        self.notices: list[str] = []
        #: Frames from ground stations whose checksum was wrong.
        self.bad_frames = 0
        self._everyone: list[GroundStation] | None = None  # recomputed after each change

    # The connected stations.

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        """Send to `peer` before it is heard; `until_answered`: only while no peer is heard on its link (broadcast)."""
        self._default_peers[peer] = until_answered
        self._everyone = None
        if self.station(peer) is None:
            self._unheard[peer] = self._made(peer)

    def remove_default_peer(self, peer: Peer) -> None:
        self._default_peers.pop(peer, None)
        self._unheard.pop(peer, None)
        self._everyone = None

    def remove_link(self, name: str) -> list[Peer]:
        """Forget all stations on a link; returns those that were heard."""
        for peer in [peer for peer in self._default_peers if peer.link == name]:
            self.remove_default_peer(peer)
        heard = [peer for peer in self._heard if peer.link == name]
        for peer in [*heard, *(peer for peer in self._unheard if peer.link == name)]:
            self.gone(peer)
        return heard

    def station(self, peer: Peer) -> GroundStation | None:
        return self._heard.get(peer) or self._unheard.get(peer)

    def speaker(self, station: Station) -> Speaker:
        """The sender with the station's ids; an empty one if its address has too many to remember."""
        there = self._heard.get(station.peer)
        return (there and there.speakers.get((station.sysid, station.compid))) or Speaker()

    def peers(self) -> list[Peer]:
        """The peers that were heard, in order of arrival."""
        return list(self._heard)

    def everyone(self) -> Sequence[GroundStation]:
        """All stations that receive broadcasts."""
        if self._everyone is None:
            answered = {peer.link for peer in self._heard}
            unheard = (
                station
                for peer, station in self._unheard.items()
                if (is_until := self._default_peers.get(peer)) is not None and not (is_until and peer.link in answered)
            )
            self._everyone = [*self._heard.values(), *unheard]
        return self._everyone

    def gone(self, peer: Peer) -> None:
        """Forget a station; a configured one starts from scratch."""
        self._unheard.pop(peer, None)
        station = self._heard.pop(peer, None)
        if station is not None and station.places is not None:
            station.places.remove(station)
            station.leaves()
        self._everyone = None
        if peer in self._default_peers:
            self._unheard[peer] = self._made(peer)

    def tick(self, now: float) -> None:
        latest: dict[tuple[str, tuple[int, int]], float] = {}
        for peer, station in self._heard.items():
            for ids, speaker in station.speakers.items():
                latest[peer.link, ids] = max(speaker.heard_at, latest.get((peer.link, ids), -inf))
        for peer, station in [*self._heard.items()]:
            # Heard later at another address: the station has moved there.
            moved = all(latest[peer.link, ids] > each.heard_at for ids, each in station.speakers.items())
            if now >= station.heard_at + (MOVED_S if moved else EXPIRY_S):
                self._leaves(station)
        self.due = now + _EXPIRY_INTERVAL_S if self._heard else inf

    def _leaves(self, station: GroundStation) -> None:
        self.gone(station.peer)
        self._emit(GcsSilent(peer=str(station.peer)))

    def _made(self, peer: Peer, *, is_connection: bool = False) -> GroundStation:
        access = self._access.get(peer.link, self._open_access)
        return GroundStation(peer, access, *self._ids, self.hosts.host(peer.host) if is_connection else None)

    def _places_of(self, station: GroundStation) -> Places:
        key = station.peer.link, station.is_listener
        places = self._places.get(key)
        if places is None:
            places = self._places[key] = Places(MAX_LISTENERS if station.is_listener else MAX_PEERS)
        return places

    # Received from them.

    def sender(self, peer: Peer, now: float, *, datagram: bool) -> GroundStation | None:
        """The sender of a read or a datagram; None if it sends too many. A new one is remembered when it is admitted.

        New addresses share one limit, because they may be made up; a connection cannot be.
        """
        station = self._heard.get(peer) or self._unheard.get(peer)
        if station is None:
            station = self._made(peer, is_connection=not datagram)
            if not datagram:
                self._unheard[peer] = station
        is_allowed = station.allows(Cost.RECEIVED, now) and (
            station.host is not None or self.hosts.totals[Cost.RECEIVED].take(now)
        )
        return station if is_allowed else None

    def split(self, station: GroundStation, data: bytes, *, datagram: bool) -> list[MavlinkFrame]:
        """Parse bytes from a station into frames. A datagram holds whole frames only."""
        splitter = station.splitter
        bad_before = splitter.bad_frames
        frames = [*map(MavlinkFrame, splitter.split(data, is_end=datagram))]
        self.bad_frames += splitter.bad_frames - bad_before
        return frames

    def admits(self, station: GroundStation, now: float) -> bool:
        """False if a station's first frame must be ignored, because it comes from one of too many new addresses."""
        if station.standing is not Standing.PROVEN and not self._places_of(station).has_room_for(station.peer):
            return False
        station.host = self.hosts.host(station.peer.host)
        return station.standing is Standing.PROVEN or station.host.allows(Cost.ARRIVAL, now)

    def heard(self, station: GroundStation, frame: MavlinkFrame, sender: tuple[int, int], now: float) -> None:
        """Note a frame from a station, which counts as connected from now on."""
        peer = station.peer
        is_unknown = not station.is_heard
        if station.places is None:
            self._takes_place(station, now)
        else:
            station.places.stations.move_to_end(peer)
        if station.heard(frame, sender, now):
            self._on_newcomer(station, now)
        if is_unknown:
            name = Station(peer, *sender)
            self._emit(GcsFound(station=str(name)))
            for notice in self.notices:
                self.say(Severity.WARNING, notice, name)

    def _takes_place(self, station: GroundStation, now: float) -> None:
        places = self._places_of(station)
        if (displaced := places.displaced_by(station.peer)) is not None:
            self._leaves(displaced)
        places.add(station)
        station.joins()
        self._unheard.pop(station.peer, None)
        self._heard[station.peer] = station
        self._everyone = None
        self.due = min(self.due, now + _EXPIRY_INTERVAL_S)

    def record(self, station: GroundStation, frame: MavlinkFrame) -> None:
        if self.on_frames is not _drop and not station.is_listener and station.allows(Cost.RECORDED):
            self.on_frames([frame.raw])

    def displaced(self, peers: Mapping[Peer, float]) -> Peer:
        """The connection of a full link to drop: the one silent for longest, those with their own budget last.

        `peers`: when each was last heard.
        """

        def worth(peer: Peer) -> tuple[bool, bool, float]:
            station = self._heard.get(peer)
            return station is not None and station.has_own_budget, station is not None, peers[peer]

        return min(peers, key=worth)

    def has_own_budget(self, peer: Peer) -> bool:
        """True for a connected station whose limits strangers cannot use up."""
        return (station := self._heard.get(peer)) is not None and station.has_own_budget

    def allows(self, station: Station, cost: Cost) -> bool:
        """Count work that a ground station causes; False if that exceeds its limit."""
        return (sender := self._heard.get(station.peer)) is not None and sender.allows(cost)

    def allows_write(self, station: Station, now: float) -> bool:
        """Count a write to the flight controller's flash; False if it must wait."""
        return self.flash.allows(self._heard.get(station.peer), now)

    def not_written(self, station: Station) -> None:
        """Take back a write: the flash held the same already, or the flight controller refused."""
        self.flash.not_written(self._heard.get(station.peer))

    def wrote_at(self, station: Station) -> float:
        """The time of the last write by the station's host: the one that has waited longest writes first."""
        sender = self._heard.get(station.peer)
        return inf if sender is None or sender.host is None else sender.host.wrote_at

    def record_flight(self, *, on: bool) -> None:
        """Log everything that a connected ground station would get, even if there is none."""
        if on and self._logs_flights:
            self.add_default_peer(RECORDER, until_answered=False)
        else:
            self.remove_default_peer(RECORDER)

    # Wi-Fi roaming.

    def moved_to(self, station: Station, now: float) -> list[Station]:
        """The new addresses of a station that fell silent at its old one: usually none."""
        old = self._heard.get(station.peer)
        if old is None or now < old.heard_at + _STILL_S:
            return []
        return [where for where in self.elsewhere(station) if self.has_moved(station, where, now)]

    def elsewhere(self, station: Station) -> list[Station]:
        """Other addresses where these ids were heard."""
        ids = station.sysid, station.compid
        others = (peer for peer, there in self._heard.items() if ids in there.speakers and peer != station.peer)
        return [Station(peer, *ids) for peer in others]

    def has_moved(self, station: Station, to: Station, now: float) -> bool:
        """True if `to` is the new address of a station that fell silent at its old one.

        This excludes a second station with the same ids, heard earlier or alongside the first.
        """
        ids = station.sysid, station.compid
        old, new = self._heard.get(station.peer), self._heard.get(to.peer)
        if old is None or new is None or old is new or ids != (to.sysid, to.compid):
            return False
        return (
            now >= old.heard_at + _STILL_S
            and new.places is old.places
            and ids in new.speakers
            and new.came_at >= old.heard_at
        )

    # Messages to stations.

    def take_datagrams(self) -> list[tuple[Peer, bytes]]:
        """The datagrams to send; each holds whole frames. Those of one station are in order."""
        datagrams: list[tuple[Peer, bytes]] = []
        for station, frames in self._outgoing.items():
            together = b"".join(frames)
            if len(together) <= MAX_DATAGRAM_SIZE:
                datagrams.append((station.peer, together))
            else:
                datagrams += ((station.peer, datagram) for datagram in _in_datagrams(frames, together))
        self._outgoing.clear()
        return datagrams

    def to(self, station: Station, *together: Message) -> None:
        """Send messages in one datagram to one ground station, unless it has left."""
        receiver = self._heard.get(station.peer) or self._unheard.get(station.peer)
        if receiver is not None:
            self._send(receiver, receiver.writer, together)

    def mission_ack(self, station: Station, result: MissionResult, mission_type: int = 0) -> None:
        self.to(station, messages.MAVLink_mission_ack_message(station.sysid, station.compid, result, mission_type))

    def refuse(self, station: Station, refusal: Refusal, mission_type: int = 0) -> None:
        """Refuse a mission transfer: send the reason as a text, and a MISSION_ACK."""
        self.say(Severity.ERROR, refusal.text, station)
        self.mission_ack(station, refusal.ack, mission_type)

    def to_as(self, ids: tuple[int, int], receiver: GroundStation, message: Message) -> None:
        """Send a message to one ground station under the ids that it addressed."""
        self._send(receiver, FrameWriter(*ids, receiver.access.signer), [message])

    def _send(self, receiver: GroundStation, writer: FrameWriter, together: Iterable[Message]) -> None:
        version, frames = receiver.frame_version, []
        for message in together:  # a loop: a comprehension is a call
            frames.append(writer.frame(pack(message), version))  # noqa: PERF401
        self._outgoing[receiver] += frames
        if self.on_frames is not _drop and not receiver.is_listener:
            self.on_frames(frames)

    def broadcast(self, message: Message) -> None:
        self.multicast(pack(message), self.everyone())

    def multicast(self, packed: Packed, stations: Iterable[GroundStation]) -> None:
        """Send a packed message to several stations that can read it."""
        frame = None
        # A flight is logged at the default rates, independent of the stations' requests.
        is_logged = self.on_frames is not _drop and RECORDER not in self._default_peers
        for station in stations:
            if station.frame_version == 1 and packed.is_v2_only:
                continue
            frame = station.writer.frame(packed, station.frame_version)
            if station.peer is RECORDER:
                is_logged = True
            else:
                self._outgoing[station].append(frame)
        if frame is not None and is_logged:
            self.on_frames([frame])

    def beat(self, heartbeat: Message, stations: Iterable[GroundStation]) -> None:
        """Send the heartbeat in MAVLink 2, then in MAVLink 1 too, to stations that have not sent MAVLink 2.

        QGroundControl talks to the vehicle in the version of the first frame that it gets, and a ground station that
        knows only MAVLink 1 would not see the vehicle otherwise. Signed links need no MAVLink 1.
        """
        packed = pack(heartbeat)
        logged: bytes | None = None
        for station in stations:
            frames = [station.writer.frame(packed, version) for version in ((2,) if station.reads_v2_only else (2, 1))]
            logged = logged or frames[0]
            if station.peer is not RECORDER:
                self._outgoing[station] += frames
        if logged is not None:
            self.on_frames([logged])

    def say(self, severity: Severity, text: str, to: Station | None = None, *, is_reminder: bool = False) -> None:
        """Show a text on one ground station or on all; a refusal only once per attempt, unless `is_reminder`."""
        if to is None:
            self._say(severity, text, self._readers_of_texts())
        elif (station := self.station(to.peer)) is not None and station.allows(Cost.TEXT):
            is_refusal = severity is Severity.ERROR and not is_reminder
            if not is_refusal or station.texts.is_new(text, station.heard_at):
                self._say(severity, text, [station])

    def say_among(self, stations: Iterable[GroundStation], severity: Severity, text: str) -> None:
        """Show a text on these ground stations."""
        self._say(severity, text, [reader for reader in stations if not reader.is_listener])

    def say_to_others(self, severity: Severity, text: str, station: Station) -> None:
        self._say(severity, text, [reader for reader in self._readers_of_texts() if reader.peer != station.peer])

    def _say(self, severity: Severity, text: str, stations: Sequence[GroundStation]) -> None:
        """Send a text in pieces that fit STATUSTEXT."""
        self._emit(GcsText(text=text))
        recorder = self.station(RECORDER)
        if stations and recorder is not None and recorder not in stations:
            stations = [*stations, recorder]  # the log also has the texts for one station
        self._text_id = self._text_id % _MAX_TEXT_ID + 1
        # MAVSDK joins the pieces without a separator, and shows padding as a gap.
        self._send_pieces(severity, cut_text(text), [station for station in stations if station.is_like_mavsdk])
        self._send_pieces(severity, split_text(text), [station for station in stations if not station.is_like_mavsdk])

    def _send_pieces(self, severity: Severity, pieces: Sequence[str], stations: Sequence[GroundStation]) -> None:
        for chunk, piece in enumerate(pieces):
            # With an id, MAVSDK, MAVProxy and QGroundControl join the pieces; Mission Planner shows each separately.
            text_id = self._text_id if len(pieces) > 1 else 0
            message = messages.MAVLink_statustext_message(severity, piece.encode("ascii", "replace"), text_id, chunk)
            self.multicast(pack(message), stations)

    def _readers_of_texts(self) -> list[GroundStation]:
        return [station for station in self.everyone() if not station.is_listener]

    def forward(self, frames: Sequence[bytes], stations: Iterable[GroundStation]) -> None:
        """Send whole frames unchanged."""
        for station in stations:
            self._outgoing[station] += frames


def _drop(_frames: Sequence[bytes]) -> None:
    """The frame listener of a bridge without a log."""


def _in_datagrams(frames: Sequence[bytes], together: bytes) -> list[bytes]:
    """Join frames into datagrams of at most 280 bytes: the cost is per datagram, not per byte."""
    datagrams: list[bytes] = []
    start = end = 0
    for frame in frames:
        if end + len(frame) > start + MAX_DATAGRAM_SIZE:
            datagrams.append(together[start:end])
            start = end
        end += len(frame)
    return [*datagrams, together[start:]]
