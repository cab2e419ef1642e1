# SPDX-License-Identifier: GPL-3.0-or-later
"""MultiWii 2.4 NAV: each record goes to EEPROM at once; the flag LAST ends the list (docs/inav.md)."""

from bridge.controllers.nav.mission_store import NOTHING, NavMissions
from bridge.line.conversation import Conversation
from protocols.msp.nav import LAST, NavRecord

#: Flags of invalid records: a wrong checksum in EEPROM, and erased EEPROM.
_NO_RECORD = (0xFE, 0xFF)
#: Action and flag of every reply while it flies a mission.
_NAVIGATING = (0, 0xFF)


class MultiwiiMissions(NavMissions):
    """The mission store of one MultiWii NAV. Its EEPROM takes 70 ms for a record."""

    _stores_slowly = True
    #: The records of a list that reads as empty.
    _empty: tuple[NavRecord, ...] = NOTHING

    def pull(self) -> Conversation[tuple[NavRecord, ...] | None]:
        """Read up to the last record. A list without one reads as empty, as does the single RTH of a cleared one."""
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
        """Read some records, while disarmed: nothing else shows that another client has changed the list."""
        if self._known is None or self._vehicle.armed is not False:
            return True
        return (yield from self._has_same_records(self._known or self._empty))

    def _order(self, wanted: tuple[NavRecord, ...]) -> list[tuple[int, NavRecord]]:
        """Write a single RTH first and the real record 1 last: a list interrupted in between only flies home."""
        first, *rest = enumerate(wanted, 1)
        return [(1, NOTHING[0]), *rest, first] if rest else [first]

    def _keep(self) -> Conversation[None]:
        yield from ()
