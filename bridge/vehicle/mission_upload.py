# SPDX-License-Identifier: GPL-3.0-or-later
"""A ground station writes a mission: the vehicle's side of MAVLink's upload (mission-rules.md, clients.md).

One transfer at a time. Mission Planner eats its own packets and takes any ack to MISSION_COUNT as "go on"; what is odd
below is so because of that, and clients.md says which of its habits it answers.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from bridge.gcs.cost import TOO_MANY_WRITES, Cost
from bridge.gcs.station import Peer, Post, Severity, Station
from bridge.line.conversation import LinkLost
from bridge.line.runner import Runner
from bridge.missions.fc_mission_store import StoreReport
from bridge.missions.list_check import ListCheck, begin_check, check_count
from bridge.missions.mission_service import NO_LINK, Delivery, MissionService
from bridge.missions.mission_texts import finding_lines
from bridge.model.events import EventLog, Incidents
from bridge.model.finding import Finding, News
from bridge.model.mission_log import ArrivedMission
from bridge.model.refusal import ARMED, Refusal
from bridge.model.verdict import CLEARED_LIST, Result, Verdict
from bridge.vehicle.item_request import ItemRequest
from bridge.vehicle.recent_answers import RecentAnswers
from protocols.mavlink.dialect import messages
from protocols.mission_item import MissionItem, MissionResult

MISSION_TYPE_MISSION = 0
MISSION_TYPE_ALL = 255
_GIVE_UP_S = 5.0
_TOO_MANY_UPLOADS = Refusal(MissionResult.DENIED, "Too many uploads: wait a few seconds")


class Phase(Enum):
    """A transfer's life. It begins with MISSION_COUNT and ends with the final MISSION_ACK."""

    ASKING = "asking the flight controller whether it would take a list"
    RECEIVING = "items come in"
    DELIVERING = "stored, pushed and verified"


@dataclass(slots=True)
class _Transfer:
    incident: str
    station: Station
    count: int
    phase: Phase = Phase.ASKING
    check: ListCheck | None = None
    items: dict[int, MissionItem] = field(default_factory=dict)
    checked: int = 0  # items 0..checked-1 are there and have been checked
    progress_at: float = 0.0
    request: ItemRequest = field(default_factory=ItemRequest)
    announced_again: bool = False  # begun anew, or a COUNT that the network repeated: the next item tells


