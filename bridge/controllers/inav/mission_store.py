# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV: the list is in its memory until SAVE; what is not whole cannot be flown (docs/inav.md)."""

from contextlib import suppress

from bridge.controllers.nav.mission_store import NOTHING, Failed, NavMissions
from bridge.line.conversation import Conversation, LinkLost, ask
from bridge.missions.fc_mission_store import PushFailure
from protocols.msp.frame import Direction, request
from protocols.msp.nav import INFO_SIZE, LOAD_REQUEST, SAVE_REQUEST, Nav, NavInfo, NavRecord, decode_info

_MAX_SAVES = 2
_SAVE_PATIENCE = 4


class InavMissions(NavMissions):
    """The mission store of one INAV. Record 1 wipes what is there, and no list is valid before its last record."""

    def pull(self) -> Conversation[tuple[NavRecord, ...] | None]:
        """Read the list that is there. One that is not whole is none; so is the single RTH of a cleared one."""
        info = yield from self._info()
        if info is None:
            return None
        records: list[NavRecord] = []
        for number in range(1, info.count + 1 if info.is_valid else 1):
            record = yield from self.read(number)
            if record is None:
                return None
            records.append(record)
        self._known = () if tuple(records) == NOTHING else tuple(records)
        return self._known

    def _order(self, wanted: tuple[NavRecord, ...]) -> list[tuple[int, NavRecord]]:
        return list(enumerate(wanted, 1))

    def _prove(self, count: int) -> Conversation[None]:
        info = yield from self._info()
        if info is None:
            raise Failed(PushFailure.NO_ANSWER)
        if not info.is_valid or info.count != count:
            raise Failed(PushFailure.REFUSED, is_final=False)

    def _keep(self) -> Conversation[None]:
        """SAVE, and look again: the flight controller stands still meanwhile, and may have restarted."""
        before = yield from self._info()
        if before is None:
            raise Failed(PushFailure.UNCERTAIN)
        for _ in range(_MAX_SAVES):
            reply = yield from ask(SAVE_REQUEST, Nav.SAVE, 0, tries=1, exclusive=True)
            after = yield from self._info_after_save()
            if after != before:
                raise Failed(PushFailure.UNCERTAIN)
            if reply is not None:
                break
        last = yield from self.read(before.count)
        if reply is None or reply.direction is Direction.ERROR or last is None:
            raise Failed(PushFailure.NOT_SAVED)

    def _still_holds(self, records: tuple[NavRecord, ...]) -> Conversation[bool]:
        info = yield from self._info()
        return _has(info, records)

    def _restore_at_once(self, before: tuple[NavRecord, ...] | None) -> Conversation[bool]:
        """Have it LOAD what was saved last: the old list, unless somebody else wrote one and did not save it."""
        with suppress(LinkLost):
            yield from ask(LOAD_REQUEST, Nav.LOAD, 0, tries=1)
            info = yield from self._info()
            return bool(before) and _has(info, before or ())
        return False

    def _info_after_save(self) -> Conversation[NavInfo | None]:
        """Ask for longer than its flash takes to be written."""
        for _ in range(_SAVE_PATIENCE):
            info = yield from self._info()
            if info is not None:
                return info
        return None

    def _info(self) -> Conversation[NavInfo | None]:
        reply = yield from ask(request(Nav.GETINFO), Nav.GETINFO, INFO_SIZE)
        return None if reply is None else decode_info(reply.payload)


def _has(info: NavInfo | None, records: tuple[NavRecord, ...]) -> bool:
    return info is not None and info.is_valid and info.count == len(records)
