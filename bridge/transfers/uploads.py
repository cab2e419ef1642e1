# SPDX-License-Identifier: GPL-3.0-or-later
"""A ground station writes a mission: the vehicle's side of MAVLink's upload (docs/mission-rules.md).

Lists are received in parallel, and written one at a time. Mission Planner loses some packets, and takes any ack to
MISSION_COUNT as "continue". Most special cases below respond to a behaviour listed in docs/ground-stations.md.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import inf
from typing import Any

from bridge.gcs.budget import Cost
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import Sender
from bridge.gcs.station import Peer
from bridge.line.conversation import Conversation
from bridge.missions.fc_mission_store import StoreReport
from bridge.missions.list_check import begin_check, check_count
from bridge.missions.mission_service import OCCUPIED, DeliveryResult, MissionService, MissionTransfer, TransferStep
from bridge.model.events import Emit, UploadEnded, UploadRefused, UploadStarted
from bridge.model.missions import ArrivedMission, Refusal
from bridge.transfers.arriving_list import WholeList
from bridge.transfers.downloads import MissionDownloads
from bridge.transfers.upload_answers import NEVER_ASK, UploadAnswers
from bridge.transfers.upload_states import (
    TRANSITIONS,
    Arrived,
    Asking,
    Cancelled,
    Complete,
    Delivered,
    Delivering,
    DeliveringDespiteCancel,
    DeliveringUnanswered,
    Ended,
    Event,
    Fixed,
    Ready,
    Receiving,
    Replaced,
    SenderFinished,
    Turn,
    Upload,
    UploadState,
    Waiting,
)
from bridge.voice import sentences
from bridge.voice.happening import Happening
from bridge.voice.mission_report import with_meant_home
from bridge.voice.stations import Kind
from protocols.float32 import is_single
from protocols.mavlink.codec import item_from_float_message, item_from_int_message
from protocols.mavlink.dialect import Message, messages
from protocols.mission_item import Command, MissionItem, MissionResult
from reports.finding import Finding
from reports.verdict import CLEARED_LIST, Result, Verdict

Handler = Callable[[Sender, Message, float], object]
_TOO_MANY_UPLOADS = Refusal(MissionResult.DENIED, sentences.TOO_MANY_UPLOADS())
#: A ground station that reads the mission has given up an upload that was silent for this long.
_SILENT_S = 1.0
#: An upload that waits for the end of another transfer looks again at this interval.
_LOOK_AGAIN_S = 0.05
_AGAIN = Replaced("the station started again")


class MissionUploads:
    """All ground stations' uploads and clears. `tick` leaves the states `Waiting` and `Complete` (`_turn`)."""

    def __init__(self, missions: MissionService, ground: Ground, emit: Emit) -> None:
        self._missions = missions
        self._ground = ground
        self._emit = emit
        #: In the order of their MISSION_COUNT.
        self._uploads: list[Upload] = []
        self.answers = UploadAnswers(ground, missions.mission_type, are_kept=missions.are_kept)
        #: The time of the next `tick`, or infinity without an upload or an answer to repeat.
        self.due = inf

    @property
    def receiving(self) -> MissionTransfer | None:
        for upload in self._within(Receiving):
            received = len(upload.state.received)
            return MissionTransfer(str(upload.sender), TransferStep.RECEIVING, received, upload.count)
        return None

    def is_writing(self, sender: Sender) -> bool:
        """True if an upload of this ground station runs or waits."""
        return self._of(sender) is not None

    # From ground stations.

    def count(self, sender: Sender, count: int, now: float) -> None:
        """MISSION_COUNT: an upload is announced, or cancelled with a count of 0."""
        if sender.is_late:
            return
        upload = self._of(sender)
        if upload is None:
            if not count and self.answers.repeat_cancelled(sender, now):
                return
            is_qgc = sender.station.behaviour.kind is Kind.QGROUNDCONTROL
            if not count and is_qgc and self.answers.are_only_missions_stored:
                # Its button Clear sends MISSION_CLEAR_ALL. This is a plan without waypoints, perhaps with a fence.
                sender.say(sentences.EMPTY_PLAN())
            self._begin(sender, count, now)
            return
        upload.heard_at, state = now, upload.state
        if not count:
            # A clear may be repeated.
            if upload.count:
                self._handle(upload, Cancelled(), now)
        elif count != upload.count or state.received or isinstance(state, Delivering):
            # Perhaps the same list, which the sender has also begun again.
            self._handle(upload, _AGAIN, now)
            self._begin(sender, count, now)
        elif isinstance(state, Receiving):
            self._request(upload, *state.repeats(now))

    def clear_all(self, sender: Sender, mission_type: int, now: float) -> None:
        """MISSION_CLEAR_ALL. `mission_type`: of the answer, MISSION or ALL."""
        upload = self._of(sender)
        if upload is not None:
            if not upload.count and not isinstance(upload.state, DeliveringUnanswered):
                return
            self._handle(upload, _AGAIN, now)
        self._begin(sender, 0, now, mission_type)

    def item(self, sender: Sender, item: MissionItem, now: float) -> None:
        upload = self._of(sender)
        if upload is None:
            self.answers.late_item(sender, item.seq, now)
            return
        if sender.is_late and sender.is_older(upload.number):
            # Delayed by the network: an item of the previous list.
            return
        upload.heard_at, state = now, upload.state
        if not isinstance(state, Receiving):
            # The next request or the final ack will follow anyway.
            state.item_repeated(now)
        elif item.seq >= upload.count:
            beyond = Refusal(MissionResult.INVALID_SEQUENCE, sentences.BEYOND_THE_COUNT(item.seq, upload.count))
            sender.refuse(beyond, self._missions.mission_type)
        elif (held := state.list.items.get(item.seq)) is not None and repr(held) != repr(item):
            # Of another list. Compared as text, because NaN, "not given", differs from itself.
            self._handle(upload, _AGAIN, now)
            self._begin(sender, upload.count, now)
        else:
            taken = state.list.take(item, sender, now)
            if isinstance(taken, int):
                self._request(upload, taken)
            elif taken is not None:
                self._handle(upload, Arrived(taken), now)
            else:
                self.due = min(self.due, state.due)

    def ack(self, sender: Sender, result: int, now: float) -> None:
        """MISSION_ACK from a ground station: an error cancels the upload, ACCEPTED ends "Write Fast"."""
        upload = self._of(sender)
        if upload is None:
            return
        upload.is_write_fast |= result == MissionResult.ACCEPTED
        if isinstance(upload.state, Delivering):
            return
        if result != MissionResult.ACCEPTED:
            self._handle(upload, Ended(_cancelled(sentences.CANCELLED_WITH(result))), now)
        elif upload.state.received:
            self._handle(upload, SenderFinished(), now)

    def reads(self, sender: Sender, now: float) -> None:
        """The ground station reads the mission: its silent upload ends without an ack, which it would misunderstand."""
        for upload in [*self._uploads]:
            if upload.sender == sender and now >= upload.heard_at + _SILENT_S:
                self._handle(upload, Replaced("the station is reading the mission"), now)

    # From the rest of the bridge.

    def end(self, refusal: Refusal, now: float) -> None:
        """End the uploads not yet delivered: the craft was armed, the flight controller lost, or the bridge stops."""
        for upload in self._within(Waiting, Asking, Receiving, Complete):
            self._handle(upload, Ended(refusal), now)

    def peer_gone(self, peer: Peer, now: float) -> None:
        """A ground station's connection is closed: the uploads end without waiting for the timeout."""
        for upload in self._within(Waiting, Asking, Receiving, Complete):
            if upload.sender.peer == peer:
                self._handle(upload, Ended(_cancelled(sentences.DISCONNECTED())), now)

    def tick(self, now: float) -> None:
        """Repeat requests and answers, end states at their deadlines, continue the uploads whose turn has come."""
        self.due = inf
        for upload in [*self._uploads]:
            state = upload.state
            if now >= state.deadline:
                self._handle(upload, Ended(state.timeout), now)
            elif now >= state.due:
                if state.received or isinstance(state, Delivering):
                    # Without items, a station there may have started again, and would take it for its own list's.
                    self._follow(upload, now)
                upload.has_losses |= isinstance(state, Receiving)
                self._request(upload, *state.repeats(now))
        self.answers.tick(now)
        for upload in self._within(Waiting, Complete):
            event = self._turn(upload, now)
            if event is not None:
                self._handle(upload, event, now)
        for upload in self._uploads:
            self.due = min(self.due, upload.state.due)
            if isinstance(upload.state, Waiting | Complete):
                self.due = min(self.due, now + _LOOK_AGAIN_S)
        self.due = min(self.due, self.answers.due)

    def _within(self, *states: type[UploadState]) -> list[Upload]:
        return [upload for upload in self._uploads if isinstance(upload.state, states)]

    # State changes of an upload.

    def _begin(self, sender: Sender, count: int, now: float, mission_type: int | None = None) -> None:
        mission_type = self._missions.mission_type if mission_type is None else mission_type
        self.answers.forget(sender)
        if not sender.station.allows(Cost.UPLOAD):
            # A flood must cost less than the lists that it announces: no log entry.
            sender.say(_TOO_MANY_UPLOADS.why)
            self.answers.end(sender, _TOO_MANY_UPLOADS.ack, 0, now, mission_type)
            return
        upload = Upload(sender, count, mission_type, now, sender.number)
        self._uploads.append(upload)
        self.due = 0.0
        armed = self._missions.armed_refusal()
        if armed is not None:
            self._handle(upload, Ended(armed), now)

    def _turn(self, upload: Upload, now: float) -> Event | None:
        """The event that continues an upload, None if it must wait for others."""
        state = upload.state
        if isinstance(state, Complete):
            refusal = self._missions.acquire(upload)
            is_write = state.whole.verdict.result is not Result.REJECTED
            if refusal is None and is_write and not upload.sender.station.allows(Cost.FLASH):
                refusal = Refusal(MissionResult.DENIED, sentences.FLASH_WEAR())
        else:
            refusal = self._missions.occupied()
        if refusal is not None:
            return None if refusal is OCCUPIED else Ended(refusal)
        is_clear = isinstance(state, Waiting) and not upload.count
        return Arrived(WholeList((), CLEARED_LIST)) if is_clear else Turn()

    def _handle(self, upload: Upload, event: Event, now: float) -> None:
        """Change the state of an upload, unless it has ended meanwhile."""
        if upload not in self._uploads:
            return
        before = upload.state
        after = TRANSITIONS[type(before)][type(event)]
        assert after is not Fixed.NEVER, f"{event} in {before}"
        if isinstance(after, type):
            upload.state = after(upload, event, now)
            self.due = 0.0 if after is Complete else min(self.due, upload.state.due)
        elif after is Fixed.END:
            self._uploads.remove(upload)
            self._missions.release(upload)
            self.due = 0.0 if self._uploads else self.due
        if isinstance(before, Receiving) or isinstance(upload.state, Receiving):
            self._missions.is_arriving = bool(self._within(Receiving))
        match event:
            case Turn() if isinstance(before, Complete):
                held = self._missions.held
                upload.is_part = held is not None and _is_part(before.whole.verdict.items, held.items)
                delivered = partial(self._delivered, upload, before.whole.verdict)
                self._missions.run(self._delivery(upload, before.whole), delivered, now)
            case Turn():
                if self._within(Asking) == [upload]:
                    # The reply serves all that wait for it.
                    self._missions.run(self._missions.preflight(), self._asked, now)
            case Ready():
                self._emit(UploadStarted(station=str(upload.sender), count=upload.count))
                self._request(upload, 0)
            case Cancelled() if after is Fixed.END:
                self._refuse(upload, _cancelled(sentences.CANCELLED()), now)
            case Replaced(why) if after is Fixed.END:
                self._emit_refusal(upload, _cancelled(sentences.SUPERSEDED(why)))
            case Ended(refusal):
                self._refuse(upload, refusal, now)
        self.due = min(self.due, self.answers.due)

    def _asked(self, answer: StoreReport | Refusal, now: float) -> None:
        """The flight controller has answered whether it can take a list."""
        for upload in self._within(Asking):
            event: Event
            if isinstance(answer, Refusal):
                event = Ended(answer)
            elif rejection := check_count(upload.count, answer.rules):
                event = Ended(Refusal(rejection.ack, sentences.REJECTED(rejection.finding.text())))
            else:
                event = Ready(begin_check(upload.count, answer.rules, self._missions.vehicle.place()))
            self._handle(upload, event, now)

    def _request(self, upload: Upload, *seqs: int) -> None:
        """Request items in one datagram."""
        state, to = upload.state, upload.sender
        if isinstance(state, Receiving):
            self.due = min(self.due, state.list.request.due)
        # MISSION_REQUEST (40), because in INT mode Mission Planner understands only that.
        ids, kind = (to.sysid, to.compid), self._missions.mission_type
        make = partial(messages.MAVLink_mission_request_message, *ids, mission_type=kind)
        to.to(*map(make, seqs))

    def _delivery(self, upload: Upload, whole: WholeList) -> Conversation[DeliveryResult]:
        """Store the list and write it. A rejected list is only stored, unless the sender sent too many of them."""
        is_kept = whole.verdict.result is not Result.REJECTED or upload.sender.station.allows(Cost.STORED)
        arrived = ArrivedMission(
            str(upload.sender), whole.items, whole.verdict, upload.sender.identity, lambda: upload.is_write_fast
        )
        return self._missions.deliver(arrived, is_kept=is_kept)

    def _delivered(self, upload: Upload, verdict: Verdict[Any], delivery: DeliveryResult | Refusal, now: float) -> None:
        if isinstance(delivery, Refusal):
            self._handle(upload, Ended(delivery), now)
            return
        accepted = delivery.ack is MissionResult.ACCEPTED
        if accepted and upload.is_part:
            upload.sender.say(sentences.PART_OF_LAST())
        self.answers.report(upload.sender, with_meant_home(verdict) if upload.is_write_fast else verdict, delivery)
        if upload in self._uploads:
            self._answer(upload, delivery.ack, now)
            self._handle(upload, Delivered(), now)
        self._emit(
            UploadEnded(
                level="info" if accepted else "warning",
                station=str(upload.sender),
                mission=delivery.number,
                ack=delivery.ack.name,
                detail=delivery.text,
            )
        )

    def _refuse(self, upload: Upload, refusal: Refusal, now: float) -> None:
        """Report the reason for the end of an upload. The received items are still stored."""
        items = upload.state.received
        if items:
            finding = Finding(None, "list", len(items), None, refusal.text)
            whole = WholeList(items, Verdict(Result.REJECTED, refusal.ack, findings=(finding,)))
            self._missions.run(self._delivery(upload, whole), lambda _result, _at: None, now)
        upload.sender.say(refusal.why)
        self._answer(upload, refusal.ack, now)
        self._emit_refusal(upload, refusal)

    def _of(self, sender: Sender) -> Upload | None:
        """The newest upload of a ground station: one may wait behind another that is being written."""
        for upload in reversed(self._uploads):
            if upload.sender == sender:
                return upload
        for upload in self._uploads:
            self._follow(upload, sender.station.heard_at)
            if upload.sender == sender:
                return upload
        return None

    def _follow(self, upload: Upload, now: float) -> None:
        """A station whose address has changed goes on from there, unless it has begun another list there."""
        there = self._ground.moved(upload.sender, now)
        if there is upload.sender or self.answers.has_answered(there, now):
            return
        upload.sender = there
        if isinstance(upload.state, Receiving):
            upload.state.list.moved()

    def _answer(self, upload: Upload, ack: MissionResult, now: float) -> None:
        state = upload.state
        if isinstance(state, DeliveringUnanswered):
            return
        is_cancelled = isinstance(state, DeliveringDespiteCancel)
        again_to = NEVER_ASK[upload.has_losses] if isinstance(state, Delivering) else ()
        to, count, kind = upload.sender, upload.count, upload.mission_type
        self.answers.end(to, ack, count, now, kind, is_cancelled=is_cancelled, again_to=again_to)

    def _emit_refusal(self, upload: Upload, refusal: Refusal) -> None:
        self._emit(UploadRefused(station=str(upload.sender), ack=refusal.ack.name, why=refusal.text))


