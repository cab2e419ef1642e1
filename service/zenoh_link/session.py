# SPDX-License-Identifier: GPL-3.0-or-later
"""The zenoh session, the thread for everything that may block (opening, closing, reliable samples), and liveliness.

zenoh connects and reconnects in its own threads. The event loop never waits for any of it.
"""

import asyncio
import threading
from collections import deque
from collections.abc import Callable
from enum import Enum

import structlog
import zenoh

from bridge.model.events import BridgeEvent, Emit, Level
from payloads.endpoints import in_short
from payloads.mission_data import Json
from service.machine.threads import BackgroundThread, post

Job = Callable[[], None]
#: The interval of diagnoses. zenoh tries again at least every 4 s.
_DIAGNOSIS_S = 5.0


class JobKind(Enum):
    """The number of jobs that may wait before one of this kind.

    A flood of guests' queries must not displace commands' replies and reports.
    """

    SAMPLE = 256
    COMMAND_REPLY = 192
    REPLY = 128


_RETRY_S = 2.0
#: A stalled receiver must not delay the daemon's end: then the session ends without closing.
_CLOSE_TIMEOUT_S = 0.6
RENAME = "give one of the two another zenoh.vehicle"

_log = structlog.get_logger()


class SessionThread:
    """Retries until the session is open, calls `declare` to set it up, then runs jobs in their order."""

    def __init__(self, config: zenoh.Config, declare: Callable[[zenoh.Session], None]) -> None:
        self._config = config
        self._declare = declare
        self._session: zenoh.Session | None = None
        self._jobs: deque[Job] = deque()
        self._wake = threading.Condition()
        self._is_closing = False
        self._complaint = ""
        #: Samples and replies that were dropped.
        self.dropped = 0
        self._thread = threading.Thread(target=self._run, name="zenoh session", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def submit(self, job: Job, kind: JobKind = JobKind.SAMPLE) -> None:
        """Run a job on the thread. If too many are waiting, a reply is dropped, and a sample displaces the oldest."""
        with self._wake:
            if len(self._jobs) >= kind.value:
                self.dropped += 1
                if kind is not JobKind.SAMPLE:
                    return
                self._jobs.popleft()
            self._jobs.append(job)
            self._wake.notify()

    def timestamp(self) -> zenoh.Timestamp | None:
        """The time of the session's clock, for a reply. Samples get theirs from zenoh."""
        return None if self._session is None else self._session.new_timestamp()

    def close(self) -> None:
        """Close the session. Waits for that only briefly."""
        with self._wake:
            self._is_closing = True
            self._wake.notify()
        closer = threading.Thread(target=self._close, name="zenoh closer", daemon=True)
        closer.start()
        closer.join(_CLOSE_TIMEOUT_S)
        if closer.is_alive():
            _log.warning("zenoh.closed_without_farewell", what="a receiver is stalled")

    def _close(self) -> None:
        # The last jobs still run: the thread ends when none is waiting.
        self._thread.join(_CLOSE_TIMEOUT_S / 2)
        if self._session is not None:
            try:
                self._session.close()  # type: ignore[no-untyped-call]
            except zenoh.ZError as error:
                _log.debug("zenoh.close_failed", why=in_short(error))

    def _run(self) -> None:
        self._session = self._open()
        while self._session is not None:
            with self._wake:
                while not self._jobs:
                    if self._is_closing:
                        return
                    self._wake.wait()
                job = self._jobs.popleft()
            try:
                job()
            except Exception as error:
                # Also a bug in an encoder: one sample must not stop all others.
                self._complain("zenoh.not_sent", error)

    def _open(self) -> zenoh.Session | None:
        while not self._is_closing:
            try:
                session = zenoh.open(self._config)
                try:
                    self._declare(session)
                except Exception:
                    session.close()  # type: ignore[no-untyped-call]  # else its token would count as another bridge
                    raise
            except Exception as error:
                # Also an error in a declaration: a thread that ends here would end zenoh silently.
                self._complain("zenoh.not_open", error)
            else:
                self._complaint = ""
                _log.info("zenoh.open", id=str(session.zid()))
                return session
            with self._wake:
                self._wake.wait_for(lambda: self._is_closing, _RETRY_S)
        return None

    def _complain(self, event: str, error: Exception) -> None:
        """Log an error once, not each time that it repeats."""
        why = in_short(error)
        level = _log.debug if why == self._complaint else _log.warning
        level(event, why=why)
        self._complaint = why


async def log_outages(diagnose: Callable[[], str], is_alone: Callable[[], bool]) -> None:
    """Log why sessions are not connected, because zenoh keeps trying without a message; never returns.

    Each new reason is logged once, if two diagnoses in a row find it and the bridge is still alone: a single one may
    meet a router that has just returned, before zenoh has joined it. `diagnose` may block: it is called on a thread,
    because an endpoint that drops all packets takes seconds to time out.
    """
    thread = BackgroundThread("zenoh why")
    found = logged = ""
    try:
        while True:
            await asyncio.sleep(_DIAGNOSIS_S)
            before, found = found, await thread.ask(diagnose) if is_alone() else ""
            if found and found == before != logged and is_alone():
                logged = found
                _log.warning("zenoh.alone", why=found)
    finally:
        thread.close(0)


class NameTaken(BridgeEvent):
    """Another bridge has the same vehicle name."""

    name_in_log = "zenoh.name_taken"
    level: Level = "warning"
    vehicle: str
    by: str
    what: str = RENAME


class Liveliness:
    """Shows that the bridge is alive. `others`: sessions of other bridges with the same vehicle name."""

    def __init__(self, vehicle: str, emit: Emit) -> None:
        self._vehicle = vehicle
        self._emit = emit
        self._loop = asyncio.get_running_loop()
        self._own = ""
        self._token: zenoh.LivelinessToken | None = None
        self.others: set[str] = set()
        self._neighbours: set[str] = set()

    def declare(self, session: zenoh.Session, alive: str) -> None:
        """Declare the token and find others. Called on the session's thread. `alive`: the tokens' key prefix."""
        self._own = str(session.zid())

        def joined(event: zenoh.TransportEvent) -> None:
            is_there = event.kind == zenoh.SampleKind.PUT
            post(self._loop, self._neighbours.add if is_there else self._neighbours.discard, str(event.transport.zid))

        session.info.declare_transport_events_listener(zenoh.handlers.Callback(joined, indirect=False), history=True)
        liveliness = session.liveliness()
        # Must be kept: zenoh undeclares a token that is garbage-collected.
        self._token = liveliness.declare_token(f"{alive}/{self._own}")

        def seen(sample: zenoh.Sample) -> None:
            is_there = sample.kind == zenoh.SampleKind.PUT
            post(self._loop, self._seen, str(sample.key_expr).rpartition("/")[2], is_there)

        liveliness.declare_subscriber(f"{alive}/*", zenoh.handlers.Callback(seen, indirect=False), history=True)

    def _seen(self, peer_id: str, is_there: bool) -> None:
        if peer_id == self._own or is_there == (peer_id in self.others):
            return
        if is_there:
            self.others.add(peer_id)
            self._emit(NameTaken(vehicle=self._vehicle, by=peer_id))
        else:
            self.others.discard(peer_id)

    @property
    def is_alone(self) -> bool:
        return not self._neighbours

    def status(self) -> Json:
        return {
            "zenoh": "open" if self._own else "not open",
            "zenoh_neighbours": len(self._neighbours),
            "zenoh_others_of_this_name": len(self.others),
        }
