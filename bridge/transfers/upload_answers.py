# SPDX-License-Identifier: GPL-3.0-or-later
"""The answers that end uploads: sent, reported as texts, and remembered for repeated items. Sans-IO."""

from collections.abc import Collection
from math import inf
from typing import Any

from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import Sender
from bridge.missions.mission_service import DeliveryResult
from bridge.model.missions import FinalAck, Refusal, TransferMemory
from bridge.voice import sentences
from bridge.voice.mission_report import finding_lines
from bridge.voice.stations import Kind
from protocols.mission_item import MissionResult
from reports.verdict import Result, Verdict

#: Mission Planner sends the last item for 5 s, a Cancel for 2.8 s.
_MEMORY_S = 10.0
_CANCEL_S = 3.0
#: These never ask for the final ack again, so it is sent four times. Not later: QGroundControl's user takes 0.1 s to
#: begin the next transfer, whose end a stale ack would be. A script on MAVSDK takes no time: only after a loss (True).
NEVER_ASK = {False: (Kind.QGROUNDCONTROL,), True: (Kind.QGROUNDCONTROL, Kind.MAVSDK)}
_ACK_AGAIN_S = (0.02, 0.04, 0.06)
_ACK_LATE_S = 0.02
#: An item that arrives sooner after the final ack was sent before it, and does not show that it was lost.
_CROSSING_S = 0.4
_NOT_WHOLE = Refusal(MissionResult.UNSUPPORTED, sentences.NOT_WHOLE())


class UploadAnswers:
    """Answers ground stations. Each one's last answer is remembered for 10 s."""

    def __init__(self, ground: Ground, mission_type: int, *, are_kept: bool) -> None:
        self._ground = ground
        self._mission_type, self._are_kept = mission_type, are_kept
        #: True if the flight controller cannot store fences and rally points.
        self.are_only_missions_stored = True
        #: The answers that are to be sent again.
        self._again: list[tuple[Sender, FinalAck]] = []
        #: The time of the next `tick`, or infinity without a due answer.
        self.due = inf

    # At the end of an upload.

    def end(
        self,
        sender: Sender,
        ack: MissionResult,
        count: int,
        now: float,
        mission_type: int | None = None,
        *,
        is_cancelled: bool = False,
        again_to: Collection[Kind] = (),
    ) -> None:
        """Send the final MISSION_ACK of an upload of `count` items, or 0 for a clear.

        A Cancel after a refusal, or after one that came too late (`is_cancelled`), gets the same answer: it must not
        clear the mission. `again_to`: these get it again until they send another mission message.
        """
        cancel_s = _CANCEL_S if count and (is_cancelled or ack is not MissionResult.ACCEPTED) else 0.0
        answer = FinalAck(ack, count, now, now + cancel_s)
        if again_to and count and sender.station.behaviour.kind in again_to:
            answer.again = [now + later_s for later_s in _ACK_AGAIN_S]
            self._again.append((sender, answer))
            self.due = min(self.due, answer.again[0])
        self._memory(sender).final_ack = answer
        sender.mission_ack(ack, self._mission_type if mission_type is None else mission_type)

    def report(self, sender: Sender, verdict: Verdict[Any], delivery: DeliveryResult) -> None:
        """Report everything to the sender, and the change on the aircraft to other ground stations.

        The summary is last: Mission Planner shows the last text. Before it only dangers are warnings, which its voice
        says.
        """
        accepted = delivery.ack is MissionResult.ACCEPTED
        if verdict.result is Result.ACCEPTED and not sender.station.has_written:
            sender.station.has_written = True
            if self.are_only_missions_stored and sender.station.behaviour.kind is Kind.QGROUNDCONTROL:
                # It silently leaves out lists that the vehicle does not offer to store.
                sender.say(sentences.ONLY_MISSIONS())
        for line in finding_lines(verdict.findings) if accepted else ():
            if line.text != delivery.text:
                sender.say(line)
        if delivery.number is None and self._are_kept:
            sender.say(sentences.NOT_STORED_ON_PI())
        sender.say(delivery.why)
        if delivery.change is not None:
            self._ground.say(delivery.change(sender.name), but=sender.station)

    def went_on(self, sender: Sender) -> None:
        """The station has sent another mission message: it has the final ack, or does not wait for it."""
        if (answer := self._memory(sender).final_ack) is not None:
            answer.again = []

    def tick(self, now: float) -> None:
        if now < self.due:
            return
        # A station may have left, or begun another upload.
        self._again = [each for each in self._again if each[1].again and self._memory(each[0]).final_ack is each[1]]
        for sender, answer in self._again:
            if now >= answer.again[0]:
                if now < answer.again[0] + _ACK_LATE_S:
                    sender.mission_ack(answer.ack, self._mission_type)
                answer.again = answer.again[1:]
        self.due = min((answer.again[0] for _, answer in self._again if answer.again), default=inf)

    # After the end.

    def repeat_cancelled(self, sender: Sender, now: float) -> bool:
        """Answer a Cancel again if the first answer was lost: it must not clear the mission on the craft."""
        answer = self._last(sender, now)
        if answer is None or now >= answer.cancelled_until:
            return False
        sender.mission_ack(answer.ack, self._mission_type)
        return True

    def late_item(self, sender: Sender, seq: int, now: float) -> None:
        """Answer an item of an upload that has ended."""
        if (answer := self._last(sender, now)) is not None:
            has_missed_it = seq == answer.count - 1 and now >= answer.sent_at + _CROSSING_S
            if answer.is_refusal or has_missed_it:
                sender.mission_ack(answer.ack, self._mission_type)

    def partial_list(self, sender: Sender, now: float) -> None:
        """MISSION_WRITE_PARTIAL_LIST: Mission Planner's answer to a refusal that it did not understand."""
        answer = self._last(sender, now)
        if answer is not None and answer.is_refusal:
            sender.mission_ack(answer.ack, self._mission_type)
        else:
            sender.refuse(_NOT_WHOLE, self._mission_type)

    def has_answered(self, sender: Sender, now: float) -> bool:
        """True if an upload from this address has just ended."""
        return self._last(sender, now) is not None

    def forget(self, sender: Sender) -> None:
        """The ground station has begun a new upload."""
        self._memory(sender).final_ack = None
        sender.station.bad_news.forget()

    def _memory(self, sender: Sender) -> TransferMemory:
        return sender.transfers[self._mission_type]

    def _last(self, sender: Sender, now: float) -> FinalAck | None:
        """The last answer to a ground station, if it is recent."""
        answer = self._memory(sender).final_ack
        return answer if answer is not None and now <= answer.sent_at + _MEMORY_S else None
