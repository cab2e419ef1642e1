# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a list to INAV and MultiWii NAV (docs/inav.md): record by record, each read back before the next is sent.

A reply to SET_WP does not mean that the record was stored, so only read-back counts. An armed flight controller is not
written to: STATUS is requested before the first record and before the last, which makes the list flyable,
and watched in between.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil

from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.fc.profile import FlightController
from bridge.line.conversation import Conversation, LinkLost, Receive, Send, Stopped, ask, ask_armed, send
from bridge.missions.fc_mission_store import (
    FcMissionStore,
    PushFailed,
    PushFailure,
    PushProgress,
    PushResult,
    StoreReport,
    StoreState,
)
from bridge.model.vehicle import Vehicle
from protocols.mission_item import MissionItem
from protocols.msp.frame import Direction, MspFrame
from protocols.msp.nav import (
    LAST,
    WP_SIZE,
    Nav,
    NavAction,
    NavRecord,
    UnsafeRecord,
    decode_wp,
    encode_read_wp,
    encode_set_wp,
)
from protocols.msp.nav_items import home_item, item_seqs, items_from_records

#: The replacement for an empty list, which cannot be written.
NOTHING = (NavRecord(NavAction.RTH, flag=LAST),)
_TRIES = 5
_WP = frozenset((Nav.WP,))
#: A list is compared within this many checks, a quarter of a second each if the board answers fast enough.
_CHECKS = 6
#: Other changes, and transfers, have to wait until a check ends.
_MOST_COMPARED = 12
#: Restarts of one push after a read-back mismatch.
_MAX_BEGINS = 3


