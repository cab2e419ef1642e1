# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge as one vehicle in zenoh: wires the parts together and routes events.

The path of a sample from the UART:
    Daemon.flush -> Node.telemetry -> Publisher.put -> zenoh
Anything that may wait takes the session's thread:
    Daemon._happened -> Node.happened -> SessionThread -> zenoh
    zenoh -> Queries -> Answers or CommandQueries -> DaemonApi -> Question -> SessionThread -> zenoh
"""

import asyncio
import os
import time
from collections.abc import Callable
from functools import partial
from math import inf

import structlog
import zenoh

from bridge.missions.mission_service import DeliveryResult, HeldMission
from bridge.model.events import BridgeEvent
from bridge.model.missions import ArrivedMission
from payloads import keys
from payloads.endpoints import connect_endpoints, endpoint_trouble, tls_files
from payloads.keys import ZenohKey
from payloads.mission_data import Json, plain
from payloads.overview import overview_of
from payloads.payload import Payloads, encode
from reports.vehicle_groups import Group
from service.daemon.api import DaemonApi
from service.daemon.daemon import Daemon, Follower
from service.daemon.telemetry_logs import TelemetryLogs
from service.machine.raspberry_pi import SYNCHRONIZED
from service.recording.tlog_recorder import TLOG_FOLDER
from service.settings.zenoh import ZenohSettings
from service.settings.zenoh_config import make_config
from service.zenoh_link.answers import Answers, CommandQueries, mission_current, mission_report
from service.zenoh_link.mavlink_link import MavlinkLink
from service.zenoh_link.publisher import Publisher
from service.zenoh_link.queries import Queries
from service.zenoh_link.session import Liveliness, SessionThread, log_outages

_STATE_INTERVAL_S, _OVERVIEW_INTERVAL_S = 1.0, 10.0
_GROUPS = {key.suffix: group for group, key in keys.TELEMETRY.items()}

_log = structlog.get_logger()


class Node(Follower):
    """Must be made on the daemon's event loop; ZenohSettingsError."""

    def __init__(self, settings: ZenohSettings, daemon: Daemon) -> None:
        self._settings = settings
        self._daemon = daemon
        self._loop = asyncio.get_running_loop()
        config = make_config(settings)
        self._endpoints, self._tls_files = connect_endpoints(config), tls_files(config)
        self._thread = SessionThread(config, self._declare)
        # A Pi's clock is not better than a millisecond, and each digit costs data.
        self._payloads = Payloads(lambda: round(time.time(), 3))
        self._publisher = Publisher(self._payloads, self._readers_changed)
        self._presence = Liveliness(settings.vehicle, self._emit)
        self._mavlink = MavlinkLink(self._publisher, daemon.gcs, self._presence.others)
        self._queries = Queries(self._payloads, self._thread)
        api = DaemonApi(daemon)
        logs = None if daemon.settings.state_dir is None else daemon.settings.state_dir / TLOG_FOLDER
        self._logs = TelemetryLogs(logs)
        self._answerers = Answers(self._state, daemon.bridge, api).answerers
        if settings.commands:
            self._answerers |= CommandQueries(api, self._presence.others, self._logs).answerers
        self._held: HeldMission | None = None
        #: The overview's urgent values as last published, and when the next one is due without a change of these.
        self._overview_marks: object = None
        self._overview_due = -inf
        self._pending_publish: asyncio.Handle | None = None
        self._tick: asyncio.TimerHandle | None = None
        self._outages: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Join as soon as there is a session to join."""
        self._daemon.gcs.add(self._mavlink)
        self._daemon.add_follower(self)
        self._thread.start()
        self._every_second()
        if self._endpoints:
            diagnose = partial(endpoint_trouble, self._endpoints, self._tls_files)
            self._outages = self._loop.create_task(log_outages(diagnose, lambda: self._presence.is_alone))

    async def close(self) -> None:
        """Leave. Takes at most a second."""
        if self._tick is not None:
            self._tick.cancel()
        if self._outages is not None:
            self._outages.cancel()
        await self._queries.close()
        self._logs.close()
        self._thread.close()

    # The methods of service.daemon.daemon.Follower.

    def telemetry(self, groups: frozenset[Group]) -> None:
        for group in groups:
            self._publish(group)

    def happened(self, event: BridgeEvent) -> None:
        """Publish an event, and soon after it the changed state."""
        about = {"level": event.level, "event": event.name_in_log, "facts": event.facts()}
        body = self._payloads.head(keys.EVENT) | about
        self._thread.submit(lambda: self._publisher.put_raw(keys.EVENT, encode(keys.EVENT, body)))
        if event.level != "debug":
            self._publish_soon()

    def mission_ended(self, mission: ArrivedMission, delivery: DeliveryResult) -> None:
        self._send_reliably(keys.MISSION_REPORT, partial(mission_report, mission, delivery))
        self._publish_soon()

    def status(self) -> Json:
        return self._presence.status() | {"zenoh_dropped": self._thread.dropped + self._publisher.failed}

    # On the session's thread.

    def _declare(self, session: zenoh.Session) -> None:
        for key in keys.KEYS:
            if key.is_published:
                self._publisher.declare(session, key, self._name(key.suffix))
        for key, answerer in self._answerers.items():
            self._queries.declare(session, key, self._name(key.suffix), answerer)
        if self._settings.mavlink_in:
            self._mavlink.declare_input(session, self._name(keys.MAVLINK_IN.suffix))
        self._presence.declare(session, self._name(keys.ALIVE))

    # On the event loop.

    def _name(self, suffix: str) -> str:
        return keys.full(self._settings.prefix, self._settings.vehicle, suffix)

    def _emit(self, event: BridgeEvent) -> None:
        getattr(_log, event.level)(event.name_in_log, **event.facts())
        self.happened(event)

    def _readers_changed(self, key: ZenohKey, is_read: bool) -> None:
        _log.debug("zenoh.readers", key=key.suffix, is_read=is_read)
        if key is keys.MAVLINK_OUT:
            self._mavlink.read(is_read=is_read)
        elif key.suffix in _GROUPS:
            read = [group for group, its_key in keys.TELEMETRY.items() if self._publisher.has_readers(its_key)]
            self._daemon.bridge.watch(read)
            self._daemon.flush()

    def _state(self) -> Json:
        return {
            "vehicle": self._settings.vehicle,
            "others_of_this_name": len(self._presence.others),
            "time_source": "ntp" if os.path.exists(SYNCHRONIZED) else "pi",
            **plain(self._daemon.report()),
        }

    def _publish(self, group: Group) -> None:
        key = keys.TELEMETRY[group]
        if self._publisher.has_readers(key):
            self._publisher.put(key, plain(self._daemon.bridge.group(group, self._loop.time())))

    def _send_reliably(self, key: ZenohKey, body: Callable[[], Json]) -> None:
        """Publish on the session's thread, which also makes the body: for a long list that takes time."""
        head = self._payloads.head(key)
        self._thread.submit(lambda: self._publisher.put_raw(key, encode(key, head | body())))

    def _publish_soon(self) -> None:
        """Publish the state and the mission once, for all changes of this moment."""
        if self._pending_publish is None:
            self._pending_publish = self._loop.call_soon(self._publish_whole)

    def _every_second(self) -> None:
        self._tick = self._loop.call_later(_STATE_INTERVAL_S, self._every_second)
        self._publish_whole()

    def _publish_whole(self) -> None:
        self._pending_publish = None
        self._publish(Group.LINK)
        state, now = self._state(), self._loop.time()
        if self._publisher.is_declared:
            self._publisher.put(keys.STATE, state)
        if self._publisher.has_readers(keys.OVERVIEW):
            overview = overview_of(state)
            if now >= self._overview_due or overview.marks != self._overview_marks:
                self._overview_due, self._overview_marks = now + _OVERVIEW_INTERVAL_S, overview.marks
                self._publisher.put(keys.OVERVIEW, plain(overview))
        held = self._daemon.bridge.missions.held
        if held is not self._held:
            self._held = held
            self._send_reliably(keys.MISSION_CURRENT, partial(mission_current, held))
