# SPDX-License-Identifier: GPL-3.0-or-later
"""The running bridge: its links, its store and its clock, on one event loop."""

import asyncio
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Protocol

import structlog

from bridge.bridge import Bridge
from bridge.config import BridgeConfig
from bridge.fc.autosense import SPEEDS
from bridge.fc.msp_sharing import refused
from bridge.gcs.guard import LinkAccess
from bridge.gcs.station import Peer
from bridge.line.conversation import StoreEffect
from bridge.missions.mission_service import DeliveryResult
from bridge.model.events import Level
from bridge.model.mission_log import ArrivedMission
from bridge.model.vehicle_groups import Group
from protocols.msp.frame import MspFrame
from service.daemon.mission_data import Json
from service.daemon.store_worker import StoreWorker
from service.links.fc_device import device_opener
from service.links.fc_port import MOVED_ON, STOPPED
from service.links.gcs_links import GcsLink, LinkError, open_link
from service.links.msp_share import Share, open_share
from service.links.port_finder import PortFinder
from service.links.signing_state import SigningState
from service.machine.host import Host
from service.machine.package import page, version
from service.recording.recorder import Recording
from service.settings import PassThroughRule, Settings
from service.settings.addresses import AutoFc, FcAddress, GcsAddress, SerialFc

#: The interval of messages about an unsuccessful search: a silent log looks like a hang.
_SEARCH_REPORT_S = 60.0
#: Timeouts of a stop: for a push to finish, for its abort, for the store. Together they stay within 2 s.
_FINISH_S = 1.0
_ABORT_S = 0.6
_STORE_TIMEOUT_S = 0.2
_REST_INTERVAL_S = 0.02
#: A timer that fires earlier than the deadline by more than this is replaced; it would wake the process for nothing.
_TOO_EARLY_S = 0.01
#: Frames are accepted over zenoh only if its transport is authenticated, or the owner waived that.
_ZENOH = {"zenoh": LinkAccess(may_write=lambda _peer: True)}
_FLIGHT = {"vehicle.armed": True, "vehicle.disarmed": False}
_WHO_MAY_WRITE = f"anyone who reaches it may write missions and parameters; to restrict it: {page('docs/signing.md')}"

_log = structlog.get_logger()


@dataclass(slots=True)
class Traffic:
    """The traffic on one port or link since the start: bytes, and pieces (reads and writes, or datagrams)."""

    pieces_received: int = 0
    bytes_received: int = 0
    pieces_sent: int = 0
    bytes_sent: int = 0


class Follower(Protocol):
    """A part of this process that follows the daemon's events. Its methods must not block."""

    def telemetry(self, groups: frozenset[Group]) -> None:
        """New values in these groups, which were requested with `bridge.report.watch`."""

    def event(self, level: Level, event: str, facts: Mapping[str, object]) -> None:
        """An event was logged."""

    def mission_ended(self, mission: ArrivedMission, delivery: DeliveryResult) -> None:
        """A received mission was completed or rejected."""

    def status(self) -> Json:
        """The follower's part of `naze-bridge status`."""


