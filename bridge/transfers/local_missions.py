# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission operations for the command line, the status page and zenoh. Sans-IO."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from bridge.gcs.ground import Ground
from bridge.line.conversation import Conversation
from bridge.missions.fc_mission_store import StoreReport
from bridge.missions.list_check import check_list
from bridge.missions.mission_service import DeliveryResult, HeldMission, MissionService, MissionTransfer
from bridge.model.events import Emit, PushEnded, PushStarted
from bridge.model.missions import ArrivedMission, Refusal
from bridge.transfers.uploads import MissionUploads
from bridge.voice import sentences
from protocols.mission_item import MissionItem, MissionResult
from protocols.plain_text import plain_text
from reports.verdict import Result, Verdict

_WOULD_ERASE = Refusal(MissionResult.DENIED, sentences.WOULD_ERASE())


@dataclass(frozen=True, slots=True)
class LocalMissions:
    """Writes, reads and checks whole lists, by the same rules as uploads from ground stations."""

    _missions: MissionService
    _uploads: MissionUploads
    _ground: Ground
    _emit: Emit

    @property
    def held(self) -> HeldMission | None:
        """The flight controller's mission, as last read."""
        return self._missions.on_board

    @property
    def others(self) -> tuple[HeldMission, ...]:
        return self._missions.others

    @property
    def transfer(self) -> MissionTransfer | None:
        """The mission being received or written."""
        return self._missions.writing or self._uploads.receiving

    def push(
        self,
        items: Sequence[MissionItem],
        source: str,
        on_progress: Callable[[int], None],
        on_done: Callable[[DeliveryResult | Refusal, ArrivedMission | None], None],
        now: float,
        *,
        may_erase: bool = True,
    ) -> None:
        """Write a list. An empty one clears the flight controller's. `on_progress` gets the number of records written.

        `may_erase` False: a list without a storable item is refused.
        """
        source = plain_text(source)
        owner = object()
        arrived: list[ArrivedMission] = []

        def conversation() -> Conversation[DeliveryResult | Refusal]:
            report: StoreReport | Refusal = yield from self._missions.preflight()
            if isinstance(report, Refusal):
                return report
            verdict = check_list(items, report.rules, self._missions.vehicle.place())
            arrived.append(ArrivedMission(source, tuple(items), verdict))
            if verdict.result is Result.CLEARED and not may_erase:
                return _WOULD_ERASE
            return (yield from self._missions.deliver(arrived[0], on_progress))

        def done(result: DeliveryResult | Refusal, _at: float) -> None:
            self._missions.release(owner)
            if arrived and isinstance(result, DeliveryResult):
                is_lossy = result.ack is MissionResult.ACCEPTED and result.why.severity.is_on_hud
                pushed = sentences.PUSHED_WITH_LOSSES if is_lossy else sentences.PUSHED
                self._ground.say(pushed(source, result.text))
            self._emit(
                PushEnded(
                    level="info" if result.ack is MissionResult.ACCEPTED else "warning",
                    source=source,
                    mission=result.number if isinstance(result, DeliveryResult) else None,
                    ack=result.ack.name,
                    detail=result.text,
                )
            )
            on_done(result, arrived[0] if arrived else None)

        self._emit(PushStarted(source=source, count=len(items)))
        refusal = self._missions.acquire(owner)
        if refusal is None:
            self._missions.run(conversation(), done, now)
        else:
            done(refusal, now)

    def pull(self, on_done: Callable[[HeldMission | Refusal], None], now: float) -> None:
        self._missions.run(self._missions.shown(), lambda held, _at: on_done(held), now)

    def check(
        self, items: Sequence[MissionItem], on_done: Callable[[Verdict[Any] | Refusal], None], now: float
    ) -> None:
        """Check a list by the rules of the current flight controller, without writing it."""
        self._missions.run(self._missions.check(items), lambda verdict, _at: on_done(verdict), now)
