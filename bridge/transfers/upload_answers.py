# SPDX-License-Identifier: GPL-3.0-or-later
"""The answers that end uploads: sent, reported as texts, and remembered for repeated items. Sans-IO."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

from bridge.gcs.ground import Ground
from bridge.gcs.station import Peer, Severity, Station
from bridge.missions.mission_service import DeliveryResult
from bridge.missions.mission_texts import finding_lines
from bridge.model.finding import News
from bridge.model.refusal import Refusal
from bridge.model.verdict import Result, Verdict
from protocols.mission_item import MissionResult

#: Mission Planner sends its last item for 5 s, its Cancel for 2.8 s.
_MEMORY_S = 10.0
_CANCEL_S = 3.0
#: More than there are peers with standing on a link. Twice as many answers are reduced to this number.
_MOST = 64
#: Mission Planner has reported "Write Fast" as a success to its user, so a failure is shown three times, 2 s apart.
_REMINDERS_S = (2.0, 4.0)
#: QGroundControl waits 1.5 s for the final ack, and MAVSDK 2.5 s; neither asks for it again. So it is sent three times.
_ACK_AGAIN_S = (0.4, 0.9)
_NOT_WHOLE = Refusal(MissionResult.UNSUPPORTED, "A mission can only be written as a whole")
#: QGroundControl leaves out what the vehicle does not offer to store, and says nothing.
_ONLY_MISSIONS = "Fences and rally points are not stored here"
_UNKNOWN_UPLOAD = Refusal(MissionResult.OPERATION_CANCELLED, "Unknown upload: write it again")


@dataclass(slots=True)
class _Answer:
    """The MISSION_ACK that ended an upload of `count` items. It answers a Cancel until `cancelled_until`."""

    ack: MissionResult
    count: int
    until: float
    cancelled_until: float
    #: When to send the ack again, or the reason for a refusal.
    again: Sequence[tuple[float, str | None]] = ()

    @property
    def is_refusal(self) -> bool:
        return self.ack is not MissionResult.ACCEPTED


class UploadAnswers:
    """Answers ground stations, and remembers each one's last answer for 10 s.

    In a flood, those to peers with standing (bridge.gcs.budget) are forgotten last. `let_read` is called after a text
    that the pilot must read.
    """

    def __init__(self, ground: Ground, let_read: Callable[[Peer, float], None]) -> None:
        self._ground = ground
        self._let_read = let_read
        self._answers: dict[Station, _Answer] = {}  # oldest first
        #: The time of the next `tick`; infinity if nothing is to be sent later.
        self.due = inf

    # At the end of an upload.

    def end(
        self,
        station: Station,
        ack: MissionResult,
        count: int,
        now: float,
        mission_type: int = 0,
        *,
        is_cancelled: bool = False,
        is_repeated: bool = False,
    ) -> None:
        """Send the final MISSION_ACK of an upload of `count` items; 0 for a clear.

        A Cancel after a refusal, or after one that came too late (`is_cancelled`), gets the same answer: it must not
        clear the mission. `is_repeated`: send it again until the station sends another mission message.
        """
        self._forget_old(now)
        self._answers.pop(station, None)
        cancel_s = _CANCEL_S if count and (is_cancelled or ack is not MissionResult.ACCEPTED) else 0.0
        answer = self._answers[station] = _Answer(ack, count, now + _MEMORY_S, now + cancel_s)
        if is_repeated and count:
            self._repeat(answer, _ACK_AGAIN_S, None, now)
        if len(self._answers) >= 2 * _MOST:
            self._forget_strangers()
        self._ground.mission_ack(station, ack, mission_type)

    def report(self, station: Station, verdict: Verdict[Any], delivery: DeliveryResult, now: float) -> None:
        """Report everything to the sender, and the change on the aircraft to other ground stations.

        The summary is last, and the only warning: Mission Planner shows the last one, and its voice says the first.
        """
        accepted = delivery.ack is MissionResult.ACCEPTED
        sender = self._ground.station(station.peer)
        if verdict.result is Result.ACCEPTED and sender is not None and not sender.has_written:
            sender.has_written = True
            self._ground.say(Severity.INFO, _ONLY_MISSIONS, station)
        for news, line in finding_lines(verdict.findings) if accepted else ():
            if line != delivery.text:
                self._ground.say(Severity.NOTICE if news is News.WARNING else Severity.INFO, line, station)
        if delivery.number is None:
            self._ground.say(Severity.WARNING, "The mission could not be stored on the Pi", station)
        severity = Severity.INFO if accepted else Severity.ERROR
        if accepted and delivery.is_lossy:
            severity = Severity.WARNING
        self._ground.say(severity, delivery.text, station)
        if severity is not Severity.INFO:
            self._let_read(station.peer, now)
        if delivery.change:
            severity = Severity.WARNING if verdict.result is Result.CLEARED else Severity.INFO
            self._ground.say_to_others(severity, f"{delivery.change}, by {station.peer}", station)

    def remind(self, station: Station, text: str, now: float) -> None:
        """Repeat the reason for a refusal that the station may not have noticed."""
        if (answer := self._answers.get(station)) is not None:
            self._repeat(answer, _REMINDERS_S, text, now)

    def _repeat(self, answer: _Answer, later_s: Sequence[float], text: str | None, now: float) -> None:
        answer.again = [(now + seconds, text) for seconds in later_s]
        self.due = min(self.due, now + later_s[0])

    def went_on(self, station: Station) -> None:
        """The station has sent another mission message: it has the final ack, or does not wait for it."""
        if (answer := self._answers.get(station)) is not None:
            answer.again = [again for again in answer.again if again[1] is not None]

    def tick(self, now: float) -> None:
        """Send what is due."""
        if now < self.due:
            return
        for station, answer in self._answers.items():
            for due, text in answer.again:
                if now < due:
                    continue
                if text is not None:
                    self._ground.say(Severity.ERROR, text, station, is_reminder=True)
                else:
                    self._ground.mission_ack(station, answer.ack)
            answer.again = [again for again in answer.again if now < again[0]]
        self.due = min((due for answer in self._answers.values() for due, _ in answer.again), default=inf)

    # After the end.

    def repeat_cancelled(self, station: Station, now: float) -> bool:
        """Answer a Cancel again if the first answer was lost: it must not clear the mission on the craft."""
        answer = self._to(station, now)
        if answer is None or now >= answer.cancelled_until:
            return False
        self._ground.mission_ack(station, answer.ack)
        return True

    def late_item(self, station: Station, seq: int, now: float, *, is_lost: bool) -> None:
        """Answer an item of an upload that has ended; if `is_lost`, perhaps because the daemon was restarted.

        A ground station whose address has just changed gets no answer.
        """
        answer = self._to(station, now)
        if answer is not None:
            if answer.is_refusal or seq == answer.count - 1:
                self._ground.mission_ack(station, answer.ack)
        elif is_lost and not self._is_known(station, now):
            self._ground.say(Severity.ERROR, _UNKNOWN_UPLOAD.text, station)
            self.end(station, _UNKNOWN_UPLOAD.ack, 0, now)

    def partial_list(self, station: Station, now: float) -> None:
        """MISSION_WRITE_PARTIAL_LIST: Mission Planner's answer to a refusal that it did not understand."""
        answer = self._to(station, now)
        if answer is not None and answer.is_refusal:
            self._ground.mission_ack(station, answer.ack)
        else:
            self._ground.refuse(station, _NOT_WHOLE)

    def forget(self, station: Station) -> None:
        """The ground station has begun a new upload."""
        self._answers.pop(station, None)

    def was_said_to(self, station: Station, now: float) -> bool:
        """True if the station was answered at this address."""
        self._forget_old(now)
        return station in self._answers

    def _to(self, station: Station, now: float) -> _Answer | None:
        """The last answer to a ground station, at its current or previous address."""
        self._forget_old(now)
        if station in self._answers:
            return self._answers[station]
        has_moved = self._ground.has_moved
        return next((answer for known, answer in self._answers.items() if has_moved(known, station, now)), None)

    def _is_known(self, station: Station, now: float) -> bool:
        """True if a station with these ids was answered, here or at an address that it may have left."""
        self._forget_old(now)
        return any((known.sysid, known.compid) == (station.sysid, station.compid) for known in self._answers)

    def _forget_strangers(self) -> None:
        """Keep answers to peers with standing, to hosts with few answers, to accepted lists, and the latest."""
        hosts = Counter(station.peer.host for station in self._answers)

        def worth(station: Station) -> tuple[bool, int, bool]:
            peer = station.peer
            return self._ground.has_own_budget(peer), -hosts[peer.host], not self._answers[station].is_refusal

        for station in sorted(self._answers, key=worth)[:_MOST]:
            del self._answers[station]

    def _forget_old(self, now: float) -> None:
        while self._answers and now > self._answers[oldest := next(iter(self._answers))].until:
            del self._answers[oldest]
