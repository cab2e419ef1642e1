# SPDX-License-Identifier: GPL-3.0-or-later
"""The ground stations' end of slow links to vehicles: missions are received and read here, and cross them as a whole.

A mission over MAVLink takes a round trip for each item. So the receiver of the bridge itself (bridge/transfers) runs
next to the ground station, the whole list goes to the vehicle as one command, and the final ack waits for the result.
Everything else is passed on to the vehicle that it addresses, with new sequence numbers: stations show gaps as a bad
link. Sans-IO.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import Sender
from bridge.gcs.rights import LinkAccess
from bridge.gcs.station import Datagrams, Peer
from bridge.line.conversation import Conversation, Pause
from bridge.line.runner import Runner
from bridge.missions.fc_mission_store import PushProgress, StoreReport, StoreState
from bridge.missions.list_check import ListCheck
from bridge.missions.mission_service import DeliveryResult, HeldMission, MissionService
from bridge.model.events import BridgeEvent
from bridge.model.missions import ARMED, ArrivedMission, Refusal
from bridge.model.vehicle import FlightState, Source, Vehicle
from bridge.transfers.downloads import MissionDownloads
from bridge.transfers.mission_types import ENDS_DOWNLOAD, GUIDED, READS
from bridge.transfers.uploads import MissionUploads, mission_handlers
from bridge.voice import sentences
from protocols.mavlink.codec import decode, repack
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter, is_disarmed_heartbeat
from protocols.mission_item import ListIdentity, MissionItem, MissionResult
from reports.finding import Finding, RejectingFinding, without_defaults
from reports.verdict import Result, Verdict

#: As a mission file in a command (service/zenoh_link/answers.py).
_MOST_ITEMS = 1000
#: How often a conversation checks if the vehicle has replied.
_LOOK_S = 0.02
#: The state's copy of the mission arrives within this time.
_COPY_S = 5.0
_UNKNOWN = Refusal(MissionResult.DENIED, sentences.VEHICLE_UNKNOWN())
#: A ground station's messages about the mission that is on a vehicle.
_MISSION_REQUESTS = frozenset(
    (
        *READS,
        *ENDS_DOWNLOAD,
        m.MAVLINK_MSG_ID_MISSION_ITEM,
        m.MAVLINK_MSG_ID_MISSION_ITEM_INT,
        m.MAVLINK_MSG_ID_MISSION_WRITE_PARTIAL_LIST,
        m.MAVLINK_MSG_ID_MISSION_SET_CURRENT,
    )
)


@dataclass(frozen=True, slots=True)
class WriteResult:
    """The vehicle's reply to a list. `items`: as stored there, None if it was not accepted."""

    ack: MissionResult
    text: str
    findings: Sequence[Finding] = ()
    items: tuple[MissionItem, ...] | None = None


@dataclass(frozen=True, slots=True)
class SendToVehicle:
    """An effect: send a frame to the vehicle."""

    frame: bytes


@dataclass(frozen=True, slots=True)
class WriteList:
    """An effect: have the vehicle write a list, () to clear. The reply is passed to `Relays.wrote`."""

    items: Sequence[MissionItem]


@dataclass(frozen=True, slots=True)
class SameSystem:
    """An effect: a vehicle is left out, because another has the system id."""

    other: str
    system: int


RelayEffect = Datagrams | SendToVehicle | WriteList


