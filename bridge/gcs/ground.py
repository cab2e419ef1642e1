# SPDX-License-Identifier: GPL-3.0-or-later
"""All ground stations: who is connected, and where. Sans-IO."""

from collections.abc import Callable, Mapping, Sequence
from math import inf

from bridge.gcs.budget import Budgets, Cost
from bridge.gcs.ground_station import GroundStation, Outbox, Sender
from bridge.gcs.return_path import ReturnPath
from bridge.gcs.rights import LinkAccess, Standing
from bridge.gcs.station import RECORDER, Peer
from bridge.model.events import Emit, GcsFound, GcsSilent
from bridge.voice.happening import Happening
from protocols.mavlink.codec import FrameWriter, pack
from protocols.mavlink.dialect import Message
from protocols.mavlink.frame import MavlinkFrame

#: A UDP station that is silent for this long has left. A TCP station leaves with the connection.
_EXPIRY_S = 60.0
#: This time applies to a station that has not shown that it receives anything.
_UNPROVEN_S = 5.0
#: Stations with a copy of the telemetry.
MAX_STATIONS = 32
#: A station that is silent for this long, three heartbeats, makes room for a newcomer without proven rights.
_ROOM_S = 3.0
#: A connected station, whether or not it transfers a mission, is never silent for this long.
_STILL_S = 1.0
#: The interval between searches for silent stations.
_EXPIRY_INTERVAL_S = 1.0


