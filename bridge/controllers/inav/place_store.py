# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's safehomes and geozones, as rally points and fences: in RAM until the configuration is written.

The old places stay in its flash until the new places are read back equal. Otherwise the old places are written again.
"""

from abc import abstractmethod
from collections.abc import Sequence

from bridge.fc.fc_settings import write_eeprom
from bridge.fc.profile import FlightController
from bridge.line.conversation import Conversation, LinkLost, ask, ask_armed
from bridge.missions.fc_mission_store import (
    FcMissionStore,
    PushFailure,
    PushProgress,
    PushResult,
    StoreReport,
    StoreState,
)
from bridge.missions.list_check import MissionRules
from protocols.msp.frame import Direction, request
from reports.verdict import RecordT

_ACK_SIZE = 0


class InavPlaceStore(FcMissionStore[RecordT]):
    """Lists that INAV's configuration holds."""

    reads_armed = True

    def __init__(self, controller: FlightController) -> None:
        assert controller.arm_bit is not None
        self._arm_bit = controller.arm_bit
        #: As last read; None if unknown.
        self._known: tuple[RecordT, ...] | None = None
        #: True if the board's RAM may differ from the flash.
        self._is_unsaved = False

    def report(self) -> Conversation[StoreReport | None]:
        armed = yield from ask_armed(self._arm_bit)
        if armed is None or (yield from self.pull()) is None:
            return None
        return StoreReport(StoreState.ARMED if armed else StoreState.READY, self._rules(), None)

    def push(self, records: tuple[RecordT, ...], progress: PushProgress) -> Conversation[PushResult]:
        """Write what differs, read all of it back, and save it."""
        try:
            before = self._known if self._known is not None else (yield from self.pull())
            if before is None or (yield from ask_armed(self._arm_bit)) is not False:
                return PushResult(PushFailure.PLACES_KEPT)
            wanted = self._whole(records)
            if before == wanted and not self._is_unsaved:
                return PushResult(None, unchanged=True)
            self._is_unsaved = True
            is_written = yield from self._write(wanted, before)
            held = yield from self.pull()
            if not is_written or held != wanted:
                yield from self._write(before, held or wanted)
                self._is_unsaved = (yield from self.pull()) != before
                return PushResult(PushFailure.PLACES_PARTLY if self._is_unsaved else PushFailure.PLACES_KEPT)
            if (yield from write_eeprom()) is not None:
                return PushResult(PushFailure.PLACES_NOT_SAVED)
            self._is_unsaved, self._known = False, wanted
            return PushResult(None)
        except LinkLost:
            return PushResult(PushFailure.PLACES_PARTLY if self._is_unsaved else PushFailure.PLACES_KEPT)

    def seq_of(self, records: Sequence[RecordT], number: int) -> int:
        return 0

    @abstractmethod
    def _rules(self) -> MissionRules:
        """The rules for a new list."""

    def _whole(self, records: tuple[RecordT, ...]) -> tuple[RecordT, ...]:
        """The list as it is read back. Of an empty one, what clears it."""
        return records

    @abstractmethod
    def _write(self, wanted: tuple[RecordT, ...], held: tuple[RecordT, ...]) -> Conversation[bool]:
        """Set what differs from `held`. Returns False if the board refuses or does not answer."""


def take(command: int, payload: bytes, *, tries: int = 3) -> Conversation[bool]:
    """Send a setter. Returns True if it was acknowledged."""
    reply = yield from ask(request(command, payload), command, _ACK_SIZE, tries=tries)
    return reply is not None and reply.direction is Direction.REPLY
