# SPDX-License-Identifier: GPL-3.0-or-later
"""A model of the flight controller's side of the mission extension: requests in, replies out (docs/msp-mission.md)."""

import struct
from dataclasses import dataclass

from protocols.mission_item import ListIdentity
from protocols.msp.mission import (
    RECORD_SIZE,
    VERSION,
    Info,
    InfoFlag,
    MissionCommand,
    ReplyStatus,
    Staged,
    Stored,
    WpCommand,
)
from simulator.board.flash import FlashError, NorFlash
from simulator.naze.mission_slots import MissionSlots
from simulator.naze.missions import Board
from simulator.naze.replies import MAX_RADIUS_CM, Radius, encode_reply, unmask

_LIST = struct.Struct("<HI")
_READ = struct.Struct("<HBB")
_RECORDS_HEADER = struct.Struct("<BH")
_RADIUS = struct.Struct("<HH")
#: The burst of flash writes that requests may cause, and the interval at which one more is allowed.
_WRITE_BURST = 250
_WRITE_INTERVAL_MS = 300_000


@dataclass(slots=True)
class _Upload:
    """A list being staged. `touched`: the time of the last request, seconds."""

    identity: ListIdentity
    touched: float
    next: int = 0


class MissionCommands:
    """State of the extension since boot: the slots, and the open transfer if any; see Missions."""

    def __init__(self, flash: NorFlash, board: Board) -> None:
        self._board = board
        self._options = board.options
        self._slots = MissionSlots(flash, board.options)
        self._transfer: _Upload | None = None
        self._writes_left = _WRITE_BURST
        self._intervals = 0

    def answer(self, command: int, payload: bytes, now: float) -> bytes | None:
        """The reply's payload, or None if it is not one of the extension's commands. PowerCutError."""
        self.drop_stale(now)
        body = unmask(payload)
        match command:
            case MissionCommand.INFO:
                return encode_reply(self._info())
            case MissionCommand.BEGIN:
                return encode_reply(self._progress(self._begin(body, now)))
            case MissionCommand.CHUNK:
                return encode_reply(self._progress(self._chunk(body, now)))
            case MissionCommand.COMMIT:
                return encode_reply(Stored(self._commit(body, now), self._slots.stored))
            case MissionCommand.ABORT:
                return bytes((self._abort(payload),))
            case MissionCommand.READ:
                return self._read(body)
            case MissionCommand.RADIUS:
                return encode_reply(Radius(self._radius(body, now), self._board.wp_radius_cm))
        return None

    def drop_stale(self, now: float) -> None:
        """Drop an open transfer if the craft is armed or at the timeout. Add to the write budget."""
        intervals = int(now * 1000) // _WRITE_INTERVAL_MS
        self._writes_left = min(self._writes_left + intervals - self._intervals, _WRITE_BURST)
        self._intervals = intervals
        if self._transfer:
            silence = now - self._transfer.touched
            if self._board.armed or silence > self._options.transfer_timeout_ms / 1000:
                self._transfer = None

    @property
    def stored(self) -> bytes:
        return self._slots.read(0, self._slots.stored.count)

    def store(self, records: bytes) -> None:
        if not self._board.armed and records != self.stored:
            self._transfer = None
            self._slots.store(records)

    @property
    def writes(self) -> int:
        """The number of lists ever made valid in this flash."""
        return self._slots.writes

    def _info(self) -> Info:
        flags = InfoFlag(0)
        if self._board.armed:
            flags |= InfoFlag.ARMED
        if self._board.write_pending:
            flags |= InfoFlag.WRITE_PENDING
        if self._transfer:
            flags |= InfoFlag.TRANSFER_OPEN
        if not self._writes_left:
            flags |= InfoFlag.WRITES_SPENT
        options = self._options
        return Info(
            version=VERSION,
            flags=flags,
            chunk_records=options.chunk_records,
            chunk_window=options.chunk_window,
            read_records=options.read_records,
            capacity=options.capacity,
            stored=self._slots.stored,
            wp_radius_cm=self._board.wp_radius_cm,
            inter_byte_timeout_ms=options.inter_byte_timeout_ms,
            staged=self._transfer.next if self._transfer else 0,
            flash_writes=self._slots.writes,
        )

    def _refusal(self) -> ReplyStatus | None:
        if self._board.armed:
            return ReplyStatus.ARMED
        return ReplyStatus.BUSY if self._board.write_pending else None

    def spend_write(self) -> bool:
        if self._writes_left:
            self._writes_left -= 1
            return True
        return False

    def _progress(self, status: ReplyStatus) -> Staged:
        """The progress of the transfer, with `status`, or zeros without one."""
        staged = self._transfer.next if self._transfer else 0
        return Staged(status, staged, self._slots.staged_checksum(staged))

    def _begin(self, body: bytes | None, now: float) -> ReplyStatus:
        if body is None or len(body) != _LIST.size:
            return ReplyStatus.BAD_REQUEST
        identity = ListIdentity(*_LIST.unpack(body))
        if identity.count == 0 and identity.checksum:
            return ReplyStatus.BAD_REQUEST
        if refusal := self._refusal():
            return refusal
        if self._transfer and self._transfer.identity == identity:
            self._transfer.touched = now
            return ReplyStatus.OK
        self._transfer = None
        if identity.count > self._options.capacity:
            return ReplyStatus.NO_SPACE
        if identity == self._slots.stored:
            return ReplyStatus.SAME
        if not self._slots.is_prepared:
            if not self.spend_write():
                return ReplyStatus.BUSY
            try:
                self._slots.prepare()
            except FlashError:
                return ReplyStatus.FLASH
        self._transfer = _Upload(identity, now)
        return ReplyStatus.OK

    def _chunk(self, body: bytes | None, now: float) -> ReplyStatus:
        count, rest = divmod(len(body) - 2 if body else 0, RECORD_SIZE)
        if not body or rest or not 1 <= count <= self._options.chunk_records:
            return ReplyStatus.BAD_REQUEST
        if refusal := self._refusal():
            return refusal
        transfer = self._transfer
        if transfer is None:
            return ReplyStatus.NO_TRANSFER
        transfer.touched = now
        first = int.from_bytes(body[:2], "little")
        if first != transfer.next:
            return ReplyStatus.OK if first < transfer.next else ReplyStatus.SEQUENCE
        if first + count > transfer.identity.count:
            return ReplyStatus.RANGE
        records = [body[at : at + RECORD_SIZE] for at in range(2, len(body), RECORD_SIZE)]
        if any(record[-1] > max(WpCommand) for record in records):
            self._transfer = None
            return ReplyStatus.BAD_RECORD
        try:
            for record in records:
                self._slots.stage(transfer.next, record)
                transfer.next += 1
        except FlashError:
            self._transfer = None
            return ReplyStatus.FLASH
        return ReplyStatus.OK

    def _commit(self, body: bytes | None, now: float) -> ReplyStatus:
        if body is None or len(body) != _LIST.size:
            return ReplyStatus.BAD_REQUEST
        if refusal := self._refusal():
            return refusal
        identity = ListIdentity(*_LIST.unpack(body))
        transfer = self._transfer
        if transfer is None:
            return ReplyStatus.OK if identity == self._slots.stored else ReplyStatus.NO_TRANSFER
        transfer.touched = now
        if transfer.next < transfer.identity.count:
            return ReplyStatus.INCOMPLETE
        self._transfer = None
        staged = ListIdentity(transfer.next, self._slots.staged_checksum(transfer.next))
        if not identity == transfer.identity == staged:
            return ReplyStatus.CHECKSUM
        try:
            self._slots.commit(identity)
        except FlashError:
            return ReplyStatus.FLASH
        return ReplyStatus.OK

    def _abort(self, payload: bytes) -> ReplyStatus:
        if payload:
            return ReplyStatus.BAD_REQUEST
        self._transfer = None
        return ReplyStatus.OK

    def _read(self, body: bytes | None) -> bytes:
        if body is None or len(body) != _READ.size:
            return _RECORDS_HEADER.pack(ReplyStatus.BAD_REQUEST, 0)
        first, count, zero = _READ.unpack(body)
        if zero or not count:
            return _RECORDS_HEADER.pack(ReplyStatus.BAD_REQUEST, 0)
        if first >= self._slots.stored.count:
            return _RECORDS_HEADER.pack(ReplyStatus.RANGE, first)
        return _RECORDS_HEADER.pack(ReplyStatus.OK, first) + self._slots.read(
            first, min(count, self._options.read_records)
        )

    def _radius(self, body: bytes | None, now: float) -> ReplyStatus:
        if body is None or len(body) != _RADIUS.size:
            return ReplyStatus.BAD_REQUEST
        value, inverse = _RADIUS.unpack(body)
        if value ^ inverse != 0xFFFF:
            return ReplyStatus.BAD_REQUEST
        refusal = self._refusal()
        if refusal is not ReplyStatus.ARMED and value == self._board.wp_radius_cm:
            return ReplyStatus.OK
        if refusal:
            return refusal
        if value > MAX_RADIUS_CM:
            return ReplyStatus.RANGE
        if not self.spend_write():
            return ReplyStatus.BUSY
        self._board.set_wp_radius(value, now)
        return ReplyStatus.OK
