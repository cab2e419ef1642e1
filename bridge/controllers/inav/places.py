# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's safehomes, as rally points, and the store that geozones share with them: in RAM until INAV saves.

The old places stay in flash until the new places are read back equal. Otherwise the old places are written again.
A safehome lacks a height, but has an approach by which an aeroplane lands. Each MSP_SET_WP erases an approach: that of
the mission whose number is the count of missions written since the boot, and after nine missions all of them, also
those of the safehomes (fc_msp.c, 7.1.0 to 9.1.0). SAVE would store that.
"""

from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

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
from bridge.missions.list_check import ListCheck, MissionRules, missing_coordinate, refuse_frame, refuse_position
from bridge.model.ground_track import distance_m
from protocols.mission_item import Command, Frame, MissionItem, MissionResult
from protocols.msp.frame import Direction, request
from protocols.msp.inav_places import (
    APPROACH_SIZE,
    FW_APPROACH,
    SAFEHOME,
    SAFEHOME_SIZE,
    SAFEHOMES,
    SET_FW_APPROACH,
    SET_SAFEHOME,
    FwApproach,
    Safehome,
    decode_approach,
    decode_safehome,
    encode_read_approach,
    encode_read_safehome,
)
from reports.finding import DROPPED, News, RejectingFinding, reject
from reports.verdict import CLEARED_LIST, RecordT, Result, Verdict

_ACK_SIZE = 0


class InavPlaceStore(FcMissionStore[RecordT]):
    """Lists that INAV's configuration holds."""

    reads_armed = True

    def __init__(self, controller: FlightController) -> None:
        assert controller.arm_bit is not None
        self._arm_bit = controller.arm_bit
        #: As last read, or None if unknown.
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


#: Items as floats are up to 0.9 m off.
_NOT_MOVED_M = 1.0


def read_approaches(numbers: Iterable[int]) -> Conversation[tuple[FwApproach, ...] | None]:
    """Those of these numbers, or none from a version before 7.1. None without an answer, or one about others."""
    found: list[FwApproach] = []
    for number in numbers:
        reply = yield from ask(encode_read_approach(number), FW_APPROACH, APPROACH_SIZE)
        if reply is None:
            return None
        approach = decode_approach(reply.payload)
        if approach is None:
            return ()
        if approach.number != number:
            return None
        found.append(approach)
    return tuple(found)


def write_approaches(wanted: Sequence[FwApproach], held: Sequence[FwApproach] = ()) -> Conversation[bool]:
    """Set those that the board lacks, and read them back. Returns False if that fails.

    Of the empty places only those are set that are not empty in `held`, the board's own.
    """
    filled = {each.number for each in (*wanted, *held) if not each.is_empty}
    for new in wanted:
        if new.number not in filled or (yield from read_approaches((new.number,))) == (new,):
            continue
        is_taken = yield from take(SET_FW_APPROACH, new.pack())
        if not is_taken or (yield from read_approaches((new.number,))) != (new,):
            return False
    return True


def read_safehomes() -> Conversation[tuple[Safehome, ...] | None]:
    """All of them, including those disabled; none on a version without them. None: no reply, or one about another."""
    found: list[Safehome] = []
    for number in range(SAFEHOMES):
        reply = yield from ask(encode_read_safehome(number), SAFEHOME, SAFEHOME_SIZE)
        if reply is None:
            return None
        safehome = decode_safehome(reply.payload)
        if safehome is not None:
            if safehome.number != number:
                return None
            found.append(safehome)
    return tuple(found)


def with_approaches(safehomes: Sequence[Safehome], approaches: Sequence[FwApproach]) -> tuple[Safehome, ...]:
    """A safehome's approach has the same number. Older versions lack approaches."""
    return tuple(each._replace(approach=approaches[each.number]) if approaches else each for each in safehomes)


