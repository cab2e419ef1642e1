# SPDX-License-Identifier: GPL-3.0-or-later
"""The running bridge: the links to ground stations, the store and the clock, on one event loop."""

import asyncio
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from math import inf
from typing import Any, TypeVar

import structlog

from bridge.bridge import Bridge
from bridge.config import BridgeConfig
from bridge.effects import PublishGroups, RecordFrames, RememberFlight, SendToBoard
from bridge.fc.states.searching import SPEEDS
from bridge.gcs.rights import LinkAccess
from bridge.gcs.station import Datagrams, Peer
from bridge.line.conversation import Conclude, FindPending, NoteReader, Recall, Save, StoreEffect
from bridge.missions.mission_service import DeliveryResult, MissionEnded
from bridge.model.events import Armed, BridgeEvent, Disarmed, FcFound, FcInCommandLine, FcLost, PortLost
from bridge.model.missions import ArrivedMission
from bridge.model.settings import TakenBackup
from bridge.model.vehicle import GpsTime
from payloads.mission_data import Json
from reports.vehicle_groups import Group, VehicleReport
from service.daemon.client import ControlError
from service.daemon.fc_connection import FcConnection, Traffic
from service.daemon.kept_state import FlightFile, LastSettings
from service.daemon.store_worker import StoreWorker
from service.links.gcs_links import GcsLink, open_link
from service.links.msp_share import open_share
from service.links.signing_state import SigningState
from service.machine import event_loop
from service.machine.host import Host
from service.machine.log_setup import warn_once
from service.machine.own_networks import OwnNetworks
from service.machine.package import page, version
from service.machine.raspberry_pi import SYNCHRONIZED, clock_trouble, is_clock_set
from service.recording.tlog_recorder import TLOG_FOLDER, TlogRecorder
from service.settings import Settings
from service.settings.addresses import AutoFc, FcAddress, GcsAddress, SerialFc
from storage.os_error import reason

#: Timeouts of a stop: for a push to finish, for the abort, for the store. Together they stay within 2 s.
_FINISH_S = 1.0
_ABORT_S = 0.6
_STORE_TIMEOUT_S = 0.2
_REST_INTERVAL_S = 0.02
#: Frames are accepted over zenoh only if its transport is authenticated, or the owner waived that.
_ZENOH = {"zenoh": LinkAccess(may_write=lambda _peer: True)}
_WHO_MAY_WRITE = f"anyone on this network can change missions and parameters; to restrict it: {page('docs/signing.md')}"

T = TypeVar("T")
_log = structlog.get_logger()


class Follower:
    """A part of this process that follows the daemon's events. The methods must not block."""

    def telemetry(self, groups: frozenset[Group]) -> None:
        """New values in these groups, which were requested with `Bridge.watch`."""

    def happened(self, event: BridgeEvent) -> None:
        """An event, which is also logged."""

    def mission_ended(self, mission: ArrivedMission, delivery: DeliveryResult) -> None:
        """A received mission was completed or rejected."""

    def status(self) -> Json:
        """The follower's part of `naze-bridge status`."""
        return {}


class GcsConnections:
    """Feeds the links' bytes to the bridge. Implements service.links.gcs_events.GcsEvents.

    `flush` carries out the bridge's effects.
    """

    def __init__(self, bridge: Bridge, traffic: Mapping[str, Traffic], flush: Callable[[], None]) -> None:
        self._bridge = bridge
        self._traffic = traffic
        self._flush = flush
        self._loop = asyncio.get_running_loop()
        #: The open links, by name.
        self.links: dict[str, GcsLink] = {}
        self.is_connected = bridge.is_connected
        self.add_default_peer = bridge.add_default_peer
        self.remove_default_peer = bridge.remove_default_peer

    def open(self, address: GcsAddress) -> None:
        """Open a link. Raises LinkError if that fails."""
        self.add(open_link(address, self))

    def add(self, link: GcsLink) -> None:
        self.links[link.name] = link

    def close(self) -> None:
        for link in self.links.values():
            link.close()

    def gcs_data(self, peer: Peer, data: bytes, *, datagram: bool) -> None:
        self._traffic[peer.link].bytes_received += len(data)
        try:
            if not self._bridge.gcs_received(peer, data, self._loop.time(), datagram=datagram):
                return
        except Exception:
            # A ground station must not be able to reset the flight controller's line: only the data is dropped.
            _log.exception("gcs.fault", peer=str(peer))
        self._flush()

    def gcs_gone(self, peer: Peer) -> None:
        self._bridge.gcs_gone(peer, self._loop.time())
        self._flush()