def _is_part(items: Sequence[MissionItem], before: Sequence[MissionItem]) -> bool:
    """True if a list is the one before without some items, as Resume Mission writes it, apart from a TAKEOFF."""
    former = iter(before[1:])
    kept = [item for item in items[1:] if item.command != Command.NAV_TAKEOFF]
    return 0 < len(kept) < len(before) - 1 and all(any(_is_same(item, each) for each in former) for item in kept)


def _is_same(item: MissionItem, former: MissionItem) -> bool:
    """True also if a MISSION_ITEM, which Resume Mission sends, has rounded the coordinates."""
    moved = replace(item, seq=former.seq, lat_e7=former.lat_e7, lon_e7=former.lon_e7)
    pairs = (item.lat_e7, former.lat_e7), (item.lon_e7, former.lon_e7)
    return moved == former and all(is_single((sent or 0) / 1e7, (held or 0) / 1e7) for sent, held in pairs)


def _cancelled(why: Happening) -> Refusal:
    return Refusal(MissionResult.OPERATION_CANCELLED, why)


STOPPED = _cancelled(sentences.BRIDGE_STOPS())
FC_LOST = Refusal(MissionResult.DENIED, sentences.LOST_DURING_UPLOAD())


def mission_handlers(uploads: MissionUploads, downloads: MissionDownloads) -> Mapping[int, Handler]:
    """The messages of mission transfers."""
    return {
        messages.MAVLINK_MSG_ID_MISSION_COUNT: lambda s, msg, now: uploads.count(s, msg.count, now),
        messages.MAVLINK_MSG_ID_MISSION_ITEM: lambda s, msg, now: uploads.item(s, item_from_float_message(msg), now),
        messages.MAVLINK_MSG_ID_MISSION_ITEM_INT: lambda s, msg, now: uploads.item(s, item_from_int_message(msg), now),
        messages.MAVLINK_MSG_ID_MISSION_ACK: lambda s, msg, now: uploads.ack(s, msg.type, now),
        messages.MAVLINK_MSG_ID_MISSION_CLEAR_ALL: lambda s, msg, now: uploads.clear_all(s, msg.mission_type, now),
        messages.MAVLINK_MSG_ID_MISSION_WRITE_PARTIAL_LIST: lambda s, _, now: uploads.answers.partial_list(s, now),
        messages.MAVLINK_MSG_ID_MISSION_REQUEST_LIST: lambda s, _, now: downloads.request_list(s, now),
        messages.MAVLINK_MSG_ID_MISSION_REQUEST: lambda s, msg, now: downloads.request(s, msg.seq, now, as_int=False),
        messages.MAVLINK_MSG_ID_MISSION_REQUEST_INT: lambda s, msg, now: downloads.request(
            s, msg.seq, now, as_int=True
        ),
    }