class MissionUploads:
    """All ground stations' uploads and clears. Time is passed in; messages go out through `post`."""

    def __init__(
        self,
        missions: MissionService,
        runner: Runner,
        post: Post,
        log_event: EventLog,
        incidents: Incidents,
        fallback_home: Callable[[], tuple[int, int] | None],
        moved_to: Callable[[Station, float], list[Station]],
    ) -> None:
        self._missions = missions
        self._runner = runner
        self._post = post
        self._log_event = log_event
        self._incidents = incidents
        self._fallback_home = fallback_home
        self._moved_to = moved_to
        self._transfer: _Transfer | None = None
        self._answers = RecentAnswers(moved_to)
        self._queued: tuple[Station, int] | None = None
        self._is_asking = False

    @property
    def phase(self) -> Phase | None:
        """Where the present transfer stands; None if there is none."""
        return None if self._transfer is None else self._transfer.phase

    def is_writing(self, station: Station) -> bool:
        """Tell whether the present transfer is this ground station's."""
        return self._transfer is not None and self._transfer.station == station

    def count(self, station: Station, count: int, mission_type: int, now: float) -> None:
        """MISSION_COUNT: a transfer is announced."""
        if mission_type != MISSION_TYPE_MISSION:
            self._ack(station, MissionResult.UNSUPPORTED, mission_type)
            return
        self._follow(station, now)
        present = self._transfer
        if present is not None and present.station == station:
            if present.phase is Phase.DELIVERING:
                # The list before is being written: what is proven first, then the new one. A cancel comes too late.
                if count:
                    self._queued = (station, count)
                return
            if count == 0:
                # Mission Planner's Cancel button. The pilot did not ask to lose the mission that is in the craft.
                self._cancel(now, "cancelled")
                return
            if count == present.count:
                if present.phase is Phase.RECEIVING:
                    present.announced_again = bool(present.items)
                    self._request(present, now)
                return
            self._end(now)
        self._answers.forget(station)
        transfer = _Transfer(self._incidents.begin("upload"), station, count)
        refusal = self._missions.armed_refusal() or self._limit(station) or self._missions.acquire(station)
        if refusal is not None:
            self._refuse(transfer, refusal, now)
            return
        if count == 0:
            self._deliver(transfer, CLEARED_LIST, (), now)
            return
        self._transfer = transfer
        if not self._is_asking:
            # One question serves all transfers that are begun before it is answered.
            self._is_asking = True
            self._runner.start(self._missions.preflight(), self._asked, now)

    def clear_all(self, station: Station, mission_type: int, now: float) -> None:
        """MISSION_CLEAR_ALL."""
        if mission_type not in (MISSION_TYPE_MISSION, MISSION_TYPE_ALL):
            self._ack(station, MissionResult.UNSUPPORTED, mission_type)
            return
        self._follow(station, now)
        present = self._transfer
        if present is not None and present.station == station:
            if present.phase is Phase.DELIVERING:
                if present.count:
                    self._queued = (station, 0)
                return
            self._end(now)
        self.count(station, 0, MISSION_TYPE_MISSION, now)

    def item(self, station: Station, item: MissionItem, mission_type: int, now: float) -> None:
        """MISSION_ITEM or MISSION_ITEM_INT."""
        if mission_type != MISSION_TYPE_MISSION:
            self._ack(station, MissionResult.UNSUPPORTED, mission_type)
            return
        self._follow(station, now)
        transfer = self._transfer
        if transfer is None or transfer.station != station:
            self._late_item(station, item.seq, now)
            return
        if transfer.phase is not Phase.RECEIVING:
            # Its answer is on the way: the final ack, or nothing.
            return
        if item.seq >= transfer.count:
            self._post.say(
                Severity.ERROR, f"WP {item.seq} is beyond the {transfer.count} items that were announced", station
            )
            self._ack(station, MissionResult.INVALID_SEQUENCE)
            return
        if transfer.announced_again:
            transfer.announced_again = False
            if item.seq == 0:
                # Two lists must never be mixed: nothing of the former one is kept.
                self._end(now)
                self.count(station, transfer.count, mission_type, now)
                return
        assert transfer.check is not None
        is_repeat = item.seq in transfer.items
        if not is_repeat:
            if item.seq == transfer.checked:
                transfer.request.answered(now)
            transfer.items[item.seq] = item
            transfer.progress_at = now
            while transfer.checked in transfer.items:
                rejection = transfer.check.take(transfer.items[transfer.checked])
                if rejection is not None:
                    self._reject(transfer, now)
                    return
                transfer.checked += 1
        if transfer.checked < transfer.count:
            if not is_repeat or not transfer.request.is_copy(now):
                self._request(transfer, now)
            return
        items = tuple(transfer.items[seq] for seq in range(transfer.count))
        self._deliver(transfer, transfer.check.finish(), items, now)

    def partial_list(self, station: Station, now: float) -> None:
        """MISSION_WRITE_PARTIAL_LIST: Mission Planner's answer to a refusal that it did not understand."""
        answer = self._answers.to(station, now)
        if answer is not None and answer.is_refusal:
            self._ack(station, answer.ack)
            return
        self._post.say(Severity.ERROR, "A mission can only be written as a whole", station)
        self._ack(station, MissionResult.UNSUPPORTED)

    def ack(self, station: Station, result: int, now: float) -> None:
        """MISSION_ACK from a ground station: an error cancels its transfer."""
        self._follow(station, now)
        transfer = self._transfer
        if transfer is None or transfer.station != station or result == MissionResult.ACCEPTED:
            return
        if transfer.phase is not Phase.DELIVERING:
            self._cancel(now, f"cancelled (result {result})")

    def armed(self, now: float) -> None:
        """The craft was armed: a transfer that is not yet with the flight controller ends."""
        transfer = self._transfer
        if transfer is not None and transfer.phase is not Phase.DELIVERING:
            self._abandon(transfer, ARMED, now)

    def peer_gone(self, peer: Peer, now: float) -> None:
        """A ground station's connection is closed: others need not wait for its upload to time out."""
        transfer = self._transfer
        if transfer is not None and transfer.station.peer == peer and transfer.phase is not Phase.DELIVERING:
            self._cancel(now, "ended by hanging up")

    def stop(self, now: float) -> None:
        """The bridge is about to end: what is not yet with the flight controller does not get there any more."""
        transfer = self._transfer
        if transfer is not None and transfer.phase is not Phase.DELIVERING:
            self._cancel(now, "ended: naze-bridge stops")

    def link_lost(self, now: float) -> None:
        """The flight controller is gone: so is the reason to go on receiving."""
        transfer = self._transfer
        if transfer is not None and transfer.phase is Phase.RECEIVING:
            refusal = Refusal(MissionResult.DENIED, "Flight controller lost during the upload")
            self._abandon(transfer, refusal, now)

    def tick(self, now: float) -> None:
        """Repeat a request, or give a silent ground station up."""
        transfer = self._transfer
        if transfer is None or transfer.phase is not Phase.RECEIVING:
            return
        if now >= transfer.progress_at + _GIVE_UP_S:
            self._cancel(now, f"silent for {_GIVE_UP_S:.0f} s")
        elif now >= transfer.request.due:
            transfer.request.lost()
            self._request(transfer, now)

    def next_deadline(self) -> float | None:
        """Return when `tick` has something to do."""
        transfer = self._transfer
        if transfer is None or transfer.phase is not Phase.RECEIVING:
            return None
        return min(transfer.request.due, transfer.progress_at + _GIVE_UP_S)

    def _limit(self, station: Station) -> Refusal | None:
        return None if self._post.allows(station, Cost.BOARD) else _TOO_MANY_UPLOADS

    def _asked(self, answer: StoreReport | Refusal | LinkLost, now: float) -> None:
        self._is_asking = False
        if isinstance(answer, LinkLost):
            answer = NO_LINK
        transfer = self._transfer
        if transfer is None or transfer.phase is not Phase.ASKING:
            return
        if isinstance(answer, Refusal):
            self._abandon(transfer, answer, now)
            return
        rejection = check_count(transfer.count, answer.rules)
        if rejection is not None:
            self._abandon(transfer, Refusal(rejection.ack, rejection.finding.text()), now)
            return
        transfer.check = begin_check(transfer.count, answer.rules, self._fallback_home())
        transfer.phase = Phase.RECEIVING
        transfer.progress_at = now
        self._log_event(
            "info",
            "mission.upload_started",
            station=str(transfer.station),
            count=transfer.count,
            incident=transfer.incident,
        )
        self._request(transfer, now)

    def _request(self, transfer: _Transfer, now: float) -> None:
        """Ask for the lowest missing item; id 40, the only one that Mission Planner understands in both modes."""
        seq = 0 if transfer.announced_again else transfer.checked
        transfer.request.asked(seq, now)
        station = transfer.station
        request = messages.MAVLink_mission_request_message(station.sysid, station.compid, seq, MISSION_TYPE_MISSION)
        self._post.to(station, request)
        if transfer.request.is_repeated:
            for elsewhere in self._moved_to(station, now):
                self._post.to(elsewhere, request)

    def _follow(self, station: Station, now: float) -> None:
        """Go on with the transfer of a ground station whose address has changed (Wi-Fi roaming), if this is it.

        One that was answered here has announced a list of its own: two lists must never be mixed.
        """
        transfer = self._transfer
        if transfer is None or transfer.station == station:
            return
        if self._answers.was_said_to(station, now) or station not in self._moved_to(transfer.station, now):
            return
        self._log_event(
            "info",
            "mission.station_moved",
            before=str(transfer.station),
            after=str(station),
            incident=transfer.incident,
        )
        self._missions.release(transfer.station)
        self._missions.acquire(station)
        transfer.station = station

    def _late_item(self, station: Station, seq: int, now: float) -> None:
        answer = self._answers.to(station, now)
        if answer is not None and (answer.is_refusal or seq == answer.count - 1):
            self._ack(station, answer.ack)

    def _reject(self, transfer: _Transfer, now: float) -> None:
        assert transfer.check is not None
        items = tuple(transfer.items[seq] for seq in sorted(transfer.items))
        self._deliver(transfer, transfer.check.finish(), items, now)

    def _deliver(self, transfer: _Transfer, verdict: Verdict[Any], items: tuple[MissionItem, ...], now: float) -> None:
        self._transfer = transfer
        is_rejected = verdict.result is Result.REJECTED
        if not is_rejected and not self._post.allows(transfer.station, Cost.FLASH):
            self._abandon(transfer, Refusal(MissionResult.DENIED, TOO_MANY_WRITES), now)
            return
        transfer.phase = Phase.DELIVERING
        arrived = ArrivedMission(str(transfer.station), items, verdict)
        self._runner.start(
            self._missions.deliver(arrived, _ignore, is_kept=not is_rejected or self._is_kept(transfer)),
            lambda delivery, at: self._delivered(transfer, arrived, delivery, at),
            now,
        )

    def _is_kept(self, transfer: _Transfer) -> bool:
        """False if so many lists came from there that were not flown that this one is not stored."""
        return self._post.allows(transfer.station, Cost.STORED)

    def _delivered(
        self, transfer: _Transfer, arrived: ArrivedMission, delivery: Delivery | LinkLost, now: float
    ) -> None:
        if isinstance(delivery, LinkLost):
            delivery = Delivery(NO_LINK.ack, NO_LINK.text, None)
        self._tell_writer(transfer.station, arrived.verdict, delivery)
        if delivery.ack is MissionResult.ACCEPTED:
            self._tell_others(transfer.station, delivery)
        self._answer(transfer.station, transfer.count, delivery.ack, now)
        self._log_event(
            "info" if delivery.ack is MissionResult.ACCEPTED else "warning",
            "mission.upload_ended",
            station=str(transfer.station),
            mission=delivery.number,
            ack=delivery.ack.name,
            detail=delivery.text,
            incident=transfer.incident,
        )
        self._end(now)

    def _tell_writer(self, station: Station, verdict: Verdict[Any], delivery: Delivery) -> None:
        if delivery.ack is not MissionResult.ACCEPTED:
            self._post.say(Severity.ERROR, delivery.text, station)
        else:
            self._post.say(Severity.WARNING if delivery.is_lossy else Severity.INFO, delivery.text, station)
            for news, line in finding_lines(verdict.findings):
                if line != delivery.text:
                    self._post.say(Severity.WARNING if news is News.WARNING else Severity.NOTICE, line, station)
        if delivery.number is None:
            self._post.say(Severity.WARNING, "The mission could not be stored on the Pi", station)

    def _tell_others(self, writer: Station, delivery: Delivery) -> None:
        """Other ground stations hear only what changed on the aircraft."""
        if delivery.change:
            severity = Severity.WARNING if delivery.change == "Mission erased" else Severity.INFO
            self._post.say_to_others(severity, f"{delivery.change}, by {writer.peer}", writer)

    def _cancel(self, now: float, why: str) -> None:
        assert self._transfer is not None
        refusal = Refusal(MissionResult.OPERATION_CANCELLED, f"Upload {why}, old mission kept")
        self._abandon(self._transfer, refusal, now)

    def _abandon(self, transfer: _Transfer, refusal: Refusal, now: float) -> None:
        """End a transfer before it was delivered; what came of it is stored all the same."""
        if transfer.items:
            items = tuple(transfer.items[seq] for seq in sorted(transfer.items))
            finding = Finding(None, "list", len(items), None, refusal.text)
            verdict: Verdict[Any] = Verdict(Result.REJECTED, refusal.ack, findings=(finding,))
            arrived = ArrivedMission(str(transfer.station), items, verdict)
            delivery = self._missions.deliver(arrived, _ignore, is_kept=self._is_kept(transfer))
            self._runner.start(delivery, lambda _delivery, _at: None, now)
        self._end(now)
        self._refuse(transfer, refusal, now)

    def _refuse(self, transfer: _Transfer, refusal: Refusal, now: float) -> None:
        self._post.say(Severity.ERROR, refusal.text, transfer.station)
        self._answer(transfer.station, transfer.count, refusal.ack, now)
        self._log_event(
            "warning",
            "mission.refused",
            station=str(transfer.station),
            ack=refusal.ack.name,
            why=refusal.text,
            incident=transfer.incident,
        )

    def _answer(self, station: Station, count: int, ack: MissionResult, now: float) -> None:
        for where in (station, *self._moved_to(station, now)):
            self._answers.note(where, ack, count, now)
            self._ack(where, ack)

    def _ack(self, station: Station, ack: MissionResult, mission_type: int = MISSION_TYPE_MISSION) -> None:
        self._post.to(
            station,
            messages.MAVLink_mission_ack_message(station.sysid, station.compid, ack, mission_type),
        )

    def _end(self, now: float) -> None:
        """Forget the transfer and free the desk."""
        if self._transfer is not None:
            self._missions.release(self._transfer.station)
            self._transfer = None
        if self._queued is not None:
            (station, count), self._queued = self._queued, None
            self.count(station, count, MISSION_TYPE_MISSION, now)


def _ignore(_records: int) -> None:
    """Progress matters to nobody here: MAVLink has no message for it."""
