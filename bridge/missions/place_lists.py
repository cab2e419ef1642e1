# SPDX-License-Identifier: GPL-3.0-or-later
"""Fences and rally points: lists like missions, but only the board's configuration holds them."""

from collections.abc import Callable
from functools import partial
from typing import Any

from bridge.line.conversation import Conversation
from bridge.line.runner import Runner
from bridge.missions.fc_mission_store import AnyFcMissionStore, PushProgress
from bridge.missions.mission_service import NO_LINK, DeliveryResult, HeldMission, MissionService
from bridge.model.missions import ArrivedMission, Refusal
from bridge.model.vehicle import Vehicle
from bridge.voice import sentences
from protocols.mission_item import MissionResult, identify
from reports.verdict import Result

NO_PLACES = Refusal(MissionResult.UNSUPPORTED, sentences.NO_PLACES())


class PlaceLists(MissionService):
    """The lists of one type. name: for texts. on_change: called when the board's list may have changed."""

    def __init__(
        self, mission_type: int, name: str, vehicle: Vehicle, runner: Runner, on_change: Callable[[], None]
    ) -> None:
        super().__init__(vehicle, runner, lambda _ended: None)
        self.mission_type, self.are_kept = mission_type, False
        self._name, self._on_change = name, on_change
        self.fc_store, self.are_stored = NO_PLACES, False

    def use(self, store: AnyFcMissionStore | Refusal, now: float, *, is_same_board: bool) -> None:
        """Switch to another flight controller. After the loss of a board without such lists its refusal stays."""
        if isinstance(store, Refusal) and store is not NO_PLACES and not self.are_stored:
            store = NO_PLACES
        self.are_stored = store is not NO_PLACES
        super().use(store, now, is_same_board=is_same_board)

    def deliver(
        self, arrived: ArrivedMission, progress: PushProgress = lambda _records: None, *, is_kept: bool = True
    ) -> Conversation[DeliveryResult]:
        verdict, fc_store = arrived.verdict, self.fc_store
        if verdict.result is Result.REJECTED:
            return DeliveryResult(verdict.ack, sentences.REJECTED(verdict.findings[-1].text()), None)
        if isinstance(fc_store, Refusal):
            return DeliveryResult(fc_store.ack, fc_store.why, None)
        result = yield from fc_store.push(verdict.records, progress)
        self._on_change()
        if result.failure is not None:
            return DeliveryResult(
                MissionResult.DENIED, sentences.PLACES_FAILED(self._name, result.failure.value.text), None
            )
        self.held = HeldMission(identify(verdict.records), verdict.records, verdict.items)
        warnings = sum(finding.is_warning for finding in verdict.findings)
        unchanged, count = ", unchanged" if result.unchanged else "", len(verdict.items)
        if not verdict.items:
            why = sentences.PLACES_CLEARED(self._name, unchanged)
        elif warnings:
            why = sentences.PLACES_STORED_WITH_LOSSES(self._name, count, unchanged, warnings)
        else:
            why = sentences.PLACES_STORED(self._name, count, unchanged)
        change = None if result.unchanged else partial(sentences.NEW_PLACES, self._name)
        return DeliveryResult(MissionResult.ACCEPTED, why, None, change)

    def read_back(self) -> Conversation[HeldMission | Refusal]:
        """The flight controller's list, read now."""
        fc_store = self.fc_store
        if isinstance(fc_store, Refusal):
            return fc_store
        records: tuple[Any, ...] | None = yield from fc_store.pull()
        if records is None:
            return NO_LINK
        self.held = held = HeldMission(identify(records), records, fc_store.items(records, {}))
        return held