class InavSafehomes(InavPlaceStore[Safehome]):
    """Writing a safehome erases the landing approach, which is then written again."""

    def pull(self) -> Conversation[tuple[Safehome, ...] | None]:
        safehomes = yield from read_safehomes()
        approaches = yield from read_approaches(range(SAFEHOMES))
        if safehomes is None or approaches is None:
            return None
        self._known = with_approaches(safehomes, approaches)
        return self._known

    def items(self, records: Sequence[Safehome], sent_as: Mapping[int, int]) -> tuple[MissionItem, ...]:
        return rally_items(records)

    def _rules(self) -> "RallyRules":
        return RallyRules(self._known or ())

    def _whole(self, records: tuple[Safehome, ...]) -> tuple[Safehome, ...]:
        return records or tuple(each.emptied() for each in self._known or ())

    def _write(self, wanted: tuple[Safehome, ...], held: tuple[Safehome, ...]) -> Conversation[bool]:
        for new, old in zip(wanted, held, strict=False):
            if new.pack() != old.pack() and not (yield from take(SET_SAFEHOME, new.pack())):
                return False
        approaches = [(new.approach, old.approach) for new, old in zip(wanted, held, strict=False)]
        pairs = [(new, old) for new, old in approaches if new is not None and old is not None]
        return (yield from write_approaches([new for new, _ in pairs], [old for _, old in pairs]))


@dataclass(frozen=True, slots=True)
class RallyRules:
    """The rules for rally points. current: the safehomes on the board."""

    current: tuple[Safehome, ...] = ()
    max_items: int = SAFEHOMES
    has_home: bool = False

    def begin(self, count: int, _fallback_home: tuple[int, int] | None) -> "RallyCheck":
        return RallyCheck(count, self.current)


class RallyCheck(ListCheck):
    """The check of a list of rally points."""

    def __init__(self, count: int, current: tuple[Safehome, ...]) -> None:
        super().__init__(count)
        self._current = current
        self._places: list[tuple[int, int]] = []

    def _judge(self, item: MissionItem) -> RejectingFinding | None:
        if item.command != Command.RALLY_POINT:
            return reject(MissionResult.UNSUPPORTED, item, "command", "not a rally point")
        if rejection := refuse_position(item) or refuse_frame(item, needs_position=True):
            return rejection
        if missing := missing_coordinate(item):
            self._note(item, *missing, DROPPED, "no Lat/Long")
            return None
        if item.alt_m:
            self._note(item, "alt_m", item.alt_m, 0, "safehomes lack a height: see nav_rth_altitude", News.NOTICE)
        self._places.append((item.lat_e7 or 0, item.lon_e7 or 0))
        return None

    def _refuse_kept_list(self) -> RejectingFinding | None:
        return None

    def _conclude(self) -> Verdict[Safehome]:
        if not self._places:
            return CLEARED_LIST
        records = self._fill()
        findings = tuple(self._findings)
        return Verdict(Result.ACCEPTED, MissionResult.ACCEPTED, records, rally_items(records), findings)

    def _fill(self) -> tuple[Safehome, ...]:
        """A place that is a safehome keeps its number and landing approach."""
        current = {each.number: each for each in self._current}
        filled: dict[int, Safehome] = {}
        ahead = [*self._places]
        for each in self._current:
            moved = min((_moved(each, place) for place in ahead), key=lambda to: distance_m(each, to), default=None)
            if moved is not None and each.enabled and distance_m(each, moved) < _NOT_MOVED_M:
                filled[each.number] = moved
                ahead.remove((moved.lat_e7, moved.lon_e7))
            elif (each.lat_e7 or each.lon_e7) and each.approach and each.approach.directions():
                lost = f"Safehome {each.number} was deleted or moved, and lost FW approach {each.number}"
                self._say(lost, News.WARNING)
        for number in range(SAFEHOMES):
            if number not in filled:
                empty = current.get(number, Safehome(number, False, 0, 0)).emptied()
                filled[number] = _moved(empty, ahead.pop(0)) if ahead else empty
        return tuple(filled[number] for number in range(SAFEHOMES))


def _moved(safehome: Safehome, place: tuple[int, int]) -> Safehome:
    return safehome._replace(enabled=True, lat_e7=place[0], lon_e7=place[1])


def rally_items(safehomes: Sequence[Safehome]) -> tuple[MissionItem, ...]:
    """The enabled safehomes as rally points."""
    places = [each for each in safehomes if each.enabled]
    frame = int(Frame.GLOBAL_RELATIVE_ALT)
    return tuple(
        MissionItem(seq, int(Command.RALLY_POINT), frame, 0, 0, 0, 0, each.lat_e7, each.lon_e7, 0.0)
        for seq, each in enumerate(places)
    )