class Relay:
    """One vehicle's end of MAVLink's mission protocol, under its ids, for the ground stations.

    Missions are received here once the vehicle's mission is known (`holds`), which shows that it stores missions
    itself. `is_near`: as of Ground.
    """

    def __init__(self, ids: tuple[int, int], is_near: Callable[[str], bool]) -> None:
        self.ids = ids
        self.effects: list[RelayEffect] = []
        self._targets = {(system, component) for system in (0, ids[0]) for component in (0, ids[1])}
        self.ground = Ground(*ids, _ignore, lambda _station, _now: None, {}, LinkAccess(), is_near)
        self._runner = Runner(lambda _effect: None)
        self.missions = _RemoteMissions(Vehicle(), self._runner, self.ground, self.effects)
        self.uploads = MissionUploads(self.missions, self.ground, _ignore)
        self._downloads = MissionDownloads(self.missions, self.ground)
        self._handlers = mission_handlers(self.uploads, self._downloads)

    @property
    def due(self) -> float:
        return min(self._runner.due, self.uploads.due, self.ground.due)

    def tick(self, now: float) -> None:
        for part in (self._runner, self.uploads, self.ground):
            if now >= part.due:
                part.tick(now)

    def vehicle_sent(self, frame: MavlinkFrame, now: float) -> None:
        packed = repack(frame) if frame.sender == self.ids else None
        if packed is None:
            self.ground.outbox.forward([frame.raw], self.ground.everyone)
            return
        if frame.msgid == m.MAVLINK_MSG_ID_HEARTBEAT:
            self.ground.outbox.heartbeat = self.ids, packed
            self.missions.vehicle.hear(FlightState(now, Source.MAVLINK, not is_disarmed_heartbeat(frame)))
        self.ground.outbox.multicast(packed, self.ground.everyone)

    def holds(self, items: tuple[MissionItem, ...] | None, identity: ListIdentity | None) -> None:
        is_known = items is not None and identity is not None
        self.missions.held = HeldMission(identity, (), items) if is_known else None  # type: ignore[arg-type]
        self.missions.is_local = self.missions.is_local or is_known

    def received(self, peer: Peer, data: bytes, now: float, *, datagram: bool) -> None:
        received = self.ground.received(peer, data, now, datagram=datagram)
        if received is None:
            return
        station, frames = received
        for frame in frames:
            if not (station.is_heard or self.ground.admits(station, now)):
                return
            sender = self.ground.heard(station, frame, frame.sender, now)
            if sender is not None and not self._is_answered(sender, frame, now):
                self.effects.append(SendToVehicle(frame.raw))

    def _is_answered(self, sender: Sender, frame: MavlinkFrame, now: float) -> bool:
        handler = self._handlers.get(frame.msgid) if self.missions.is_local else None
        if handler is None or frame.target not in self._targets:
            return False
        message = decode(frame)
        if message is None or getattr(message, "mission_type", 0) != m.MAV_MISSION_TYPE_MISSION:
            return False
        if getattr(message, "current", 0) in GUIDED and not self.uploads.is_writing(sender):
            return False
        if frame.msgid in READS:
            self.uploads.answers.went_on(sender)
            self.uploads.reads(sender, now)
        elif frame.msgid in ENDS_DOWNLOAD:
            self.uploads.answers.went_on(sender)
            self._downloads.forget(sender)
        handler(sender, message, now)
        return True


class _RemoteMissions(MissionService):
    """A mission store at the other end of the link. `is_local`: missions are received here."""

    def __init__(self, vehicle: Vehicle, runner: Runner, ground: Ground, effects: list[RelayEffect]) -> None:
        super().__init__(vehicle, runner, lambda _ended: None)
        self._ground = ground
        self._effects = effects
        self.is_local = self.are_kept = False  # the vehicle keeps them
        self.results: list[WriteResult] = []

    def armed_refusal(self) -> Refusal | None:
        return ARMED if self.vehicle.armed else None

    def preflight(self) -> Conversation[StoreReport | Refusal]:
        yield from ()
        return self.armed_refusal() or StoreReport(StoreState.READY, _AnyRules(), None)

    def deliver(
        self, arrived: ArrivedMission, progress: PushProgress = lambda _records: None, *, is_kept: bool = True
    ) -> Conversation[DeliveryResult]:
        """Have the vehicle check, write and verify the list."""
        verdict = arrived.verdict
        if verdict.result is Result.REJECTED:
            return DeliveryResult(verdict.ack, sentences.REJECTED(verdict.findings[-1].text()), None)
        self.results.clear()
        self._effects.append(WriteList(verdict.items))
        while not self.results:
            yield Pause(_LOOK_S)
        result = self.results.pop()
        is_lossy = any(finding.is_warning for finding in result.findings)
        accepted = sentences.STORED_WITH_LOSSES if is_lossy else sentences.STORED
        why = (accepted if result.ack is MissionResult.ACCEPTED else sentences.REJECTED)(result.text)
        if result.items is not None:
            # Until the vehicle publishes it: Mission Planner may read at once.
            self.held = HeldMission(ListIdentity(len(result.items), 0), (), result.items)
            for finding in without_defaults(result.findings):
                self._ground.say(sentences.CHANGED_ITEM(finding.text()))
        return DeliveryResult(result.ack, why, None)

    def shown(self) -> Conversation[HeldMission | Refusal]:
        """The copy of the vehicle's state."""
        waited_s = 0.0
        while self.held is None and waited_s < _COPY_S:
            yield Pause(_LOOK_S)
            waited_s += _LOOK_S
        return self.held or _UNKNOWN


class _AnyRules:
    """Accepts every list: the vehicle checks it by its own rules."""

    max_items = _MOST_ITEMS
    has_home = True

    def begin(self, count: int, _fallback_home: tuple[int, int] | None) -> ListCheck:
        return _Unchecked(count)


class _Unchecked(ListCheck):
    def __init__(self, count: int) -> None:
        super().__init__(count)
        self._items: list[MissionItem] = []

    def _judge(self, item: MissionItem) -> RejectingFinding | None:
        self._items.append(item)
        return None

    def _refuse_kept_list(self) -> RejectingFinding | None:
        return None

    def _conclude(self) -> Verdict[Any]:
        return Verdict(Result.ACCEPTED, MissionResult.ACCEPTED, items=tuple(self._items))


def _ignore(_event: BridgeEvent) -> None:
    """The vehicle itself logs events."""