class Daemon:
    """Feeds the bridge and carries out its effects. Must be made on a running event loop."""

    def __init__(self, settings: Settings, host: Host | None = None) -> None:
        self._loop = event_loop.running()
        self._lane = self._loop.lane
        self._loop.set_exception_handler(self._fault)
        self._warned: set[str] = set()
        #: Those whose clients wait for the bridge.
        self._answers: set[asyncio.Future[Any]] = set()
        self.settings = settings
        #: On the loop's clock.
        self.started_at = self._loop.time()
        self._tlog: TlogRecorder | None = None
        if settings.tlog is not None and settings.state_dir is not None:
            self._tlog = TlogRecorder(settings.state_dir / TLOG_FOLDER, settings.tlog)
        host = self._host = host or Host()
        self._flight = FlightFile(settings.state_dir, str(settings.fc), host)
        self._last_settings = LastSettings(settings.state_dir, lambda: self.fc.where)
        self._signing = SigningState(
            settings.state_dir, settings.gcs, settings.access, is_clock_set=partial(is_clock_set, host)
        )
        self.bridge = Bridge(
            BridgeConfig(
                _speeds(settings.fc),
                settings,
                access={**self._signing.links, **_ZENOH},
                is_near=OwnNetworks(host),
                version=version(),
                has_log=self._tlog is not None,
                unix_time_s=lambda now: time.time() - self._loop.time() + now,
                flight=self._flight.load(self._loop.time()),
                settings_memory=self._last_settings,
            ),
            self._loop.time(),
        )
        #: Per link. The flight controller's port is named "fc".
        self.traffic: defaultdict[str, Traffic] = defaultdict(Traffic)
        self.fc = FcConnection(settings, host, self.bridge, self.traffic["fc"], self.flush)
        self.gcs = GcsConnections(self.bridge, self.traffic, self.flush)
        #: Why missions are kept in memory only, or empty if they are stored.
        self.store_trouble = ""
        #: Why the page cannot be opened now, or empty if it can, or there is none.
        self.page_trouble = ""
        self.store = StoreWorker(settings.state_dir, self._cannot_store)
        #: Set when ground stations can connect.
        self.started = asyncio.Event()
        self._followers: list[Follower] = []

    @property
    def recording(self) -> list[str]:
        """The telemetry log in use, or the reason why recording stopped."""
        return [] if self._tlog is None else [self._tlog.describe()]

    @property
    def is_ticking(self) -> bool:
        """False after a bug in the bridge that a new search did not cure: only received data wakes it then."""
        return self._lane.timer_at < inf

    async def run(self) -> None:
        """Run until cancelled. LinkError if a port for ground stations or other programs cannot be opened."""
        with ExitStack() as stack:
            if self._tlog is not None:
                stack.callback(self._tlog.close)
            stack.callback(lambda: self._flight.close(self._loop.time()))
            for part in (self._signing, self._last_settings, self.store, self.gcs, self.fc):
                stack.callback(part.close)
            stack.callback(self._lane.stop_timer)
            for address in self.settings.gcs:
                self.gcs.open(address)
            links = [str(address) for address in self.settings.gcs]
            _log.info("daemon.started", version=version(), fc=str(self.settings.fc), gcs=links)
            for address in self.settings.gcs:
                if str(address) not in self.settings.access and address.is_public:
                    _log.warning("gcs.open", link=str(address), what=_WHO_MAY_WRITE)
            for share in self.settings.share:
                stack.callback(await open_share(share, self.bridge, self.flush))
            self._signing.start()
            self.started.set()
            self._tick(self._loop.time())
            try:
                await self.fc.run()
            finally:
                # The sender of a mission that ended with the port gets the reply once the outcome is stored.
                await self.is_at_rest(_STORE_TIMEOUT_S)

    def add_follower(self, follower: Follower) -> None:
        self._followers.append(follower)

    def report(self) -> VehicleReport:
        return self.bridge.report(self._loop.time())

    @property
    def clock_trouble(self) -> str:
        """How far this machine's clock is off, or empty if it is right, set by a network, or not known to be wrong."""
        vehicle, own_epoch_s = self.bridge.vehicle, time.time() - self._loop.time()
        gps = vehicle.last(GpsTime)
        epoch_s = vehicle.station_epoch_s if gps is None else gps.unix_s - gps.heard_at
        if epoch_s is None or self._host.path(SYNCHRONIZED).exists():
            return ""
        return clock_trouble(epoch_s - own_epoch_s, "a ground station" if gps is None else "the flight controller")

    def followers_status(self) -> Json:
        return {key: value for follower in self._followers for key, value in follower.status().items()}

    def reset_signing(self) -> None:
        """Forget the times of all ground stations: one with a wrong clock, or our own, may have shut others out."""
        self._signing.reset()

    def flush(self) -> None:
        """Carry out the effects that the bridge has after an input, and set the timer."""
        for effect in self.bridge.take():
            match effect:
                case Datagrams():
                    for peer, data in effect:
                        self.gcs.links[peer.link].send(peer, data)
                        self.traffic[peer.link].bytes_sent += len(data)
                case SendToBoard():
                    self.fc.carry_out(effect)
                case RecordFrames():
                    assert self._tlog is not None
                    self._tlog.record(effect)
                case PublishGroups(groups):
                    for follower in self._followers:
                        follower.telemetry(groups)
                case BridgeEvent():
                    self._happened(effect)
                case Save() | Conclude() | Recall() | NoteReader() | FindPending():
                    self.store.carry_out(effect, partial(self._store_answered, effect))
                case MissionEnded(mission, delivery):
                    for follower in self._followers:
                        follower.mission_ended(mission, delivery)
                case TakenBackup(board):
                    self.store.back_up(board.uid or self.fc.where, effect)
                case RememberFlight(flight):
                    self._flight.save(flight)
        if self.bridge.due != self._lane.timer_at:
            self._lane.set_timer(self.bridge.due, self._tick)

    async def answer(self, start: Callable[[Callable[[T], None], float], None]) -> T:
        """Start an operation of the bridge at the given time, and wait until it calls back with the result.

        ControlError if an error in the bridge ends it.
        """
        future: asyncio.Future[T] = self._loop.create_future()

        def done(result: T) -> None:
            if not future.done():  # the client may have disconnected
                future.set_result(result)

        start(done, self._loop.time())
        self._answers.add(future)
        future.add_done_callback(self._answers.discard)
        self.flush()
        return await future

    async def finish(self) -> None:
        """Start no more transfers. The current one finishes soon, or is aborted cleanly."""
        self.bridge.stop_missions(self._loop.time())
        self.flush()
        if not await self.is_at_rest(_FINISH_S):
            await self.abort()

    async def abort(self) -> None:
        self.bridge.abort(self._loop.time())
        self.flush()
        await self.is_at_rest(_ABORT_S)

    async def is_at_rest(self, seconds: float) -> bool:
        """Wait for the end of all conversations, with a timeout. Returns True if there are none."""
        for _ in range(int(seconds / _REST_INTERVAL_S)):
            if not self.bridge.is_busy:
                break
            await asyncio.sleep(_REST_INTERVAL_S)
        return not self.bridge.is_busy

    def _happened(self, event: BridgeEvent) -> None:
        getattr(_log, event.level)(event.name_in_log, **event.facts())
        if self._tlog is not None and isinstance(event, Armed | Disarmed):
            self._tlog.flies(is_flying=isinstance(event, Armed))
        if isinstance(event, FcFound | FcLost | PortLost | FcInCommandLine):
            self.fc.happened(event)
        for follower in self._followers:
            follower.happened(event)

    def _cannot_store(self, why: str) -> None:
        self.store_trouble = why
        self.bridge.notify("Missions are kept in memory: state folder unusable")
        self.flush()

    def _fault(self, _loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """A callback of the loop raised: log it, and restart the flight controller's line.

        asyncio would write to standard error, and block if its pipe is full.
        """
        error = context.get("exception")
        if isinstance(error, OSError) and "accept" in context["message"]:
            # No file descriptor is left for a new client. asyncio retries every second.
            warn_once(self._warned, "daemon.cannot_accept", why=reason(error))
            return
        _log.error("daemon.fault", what=context["message"], exc_info=error)
        if error is not None and "handle" in context:
            self.bridge.restart("internal error", self._loop.time())
            for answer in (each for each in tuple(self._answers) if not each.done()):
                answer.set_exception(ControlError("the daemon failed; see its log"))
            self.flush()

    def _tick(self, now: float) -> None:
        self.bridge.tick(now)
        self.flush()

    def _store_answered(self, effect: StoreEffect, answer: object) -> None:
        self.bridge.store_answered(effect, answer, self._loop.time())
        self.flush()


def _speeds(address: FcAddress) -> Sequence[int | None]:
    if isinstance(address, AutoFc):
        return SPEEDS
    if not isinstance(address, SerialFc):
        return (None,)
    return SPEEDS if address.baud is None else (address.baud,)
