# SPDX-License-Identifier: GPL-3.0-or-later
"""MultiWii 2.4 NAV: each record goes to EEPROM at once; the flag LAST ends the list (docs/inav.md).

The record last read or written stays in RAM, and its p1 decides if a return home by the pilot's switch or by failsafe
lands there: after each conversation it is cleared, as after power-on.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from bridge.controllers.nav.leg_limits import LegLimits
from bridge.controllers.nav.mission_store import NOTHING, NavMissions
from bridge.line.conversation import Conversation, LinkLost, ask
from bridge.missions.fc_mission_store import PushProgress, PushResult, StoreReport
from protocols.msp.frame import request
from protocols.msp.nav import (
    LAST,
    NAV_CONFIG_SIZE,
    Nav,
    NavMode,
    NavRecord,
    NavStatus,
    decode_nav_limits,
    encode_set_wp,
)

#: Flags of invalid records: a wrong checksum in EEPROM, and erased EEPROM.
_NO_RECORD = (0xFE, 0xFF)
#: Action and flag of every reply while it flies a mission.
_NAVIGATING = (0, 0xFF)
#: Numbers above its capacity are not stored: SET_WP changes only the record in RAM. (255 would move a position hold.)
_NOT_STORED = 254
_CLEARED = NavRecord(0)


class MultiwiiMissions(NavMissions):
    """The mission store of one MultiWii NAV. Its EEPROM takes 70 ms for a record."""

    _stores_slowly = True
    #: The records of a list that reads as empty.
    _empty: tuple[NavRecord, ...] = NOTHING

    def report(self) -> Conversation[StoreReport | None]:
        """Also read the limits of its legs: the pilot may change these settings at any time."""
        config = yield from ask(request(Nav.NAV_CONFIG), Nav.NAV_CONFIG, NAV_CONFIG_SIZE)
        limits = None if config is None else decode_nav_limits(config.payload)
        if limits is not None:
            self._profile = replace(self._profile, limits=LegLimits(*limits))
        return (yield from super().report())

    def push(self, records: tuple[NavRecord, ...], progress: PushProgress) -> Conversation[PushResult]:
        result = yield from super().push(records, progress)
        yield from self._clear_step()
        return result

    def pull(self) -> Conversation[tuple[NavRecord, ...] | None]:
        """Read up to the last record. A list without one reads as empty, as does the single RTH of a cleared one."""
        known = yield from self._read_list()
        yield from self._clear_step()
        return known

    def _read_list(self) -> Conversation[tuple[NavRecord, ...] | None]:
        records: list[NavRecord] = []
        known: tuple[NavRecord, ...] = ()
        for number in range(1, self._profile.capacity + 1):
            record = yield from self.read(number)
            if record is None:
                return None
            if (record.action, record.flag) == _NAVIGATING:
                return None
            records.append(record)
            if record.flag in _NO_RECORD:
                break
            if record.flag == LAST:
                known = () if tuple(records) == NOTHING else tuple(records)
                break
        self._known, self._empty = known, tuple(records)
        return known

    def is_current(self) -> Conversation[bool]:
        """Read some records, while disarmed: nothing else shows that another client has changed the list.

        In flight, a return home may begin between two requests.
        """
        if self._known is None or self._vehicle.armed is not False:
            return True
        is_same = yield from self._has_same_records(self._known or self._empty)
        yield from self._clear_step()
        return is_same

    def is_contradicted(self, records: Sequence[NavRecord], status: NavStatus) -> bool:
        if status.mode != NavMode.MISSION or not status.action or not 1 <= status.number <= self._profile.capacity:
            return False
        return status.number > len(records) or records[status.number - 1].action != status.action

    def _clear_step(self) -> Conversation[None]:
        """Clear the record in RAM, unless the craft is armed or may be: telemetry may not have noticed arming yet."""
        with suppress(LinkLost):
            if self._profile.capacity < _NOT_STORED and (yield from self._ask_armed()) is False:
                yield from ask(encode_set_wp(_NOT_STORED, _CLEARED), Nav.SET_WP, 0)

    def _order(self, wanted: tuple[NavRecord, ...]) -> list[tuple[int, NavRecord]]:
        """Write a single RTH first and the real record 1 last: a list interrupted midway only flies home."""
        first, *rest = enumerate(wanted, 1)
        return [(1, NOTHING[0]), *rest, first] if rest else [first]

    def _keep(self) -> Conversation[None]:
        yield from ()
