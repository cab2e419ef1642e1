"""The bridge as a whole: one flight controller on one side, ground stations on the other. Sans-IO.

The service feeds bytes, time and the store's answers in, and afterwards takes what is to be sent, stored and said.
A byte's way from the UART:
    fc_received -> FcSession -> MspLink -> VehicleState -> vehicle_messages -> take_datagrams
A mission item's way to the flight controller, and back for the proof:
    gcs_received -> MissionUploads -> MissionCheck -> MissionDesk.deliver -> HarakiriMissions.push -> MspLink
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from bridge import vehicle_messages
from bridge.commands import Commands
from bridge.fc_session import FcSession
from bridge.flight_controller import FlightController
from bridge.harakiri import HarakiriMissions
from bridge.inbox import Inbox
from bridge.journal import Journal
from bridge.mission_check import check_list
from bridge.mission_desk import Delivery, HeldMission, MissionDesk, Refusal
from bridge.mission_dialect import MissionDialect, StoreReport
from bridge.mission_download import MissionDownloads
from bridge.mission_log import ArrivedMission
from bridge.mission_upload import MissionUploads
from bridge.parameters import Parameters
from bridge.procedure import Procedure, StoreEffect
from bridge.runner import Runner
from bridge.station import Peer, Severity, Station
from bridge.stations import Stations
from protocols.mavlink.codec import MavlinkDecoder, MavlinkEncoder
from protocols.mavlink.dialect import Message, messages
from protocols.mavlink.frame import MavlinkSplitter
from protocols.mission_item import MissionItem

_HEARTBEAT_INTERVAL_S = 1.0
_TEXT_SIZE = 50


@dataclass(frozen=True, slots=True)
class BridgeConfig:
    """How one bridge is set up. `speeds`: what the port may run at, (None,) where it has no speed."""

    speeds: Sequence[int | None]
    sysid: int = 1
    compid: int = 1
    takeoff_max_m: int = 15


class Bridge:
    """Implements `Post` for its own parts."""

    def __init__(self, config: BridgeConfig, journal: Journal, now: float) -> None:
        self._config = config
        self._journal = journal
        self._started_at = now
        self._stations = Stations()
        self._default_peers: dict[Peer, bool] = {}
        self._splitters: dict[Peer, MavlinkSplitter] = {}
        self._decoder = MavlinkDecoder()
        self._encoder = MavlinkEncoder(config.sysid, config.compid)
        self._datagrams: list[tuple[Peer, bytes]] = []
        self._store_effects: list[StoreEffect] = []
        self._heartbeat_due = now
        self._now = now
        self._was_armed = False
        self._announced_home: tuple[int, int] | None = None

        self.runner = Runner(self._store_effects.append)
        self.session = FcSession(config.speeds, self.runner, journal, self._controller_changed)
        self.desk = MissionDesk()
        self._uploads = MissionUploads(self.desk, self.runner, self, journal, self._home)
        self._downloads = MissionDownloads(self.desk, self.runner, self, self._is_armed, self._home)
        parameters = Parameters(self.desk, self.runner, self, config.sysid)
        commands = Commands(self, self._on_demand(), self._banner)
        self._inbox = Inbox(self, self._uploads, self._downloads, parameters, commands)

    # The flight controller's side.

    @property
    def speed(self) -> int | None:
        """Return what the port must be set to, baud."""
        return self.session.speed

    def fc_opened(self, now: float) -> None:
        """Take note that the port is open."""
        self._now = now
        self.session.opened(now)

    def fc_closed(self, now: float, why: str) -> None:
        """Take note that the port is gone."""
        self._now = now
        self.session.closed(now, why)

    def fc_received(self, data: bytes, now: float) -> None:
        """Take bytes from the port."""
        self._now = now
        self.session.received(data, now)
        armed = self.session.vehicle.armed
        if armed is None or armed == self._was_armed:
            # What is not known is no change: a Harakiri that arms may fall silent first.
            return
        if armed:
            self._uploads.armed(now)
        self._journal("info", "vehicle.armed" if armed else "vehicle.disarmed")
        self._was_armed = armed

    def take_fc_output(self) -> list[bytes]:
        """Return what is to be written to the port at the present `speed`."""
        return self.session.take_output()

    # The ground stations' side.

    def add_default_peer(self, peer: Peer, *, until_answered: bool) -> None:
        """Send to `peer` before it was heard; `until_answered`: only while nobody is heard on its link (broadcast)."""
        self._default_peers[peer] = until_answered

    def remove_default_peer(self, peer: Peer) -> None:
        """Stop that."""
        self._default_peers.pop(peer, None)

    def gcs_received(self, peer: Peer, data: bytes, now: float, *, datagram: bool) -> None:
        """Take bytes from a ground station. A datagram holds whole frames only."""
        self._now = now
        splitter = self._splitters.get(peer)
        if splitter is None:
            splitter = MavlinkSplitter()
            if not datagram:
                self._splitters[peer] = splitter
        frames = splitter.feed(data)
        if datagram:
            frames += splitter.reset()
        for frame in frames:
            if frame.sysid == self._config.sysid:
                continue
            if not self._stations.heard(peer, frame.version, now):
                if not self._stations.add(peer, frame.version, now):
                    return
                self._journal("info", "gcs.found", station=str(Station(peer, frame.sysid, frame.compid)))
                # Who comes later must hear of home, too.
                self._announced_home = None
            if not self._inbox.understands(frame.msgid):
                continue
            message = self._decoder.decode(frame)
            if message is not None and self._is_for_us(message):
                self._inbox.take(Station(peer, frame.sysid, frame.compid), message, now)

    def gcs_gone(self, peer: Peer, now: float) -> None:
        """A ground station's connection is closed."""
        self._now = now
        self._uploads.peer_gone(peer, now)
        self._stations.gone(peer)
        self._splitters.pop(peer, None)

    def peers(self) -> list[Peer]:
        """Return the ground stations that are there."""
        return self._stations.peers()

    def take_datagrams(self) -> list[tuple[Peer, bytes]]:
        """Return what is to be sent to ground stations, in order, one frame each."""
        datagrams, self._datagrams = self._datagrams, []
        return datagrams

    def to(self, station: Station, message: Message) -> None:
        """Send a message to one ground station."""
        version = self._stations.version(station.peer)
        self._datagrams.append((station.peer, self._encoder.encode(message, version)))

    def say(self, severity: Severity, text: str) -> None:
        """Show a text on every ground station, in pieces that fit STATUSTEXT."""
        self._journal("debug", "gcs.text", text=text)
        for piece in split_text(text):
            self._broadcast(messages.MAVLink_statustext_message(severity, piece.encode("ascii", "replace")))

    # The store.

    def take_store_effects(self) -> list[StoreEffect]:
        """Return what is to be done in the store; each is answered by `store_answered`."""
        effects = self._store_effects[:]
        self._store_effects.clear()
        return effects

    def store_answered(self, answer: object, now: float) -> None:
        """Take the store's answer."""
        self._now = now
        self.runner.store_answered(answer, now)

    # The command line's side.

    def push_locally(
        self,
        items: Sequence[MissionItem],
        source: str,
        on_progress: Callable[[int], None],
        on_done: Callable[[Delivery | Refusal, ArrivedMission | None], None],
        now: float,
    ) -> None:
        """Do what an upload by a ground station does, with a list that is all there. No items: clear."""
        self._now = now
        owner = object()
        refusal = self.desk.acquire(owner)
        if refusal is not None:
            on_done(refusal, None)
            return
        arrived: list[ArrivedMission] = []

        def procedure() -> Procedure[Delivery | Refusal]:
            report: StoreReport | Refusal = yield from self.desk.preflight()
            if isinstance(report, Refusal):
                return report
            verdict = check_list(items, report.profile, self._home())
            arrived.append(ArrivedMission(source, tuple(items), verdict))
            return (yield from self.desk.deliver(arrived[0], on_progress))

        def done(result: Delivery | Refusal, _at: float) -> None:
            self.desk.release(owner)
            if arrived and isinstance(result, Delivery):
                self.say(Severity.NOTICE, f"{source}: {result.text}")
            on_done(result, arrived[0] if arrived else None)

        self.runner.start(procedure(), done, now)

    def pull_locally(self, on_done: Callable[[HeldMission | Refusal], None], now: float) -> None:
        """Read what the flight controller holds."""
        self._now = now
        self.runner.start(self.desk.read_back(), lambda held, _at: on_done(held), now)

    # Time.

    def tick(self, now: float) -> None:
        """Do what is due."""
        self._now = now
        self.session.tick(now)
        self.runner.tick(now)
        self._uploads.tick(now)
        if now >= self._heartbeat_due:
            self._heartbeat_due = max(self._heartbeat_due + _HEARTBEAT_INTERVAL_S, now)
            self._every_second(now)

    def next_deadline(self) -> float:
        """Return when `tick` has something to do."""
        deadlines = (
            self.session.next_deadline(),
            self.runner.next_deadline(),
            self._uploads.next_deadline(),
            self._heartbeat_due,
        )
        return min(deadline for deadline in deadlines if deadline is not None)

    def _every_second(self, now: float) -> None:
        for peer in self._stations.expire(now):
            self._splitters.pop(peer, None)
            self._journal("info", "gcs.silent", peer=str(peer))
        vehicle = self.session.vehicle
        heartbeat = vehicle_messages.heartbeat(vehicle, linked=self.session.controller is not None)
        self._broadcast(heartbeat)
        self._introduce(heartbeat)
        boot_ms = self._boot_ms()
        for message in (
            vehicle_messages.sys_status(vehicle),
            vehicle_messages.battery_status(vehicle),
            vehicle_messages.attitude(vehicle, boot_ms),
            vehicle_messages.gps_raw_int(vehicle, boot_ms),
            vehicle_messages.global_position_int(vehicle, boot_ms),
            self._mission_current(),
            self._changed_home(),
        ):
            if message is not None:
                self._broadcast(message)

    def _changed_home(self) -> Message | None:
        """HOME_POSITION whenever it is another one; who asks gets it at any time."""
        home = self._home()
        if home == self._announced_home:
            return None
        self._announced_home = home
        return vehicle_messages.home_position(home)

    def _introduce(self, heartbeat: Message) -> None:
        """Send the heartbeat in the other MAVLink version too, where it is not known which one is understood.

        A ground station of MAVLink 1 only would not see the vehicle otherwise; Mission Planner speaks MAVLink 1
        until it has seen MAVLink 2.
        """
        for peer in self._everyone():
            other = 1 if self._stations.is_unknown(peer) else 2
            if self._stations.version(peer) != other:
                self._datagrams.append((peer, self._encoder.encode(heartbeat, other)))

    def _broadcast(self, message: Message) -> None:
        frames: dict[int, bytes] = {}
        for peer in self._everyone():
            version = self._stations.version(peer)
            if version not in frames:
                frames[version] = self._encoder.encode(message, version)
            self._datagrams.append((peer, frames[version]))

    def _everyone(self) -> list[Peer]:
        heard = self._stations.peers()
        answered = {peer.link for peer in heard}
        unheard = (
            peer
            for peer, until_answered in self._default_peers.items()
            if peer not in heard and not (until_answered and peer.link in answered)
        )
        return [*heard, *unheard]

    def _is_for_us(self, message: Message) -> bool:
        system = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        return system in (0, self._config.sysid) and component in (0, self._config.compid)

    def _controller_changed(self, controller: FlightController | None, now: float) -> None:
        dialect: MissionDialect | None = None
        if controller is not None and controller.info is not None:
            dialect = HarakiriMissions(controller.info, self._config.takeoff_max_m)
        self.desk.controller_changed(controller, dialect)
        self._downloads.forget_all()
        if controller is None:
            self._uploads.link_lost(now)
            self.say(Severity.WARNING, "Flight controller lost")
        else:
            self.say(Severity.INFO, f"Found {controller.name}")
        if dialect is not None:
            # What it holds is known from the start: MISSION_CURRENT counts it, a first Read is answered at once.
            self.runner.start(self.desk.read_back(), lambda _held, _at: None, now)

    def _home(self) -> tuple[int, int] | None:
        return self.session.vehicle.home_or_position()

    def _is_armed(self) -> bool | None:
        return self.session.vehicle.armed

    def _boot_ms(self) -> int:
        return int((self._now - self._started_at) * 1000) & 0xFFFFFFFF

    def _banner(self) -> str:
        controller = self.session.controller
        return f"naze-bridge: {controller.name if controller else 'no flight controller'}"

    def _mission_current(self) -> Message:
        held = self.desk.held
        return vehicle_messages.mission_current(0 if held is None else held.identity.count)

    def _on_demand(self) -> dict[int, Callable[[], Message | None]]:
        return {
            messages.MAVLINK_MSG_ID_AUTOPILOT_VERSION: vehicle_messages.autopilot_version,
            messages.MAVLINK_MSG_ID_HOME_POSITION: lambda: vehicle_messages.home_position(self._home()),
            messages.MAVLINK_MSG_ID_MISSION_CURRENT: self._mission_current,
            messages.MAVLINK_MSG_ID_SYS_STATUS: lambda: vehicle_messages.sys_status(self.session.vehicle),
        }


def split_text(text: str) -> list[str]:
    """Split at spaces into pieces of at most 50 characters."""
    pieces: list[str] = []
    while len(text) > _TEXT_SIZE:
        cut = text.rfind(" ", 1, _TEXT_SIZE + 1)
        cut = cut if cut > 0 else _TEXT_SIZE
        pieces.append(text[:cut])
        text = text[cut:].lstrip()
    return [*pieces, text]
