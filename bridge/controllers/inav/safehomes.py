# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's safehomes as rally points: up to eight places, without heights."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bridge.controllers.inav.place_store import InavPlaceStore, take
from bridge.line.conversation import Conversation, ask
from bridge.missions.list_check import ListCheck, missing_coordinate, refuse_frame, refuse_position
from protocols.mission_item import Command, Frame, MissionItem, MissionResult
from protocols.msp.inav_places import (
    SAFEHOME,
    SAFEHOME_SIZE,
    SAFEHOMES,
    SET_SAFEHOME,
    Safehome,
    decode_safehome,
    encode_read_safehome,
)
from reports.finding import DROPPED, Finding, News, RejectingFinding, reject
from reports.verdict import CLEARED_LIST, Result, Verdict


def read_safehomes() -> Conversation[tuple[Safehome, ...] | None]:
    """All of them, also those that are off; none from a version without them. None: it does not answer."""
    found: list[Safehome] = []
    for number in range(SAFEHOMES):
        reply = yield from ask(encode_read_safehome(number), SAFEHOME, SAFEHOME_SIZE)
        if reply is None:
            return None
        safehome = decode_safehome(reply.payload)
        if safehome is not None:
            found.append(safehome)
    return tuple(found)


class InavSafehomes(InavPlaceStore[Safehome]):
    """Writing one also resets its landing approach, so those that are unchanged keep their number."""

    def pull(self) -> Conversation[tuple[Safehome, ...] | None]:
        found = yield from read_safehomes()
        if found is not None:
            self._known = found
        return found

    def items(self, records: Sequence[Safehome], sent_as: Mapping[int, int]) -> tuple[MissionItem, ...]:
        return rally_items(records)

    def _rules(self) -> "RallyRules":
        return RallyRules(self._known or ())

    def _whole(self, records: tuple[Safehome, ...]) -> tuple[Safehome, ...]:
        return records or tuple(Safehome(number, False, 0, 0) for number in range(SAFEHOMES))

    def _write(self, wanted: tuple[Safehome, ...], held: tuple[Safehome, ...]) -> Conversation[bool]:
        for new, old in zip(wanted, held, strict=False):
            if new != old and not (yield from take(SET_SAFEHOME, new.pack())):
                return False
        return True


@dataclass(frozen=True, slots=True)
class RallyRules:
    """The rules for rally points. former: the safehomes on the board."""

    former: tuple[Safehome, ...] = ()
    max_items: int = SAFEHOMES
    has_home: bool = False

    def begin(self, count: int, _fallback_home: tuple[int, int] | None) -> "RallyCheck":
        return RallyCheck(count, self.former)


class RallyCheck(ListCheck):
    """The check of a list of rally points."""

    def __init__(self, count: int, former: tuple[Safehome, ...]) -> None:
        super().__init__(count)
        self._former = former
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
            self._note(item, "alt_m", item.alt_m, 0, "a safehome has no height: see nav_rth_altitude", News.NOTICE)
        self._places.append((item.lat_e7 or 0, item.lon_e7 or 0))
        return None

    def _refuse_kept_list(self) -> RejectingFinding | None:
        return None

    def _conclude(self) -> Verdict[Safehome]:
        if not self._places:
            return CLEARED_LIST
        off = sum(not each.enabled and bool(each.lat_e7 or each.lon_e7) for each in self._former)
        if off:
            why = f"Safehomes that were off are erased: {off}"
            self._findings.append(Finding(None, "count", None, None, why, news=News.WARNING))
        slots: dict[int, tuple[int, int]] = {}
        ahead = [*self._places]
        for each in self._former:
            if each.enabled and (each.lat_e7, each.lon_e7) in ahead:
                slots[each.number] = each.lat_e7, each.lon_e7
                ahead.remove(slots[each.number])
        free = (number for number in range(SAFEHOMES) if number not in slots)
        slots.update(zip(free, ahead, strict=False))
        empty = Safehome(0, False, 0, 0)
        records = tuple(
            Safehome(number, True, *slots[number]) if number in slots else empty._replace(number=number)
            for number in range(SAFEHOMES)
        )
        findings = tuple(self._findings)
        return Verdict(Result.ACCEPTED, MissionResult.ACCEPTED, records, rally_items(records), findings)


def rally_items(safehomes: Sequence[Safehome]) -> tuple[MissionItem, ...]:
    """Those that are on."""
    places = [each for each in safehomes if each.enabled]
    frame = int(Frame.GLOBAL_RELATIVE_ALT)
    return tuple(
        MissionItem(seq, int(Command.RALLY_POINT), frame, 0, 0, 0, 0, each.lat_e7, each.lon_e7, 0.0)
        for seq, each in enumerate(places)
    )
