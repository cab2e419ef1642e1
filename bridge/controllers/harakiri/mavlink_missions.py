# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions for a Harakiri that answers only MAVLink, by its own mission messages (baseflight_mavlink.c).

It accepts only MISSION_ITEM, with coordinates in single precision, one item at a time, and drops a transfer after
500 ms. A second later it writes the partial list in its RAM to flash. But any error in between makes it reload the old
list: so after a failure the bridge sends an item that is out of sequence. `bridge.fc.states.mavlink` avoids the traps
of its serial port; an item that cannot be sent safely rejects the list.

A written list is read back, item by item. The rules round coordinates so that they survive single precision unchanged.
"""

import struct
from collections.abc import Sequence
from dataclasses import replace

from bridge.controllers.harakiri.check import harakiri_rules
from bridge.controllers.harakiri.flight import USUAL_FLIGHT
from bridge.controllers.harakiri.mission_store import HarakiriStore
from bridge.controllers.harakiri.rules import MAV_COMMANDS, items_from_records
from bridge.controllers.harakiri.single_precision import degrees_read_e7, degrees_to_send
from bridge.fc.profile import FlightController, RuleSettings
from bridge.line.conversation import Await, Conversation, LinkLost, Pause, Stopped, Transmit
from bridge.missions.fc_mission_store import PushFailed, PushFailure, PushProgress, PushResult, StoreReport, StoreState
from bridge.model.vehicle import Vehicle
from protocols.mavlink.codec import decode, pack
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.mission_item import Command, Frame, MissionItem
from protocols.msp.mission import WpRecord

#: Harakiri's ids; it does not check the target itself.
_TARGET = (1, 200)
#: Short enough for a second try within its 500 ms.
_TIMEOUT_S = 0.2
_TRIES = 2
_MAX_BEGINS = 3
#: The list is written 1 s after the last item, which stalls the CPU.
_WRITTEN_AFTER_S = 1.6
_REQUEST, _ACK = m.MAVLINK_MSG_ID_MISSION_REQUEST, m.MAVLINK_MSG_ID_MISSION_ACK
_COUNT, _ITEM = m.MAVLINK_MSG_ID_MISSION_COUNT, m.MAVLINK_MSG_ID_MISSION_ITEM
_NO_SEQ = 0xFFFF
_COMMANDS = {int(command): number for number, command in MAV_COMMANDS.items()}
#: The failure reported if this ends the last attempt; any other becomes "the line is bad".
_FAILURES = {
    m.MAV_MISSION_NO_SPACE: PushFailure.NO_SPACE,
    m.MAV_MISSION_INVALID: PushFailure.REFUSED,
    m.MAV_MISSION_ERROR: PushFailure.BUSY,
}


class HarakiriMavlinkMissions(HarakiriStore):
    """The mission store of one Harakiri in MAVLink mode."""

    def __init__(self, _board: FlightController, vehicle: Vehicle, settings: RuleSettings) -> None:
        self._vehicle = vehicle
        self._settings = settings

    def report(self) -> Conversation[StoreReport | None]:
        """Its state from telemetry; the stored list is unknown until it is read."""
        yield from ()
        armed = self._vehicle.armed
        if armed is None:
            return None
        flight = None if self._vehicle.last_flight is None else USUAL_FLIGHT
        rules = replace(harakiri_rules(self._settings), is_single_precision=True, flight=flight)
        return StoreReport(StoreState.ARMED if armed else StoreState.READY, rules, None)

    def push(self, records: tuple[WpRecord, ...], progress: PushProgress) -> Conversation[PushResult]:
        if self._vehicle.armed is not False:
            # Nothing is sent to a craft that may be armed; the firmware would also refuse it.
            return PushResult(PushFailure.ARMED)
        items = [_message(seq, item) for seq, item in enumerate(items_from_records(records))] or _NOTHING
        failure = PushFailure.NO_ANSWER
        try:
            for _ in range(_MAX_BEGINS):
                try:
                    try:
                        yield from self._write(items, progress)
                    except Stopped:
                        raise PushFailed(PushFailure.STOPPED) from None
                    yield Pause(_WRITTEN_AFTER_S)
                    held = yield from self.pull()
                    return PushResult(None if held == records else PushFailure.UNCERTAIN)
                except PushFailed as failed:
                    failure = failed.failure
                    restored = yield from self._restore()
                    if not restored:
                        return PushResult(PushFailure.UNCERTAIN)
                    if failed.is_final:
                        break
                    if failure is PushFailure.BUSY:
                        yield Pause(_WRITTEN_AFTER_S)
        except LinkLost:
            failure = PushFailure.UNCERTAIN
        return PushResult(failure)

    def pull(self) -> Conversation[tuple[WpRecord, ...] | None]:
        """Read its list. With an empty one the board does not answer."""
        for _ in range(_MAX_BEGINS):
            count = yield from self._question(m.MAVLink_mission_request_list_message(*_TARGET), _COUNT)
            if count is None:
                continue
            records = yield from self._read_records(self._field(count, "count"))
            if records is not None:
                return records
        # No answer means an empty store; a lost line would have ended the conversation.
        return () if count is None else None

    def _write(self, items: Sequence[Message], progress: PushProgress) -> Conversation[None]:
        """Send the list, up to its MISSION_ACK."""
        answer = yield from self._ask(m.MAVLink_mission_count_message(*_TARGET, len(items)), 0)
        for seq, item in enumerate(items):
            if answer.msgid == _ACK or self._field(answer, "seq") != seq:
                raise PushFailed(PushFailure.NO_ANSWER, is_final=False)
            answer = yield from self._ask(item, seq + 1)
            if answer.msgid == _ACK and self._field(answer, "type") == m.MAV_MISSION_ACCEPTED:
                if len(items) - seq > 1 and items is not _NOTHING:
                    raise PushFailed(PushFailure.NO_ANSWER, is_final=False)
                return
            progress(seq + 1)
        raise PushFailed(PushFailure.NO_ANSWER, is_final=False)

    def _ask(self, message: Message, expected: int) -> Conversation[MavlinkFrame]:
        """Send, and wait for the request for item `expected` or a MISSION_ACK; PushFailed if it refuses."""
        for _ in range(_TRIES):
            is_safe: bool = yield Transmit(pack(message))
            if not is_safe:
                # Only the pilot can help, by moving the waypoint by a metre.
                raise PushFailed(PushFailure.UNSAFE)
            while True:
                answer: MavlinkFrame | None = yield Await(frozenset((_REQUEST, _ACK)), _TIMEOUT_S)
                if answer is None:
                    break
                if answer.msgid == _ACK:
                    result = self._field(answer, "type")
                    if result == m.MAV_MISSION_ACCEPTED:
                        return answer
                    failure = _FAILURES.get(result, PushFailure.NO_ANSWER)
                    raise PushFailed(failure, is_final=failure in (PushFailure.NO_SPACE, PushFailure.REFUSED))
                if self._field(answer, "seq") == expected:
                    return answer
        raise PushFailed(PushFailure.NO_ANSWER, is_final=False)

    def _restore(self) -> Conversation[bool]:
        """Make it reload the old list; True if it confirms that."""
        nowhere = replace(items_from_records([_HOME])[0], seq=_NO_SEQ)
        for _ in range(3):
            yield Transmit(pack(_message(_NO_SEQ, nowhere)))
            answer: MavlinkFrame | None = yield Await(frozenset((_ACK,)), _TIMEOUT_S)
            if answer is not None and self._field(answer, "type") != m.MAV_MISSION_ACCEPTED:
                return True
        return False

    def _read_records(self, count: int) -> Conversation[tuple[WpRecord, ...] | None]:
        records: list[WpRecord] = []
        for seq in range(count):
            message = m.MAVLink_mission_request_message(*_TARGET, seq)
            answer = yield from self._question(message, _ITEM, seq)
            item = None if answer is None else decode(answer)
            record = None if item is None else _record(item)
            if record is None:
                return None
            records.append(record)
        return tuple(records)

    def _question(self, message: Message, answer_id: int, seq: int | None = None) -> Conversation[MavlinkFrame | None]:
        for _ in range(_TRIES):
            is_safe: bool = yield Transmit(pack(message))
            if not is_safe:
                return None
            answer: MavlinkFrame | None = yield Await(frozenset((answer_id,)), _TIMEOUT_S)
            if answer is not None and (seq is None or self._field(answer, "seq") == seq):
                return answer
        return None

    def _field(self, frame: MavlinkFrame, name: str) -> int:
        message = decode(frame)
        return _NO_SEQ if message is None else int(getattr(message, name))


def _message(seq: int, item: MissionItem) -> Message:
    """Make MISSION_ITEM. Harakiri reads neither frame nor autocontinue."""
    params = (item.p1, item.p2, 0.0, item.p4)
    place = (degrees_to_send(item.lat_e7 or 0), degrees_to_send(item.lon_e7 or 0), item.alt_m)
    command = Command.NAV_ROI if item.command not in _COMMANDS else item.command
    return m.MAVLink_mission_item_message(*_TARGET, seq, Frame.GLOBAL_RELATIVE_ALT, command, 0, 1, *params, *place)


def _record(item: Message) -> WpRecord | None:
    """The record that reads back as this MISSION_ITEM; None if no record does."""
    is_turns = item.command == Command.NAV_LOITER_TURNS
    try:
        record = WpRecord(
            lat_e7=degrees_read_e7(item.x),
            lon_e7=degrees_read_e7(item.y),
            height_m=int(item.z),
            roi_heading=int(item.param4),
            time=0 if is_turns else int(item.param1),
            radius_m=int(item.param2),
            turns=int(item.param1) if is_turns else 0,
            command=_COMMANDS.get(item.command, 0),
        )
        record.pack()
    except (ValueError, OverflowError, struct.error):
        return None
    return record


_HOME = WpRecord(0, 0, 0, 0, 0, 0, 0, 0)
#: Two items, the first of them invalid, are accepted and clear the store.
_NOTHING = [_message(seq, replace(items_from_records([_HOME])[0], seq=seq)) for seq in (0, 1)]
