# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's own mission store and the MAVLink messages that fill it (baseflight_mavlink.c, floppy.c).

The list in RAM is changed item by item. Without the extension it is written to flash a second after the last item, even
if the transfer is incomplete. An error before that reloads the list from flash. With it, the list is written before it
is acknowledged.
"""

from collections.abc import Callable

from protocols.float32 import single
from protocols.mavlink.codec import Packed, decode, pack
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.mission_item import pack_records
from protocols.msp.mission import WpCommand, WpRecord, unpack_records
from simulator.board.flash import FlashError, NorFlash
from simulator.naze.mission_slots import MissionSlots
from simulator.naze.missions import Board, Missions

_TIMEOUT_S = 0.5
_WRITE_DELAY_S = 1.0
_CAPACITY = 146
_E7 = single(1e7)
_COMMANDS = {
    m.MAV_CMD_NAV_WAYPOINT: WpCommand.WAYPOINT,
    m.MAV_CMD_NAV_ROI: WpCommand.SETROI,
    m.MAV_CMD_NAV_LOITER_UNLIM: WpCommand.LOITER_UNLIM,
    m.MAV_CMD_NAV_LOITER_TURNS: WpCommand.LOITER_TURNS,
    m.MAV_CMD_NAV_LOITER_TIME: WpCommand.LOITER_TIME,
    m.MAV_CMD_NAV_RETURN_TO_LAUNCH: WpCommand.RETURN_TO_LAUNCH,
    m.MAV_CMD_NAV_LAND: WpCommand.LAND,
    m.MAV_CMD_NAV_TAKEOFF: WpCommand.TAKEOFF,
}
_MAV_COMMANDS = {number: command for command, number in _COMMANDS.items()}
_TO_PLACE = (WpCommand.WAYPOINT, WpCommand.LOITER_UNLIM, WpCommand.LOITER_TURNS, WpCommand.LOITER_TIME)
_NOT_ALONE = (WpCommand.SETROI, WpCommand.RETURN_TO_LAUNCH, WpCommand.LAND, WpCommand.TAKEOFF)


class OwnMissionStore:
    """One boot's store. `send` packs and sends a message to a partner. `on_reset`: called at the end of a transfer.

    With the extension, `missions` keeps the list, and an interrupted upload leaves the old list. Without it, the list
    is written with the configuration, complete or not.
    """

    def __init__(
        self,
        flash: NorFlash,
        board: Board,
        missions: Missions | None,
        send: Callable[[Packed], None],
        on_reset: Callable[[], None],
    ) -> None:
        self._board = board
        self._missions = missions
        self._slots = MissionSlots(flash, board.options)
        self._send = send
        self._on_reset = on_reset
        self._partner = (0, 0)
        self.load()
        self._receiving = self._sending = self._knows_roi = False
        self._total = self._expected = 0
        #: With the extension, the last item of the upload that was accepted last, or 0 if there is none.
        self._last_accepted = 0
        self._touched = 0.0

    @property
    def stored(self) -> bytes:
        return self._missions.stored if self._missions else self._slots.read(0, self._slots.stored.count)

    @property
    def count(self) -> int:
        return len(self._list)

    def load(self) -> None:
        self._list = list(unpack_records(self.stored))

    def clear(self) -> None:
        self._list.clear()

    def save(self) -> None:
        """Write the list in RAM to flash. FlashError, PowerCutError."""
        if self._missions and self._receiving:
            self._reset()
            self.load()
        (self._missions or self._slots).store(pack_records(self._list))

    def drop_stale(self, now: float) -> None:
        """With the extension, restore the old list after an interrupted upload."""
        if self._missions and self._receiving and now - self._touched > _TIMEOUT_S:
            self._reset()
            self.load()

    def take(self, frame: MavlinkFrame, now: float) -> None:
        message = decode(frame)
        if message is None:
            return
        self._partner = (frame.sysid, frame.compid)
        self.drop_stale(now)
        if (self._receiving or self._sending) and now - self._touched > _TIMEOUT_S:
            self._reset()
        match frame.msgid:
            case m.MAVLINK_MSG_ID_MISSION_COUNT:
                self._begin(message.count, now)
            case m.MAVLINK_MSG_ID_MISSION_ITEM:
                self._item(message, now)
            case m.MAVLINK_MSG_ID_MISSION_REQUEST_LIST:
                if self._is_free() and self._list:
                    self._sending, self._touched = True, now
                    self._send(pack(m.MAVLink_mission_count_message(*self._partner, len(self._list))))
            case m.MAVLINK_MSG_ID_MISSION_REQUEST:
                if self._sending and not self._board.armed and message.seq < len(self._list):
                    self._touched = now
                    self._send(pack(self._stored_item(message.seq)))
                    if message.seq == len(self._list) - 1:
                        self._reset()

    def _reset(self) -> None:
        self._receiving = self._sending = self._knows_roi = False
        self._expected = 0
        self._on_reset()

    def _is_free(self) -> bool:
        busy = self._receiving or self._sending or self._board.write_pending
        return not (busy or self._board.armed)

    def _ack(self, result: int) -> None:
        if self._missions:
            self._ack_stored(result)
            return
        if self._board.config_write_due is not None and result != m.MAV_MISSION_ACCEPTED:
            self._board.config_write_due = None
            self.load()
        self._send(pack(m.MAVLink_mission_ack_message(*self._partner, result)))
        self._reset()

    def _ack_stored(self, result: int) -> None:
        """With the extension: store the list before it is accepted (MissionUploaded)."""
        assert self._missions is not None
        if result == m.MAV_MISSION_ACCEPTED and self._receiving:
            try:
                self._missions.store(pack_records(self._list))
            except FlashError:
                result = m.MAV_MISSION_ERROR
        if result != m.MAV_MISSION_ACCEPTED:
            self.load()
        self._last_accepted = self._total - 1 if result == m.MAV_MISSION_ACCEPTED else 0
        self._send(pack(m.MAVLink_mission_ack_message(*self._partner, result)))
        self._reset()

    def _request(self, now: float) -> None:
        self._touched = now
        self._send(pack(m.MAVLink_mission_request_message(*self._partner, self._expected)))

    def _begin(self, count: int, now: float) -> None:
        self._last_accepted = 0
        if not self._is_free() or count < 2:
            self._ack(m.MAV_MISSION_ERROR)
        elif count > _CAPACITY:
            self._ack(m.MAV_MISSION_NO_SPACE)
        else:
            self._reset()
            self._list.clear()
            self._receiving, self._total = True, count
            self._request(now)

    def _item(self, message: Message, now: float) -> None:
        if self._last_accepted and message.seq == self._last_accepted:
            self._ack(m.MAV_MISSION_ACCEPTED)
            return
        if self._board.armed or not self._receiving:
            self._ack(m.MAV_MISSION_ERROR)
            return
        if message.seq != self._expected:
            self._ack(m.MAV_MISSION_INVALID_SEQUENCE)
            return
        is_last = message.seq == self._total - 1
        command = _COMMANDS.get(message.command)
        if (
            (command is WpCommand.SETROI and is_last)
            or (command is WpCommand.TAKEOFF and message.seq != 1)
            or (command in (WpCommand.LOITER_UNLIM, WpCommand.LAND) and not is_last)
            or (command in _NOT_ALONE and self._total == 2)
        ):
            self._ack(m.MAV_MISSION_INVALID)
            return
        record = self._record(message, command)
        self._expected += 1
        if not self._missions:
            self._board.config_write_due = now + _WRITE_DELAY_S
        if record is not None:
            self._list.append(record)
        elif self._total == 2:
            self._list.clear()
            self._ack(m.MAV_MISSION_ACCEPTED)
            if not self._missions:
                self._board.config_write_due = now
            return
        if is_last:
            self._ack(m.MAV_MISSION_ACCEPTED)
        else:
            self._request(now)

    def _record(self, message: Message, command: WpCommand | None) -> WpRecord | None:
        """The firmware's record for an item, or None if it skips it."""
        lat_e7, lon_e7 = (int(single(single(degrees) * _E7)) for degrees in (message.x, message.y))
        height = _within(message.z, -32767, 32767) or 2
        if command is None or (command in (*_TO_PLACE, WpCommand.SETROI) and not (lat_e7 and lon_e7)):
            return None
        heading = time = radius = turns = 0
        match command:
            case WpCommand.WAYPOINT:
                time = _within(message.param1, 0, 1)
            case WpCommand.SETROI:
                height, self._knows_roi = 0, True
            case WpCommand.LOITER_TURNS:
                turns = _within(message.param1, -127, 127) or 1
            case WpCommand.LOITER_TIME:
                time = _within(message.param1, 1, 255)
            case WpCommand.RETURN_TO_LAUNCH:
                lat_e7 = lon_e7 = 0
            case WpCommand.LAND:
                lat_e7 = lon_e7 = height = 0
            case WpCommand.TAKEOFF:
                lat_e7 = lon_e7 = 0
                height = _within(height, 2, 255)
        if command in _TO_PLACE:
            radius = _within(message.param2, self._board.wp_radius_cm // 100, 255)
            if command is not WpCommand.LOITER_TURNS and self._knows_roi:
                heading = _within(message.param4, 0, 1)
        return WpRecord(lat_e7, lon_e7, height, heading, time, radius, turns, command)

    def _stored_item(self, seq: int) -> Message:
        record = self._list[seq]
        first = record.turns if record.command == WpCommand.LOITER_TURNS else record.time
        place = (single(single(record.lat_e7) / _E7), single(single(record.lon_e7) / _E7), float(record.height_m))
        params = (float(first), float(record.radius_m), 0.0, float(record.roi_heading))
        command = _MAV_COMMANDS[WpCommand(record.command)]
        frame = m.MAV_FRAME_GLOBAL_RELATIVE_ALT
        return m.MAVLink_mission_item_message(*self._partner, seq, frame, command, 0, 1, *params, *place)


def _within(value: float, low: int, high: int) -> int:
    """Like constrain_int, which takes an int."""
    return min(max(int(value), low), high)
