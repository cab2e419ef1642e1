# SPDX-License-Identifier: GPL-3.0-or-later
"""All ground stations, and the queue of datagrams to them. Sans-IO."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import inf

from bridge.gcs.budget import Budgets
from bridge.gcs.cost import Cost
from bridge.gcs.ground_station import GroundStation, Speaker
from bridge.gcs.return_path import ReturnPath
from bridge.gcs.rights import LinkAccess, Standing
from bridge.gcs.station import RECORDER, Datagrams, Peer, Severity, Station
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
#: This time applies to a station that has not shown that it receives anything.
_UNPROVEN_S = 5.0
#: Stations with a copy of the telemetry.
MAX_STATIONS = 32
#: A connected station, whether or not it transfers a mission, is never silent for this long.
_STILL_S = 1.0
#: The interval between searches for silent stations.
_EXPIRY_INTERVAL_S = 1.0
_MAX_TEXT_ID = 0xFFFF
#: Mission Planner, QGroundControl, MAVSDK and MAVProxy read several frames in a datagram; MAVROS cuts at 296 bytes.
MAX_DATAGRAM_SIZE = 280


class Ground:
    """The ground stations. `on_newcomer` is called for one that is new or returns after a silence.

    `access`: the rules of each link; a link without rules is `open_access`. A station that may only read gets telemetry
    and answers, but no texts for everyone, and is not recorded. `is_near`: True for an address on the machine's own
    networks, without a router in between. `is_recorded`: there is a telemetry log.
    """

    def __init__(
        self,
        sysid: int,
        compid: int,
        emit: Emit,
        on_newcomer: Callable[[GroundStation, float], None],
        access: Mapping[str, LinkAccess],
        open_access: LinkAccess,
        is_near: Callable[[str], bool] = lambda _host: True,
        *,
        is_recorded: bool = False,
    ) -> None:
        self._ids = sysid, compid
        self._emit = emit
        self._on_newcomer = on_newcomer
        #: Frames to and from ground stations for the telemetry log, each once; None if there is no log.
        self.recorded: list[bytes] | None = [] if is_recorded else None
        self._access = access
        self._open_access = open_access
        self._is_near = is_near
        self._heard: dict[Peer, GroundStation] = {}  # in order of arrival
        #: Configured stations, and connections, that have not sent a frame.
        self._unheard: dict[Peer, GroundStation] = {}
        #: Stations that have not shown that they receive anything.
        self._unproven: dict[Peer, GroundStation] = {}
        #: The vehicle's ids and last heartbeat: all that such a station gets.
        self._heartbeat: tuple[tuple[int, int], Packed] | None = None
        self._default_peers: dict[Peer, bool] = {}
        self._budgets = Budgets()
        #: Frames to be sent.
        self.outgoing: defaultdict[GroundStation, list[bytes]] = defaultdict(list)
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
        return self._heard.get(peer) or self._unheard.get(peer) or self._unproven.get(peer)

    def is_connected(self, peer: Peer) -> bool:
        return peer in self._heard

    def speaker(self, station: Station) -> Speaker:
        """The sender with the station's ids; an empty one if its address has too many to remember."""
        there = self._heard.get(station.peer) or self.station(station.peer)
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
        for stations in (self._unheard, self._heard, self._unproven):
            stations.pop(peer, None)
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
        for peer, station in [*self._unproven.items()]:
            if now >= station.heard_at + _UNPROVEN_S:
                del self._unproven[peer]
        self.due = now + _EXPIRY_INTERVAL_S if self._heard or self._unproven else inf

    def _leaves(self, station: GroundStation) -> None:
        self.gone(station.peer)
        self._emit(GcsSilent(peer=str(station.peer)))

    def _made(self, peer: Peer, *, is_connection: bool = False) -> GroundStation:
        access = self._access.get(peer.link, self._open_access)
        return GroundStation(peer, access, *self._ids, self._budgets.of(peer.host) if is_connection else None)

    # Received from them.

    def sender(self, peer: Peer, size: int, now: float, *, datagram: bool) -> GroundStation | None:
        """The sender of a read or a datagram; None if it sends too many. A new one is remembered when it is admitted.

        The address of a datagram may be made up, unlike that of a connection.
        """
        station = self._heard.get(peer) or self.station(peer)
        if station is None:
            station = self._made(peer, is_connection=not datagram)
            if not datagram:
                self._unheard[peer] = station
            elif isinstance(peer.key, tuple):
                station.return_path = ReturnPath(is_near=self._is_near(str(peer.host)))
        if station.return_path is not None:
            station.return_path.received(size)
        if station.budget is None:
            return station if self._budgets.totals[Cost.RECEIVED].take(now) else None
        return station if station.budget.allows(Cost.RECEIVED, now, is_proven=True) else None

    def split(self, station: GroundStation, data: bytes, *, datagram: bool) -> list[MavlinkFrame]:
        """Parse bytes from a station into frames. A datagram holds whole frames only."""
        splitter = station.splitter
        bad_before = splitter.bad_frames
        frames = [*map(MavlinkFrame, splitter.split(data, is_end=datagram))]
        self.bad_frames += splitter.bad_frames - bad_before
        return frames

    def admits(self, station: GroundStation, now: float) -> bool:
        """False if a station's first frame must be ignored, because it comes from one of too many new addresses."""
        station.budget = self._budgets.of(station.peer.host)
        path = station.return_path
        return station.has_key or station.allows(
            Cost.CONTACT if path is None or path.is_near else Cost.FAR_CONTACT, now
        )

    def heard(self, station: GroundStation, frame: MavlinkFrame, sender: tuple[int, int], now: float) -> bool:
        """Note a frame from a station. False if it must first show that it receives what is sent to it.

        On an own network it is answered meanwhile, but gets no telemetry.
        """
        path, peer = station.return_path, station.peer
        is_new = station.heard(frame, sender, now)
        if peer in self._heard:
            if is_new:
                self._on_newcomer(station, now)
            return True
        is_proven = path is None or station.has_key or path.is_proven_by(frame)
        if is_proven and (station.has_key or station.allows(Cost.ARRIVAL, now)):
            self._joins(station, Station(peer, *sender), now)
            return True
        if path is None:
            return True
        self._unproven[peer] = station
        self.due = min(self.due, now + _EXPIRY_INTERVAL_S)
        self._ask(station, path)
        return path.is_near

    def _joins(self, station: GroundStation, name: Station, now: float) -> None:
        if len(self._heard) >= MAX_STATIONS:
            self._leaves(min(self._heard.values(), key=lambda each: (each.standing is Standing.PROVEN, each.heard_at)))
        for stations in (self._unheard, self._unproven):
            stations.pop(station.peer, None)
        station.return_path = None
        self._heard[station.peer] = station
        self._everyone = None
        self.due = min(self.due, now + _EXPIRY_INTERVAL_S)
        self._on_newcomer(station, now)
        self._emit(GcsFound(station=str(name)))
        for notice in self.notices:
            self.say(Severity.WARNING, notice, name)

    def show_heartbeat(self, heartbeat: Packed, ids: tuple[int, int] | None = None) -> None:
        """Keep the vehicle's last heartbeat for stations that have just been heard. `ids`: of an autopilot."""
        self._heartbeat = ids or self._ids, heartbeat

    def _ask(self, station: GroundStation, path: ReturnPath) -> None:
        """Reply to a datagram with the vehicle's heartbeat and a question that only its address gets."""
        if self._heartbeat is None or station in self.outgoing:
            return
        ids, heartbeat = self._heartbeat
        writer = station.writer if ids == self._ids else FrameWriter(*ids, station.sign)
        self.outgoing[station].append(writer.frame(heartbeat, 2))
        if (question := path.question()) is not None:
            self.outgoing[station].append(writer.frame(pack(question), 2))
        elif path.is_near and not station.reads_v2_only:
            self.outgoing[station].append(writer.frame(heartbeat, 1))

    def record(self, station: GroundStation, frame: MavlinkFrame) -> None:
        if self.recorded is not None and not station.is_listener and station.allows(Cost.RECORDED):
            self.recorded.append(frame.raw)

    def allows(self, station: Station, cost: Cost) -> bool:
        """Count work that a ground station causes; False if that exceeds its limit."""
        sender = self._heard.get(station.peer) or self.station(station.peer)
        return sender is not None and sender.allows(cost)

    def not_written(self, station: Station) -> None:
        """Take back a write: the flash held the same already, or the flight controller refused."""
        if (sender := self.station(station.peer)) is not None:
            sender.give_back(Cost.FLASH)

    def record_flight(self, *, on: bool) -> None:
        """Log everything that a connected ground station would get, even if there is none."""
        if on:
            self.add_default_peer(RECORDER, until_answered=False)
        else:
            self.remove_default_peer(RECORDER)

    # Wi-Fi roaming.

    def moved_to(self, station: Station, now: float) -> list[Station]:
        """The new addresses of a station that fell silent at its old one: usually none."""
        old = self.station(station.peer)
        if old is None or now < old.heard_at + _STILL_S:
            return []
        return [where for where in self.elsewhere(station) if self.has_moved(station, where, now)]

    def elsewhere(self, station: Station) -> list[Station]:
        """Other addresses where these ids were heard."""
        ids = station.sysid, station.compid
        everywhere = (*self._heard.items(), *self._unproven.items())
        others = (peer for peer, there in everywhere if ids in there.speakers and peer != station.peer)
        return [Station(peer, *ids) for peer in others]

    def has_moved(self, station: Station, to: Station, now: float) -> bool:
        """True if `to` is the new address of a station that fell silent at its old one.

        This excludes a second station with the same ids, heard earlier or alongside the first.
        """
        ids = station.sysid, station.compid
        old, new = self.station(station.peer), self.station(to.peer)
        if old is None or new is None or old is new or ids != (to.sysid, to.compid):
            return False
        return (
            now >= old.heard_at + _STILL_S
            and new.peer.link == old.peer.link
            and new.is_listener == old.is_listener
            and ids in new.speakers
            and new.came_at >= old.heard_at
        )

    # Messages to stations.

    def take_datagrams(self) -> Datagrams:
        """The datagrams to send; those of one station are in order."""
        datagrams = Datagrams()
        for station, frames in self.outgoing.items():
            if station.return_path is not None:
                frames = [*filter(station.return_path.allows, frames)]
            together = b"".join(frames)
            if len(together) <= MAX_DATAGRAM_SIZE:
                datagrams.append((station.peer, together))
            else:
                datagrams += ((station.peer, datagram) for datagram in _in_datagrams(frames, together))
        self.outgoing.clear()
        return datagrams

    def to(self, station: Station, *together: Message) -> None:
        """Send messages in one datagram to one ground station, unless it has left."""
        receiver = self._heard.get(station.peer) or self.station(station.peer)
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
        self._send(receiver, FrameWriter(*ids, receiver.sign), [message])

    def _send(self, receiver: GroundStation, writer: FrameWriter, together: Iterable[Message]) -> None:
        version, frames = receiver.frame_version, []
        for message in together:  # a loop: a comprehension is a call
            frames.append(writer.frame(pack(message), version))  # noqa: PERF401
        self.outgoing[receiver] += frames
        if self.recorded is not None and not receiver.is_listener:
            self.recorded += frames

    def broadcast(self, message: Message) -> None:
        self.multicast(pack(message), self.everyone())

    def multicast(self, packed: Packed, stations: Iterable[GroundStation]) -> None:
        """Send a packed message to several stations that can read it."""
        frame = None
        # A flight is logged at the default rates, independent of the stations' requests.
        is_logged = RECORDER not in self._default_peers
        for station in stations:
            if station.frame_version == 1 and packed.is_v2_only:
                continue
            frame = station.writer.frame(packed, station.frame_version)
            if station.peer is RECORDER:
                is_logged = True
            else:
                self.outgoing[station].append(frame)
        if self.recorded is not None and frame is not None and is_logged:
            self.recorded.append(frame)

    def beat(self, heartbeat: Message, stations: Iterable[GroundStation]) -> None:
        """Send the heartbeat in MAVLink 2, then in MAVLink 1 too, to stations that have not sent MAVLink 2.

        QGroundControl talks to the vehicle in the version of the first frame that it gets, and a ground station that
        knows only MAVLink 1 would not see the vehicle otherwise. Signed links need no MAVLink 1.
        """
        packed = pack(heartbeat)
        self.show_heartbeat(packed)
        logged: bytes | None = None
        for station in stations:
            frames = [station.writer.frame(packed, version) for version in ((2,) if station.reads_v2_only else (2, 1))]
            logged = logged or frames[0]
            if station.peer is not RECORDER:
                self.outgoing[station] += frames
        if self.recorded is not None and logged is not None:
            self.recorded.append(logged)

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
        recorder = None if self.recorded is None else self.station(RECORDER)
        if stations and recorder is not None and recorder not in stations:
            stations = [*stations, recorder]  # the log also has the texts for one station
        self._text_id = self._text_id % _MAX_TEXT_ID + 1
        others: list[GroundStation] = []
        joining: list[GroundStation] = []
        for station in stations:
            (joining if station.is_like_mavsdk else others).append(station)
        if joining:
            # MAVSDK joins the pieces without a separator, and shows padding as a gap.
            self._send_pieces(severity, cut_text(text), joining)
        if others:
            self._send_pieces(severity, split_text(text), others)

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
            self.outgoing[station] += frames


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
