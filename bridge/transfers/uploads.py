# SPDX-License-Identifier: GPL-3.0-or-later
"""A ground station writes a mission: the vehicle's side of MAVLink's upload (docs/mission-rules.md).

Uploads run one at a time, in the order of their MISSION_COUNT. If slow or numerous lists would lock out the others,
they are received in parallel and written one at a time. Mission Planner loses some packets, and takes any ack to
MISSION_COUNT as "continue"; most special cases below respond to a behaviour listed in docs/ground-stations.md.
"""

from collections.abc import Callable, Iterator
from functools import partial
from math import inf
from typing import Any

from bridge.gcs.cost import Cost
from bridge.gcs.flash_budget import TOO_MANY_WRITES
from bridge.gcs.ground import Ground
from bridge.gcs.station import Peer, Severity, Station
from bridge.gcs.stations import MAX_PEERS
from bridge.line.conversation import Conversation
from bridge.missions.fc_mission_store import StoreReport
from bridge.missions.list_check import begin_check, check_count
from bridge.missions.mission_service import OCCUPIED, DeliveryResult, MissionService, MissionTransfer, TransferStep
from bridge.model.events import Emit, StationMoved, UploadEnded, UploadRefused, UploadStarted
from bridge.model.finding import Finding
from bridge.model.mission_log import ArrivedMission
from bridge.model.refusal import Refusal
from bridge.model.verdict import CLEARED_LIST, Result, Verdict
from bridge.transfers.upload_answers import UploadAnswers
from bridge.transfers.upload_list import UploadList
from bridge.transfers.upload_states import (
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

_MISSION = int(messages.MAV_MISSION_TYPE_MISSION)
_TOO_MANY_UPLOADS = Refusal(MissionResult.DENIED, "Too many uploads: wait a few seconds")
#: The maximum number of simultaneous uploads: one for each peer of a link.
_MOST_UPLOADS = MAX_PEERS
#: A ground station that reads has given up an upload of which nothing was heard for this long.
_SILENT_S = 1.0
_AGAIN = "the station started again"
#: The minimum interval between asking the flight controller if it can take a list; one reply serves all that wait.
_ASK_INTERVAL_S = 0.2


class MissionUploads:
    """All ground stations' uploads and clears. `let_read` is called after a text that the pilot must read."""

    def __init__(
        self,
        missions: MissionService,
        ground: Ground,
        emit: Emit,
        incidents: Iterator[int],
        let_read: Callable[[Peer], None],
    ) -> None:
        self._missions = missions
        self._ground = ground
        self._emit = emit
        self._incidents = incidents
        self._flash = ground.flash
        self._uploads = UploadList()
        self._let_read = let_read
        self.answers = UploadAnswers(ground, let_read)
        #: False while nothing is due: no upload runs, and no reminder waits.
        self.is_active = False
        self._is_asking = False
        self._may_ask_at = 0.0

    @property
    def receiving(self) -> MissionTransfer | None:
        """The upload that receives items."""
        for upload in self._uploads.within(Receiving):
            source, received = str(upload.station), len(upload.state.received)
            return MissionTransfer(source, TransferStep.RECEIVING, received, upload.count)
        return None

    def is_writing(self, station: Station) -> bool:
        """True if an upload of this ground station runs or waits."""
        return self._uploads.of(station) is not None

    # From ground stations.

    def count(self, station: Station, count: int, now: float) -> None:
        """MISSION_COUNT: an upload is announced."""
        present = self._find(station, now)
        if present is not None:
            present.heard_at = now
        if present is None and not count and self.answers.repeat_cancelled(station, now):
            return
        if present is None or not self._is_for(present, count, now):
            self._begin(station, count, now, is_next=present is not None)

    def clear_all(self, station: Station, mission_type: int, now: float) -> None:
        """MISSION_CLEAR_ALL. `mission_type`: of the answer, MISSION or ALL."""
        present = self._find(station, now)
        if present is not None and not isinstance(present.state, Delivering):
            self._supersede(present, _AGAIN, now)
        elif present is not None and present.count == 0:
            return
        self._begin(station, 0, now, mission_type)

    def item(self, station: Station, item: MissionItem, now: float) -> None:
        """MISSION_ITEM or MISSION_ITEM_INT."""
        upload = self._find(station, now)
        if upload is None:
            self.answers.late_item(station, item.seq, now, is_lost=not self._uploads)
            return
        upload.heard_at, state = now, upload.state
        if not isinstance(state, Receiving):
            # The next request or the final ack will follow anyway.
            if isinstance(state, Complete | Delivering):
                upload.remind_later(now)
            return
        if item.seq >= upload.count:
            text = f"WP {item.seq} is beyond the {upload.count} items announced"
            self._ground.refuse(station, Refusal(MissionResult.INVALID_SEQUENCE, text))
            return
        if state.is_of_another_list(item):
            # Two lists must never be mixed: the previous one is discarded.
            self._supersede(upload, _AGAIN, now)
            self._begin(station, upload.count, now, is_next=True)
            return
        if state.is_doubtful(item, now):
            self._uploads.schedule(upload)
            return
        taken = state.take(item, now)
        if isinstance(taken, Judged):
            upload.remind_later(now)
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
            self._uploads.schedule(upload)

    def reads(self, station: Station, now: float) -> None:
        """The ground station reads the mission: its silent upload ends without an ack, which it would misunderstand."""
        for upload in [upload for upload in self._uploads if upload.station == station]:
            if now < upload.heard_at + _SILENT_S:
                continue
            if isinstance(upload.state, Delivering):
                upload.is_superseded, upload.reminder_at = True, inf
            else:
                self._supersede(upload, "the station reads the mission", now)

    # From the rest of the bridge.

    def end(self, refusal: Refusal, now: float) -> None:
        """End the uploads that have not reached the flight controller: the craft was armed, or the bridge stops."""
        self._end(self._uploads.undelivered(), refusal, now)

    def peer_gone(self, peer: Peer, now: float) -> None:
        """A ground station's connection is closed: its uploads end without waiting for the timeout."""
        gone = [upload for upload in self._uploads.undelivered() if upload.station.peer == peer]
        self._end(gone, _cancelled("ended: disconnected"), now)

    def link_lost(self, now: float) -> None:
        """The flight controller is gone: uploads that still receive items end."""
        receiving = self._uploads.within(Receiving, Complete)
        self._end(receiving, Refusal(MissionResult.DENIED, "Flight controller lost during the upload"), now)

    def tick(self, now: float) -> None:
        """Repeat a request, end a state at its deadline, begin the next upload."""
        if now >= self._uploads.due:
            for upload in [*self._uploads]:
                state = upload.state
                if now >= state.deadline:
                    self._end([upload], state.timeout, now)
                elif isinstance(state, Receiving) and now >= state.request.due:
                    state.request.lost(now)
                    self._request(upload, now)
                elif now >= upload.reminder_at:
                    upload.remind_later(now)
                    if upload.reminder_at < inf:
                        # MAVSDK allows five repeats; only a request for the item after the one before resets its count.
                        self._send_requests(upload.station, *range(max(upload.count - 2, 0), upload.count))
            self._uploads.due = min((upload.next_tick() for upload in self._uploads), default=inf)
        if now >= self.answers.due:
            self.answers.tick(now)
        self._begin_next(now)
        self._ask(now)
        self.is_active = bool(self._uploads) or self.answers.due < inf

    def next_deadline(self) -> float:
        # Asked after each datagram of a flood.
        uploads = self._uploads
        arriving, waiting = uploads.has(Asking, Receiving), uploads.has(Waiting)
        is_free = self._missions.occupied() is not OCCUPIED
        if is_free and (uploads.has(Complete) or (waiting and not arriving)):
            return 0.0
        times = [uploads.due, self.answers.due]
        times += [self._may_ask_at] if uploads.has(Asking) and not self._is_asking else []
        times += [uploads.waits_until] if is_free and waiting and arriving else []
        return min(times)

    # State changes of an upload.

    def _begin(
        self, station: Station, count: int, now: float, mission_type: int = _MISSION, *, is_next: bool = False
    ) -> None:
        self.is_active = True
        is_next |= self.answers.forget(station)
        for older in self._uploads:
            older.is_superseded |= older.station == station
        if not self._ground.allows(station, Cost.UPLOAD):
            # A flood must cost less than the lists that it announces: no incident, no log entry.
            self._ground.say(Severity.ERROR, _TOO_MANY_UPLOADS.text, station)
            self.answers.end(station, _TOO_MANY_UPLOADS.ack, count, now, mission_type)
            return
        incident = f"upload-{next(self._incidents)}"
        upload = Upload(station, count, incident, Waiting(Announced(), now), mission_type, now, is_next)
        self._uploads.add(upload)
        armed = self._missions.armed_refusal()
        if armed is not None:
            self._end([upload], armed, now)
        elif len(self._uploads) > _MOST_UPLOADS:
            ended = self._uploads.least_worth(self._ground.has_standing)
            self._end([ended], _cancelled("ended: too many at once"), now)
        self._begin_next(now)

    def _begin_next(self, now: float) -> None:
        """Continue the uploads whose turn has come: first that of the host that has written least."""
        due = self._uploads.within(Waiting, Complete)
        for upload in sorted(due, key=lambda upload: self._flash.used(upload.station.peer)):
            event = self._turn(upload, now)
            if event is not None:
                self._handle(upload, event, now)

    def _turn(self, upload: Upload, now: float) -> Event | None:
        """The event that continues an upload, None if it must wait for others."""
        state = upload.state
        if isinstance(state, Complete):
            refusal = self._missions.acquire(upload)
            is_write = state.judged.verdict.result is not Result.REJECTED
            if refusal is None and is_write and not self._flash.allows(upload.station.peer, now):
                refusal = Refusal(MissionResult.DENIED, TOO_MANY_WRITES)
        else:
            refusal = OCCUPIED if self._uploads.must_wait(now) else self._missions.occupied()
        if refusal is not None:
            return None if refusal is OCCUPIED else Ended(refusal)
        is_clear = isinstance(state, Waiting) and not upload.count
        return Judged((), CLEARED_LIST) if is_clear else Turn()

    def _handle(self, upload: Upload, event: Event, now: float) -> None:
        before = upload.state
        after = TRANSITIONS[type(before)][type(event)]
        if after is None:
            self._forget(upload, now)
        else:
            self._uploads.change(upload, after(event, now))
        match event:
            case Turn() if isinstance(before, Complete):
                delivered = partial(self._delivered, upload, before.judged.verdict)
                self._missions.run(self._delivery(upload, before.judged), delivered, now)
            case Turn():
                self._uploads.begins_to_arrive(upload, now)
            case Ready():
                self._emit(UploadStarted(station=str(upload.station), count=upload.count, incident=upload.incident))
                self._request(upload, now)
            case Ended(refusal):
                self._refuse(upload, before, refusal, now)

    def _end(self, uploads: list[Upload], refusal: Refusal, now: float) -> None:
        for upload in uploads:
            if upload in self._uploads:
                self._handle(upload, Ended(refusal), now)

    def _forget(self, upload: Upload, now: float) -> None:
        self._uploads.remove(upload, now)
        self._missions.release(upload)

    def _supersede(self, upload: Upload, why: str, now: float) -> None:
        """Drop an upload without an answer: its station would attribute it to the transfer that it begins now."""
        self._emit_refusal(upload, Refusal(MissionResult.OPERATION_CANCELLED, f"superseded: {why}"))
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
            upload.count, upload.mission_type = count, _MISSION
            return True
        if count != upload.count or isinstance(state, Complete):
            self._supersede(upload, _AGAIN, now)
            return False
        if isinstance(state, Receiving):
            state.doubt()
            self._request(upload, now)
        return True

    def _ask(self, now: float) -> None:
        """Ask the flight controller whether it can take a list, for all uploads that wait for the reply."""
        if self._uploads.has(Asking) and not self._is_asking and now >= self._may_ask_at:
            self._is_asking = True
            self._may_ask_at = now + _ASK_INTERVAL_S
            self._missions.run(self._missions.preflight(), self._asked, now)

    def _asked(self, answer: StoreReport | Refusal, now: float) -> None:
        self._is_asking = False
        for upload in self._uploads.within(Asking):
            event: Event
            if isinstance(answer, Refusal):
                event = Ended(answer)
            elif rejection := check_count(upload.count, answer.rules):
                event = Ended(Refusal(rejection.ack, rejection.finding.text()))
            else:
                check = begin_check(upload.count, answer.rules, self._missions.vehicle.place())
                event = Ready(upload.count, check, upload.is_next)
            self._handle(upload, event, now)

    def _request(self, upload: Upload, now: float) -> None:
        """Request the lowest missing item, or item 0 to learn if it is still the same list."""
        state = upload.state
        assert isinstance(state, Receiving)
        state.request.asked(state.wanted, now)
        self._uploads.schedule(upload)
        self._send_requests(upload.station, state.wanted)
        # Without items, a station at another address may have started again: it would take this request for its own
        # list's, whose MISSION_COUNT it repeats until it has one.
        if state.request.is_repeated and state.items:
            for elsewhere in self._elsewhere(upload, now):
                self._send_requests(elsewhere, state.wanted)

    def _send_requests(self, station: Station, *seqs: int) -> None:
        """Request items in one datagram, by id 40: the only one that Mission Planner understands in both modes."""
        request = partial(messages.MAVLink_mission_request_message, station.sysid, station.compid)
        self._ground.to(station, *map(request, seqs))

    def _delivery(self, upload: Upload, judged: Judged) -> Conversation[DeliveryResult]:
        """Store the list and write it; a rejected one is only stored, unless its sender sent too many of them."""
        is_kept = judged.verdict.result is not Result.REJECTED or self._ground.allows(upload.station, Cost.STORED)
        arrived = ArrivedMission(str(upload.station), judged.items, judged.verdict, upload.station.identity)
        return self._missions.deliver(arrived, is_kept=is_kept)

    def _delivered(self, upload: Upload, verdict: Verdict[Any], delivery: DeliveryResult | Refusal, now: float) -> None:
        if isinstance(delivery, Refusal):
            self._end([upload], delivery, now)
            return
        accepted = delivery.ack is MissionResult.ACCEPTED
        if verdict.result is not Result.REJECTED and accepted and not delivery.change:
            self._flash.not_written(upload.station.peer)
        self.answers.report(upload.station, verdict, delivery)
        if upload in self._uploads:
            self._answer(upload, delivery.ack, now)
            self._handle(upload, Delivered(), now)
        self._emit(
            UploadEnded(
                level="info" if accepted else "warning",
                station=str(upload.station),
                mission=delivery.number,
                ack=delivery.ack.name,
                detail=delivery.text,
                incident=upload.incident,
            )
        )

    def _refuse(self, upload: Upload, state: UploadState, refusal: Refusal, now: float) -> None:
        """Report the reason for the end of an upload; the received items are still stored."""
        if items := state.received:
            finding = Finding(None, "list", len(items), None, refusal.text)
            judged = Judged(items, Verdict(Result.REJECTED, refusal.ack, findings=(finding,)))
            self._missions.run(self._delivery(upload, judged), lambda _result, _at: None, now)
            if state.is_closed:
                self.answers.remind(upload.station, refusal.text, now)
        self._ground.say(Severity.ERROR, refusal.text, upload.station)
        self._let_read(upload.station.peer)
        self._answer(upload, refusal.ack, now)
        self._emit_refusal(upload, refusal)

    # Ground stations.

    def _find(self, station: Station, now: float) -> Upload | None:
        """The newest upload of a ground station; it continues if its address has changed (Wi-Fi roaming).

        Not if it was answered at this address: then it has announced another list, and lists must never be mixed.
        """
        if self._uploads.of(station) is None and not self.answers.was_said_to(station, now):
            for upload in self._uploads:
                if self._ground.stations.has_moved(upload.station, station, now):
                    before, after = str(upload.station), str(station)
                    self._emit(StationMoved(before=before, after=after, incident=upload.incident))
                    upload.station = station
        return self._uploads.of(station)

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
            # The station would attribute this ack to the transfer that it has begun since.
            return
        is_repeated = isinstance(upload.state, Delivering) and upload.count > 0
        for where in (upload.station, *self._elsewhere(upload, now)):
            self.answers.end(
                where,
                ack,
                upload.count,
                now,
                upload.mission_type,
                is_cancelled=upload.is_cancelled,
                is_repeated=is_repeated,
            )

    def _emit_refusal(self, upload: Upload, refusal: Refusal) -> None:
        station, ack = str(upload.station), refusal.ack.name
        self._emit(UploadRefused(station=station, ack=ack, why=refusal.text, incident=upload.incident))


def _cancelled(why: str) -> Refusal:
    return Refusal(MissionResult.OPERATION_CANCELLED, f"Upload {why}, old mission kept")


STOPPED = _cancelled("ended: naze-bridge stops")
