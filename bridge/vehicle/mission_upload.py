# SPDX-License-Identifier: GPL-3.0-or-later
"""A ground station writes a mission: the vehicle's side of MAVLink's upload (docs/mission-rules.md).

Uploads run one at a time, in the order of their MISSION_COUNT, unless slow or numerous lists would lock out the
others: then they are received in parallel, and only written one at a time. Mission Planner loses some packets, and any
ack to MISSION_COUNT means "continue" to it; most special cases below respond to a behaviour listed in
docs/ground-stations.md.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from math import inf
from typing import Any

from bridge.gcs.cost import Cost
from bridge.gcs.flash_budget import TOO_MANY_WRITES
from bridge.gcs.ground import Ground
from bridge.gcs.station import Peer, Severity, Station
from bridge.gcs.stations import MAX_PEERS
from bridge.missions.fc_mission_store import StoreReport
from bridge.missions.list_check import begin_check, check_count
from bridge.missions.mission_service import OCCUPIED, DeliveryResult, MissionService, MissionTransfer, TransferStep
from bridge.model.events import EventLog, Level
from bridge.model.finding import Finding
from bridge.model.mission_log import ArrivedMission
from bridge.model.refusal import Refusal
from bridge.model.verdict import CLEARED_LIST, Result, Verdict
from bridge.vehicle.upload_answers import UploadAnswers
from bridge.vehicle.upload_states import (
    TRANSITIONS,
    Announced,
    Asking,
    Complete,
    Delivered,
    Delivering,
    Ended,
    Event,
    Judged,
    Ready,
    Receiving,
    Turn,
    Upload,
    UploadState,
    Waiting,
)
from protocols.mavlink.dialect import messages
from protocols.mission_item import MissionItem, MissionResult

_TOO_MANY_UPLOADS = Refusal(MissionResult.DENIED, "Too many uploads: wait a few seconds")
#: The maximum number of simultaneous uploads: one for each peer of a link.
_MOST_UPLOADS = MAX_PEERS
#: A host with more of them than this is the first to lose one.
_MOST_OF_HOST = 2
#: After this long with lists arriving, an upload does not wait for its turn: a slow or silent ground station would lock
#: out the others. A pause ends that.
_ALONE_S = 4.0
_PAUSE_S = 3.0
#: Nor does it if more than this many are running or waiting.
_MOST_IN_TURN = 4
#: The flight controller is not asked more often if it can take a list; one reply serves all uploads that wait for it.
_ASK_INTERVAL_S = 0.2


class MissionUploads:
    """All ground stations' uploads and clears."""

    def __init__(self, missions: MissionService, ground: Ground, log_event: EventLog, incidents: Iterator[int]) -> None:
        self._missions = missions
        self._ground = ground
        self._log_event = log_event
        self._incidents = incidents
        self._flash = ground.flash
        self._uploads: list[Upload] = []  # in the order of their MISSION_COUNT
        self._states: Counter[type[UploadState]] = Counter()  # of the uploads
        #: No state ends and no request is repeated before this time.
        self._states_due = inf
        self.answers = UploadAnswers(ground)
        #: False while nothing is due: no upload runs, and no reminder waits.
        self.is_active = False
        self._is_asking = False
        self._may_ask_at = 0.0
        #: Since when lists have been arriving without a pause, and when the last upload ended.
        self._arriving_since = self._last_end = -inf

    @property
    def receiving(self) -> MissionTransfer | None:
        """The upload that receives items."""
        for upload in self._uploads:
            if isinstance(upload.state, Receiving):
                source, received = str(upload.station), len(upload.state.items)
                return MissionTransfer(source, TransferStep.RECEIVING, received, upload.count)
        return None

    def is_writing(self, station: Station) -> bool:
        """True if an upload of this ground station runs or waits."""
        return self._of(station) is not None

    # From ground stations.

    def count(self, station: Station, count: int, now: float) -> None:
        """MISSION_COUNT: an upload is announced."""
        present = self._find(station, now)
        if present is None and not count and self.answers.repeat_cancelled(station, now):
            return
        if present is None or not self._is_for(present, count, now):
            self._begin(station, count, now)

    def clear_all(self, station: Station, mission_type: int, now: float) -> None:
        """MISSION_CLEAR_ALL. `mission_type`: of the answer, MISSION or ALL."""
        present = self._find(station, now)
        if present is not None and not isinstance(present.state, Delivering):
            self._supersede(present, now)
        elif present is not None and present.count == 0:
            return
        self._begin(station, 0, now, mission_type)

    def item(self, station: Station, item: MissionItem, now: float) -> None:
        """MISSION_ITEM or MISSION_ITEM_INT."""
        upload = self._find(station, now)
        if upload is None:
            self.answers.late_item(station, item.seq, now, is_lost=not self._uploads)
            return
        state = upload.state
        if not isinstance(state, Receiving):
            # The next request or the final ack is on its way already.
            return
        if item.seq >= upload.count:
            text = f"WP {item.seq} is beyond the {upload.count} items announced"
            self._ground.refuse(station, Refusal(MissionResult.INVALID_SEQUENCE, text))
            return
        if state.is_of_another_list(item):
            # Two lists must never be mixed: the previous one is discarded.
            self._supersede(upload, now)
            self._begin(station, upload.count, now)
            return
        state.announced_again = False
        taken = state.take(item, now)
        if isinstance(taken, Judged):
            self._handle(upload, taken, now)
            self._begin_next(now)
        elif taken:
            self._request(upload, now)

    def ack(self, station: Station, result: int, now: float) -> None:
        """MISSION_ACK from a ground station: an error cancels its upload, ACCEPTED ends "Write Fast"."""
        upload = self._find(station, now)
        if upload is None or isinstance(upload.state, Delivering):
            return
        if result != MissionResult.ACCEPTED:
            self._end([upload], _cancelled(f"cancelled (result {result})"), now)
        else:
            upload.state.close(now)
            self._states_due = now  # the deadline may be sooner

    # From the rest of the bridge.

    def end(self, refusal: Refusal, now: float) -> None:
        """End the uploads that have not reached the flight controller: the craft was armed, or the bridge stops."""
        self._end(self._undelivered(), refusal, now)

    def peer_gone(self, peer: Peer, now: float) -> None:
        """A ground station's connection is closed: its uploads end without waiting for the timeout."""
        gone = [upload for upload in self._undelivered() if upload.station.peer == peer]
        self._end(gone, _cancelled("ended: disconnected"), now)

    def link_lost(self, now: float) -> None:
        """The flight controller is gone: uploads that still receive items end."""
        receiving = [upload for upload in self._uploads if isinstance(upload.state, Receiving | Complete)]
        self._end(receiving, Refusal(MissionResult.DENIED, "Flight controller lost during the upload"), now)

    def tick(self, now: float) -> None:
        """Repeat a request, end a state at its deadline, begin the next upload."""
        if now >= self._states_due:
            for upload in self._uploads[:]:
                state = upload.state
                if now >= state.deadline:
                    self._end([upload], state.timeout, now)
                elif isinstance(state, Receiving) and now >= state.request.due:
                    state.request.lost()
                    self._request(upload, now)
            self._states_due = min((upload.state.next_tick() for upload in self._uploads), default=inf)
        if now >= self.answers.due:
            self.answers.tick(now)
        self._begin_next(now)
        self._ask(now)
        self.is_active = bool(self._uploads) or self.answers.due < inf

    def next_deadline(self) -> float:
        # Asked after each datagram of a flood.
        states = self._states
        arriving, waiting = states[Asking] or states[Receiving], states[Waiting]
        is_free = self._missions.occupied() is not OCCUPIED
        if is_free and (states[Complete] or (waiting and not arriving)):
            return 0.0
        times = [self._states_due, self.answers.due]
        times += [self._may_ask_at] if states[Asking] and not self._is_asking else []
        times += [self._arriving_since + _ALONE_S] if is_free and waiting and arriving else []
        return min(times)

    # State changes of an upload.

    def _begin(
        self, station: Station, count: int, now: float, mission_type: int = messages.MAV_MISSION_TYPE_MISSION
    ) -> None:
        self.is_active = True
        self.answers.forget(station)
        for older in self._uploads:
            older.is_superseded |= older.station == station
        if not self._ground.allows(station, Cost.UPLOAD):
            # A flood must cost less than the lists that it announces: no incident, no log entry.
            self._ground.say(Severity.ERROR, _TOO_MANY_UPLOADS.text, station)
            self.answers.end(station, _TOO_MANY_UPLOADS.ack, count, now, mission_type)
            return
        incident = f"upload-{next(self._incidents)}"
        upload = Upload(station, count, incident, Waiting(Announced(), now), mission_type)
        self._uploads.append(upload)
        self._entered(upload)
        armed = self._missions.armed_refusal()
        if armed is not None:
            self._end([upload], armed, now)
        elif len(self._uploads) > _MOST_UPLOADS:
            self._end([self._least_worth()], _cancelled("ended: too many at once"), now)
        self._begin_next(now)

    def _least_worth(self) -> Upload:
        """The upload to end if too many run: a crowded host's, else a stranger's, one without items, the oldest."""
        hosts = Counter(upload.station.peer.host for upload in self._uploads)

        def worth(upload: Upload) -> tuple[int, bool, bool, float]:
            peer, state = upload.station.peer, upload.state
            crowd = max(hosts[peer.host], _MOST_OF_HOST)
            return -crowd, self._ground.has_standing(peer), bool(state.received), state.since

        return min(self._undelivered(), key=worth)

    def _begin_next(self, now: float) -> None:
        """Continue the uploads whose turn has come: first that of the host that has written least."""
        for upload in sorted(self._in(Waiting, Complete), key=lambda upload: self._flash.used(upload.station.peer)):
            event = self._turn(upload, now)
            if event is not None:
                self._handle(upload, event, now)

    def _turn(self, upload: Upload, now: float) -> Event | None:
        """The event that continues an upload, None if it must wait for others."""
        state = upload.state
        if isinstance(state, Complete):
            refusal = self._missions.acquire(upload)
            is_write = state.verdict.result is not Result.REJECTED
            if refusal is None and is_write and not self._flash.allows(upload.station.peer, now):
                refusal = Refusal(MissionResult.DENIED, TOO_MANY_WRITES)
        else:
            refusal = OCCUPIED if self._must_wait(now) else self._missions.occupied()
        if refusal is not None:
            return None if refusal is OCCUPIED else Ended(refusal)
        is_clear = isinstance(state, Waiting) and not upload.count
        return Judged((), CLEARED_LIST) if is_clear else Turn()

    def _must_wait(self, now: float) -> bool:
        """True if the list of another upload is arriving as it should."""
        if not self._in(Asking, Receiving, Complete):
            return False
        return now < self._arriving_since + _ALONE_S and len(self._uploads) <= _MOST_IN_TURN

    def _handle(self, upload: Upload, event: Event, now: float) -> None:
        before = upload.state
        after = TRANSITIONS[type(before)][type(event)]
        if after is None:
            self._forget(upload, now)
        else:
            self._states[type(before)] -= 1
            upload.state = after(event, now)
            self._entered(upload)
        match event:
            case Turn() if isinstance(before, Complete):
                delivered = partial(self._delivered, upload, before.verdict)
                self._deliver(upload, before.received, before.verdict, delivered, now)
            case Turn():
                if self._in(Asking, Receiving) == [upload] and now >= self._last_end + _PAUSE_S:
                    self._arriving_since = now
            case Ready():
                self._note("mission.upload_started", upload, count=upload.count)
                self._request(upload, now)
            case Ended(refusal):
                self._refuse(upload, before, refusal, now)

    def _end(self, uploads: list[Upload], refusal: Refusal, now: float) -> None:
        for upload in uploads:
            if upload in self._uploads:
                self._handle(upload, Ended(refusal), now)

    def _entered(self, upload: Upload) -> None:
        self._states[type(upload.state)] += 1
        self._states_due = min(self._states_due, upload.state.next_tick())

    def _forget(self, upload: Upload, now: float) -> None:
        self._last_end = now
        self._uploads.remove(upload)
        self._states[type(upload.state)] -= 1
        self._missions.release(upload)

    def _supersede(self, upload: Upload, now: float) -> None:
        """Drop an upload without an answer: its station would attribute it to the list that it announces now."""
        ack = MissionResult.OPERATION_CANCELLED
        self._note("mission.refused", upload, "warning", ack=ack.name, why="superseded: the station started again")
        self._forget(upload, now)

    def _is_for(self, upload: Upload, count: int, now: float) -> bool:
        """Handle a MISSION_COUNT of a station whose upload runs; False if it announces a new one."""
        state = upload.state
        if count == 0:
            # Mission Planner's Cancel button, or a clear again. A list that is being written cannot be cancelled.
            upload.is_cancelled = upload.count > 0
            if upload.is_cancelled and not isinstance(state, Delivering):
                self._end([upload], _cancelled("cancelled"), now)
            return True
        if isinstance(state, Delivering):
            # The previous list is being written, the new one waits for its turn.
            return False
        if isinstance(state, Waiting):
            upload.count = count
            return True
        if count != upload.count or isinstance(state, Complete):
            self._supersede(upload, now)
            return False
        if isinstance(state, Receiving):
            state.announced_again = bool(state.items)
            self._request(upload, now)
        return True

    def _ask(self, now: float) -> None:
        """Ask the flight controller if it can take a list, for all uploads that wait for the reply."""
        if self._in(Asking) and not self._is_asking and now >= self._may_ask_at:
            self._is_asking = True
            self._may_ask_at = now + _ASK_INTERVAL_S
            self._missions.run(self._missions.preflight(), self._asked, now)

    def _asked(self, answer: StoreReport | Refusal, now: float) -> None:
        self._is_asking = False
        for upload in self._in(Asking):
            self._answered(upload, answer, now)

    def _answered(self, upload: Upload, answer: StoreReport | Refusal, now: float) -> None:
        if isinstance(answer, StoreReport) and (rejection := check_count(upload.count, answer.rules)):
            answer = Refusal(rejection.ack, rejection.finding.text())
        if isinstance(answer, Refusal):
            self._handle(upload, Ended(answer), now)
        else:
            check = begin_check(upload.count, answer.rules, self._missions.vehicle.place())
            self._handle(upload, Ready(upload.count, check), now)

    def _request(self, upload: Upload, now: float) -> None:
        """Request the lowest missing item, by id 40: the only one that Mission Planner understands in both modes."""
        state = upload.state
        assert isinstance(state, Receiving)
        state.request.asked(state.wanted, now)
        self._states_due = min(self._states_due, state.request.due)
        station = upload.station
        request = messages.MAVLink_mission_request_message(station.sysid, station.compid, state.wanted)
        self._ground.to(station, request)
        # Without items, a station at another address may have started again: it would take this request for its own
        # list's, whose MISSION_COUNT it repeats until it has one.
        if state.request.is_repeated and state.items:
            for elsewhere in self._elsewhere(upload, now):
                self._ground.to(elsewhere, request)

    def _deliver(
        self,
        upload: Upload,
        items: tuple[MissionItem, ...],
        verdict: Verdict[Any],
        on_done: Callable[[DeliveryResult | Refusal, float], None],
        now: float,
    ) -> None:
        """Store the list and write it; a rejected one is only stored, unless its sender sent too many of them."""
        is_kept = verdict.result is not Result.REJECTED or self._ground.allows(upload.station, Cost.STORED)
        arrived = ArrivedMission(str(upload.station), items, verdict)
        self._missions.run(self._missions.deliver(arrived, is_kept=is_kept), on_done, now)

    def _delivered(self, upload: Upload, verdict: Verdict[Any], delivery: DeliveryResult | Refusal, now: float) -> None:
        if isinstance(delivery, Refusal):
            self._end([upload], delivery, now)
            return
        accepted = delivery.ack is MissionResult.ACCEPTED
        if verdict.result is not Result.REJECTED and accepted and not delivery.change:
            self._flash.not_written(upload.station.peer)
        self.answers.tell(upload.station, verdict, delivery)
        if upload in self._uploads:
            self._answer(upload, delivery.ack, now)
            self._handle(upload, Delivered(), now)
        facts = {"mission": delivery.number, "ack": delivery.ack.name, "detail": delivery.text}
        self._note("mission.upload_ended", upload, "info" if accepted else "warning", **facts)

    def _refuse(self, upload: Upload, state: UploadState, refusal: Refusal, now: float) -> None:
        """Report the reason for the end of an upload; the received items are still stored."""
        if items := state.received:
            finding = Finding(None, "list", len(items), None, refusal.text)
            verdict: Verdict[Any] = Verdict(Result.REJECTED, refusal.ack, findings=(finding,))
            self._deliver(upload, items, verdict, lambda _result, _at: None, now)
            if state.is_closed:
                self.answers.remind(upload.station, refusal.text, now)
        self._ground.say(Severity.ERROR, refusal.text, upload.station)
        self._answer(upload, refusal.ack, now)
        self._note("mission.refused", upload, "warning", ack=refusal.ack.name, why=refusal.text)

    # Ground stations.

    def _of(self, station: Station) -> Upload | None:
        """The newest upload of a ground station: one may wait behind another that is being written."""
        return next((upload for upload in reversed(self._uploads) if upload.station == station), None)

    def _in(self, *states: type[UploadState]) -> list[Upload]:
        if not any(self._states[state] for state in states):
            return []
        return [upload for upload in self._uploads if type(upload.state) in states]

    def _undelivered(self) -> list[Upload]:
        return [upload for upload in self._uploads if not isinstance(upload.state, Delivering)]

    def _find(self, station: Station, now: float) -> Upload | None:
        """The newest upload of a ground station; it continues if its address has changed (Wi-Fi roaming).

        Not if it was answered at this address: then it has announced another list, and lists must never be mixed.
        """
        if self._of(station) is None and not self.answers.was_said_to(station, now):
            for upload in self._uploads:
                if self._ground.stations.has_moved(upload.station, station, now):
                    self._note("mission.station_moved", upload, before=str(upload.station), after=str(station))
                    upload.station = station
        return self._of(station)

    def _elsewhere(self, upload: Upload, now: float) -> list[Station]:
        """Other addresses of the upload's station, except those that have announced their own list."""
        announced = {other.station for other in self._uploads if other is not upload}
        return [
            where
            for where in self._ground.stations.moved_to(upload.station, now)
            if where not in announced and not self.answers.was_said_to(where, now)
        ]

    def _answer(self, upload: Upload, ack: MissionResult, now: float) -> None:
        if upload.is_superseded:
            # The station would attribute this ack to the list that it has announced since.
            return
        for where in (upload.station, *self._elsewhere(upload, now)):
            self.answers.end(where, ack, upload.count, now, upload.mission_type, is_cancelled=upload.is_cancelled)

    def _note(self, event: str, upload: Upload, level: Level = "info", **facts: object) -> None:
        self._log_event(level, event, **{"station": str(upload.station)} | facts, incident=upload.incident)


def _cancelled(why: str) -> Refusal:
    return Refusal(MissionResult.OPERATION_CANCELLED, f"Upload {why}, old mission kept")


STOPPED = _cancelled("ended: naze-bridge stops")