class NavMissions(FcMissionStore[NavRecord], ABC):
    """The mission store of one flight controller."""

    #: True if storing a record stalls it.
    _stores_slowly = False
    watch_s = 0.25
    #: The records compared so far with the board's.
    _compared = 0

    def __init__(self, profile: NavProfile, controller: FlightController, vehicle: Vehicle) -> None:
        self._profile = profile
        self._vehicle = vehicle
        assert controller.arm_bit is not None
        self._arm_bit = controller.arm_bit
        #: The flight controller's list, as last read, or None if unknown, or one that cannot be flown.
        self._known: tuple[NavRecord, ...] | None = None

    def report(self) -> Conversation[StoreReport | None]:
        """Ask if it is armed. The stored list is unknown until it is read."""
        armed = yield from self._ask_armed()
        if armed is None:
            return None
        return StoreReport(StoreState.ARMED if armed else StoreState.READY, self._rules(), None)

    def _rules(self) -> NavRules:
        return NavRules(self._profile, self._known or ())

    def items(self, records: Sequence[NavRecord], sent_as: Mapping[int, int]) -> tuple[MissionItem, ...]:
        """A list as a ground station reads it. An empty list lacks even home."""
        return items_from_records(records, home_item(self._vehicle.place()), sent_as) if records else ()

    def refreshed(self, items: tuple[MissionItem, ...]) -> tuple[MissionItem, ...]:
        """Home as on the flight controller. Before it has one, as sent, if known."""
        if not items:
            return items
        is_known = bool(items[0].lat_e7 and items[0].lon_e7)
        home = self._vehicle.place()
        if home is None or (is_known and not self._vehicle.is_home_settled):
            return items
        return (replace(items[0], lat_e7=home[0], lon_e7=home[1]), *items[1:])

    def seq_of(self, records: Sequence[NavRecord], number: int) -> int:
        """The seq of the item for record `number`, or 0 if there is none."""
        return item_seqs(records)[number - 1] if 1 <= number <= len(records) else 0

    def push(self, records: tuple[NavRecord, ...], progress: PushProgress) -> Conversation[PushResult]:
        """Write the list and verify it. After a failure restore the old list, if known."""
        before, self._known = self._known, None
        # The result if the link is lost now.
        failure = PushFailure.NO_ANSWER
        writing = False

        def proven(done: int) -> None:
            nonlocal failure
            failure = PushFailure.INCOMPLETE
            progress(done)

        try:
            yield from self._make_sure_disarmed()
            before = yield from self._confirm(before)
            # Until the first record is read back, it may or may not have wiped the old list.
            failure, writing = PushFailure.UNCERTAIN, True
            yield from self._write_surely(self._store_content(records or NOTHING), proven)
            failure, writing = PushFailure.UNCERTAIN, False
            yield from self._keep()
            self._known = records
            return PushResult(None)
        except Stopped:
            if failure is PushFailure.NO_ANSWER or (writing and (yield from self._restore_at_once(before))):
                failure = PushFailure.STOPPED
            return PushResult(failure)
        except LinkLost:
            return PushResult(failure)
        except PushFailed as failed:
            if failure is PushFailure.NO_ANSWER:
                self._known = before
            elif writing and not (yield from self._restore(before)):
                has_armed = failed.failure is PushFailure.ARMED and failure is PushFailure.INCOMPLETE
                return PushResult(PushFailure.ARMED_WHILE_WRITING if has_armed else failure)
            return PushResult(failed.failure)

    @abstractmethod
    def pull(self) -> Conversation[tuple[NavRecord, ...] | None]:
        """Read the list. Returns None if that fails."""

    @abstractmethod
    def _order(self, wanted: tuple[NavRecord, ...]) -> list[tuple[int, NavRecord]]:
        """The records to write, in order, with their numbers: half a list must never be flyable."""

    @abstractmethod
    def _keep(self) -> Conversation[None]:
        """Make the list permanent after the last record. Raises PushFailed."""

    def _store_content(self, records: tuple[NavRecord, ...]) -> tuple[NavRecord, ...]:
        """All records to write so that `records` are flown, without further losses."""
        return records

    def _confirm(self, before: tuple[NavRecord, ...] | None) -> Conversation[tuple[NavRecord, ...] | None]:
        """The old list, or None if another client has detectably changed it since it was read."""
        yield from ()
        return before

    def _restore_at_once(self, before: tuple[NavRecord, ...] | None) -> Conversation[bool]:
        """Restore the old list if that does not take time. Returns True if it is restored."""
        yield from ()
        return False

    def _write_surely(self, wanted: tuple[NavRecord, ...], progress: PushProgress) -> Conversation[None]:
        for begins in range(1, _MAX_BEGINS + 1):
            try:
                yield from self._write(wanted, progress)
                return
            except PushFailed as failed:
                if failed.is_final or begins == _MAX_BEGINS:
                    raise

    def _write(self, wanted: tuple[NavRecord, ...], progress: PushProgress) -> Conversation[None]:
        order = self._order(wanted)
        for done, (number, record) in enumerate(order, 1):
            if done == len(order) > 1:
                yield from self._make_sure_disarmed()
            elif self._vehicle.armed:
                raise PushFailed(PushFailure.ARMED)
            frame = _frame(number, record)
            if self._stores_slowly and (yield from self.read(number)) == record:
                # A ground station that timed out may send the same list again: then this is quick.
                progress(done)
                continue
            if not self._stores_slowly:
                # Replies come in order, so the read-back does not wait for the acknowledgement.
                yield send(frame, Nav.SET_WP, 0)
                if (yield from self.read(number)) == record:
                    progress(done)
                    continue
            reply = yield from ask(frame, Nav.SET_WP, 0, tries=_TRIES, exclusive=self._stores_slowly)
            if reply is None:
                raise PushFailed(PushFailure.NO_ANSWER)
            if reply.direction is Direction.ERROR:
                raise PushFailed(PushFailure.REFUSED)
            yield from self._compare(number, record)
            progress(done)
        yield from self._prove(len(wanted))

    def _prove(self, count: int) -> Conversation[None]:
        """Verify what single records do not show. Raises PushFailed."""
        yield from ()

    def _compare(self, number: int, record: NavRecord) -> Conversation[None]:
        """Read a record back, and again if it differs: the 8-bit checksum misses some damage."""
        for _ in range(2):
            held = yield from self.read(number)
            if held is None:
                raise PushFailed(PushFailure.NO_ANSWER)
            if held == record:
                return
        raise PushFailed(PushFailure.REFUSED, is_final=False)

    def read(self, number: int) -> Conversation[NavRecord | None]:
        """Read one record. Ignores replies about others (telemetry polls home)."""
        for _ in range(_TRIES):
            asked: Send | None = send(encode_read_wp(number), Nav.WP, WP_SIZE)
            while True:
                reply: MspFrame | None = yield Receive(_WP, asked)
                asked = None
                if reply is None:
                    break
                answer = decode_wp(reply.payload)
                if answer is not None and answer[0] == number:
                    return answer[1]
        return None

    def _has_same_records(self, known: tuple[NavRecord, ...]) -> Conversation[bool]:
        """Compare the next records."""
        for _ in range(min(ceil(len(known) / _CHECKS), _MOST_COMPARED)):
            place = self._compared % len(known)
            held = yield from self.read(place + 1)
            if held is not None and held != known[place]:
                return False
            self._compared += 1
        return True

    def _restore(self, before: tuple[NavRecord, ...] | None) -> Conversation[bool]:
        """Write the old list again, if known. Returns True if it is restored."""
        if not before or self._vehicle.armed:
            return False
        try:
            yield from self._make_sure_disarmed()
            yield from self._write(before, lambda _done: None)
        except (PushFailed, LinkLost):
            return False
        self._known = before
        return True

    def _make_sure_disarmed(self) -> Conversation[None]:
        armed = yield from self._ask_armed()
        if armed is None:
            raise PushFailed(PushFailure.NO_ANSWER)
        if armed:
            raise PushFailed(PushFailure.ARMED)

    def _ask_armed(self) -> Conversation[bool | None]:
        return (yield from ask_armed(self._arm_bit, tries=_TRIES))


def _frame(number: int, record: NavRecord) -> bytes:
    """Encode SET_WP. A record that crashes the flight controller (another client may have written it) is not sent."""
    try:
        return encode_set_wp(number, record)
    except UnsafeRecord as unsafe:
        raise PushFailed(PushFailure.UNSAFE) from unsafe