class Daemon:
    """Feeds the bridge and carries out its outputs. Must be made on a running event loop."""

    def __init__(self, settings: Settings, host: Host | None = None) -> None:
        self._loop = asyncio.get_running_loop()
        self._loop.set_exception_handler(self._fault)
        self.settings = settings
        #: On the loop's clock; `found_at` None: no flight controller; `lost_at` None: none was lost since.
        self.started_at = self._loop.time()
        self.found_at: float | None = None
        self.lost_at: float | None = None
        self._recording = Recording(settings.state_dir, settings.tlog, settings.record_uart)
        self._signing = SigningState(settings.state_dir, settings.gcs, settings.access)
        self.bridge = Bridge(
            BridgeConfig(
                _speeds(settings.fc),
                sysid=settings.sysid,
                takeoff_max_m=settings.takeoff_max_m,
                autopilot=settings.autopilot,
                links={**self._signing.links, **_ZENOH},
                version=version(),
                unix_time_s=lambda now: time.time() - self._loop.time() + now,
                passes_everything=settings.pass_through is PassThroughRule.EVERYTHING,
            ),
            self._log_event,
            self._loop.time(),
            self._recording.on_frames,
            self._mission_ended,
        )
        self._complained_of_accept = False
        #: Why missions are kept in memory only; empty if they are stored.
        self.store_trouble = ""
        self.store = StoreWorker(settings.state_dir, self._cannot_store)
        #: Set when ground stations can connect.
        self.started = asyncio.Event()
        self._finder = PortFinder(host or Host(), settings.state_dir) if isinstance(settings.fc, AutoFc) else None
        open_device = device_opener(settings.fc) if self._finder is None else self._finder.open
        self._port = self._recording.port(open_device, self._fc_opened, self._fc_data, self._fc_closed)
        self._links: dict[str, GcsLink] = {}
        #: Per link; the flight controller's port is named "fc".
        self.traffic: defaultdict[str, Traffic] = defaultdict(Traffic)
        self._fc_traffic = self.traffic["fc"]
        self._shares: list[Share] = []
        #: Refused requests of [[share]] ports, by reason.
        self.share_refused: Counter[str] = Counter()
        self._followers: list[Follower] = []
        if self._finder is not None:
            self._finder.move_on = self._port.move_on
            self._followers.append(self._finder)
        self._timer: asyncio.TimerHandle | None = None
        self._deadline = self._loop.time()  # of the next tick
        self._search_report: asyncio.TimerHandle | None = None

    @property
    def fc_trouble(self) -> str:
        """Why the flight controller cannot be used: its port, or its state; empty if it can be."""
        return self._port.trouble or self.bridge.session.state.trouble

    @property
    def fc_where(self) -> str:
        """The flight controller's port or address; while no port is open, the kinds of port searched."""
        return str(self.settings.fc) if self._finder is None else self._finder.where

    @property
    def recording(self) -> list[str]:
        """The files being recorded, or the reasons why recording stopped."""
        return self._recording.describe()

    @property
    def fc_dropped_bytes(self) -> int:
        """Bytes that the flight controller's line was too slow for."""
        return self._port.dropped_bytes

    async def run(self) -> None:
        """Run until cancelled. LinkError if a ground station link cannot be set up."""
        port: asyncio.Task[None] | None = None
        try:
            for address in self.settings.gcs:
                link = open_link(address, self)
                self._links[link.name] = link
            _log.info(
                "daemon.started",
                version=version(),
                fc=str(self.settings.fc),
                gcs=[str(address) for address in self.settings.gcs],
            )
            for address in self.settings.gcs:
                if str(address) not in self.settings.access:
                    _log.warning("gcs.open", link=str(address), what=_WHO_MAY_WRITE)
            for share in self.settings.share:
                self._shares.append(await open_share(share, self._shared_request))
            self._signing.start()
            self.started.set()
            port = self._loop.create_task(self._port.run())
            self._tick()
            await port
        finally:
            if port is not None:
                port.cancel()
                with suppress(asyncio.CancelledError):
                    await port
                # The sender of a mission that ended with the port gets its reply once the outcome is stored.
                await self.is_at_rest(_STORE_TIMEOUT_S)
            for timer in (self._timer, self._search_report):
                if timer is not None:
                    timer.cancel()
            if self._finder is not None:
                self._finder.close()
            for link in self._links.values():
                link.close()
            for opened in self._shares:
                opened.close()
            self.store.close()
            self._signing.close()
            self._recording.close()

    def add_follower(self, follower: Follower) -> None:
        """Subscribe a follower."""
        self._followers.append(follower)

    def followers_status(self) -> Json:
        """The followers' parts of the status."""
        return {key: value for follower in self._followers for key, value in follower.status().items()}

    def add_link(self, link: GcsLink) -> None:
        """Serve ground stations over another link; it is closed with the others."""
        self._links[link.name] = link

    def change_links(self, gcs: Sequence[GcsAddress]) -> None:
        """Serve ground stations over these links; those that stay are not interrupted."""
        wanted = {str(address): address for address in gcs}
        for name in map(str, self.settings.gcs):
            if name not in wanted and name in self._links:
                self.bridge.link_closed(name, self._loop.time())
                self.flush()
                self._links.pop(name).close()
                _log.info("gcs.closed", link=name)
        for name, address in wanted.items():
            if name not in self._links:
                try:
                    self._links[name] = open_link(address, self)
                except LinkError as error:
                    _log.error("gcs.unavailable", link=name, why=str(error))
                else:
                    _log.warning("gcs.open", link=name, what=_WHO_MAY_WRITE)
        self.settings = replace(self.settings, gcs=tuple(gcs))

    def flush(self) -> None:
        """Carry out the outputs that the bridge has after an input."""
        bridge = self.bridge
        self._port.set_speed(bridge.session.state.speed)
        self._port.may_gather = bridge.is_passing_through
        if output := bridge.take_fc_output():
            data = b"".join(output)
            self._port.write(data)
            self._fc_traffic.pieces_sent += 1
            self._fc_traffic.bytes_sent += len(data)
        self._send_datagrams()
        for effect in bridge.runner.take_store_effects():
            self._carry_out(effect)
        self._tell_followers()
        self._deadline = bridge.next_deadline()
        if self._timer is not None:
            if 0 <= self._deadline - self._timer.when() < _TOO_EARLY_S:
                # Every reply postpones the deadline a little, mostly to that of a request sent later. A timer that
                # fires too early costs less than a new one each time.
                return
            self._timer.cancel()
        self._timer = self._loop.call_at(self._deadline, self._tick)

    def _send_datagrams(self) -> None:
        for peer, data in self.bridge.ground.take_datagrams():
            link = peer.link
            self._links[link].send(peer, data)
            traffic = self.traffic[link]
            traffic.pieces_sent += 1
            traffic.bytes_sent += len(data)

    async def finish(self) -> None:
        """Start no more transfers; the current one finishes soon, or is aborted cleanly."""
        self.bridge.stop_missions(self._loop.time())
        self.flush()
        if not await self.is_at_rest(_FINISH_S):
            await self.abort()

    async def abort(self) -> None:
        """Abort the current transfer cleanly."""
        self.bridge.runner.stop(self._loop.time())
        self.flush()
        await self.is_at_rest(_ABORT_S)

    async def is_at_rest(self, seconds: float) -> bool:
        """Wait for the end of all conversations, with a timeout; True if there are none."""
        for _ in range(int(seconds / _REST_INTERVAL_S)):
            if not self.bridge.runner.is_busy:
                break
            await asyncio.sleep(_REST_INTERVAL_S)
        return not self.bridge.runner.is_busy

    # The methods of service.links.gcs_events.GcsEvents.

    def gcs_data(self, peer: Peer, data: bytes, *, datagram: bool) -> None:
        """Take bytes from a ground station."""
        traffic = self.traffic[peer.link]
        traffic.pieces_received += 1
        traffic.bytes_received += len(data)
        try:
            if not self.bridge.gcs_received(peer, data, self._loop.time(), datagram=datagram):
                return
        except Exception:
            # A ground station must not be able to reset the flight controller's line: only its data is dropped.
            _log.exception("gcs.fault", peer=str(peer))
        self.flush()

    def gcs_gone(self, peer: Peer) -> None:
        """Remove a ground station."""
        self.bridge.gcs_gone(peer, self._loop.time())
        self.flush()

    def displaced(self, peers: Mapping[Peer, float]) -> Peer:
        """The connection of a full link to close."""
        return self.bridge.ground.displaced(peers)

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        """Send to `peer` before it is heard."""
        self.bridge.ground.add_default_peer(peer, until_answered=until_answered)

    def remove_default_peer(self, peer: Peer) -> None:
        """Stop sending to an unheard peer."""
        self.bridge.ground.remove_default_peer(peer)

    def _shared_request(self, frame: MspFrame, answer: Callable[[MspFrame], None], *, may_write: bool) -> None:
        """Forward another program's MSP request, or refuse it and log the reason."""
        why = self.bridge.sharing.request(frame, answer, self._loop.time(), may_write=may_write)
        if why:
            self.share_refused[why] += 1
            level: Level = "debug" if self.share_refused[why] > 1 else "warning"
            self._log_event(level, "share.refused", command=frame.command, why=why)
            answer(refused(frame))
        self.flush()

    # The flight controller's port, the clock and the store.

    def _fc_opened(self) -> None:
        self.bridge.session.opened(self._loop.time())
        self.flush()
        self._report_search()

    def _fc_data(self, data: bytes) -> None:
        self._fc_traffic.pieces_received += 1
        self._fc_traffic.bytes_received += len(data)
        bridge = self.bridge
        if self._finder is not None:
            self._finder.received(data)
        bridge.fc_received(data, self._loop.time())
        if bridge.is_passing_through:
            # Pass-through makes only datagrams; the rest of flush() would cost too much thousands of times a second.
            self._send_datagrams()
            if self._followers:
                self._tell_followers()
        else:
            self.flush()

    def _fc_closed(self, why: str) -> None:
        self.bridge.session.closed(self._loop.time(), None if why in (STOPPED, MOVED_ON) else why)
        self.flush()

    def _tell_followers(self) -> None:
        report = self.bridge.report
        if report.fresh and (fresh := report.take_fresh()):
            for follower in self._followers:
                follower.telemetry(fresh)

    def _mission_ended(self, mission: ArrivedMission, delivery: DeliveryResult) -> None:
        for follower in self._followers:
            follower.mission_ended(mission, delivery)

    def _log_event(self, level: Level, event: str, /, **facts: object) -> None:
        getattr(_log, level)(event, **facts)
        if event in _FLIGHT:
            self._recording.flies(is_flying=_FLIGHT[event])
        if event == "fc.found":
            self.found_at, self.lost_at = self._loop.time(), None
        elif event in ("fc.lost", "fc.port_lost", "fc.in_command_line") and self.found_at is not None:
            self.found_at, self.lost_at = None, self._loop.time()
        for follower in self._followers:
            follower.event(level, event, facts)

    def _report_search(self) -> None:
        if self._search_report is not None:
            self._search_report.cancel()
        if self.bridge.session.state.is_searching:
            _log.info("fc.searching", fc=self.fc_where)
        self._search_report = self._loop.call_later(_SEARCH_REPORT_S, self._report_search)

    def _cannot_store(self, why: str) -> None:
        self.store_trouble = why
        self.bridge.ground.notice = "Missions are kept in memory: state folder unusable"
        self.flush()

    def _fault(self, _loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """A callback of the loop raised: log it, and restart the flight controller's line.

        asyncio would write to standard error, and block if its pipe is full.
        """
        error = context.get("exception")
        if isinstance(error, OSError) and "accept" in context["message"]:
            # No file descriptor is left for a new client; asyncio retries every second.
            if not self._complained_of_accept:
                self._complained_of_accept = True
                _log.warning("daemon.cannot_accept", why=error.strerror)
            return
        _log.error("daemon.fault", what=context["message"], exc_info=error)
        if error is not None and "handle" in context:
            self.bridge.restart("internal error", self._loop.time())
            self.flush()

    def _tick(self) -> None:
        now = self._loop.time()
        if now < self._deadline:
            self._timer = self._loop.call_at(self._deadline, self._tick)
            return
        self._timer = None
        self.bridge.tick(now)
        self.flush()

    def _carry_out(self, effect: StoreEffect) -> None:
        def answered(answer: object) -> None:
            self.bridge.runner.store_answered(effect, answer, self._loop.time())
            self.flush()

        self.store.carry_out(effect, answered)


def _speeds(address: FcAddress) -> Sequence[int | None]:
    if isinstance(address, AutoFc):
        return SPEEDS
    if not isinstance(address, SerialFc):
        return (None,)
    return SPEEDS if address.baud is None else (address.baud,)