class Relays:
    """Vehicles by name. Ground stations know them by system id alone.

    After each input, carry out the effects, and call `tick` at `due`:

    >>> relays.gcs_received(peer, data, now, datagram=True)
    >>> for name, effect in relays.take():
    ...     match effect:
    ...         case SendToVehicle(frame): links[name].write(frame)

    `is_near`: as of Ground.
    """

    def __init__(self, is_near: Callable[[str], bool] = lambda _host: True) -> None:
        self._is_near = is_near
        #: None until it is heard.
        self._vehicles: dict[str, Relay | None] = {}
        self._held: dict[str, tuple[tuple[MissionItem, ...] | None, ListIdentity | None]] = {}
        self._left_out: list[tuple[str, SameSystem]] = []
        self._peers: dict[Peer, bool] = {}
        self._splitters: dict[Peer, MavlinkSplitter] = {}

    def add(self, name: str) -> None:
        self._vehicles[name] = None

    def remove(self, name: str) -> None:
        """Forget a vehicle, for example because it has left."""
        self._vehicles.pop(name, None)
        self._held.pop(name, None)

    @property
    def heard(self) -> set[str]:
        """The vehicles that were heard, without those left out."""
        return set(self._heard)

    @property
    def _heard(self) -> dict[str, Relay]:
        return {name: relay for name, relay in self._vehicles.items() if relay is not None}

    @property
    def due(self) -> float:
        """The time of the next `tick`."""
        return min((relay.due for relay in self._heard.values()), default=inf)

    def tick(self, now: float) -> None:
        for relay in self._heard.values():
            if now >= relay.due:
                relay.tick(now)

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        self._peers[peer] = until_answered
        for relay in self._heard.values():
            relay.ground.add_default_peer(peer, until_answered=until_answered)

    def remove_default_peer(self, peer: Peer) -> None:
        self._peers.pop(peer, None)
        for relay in self._heard.values():
            relay.ground.remove_default_peer(peer)

    def gcs_received(self, peer: Peer, data: bytes, now: float, *, datagram: bool) -> None:
        """Handle bytes from a ground station: frames for one vehicle, and those for all, such as heartbeats."""
        frames = (MavlinkSplitter() if datagram else self._splitters.setdefault(peer, MavlinkSplitter())).feed(data)
        for relay in self._heard.values():
            own = [frame.raw for frame in frames if self._addresses(frame, relay)]
            if own:
                relay.received(peer, b"".join(own), now, datagram=datagram)

    def gcs_gone(self, peer: Peer, now: float) -> None:
        self._splitters.pop(peer, None)
        for relay in self._heard.values():
            relay.uploads.peer_gone(peer, now)
            relay.ground.gone(peer)

    def vehicle_received(self, name: str, data: bytes, now: float) -> None:
        """Pass on whole frames of a vehicle."""
        for frame in MavlinkSplitter().feed(data):
            if name not in self._vehicles:
                return
            relay = self._vehicles[name] or self._begin(name, frame.sender)
            if relay is not None:
                relay.vehicle_sent(frame, now)

    def _begin(self, name: str, ids: tuple[int, int]) -> Relay | None:
        other = next((each for each, relay in self._heard.items() if relay.ids[0] == ids[0]), None)
        if other is not None:
            self.remove(name)
            self._left_out.append((name, SameSystem(other, ids[0])))
            return None
        relay = self._vehicles[name] = Relay(ids, self._is_near)
        for peer, until_answered in self._peers.items():
            relay.ground.add_default_peer(peer, until_answered=until_answered)
        relay.holds(*self._held.get(name, (None, None)))
        return relay

    def holds(self, name: str, items: tuple[MissionItem, ...] | None, identity: ListIdentity | None) -> None:
        """The vehicle's mission has changed, or None if it is not known."""
        if name in self._vehicles:
            self._held[name] = items, identity
        if (relay := self._vehicles.get(name)) is not None:
            relay.holds(items, identity)

    def wrote(self, name: str, result: WriteResult) -> None:
        """The vehicle has replied to a WriteList."""
        if (relay := self._vehicles.get(name)) is not None:
            relay.missions.results.append(result)

    def take(self) -> list[tuple[str, RelayEffect | SameSystem]]:
        """What is to be done since the last call, by vehicle."""
        taken: list[tuple[str, RelayEffect | SameSystem]] = []
        for name, relay in self._heard.items():
            if relay.ground.outbox.outgoing:
                relay.effects.append(relay.ground.outbox.take())
            taken += [(name, effect) for effect in relay.effects]
            relay.effects.clear()
        taken += self._left_out
        self._left_out.clear()
        return taken

    def _addresses(self, frame: MavlinkFrame, relay: Relay) -> bool:
        system, _ = frame.target
        if len(self._vehicles) == 1:
            return True
        if system == 0:
            # A mission belongs to one vehicle: to clear those of all could only be a mistake.
            return frame.msgid not in _MISSION_REQUESTS
        return relay.ids[0] == system