class Ground:
    """The ground stations. `on_newcomer` is called for one that is new or returns after a silence.

    `access`: the rules of each link. A link without rules is `open_access`. A station that may only read gets telemetry
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
        self.ids = sysid, compid
        self._emit = emit
        self._on_newcomer = on_newcomer
        self.outbox = Outbox(emit, is_recorded=is_recorded)
        self._access = access
        self._open_access = open_access
        self._is_near = is_near
        self._heard: dict[Peer, GroundStation] = {}  # in order of arrival
        #: Configured stations, and connections, that have not sent a frame.
        self._unheard: dict[Peer, GroundStation] = {}
        #: Stations that have not shown that they receive anything.
        self._unproven: dict[Peer, GroundStation] = {}
        self._default_peers: dict[Peer, bool] = {}
        self._budgets = Budgets()
        self.due = inf
        #: Texts for each newcomer, about problems that began before it connected.
        self.notices: list[Happening] = []
        #: Frames from ground stations whose checksum was wrong.
        self.bad_frames = 0
        #: All stations that receive broadcasts.
        self.everyone: Sequence[GroundStation] = ()

    # The connected stations.

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        """Send to `peer` before it is heard. `until_answered`: only while no peer is heard on the link (broadcast)."""
        self._default_peers[peer] = until_answered
        if self.station(peer) is None:
            self._unheard[peer] = self._made(peer)
        self._has_changed()

    def remove_default_peer(self, peer: Peer) -> None:
        self._default_peers.pop(peer, None)
        self._unheard.pop(peer, None)
        self._has_changed()

    def station(self, peer: Peer) -> GroundStation | None:
        return self._heard.get(peer) or self._unheard.get(peer) or self._unproven.get(peer)

    def is_connected(self, peer: Peer) -> bool:
        return peer in self._heard

    def peers(self) -> list[Peer]:
        """The peers that were heard, in order of arrival."""
        return list(self._heard)

    def _has_changed(self) -> None:
        """Find the stations that receive broadcasts again."""
        answered = {peer.link for peer in self._heard}
        unheard = (
            station
            for peer, station in self._unheard.items()
            if (is_until := self._default_peers.get(peer)) is not None and not (is_until and peer.link in answered)
        )
        self.everyone = [*self._heard.values(), *unheard]

    def gone(self, peer: Peer) -> None:
        """Forget a station. A configured station starts from scratch."""
        for stations in (self._unheard, self._heard, self._unproven):
            if (station := stations.pop(peer, None)) is not None:
                station.has_left = True
        if peer in self._default_peers:
            self._unheard[peer] = self._made(peer)
        self._has_changed()

    def tick(self, now: float) -> None:
        for station in [*self._heard.values()]:
            if now >= station.bad_news.due:
                station.say_again(now)
            if now >= station.heard_at + _EXPIRY_S:
                self._leaves(station)
        for peer, station in [*self._unproven.items()]:
            if now >= station.heard_at + _UNPROVEN_S:
                self.gone(peer)
        self.due = now + _EXPIRY_INTERVAL_S if self._heard or self._unproven else inf

    def _leaves(self, station: GroundStation) -> None:
        self.gone(station.peer)
        self._emit(GcsSilent(peer=str(station.peer)))

    def _made(self, peer: Peer, *, is_connection: bool = False) -> GroundStation:
        access = self._access.get(peer.link, self._open_access)
        budget = self._budgets.of(peer.host) if is_connection else None
        return GroundStation(peer, access, *self.ids, self.outbox, budget)

    # Received from them.

    def received(
        self, peer: Peer, data: bytes, now: float, *, datagram: bool
    ) -> tuple[GroundStation, Sequence[MavlinkFrame]] | None:
        """The station that a read or a datagram came from, and the frames, or None if it sends too many.

        A datagram holds whole frames only, and its address may be made up, unlike that of a connection: a new station
        is remembered when it is admitted.
        """
        station = self._heard.get(peer) or self.station(peer)
        if station is None:
            station = self._made(peer, is_connection=not datagram)
            if not datagram:
                self._unheard[peer] = station
            elif isinstance(peer.key, tuple):
                station.return_path = ReturnPath(is_near=self._is_near(str(peer.host)))
        if station.return_path is not None:
            station.return_path.received(len(data))
        if station.budget is None:
            if not self._budgets.totals[Cost.RECEIVED].take(now):
                return None
        elif not station.budget.allows(Cost.RECEIVED, now, is_proven=True):
            return None
        splitter = station.splitter
        bad_before = splitter.bad_frames
        frames = [*map(MavlinkFrame, splitter.split(data, is_end=datagram))]
        self.bad_frames += splitter.bad_frames - bad_before
        return station, frames

    def admits(self, station: GroundStation, now: float) -> bool:
        """False if a station's first frame must be ignored, because it comes from one of too many new addresses."""
        station.budget = self._budgets.of(station.peer.host)
        path = station.return_path
        return station.has_key or station.allows(
            Cost.CONTACT if path is None or path.is_near else Cost.FAR_CONTACT, now
        )

    def heard(self, station: GroundStation, frame: MavlinkFrame, ids: tuple[int, int], now: float) -> Sender | None:
        """Note a frame, and find the sender. Returns None if that must first show that it receives what is sent to it.

        On an own network it is answered meanwhile, but does not get telemetry.
        """
        path, peer = station.return_path, station.peer
        sender = station.heard(frame, ids, now)
        if peer in self._heard:
            if station.is_back:
                self._on_newcomer(station, now)
            return sender
        is_proven = path is None or station.has_key or path.is_proven_by(frame)
        if is_proven and (station.has_key or station.allows(Cost.ARRIVAL, now)) and self._joins(sender, now):
            return sender
        if peer not in self._unheard:
            self._unproven[peer] = station
            self.due = min(self.due, now + _EXPIRY_INTERVAL_S)
        if path is None:
            return sender
        self._ask(station, path)
        return sender if path.is_near else None

    def _joins(self, sender: Sender, now: float) -> bool:
        station = sender.station
        if len(self._heard) >= MAX_STATIONS:
            first = min(self._heard.values(), key=lambda each: (each.standing is Standing.PROVEN, each.heard_at))
            if station.standing is not Standing.PROVEN and now < first.heard_at + _ROOM_S:
                return False
            self._leaves(first)
        for stations in (self._unheard, self._unproven):
            stations.pop(station.peer, None)
        station.return_path = None
        self._heard[station.peer] = station
        self._has_changed()
        self.due = min(self.due, now + _EXPIRY_INTERVAL_S)
        self._on_newcomer(station, now)
        self._emit(GcsFound(station=str(sender)))
        for notice in self.notices:
            sender.say(notice)
        return True

    def _ask(self, station: GroundStation, path: ReturnPath) -> None:
        """Reply to a datagram with the vehicle's heartbeat and a question that only its address gets."""
        outbox = self.outbox
        if outbox.heartbeat is None or station in outbox.outgoing:
            return
        ids, heartbeat = outbox.heartbeat
        writer = station.writer if ids == self.ids else FrameWriter(*ids, station.sign)
        frames = [writer.frame(heartbeat, 2)]
        if (question := path.question()) is not None:
            frames.append(writer.frame(pack(question), 2))
        elif path.is_near and not station.reads_v2_only:
            frames.append(writer.frame(heartbeat, 1))
        outbox.forward(frames, [station])

    def record_flight(self, *, on: bool) -> None:
        """Log everything that a connected ground station would get, even if there is none."""
        if on:
            self.add_default_peer(RECORDER, until_answered=False)
        else:
            self.remove_default_peer(RECORDER)
        self.outbox.recorder = self.station(RECORDER)

    def moved(self, sender: Sender, now: float) -> Sender:
        """The sender at its new address if it is silent at the old one and unknown at the new one before, else itself.

        A second station with the same ids was heard earlier or meanwhile. The new address has proven the same rights.
        """
        old, ids = sender.station, (sender.sysid, sender.compid)
        for new in (*self._heard.values(), *self._unproven.values()) if now >= old.heard_at + _STILL_S else ():
            is_same = new.peer.link == old.peer.link and new.standing is old.standing and new.return_path is None
            if ids in new.senders and is_same and new is not old and new.came_at >= old.heard_at:
                return new.senders[ids]
        return sender

    def broadcast(self, message: Message) -> None:
        self.outbox.multicast(pack(message), self.everyone)

    def say(self, happening: Happening, *, but: GroundStation | None = None) -> None:
        """Show a happening on all ground stations, except one that knows it."""
        readers = [station for station in self.everyone if not station.is_listener and station is not but]
        self.outbox.show(happening, readers)
