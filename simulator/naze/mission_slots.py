# SPDX-License-Identifier: GPL-3.0-or-later
"""Two flash slots for the mission, the newest valid one in use, and the configuration's pages.

The layout is that of firmware/naze_mission.h: a header, then the records. The header is programmed after them, its
seal last: until then the other slot is the list. Staging does not need RAM.
"""

import struct
import zlib

from protocols.mission_item import ListIdentity
from protocols.msp.mission import RECORD_SIZE
from simulator.board.flash import ERASED, PAGE_SIZE, FlashError, NorFlash
from simulator.board.options import SimOptions

_HEADER = struct.Struct("<HHII")  # magic, count, sequence, checksum of the records
_HEADER_CHECKSUM = struct.Struct("<I")
_SEAL = b"\0\0"
_SEAL_AT = _HEADER.size + _HEADER_CHECKSUM.size
_RECORDS_AT = 32
_MAGIC = 0x4D4E
_CONFIG = struct.Struct("<HHH")  # the seal of the extension's configurations, gps_wp_radius, its inverse
#: The configuration's place, and the page in which the extension stages it.
_CONFIG_PAGES = 2
_CONFIG_SEAL, _NO_SEAL = 0x5EA1, 0xFFFF
_SLOTS = 2
_BLANK = bytes((ERASED,)) * PAGE_SIZE


def slot_pages(capacity: int) -> int:
    """The pages of a slot of `capacity` records."""
    return -(-(_RECORDS_AT + capacity * RECORD_SIZE) // PAGE_SIZE)


def flash_size(options: SimOptions) -> int:
    """The size of the flash for these options, bytes."""
    return (_SLOTS * slot_pages(options.capacity) + _CONFIG_PAGES) * PAGE_SIZE


class MissionSlots:
    """The stored list, and the list being staged in the other slot."""

    def __init__(self, flash: NorFlash, options: SimOptions) -> None:
        self._flash = flash
        self._pages = slot_pages(options.capacity)
        self._capacity = options.capacity
        self._erase_seconds = options.flash_erase_ms / 1000 / self._pages
        self._program_seconds = options.record_program_ms / 1000
        self._active = _SLOTS - 1  # the first list goes into the first slot
        self.stored = ListIdentity(0, 0)
        self.writes = 0
        self.load()

    def load(self) -> None:
        """Find the newest valid slot, as done at boot."""
        self.stored, self.writes = ListIdentity(0, 0), 0
        for slot in range(_SLOTS):
            header = self._flash.read(self._start(slot), _SEAL_AT + len(_SEAL))
            magic, count, writes, checksum = _HEADER.unpack_from(header)
            is_sealed = header == _sealed(header[: _HEADER.size])
            if magic == _MAGIC and is_sealed and count <= self._capacity and writes > self.writes:
                identity = ListIdentity(count, checksum)
                if self._checksum(slot, count) == checksum:
                    self._active, self.stored, self.writes = slot, identity, writes

    def read(self, first: int, count: int) -> bytes:
        """The bytes of stored records; fewer at the end of the list."""
        count = min(count, self.stored.count - first)
        return self._flash.read(self._record(self._active, first), count * RECORD_SIZE)

    @property
    def is_prepared(self) -> bool:
        """True if the unused slot is blank."""
        return all(self._is_blank(page) for page in self._unused_pages)

    def prepare(self) -> None:
        """Erase the unused slot, except for blank pages. FlashError, PowerCutError."""
        for page in self._unused_pages:
            if not self._is_blank(page):
                self._flash.erase(page, self._erase_seconds)

    def stage(self, index: int, record: bytes) -> None:
        """Program one record into the unused slot. FlashError, PowerCutError."""
        self._flash.program(self._record(self._unused, index), record, self._program_seconds)

    def staged_checksum(self, count: int) -> int:
        """The checksum of the first `count` staged records, read from flash."""
        return self._checksum(self._unused, count)

    def commit(self, identity: ListIdentity) -> None:
        """Make the staged list the stored one. FlashError, PowerCutError."""
        header = _sealed(_HEADER.pack(_MAGIC, identity.count, self.writes + 1, identity.checksum))
        start = self._start(self._unused)
        self._flash.program(start, header[:_SEAL_AT], self._program_seconds)
        try:
            self._flash.program(start + _SEAL_AT, _SEAL, self._program_seconds)
        except FlashError:
            # A seal that reads wrong now might read correctly at the next boot.
            self._flash.erase(self._unused_pages[0], self._erase_seconds)
            raise
        self._active = self._unused
        self.stored = identity
        self.writes += 1

    def store(self, records: bytes) -> None:
        """Make a whole list the stored one, unless it already is. FlashError, PowerCutError."""
        identity = ListIdentity(len(records) // RECORD_SIZE, zlib.crc32(records))
        if identity != self.stored:
            self.prepare()
            for index in range(identity.count):
                self.stage(index, records[index * RECORD_SIZE :][:RECORD_SIZE])
            self.commit(identity)

    @property
    def _unused(self) -> int:
        return 1 - self._active

    @property
    def _unused_pages(self) -> range:
        first = self._unused * self._pages
        return range(first, first + self._pages)

    def _is_blank(self, page: int) -> bool:
        return self._flash.read(page * PAGE_SIZE, PAGE_SIZE) == _BLANK

    def _start(self, slot: int) -> int:
        return slot * self._pages * PAGE_SIZE

    def _record(self, slot: int, index: int) -> int:
        return self._start(slot) + _RECORDS_AT + index * RECORD_SIZE

    def _checksum(self, slot: int, count: int) -> int:
        return zlib.crc32(self._flash.read(self._record(slot, 0), count * RECORD_SIZE))


def _sealed(header: bytes) -> bytes:
    return header + _HEADER_CHECKSUM.pack(zlib.crc32(header)) + _SEAL


class StoredConfig:
    """gps_wp_radius, and with the extension all settings.

    Without the extension, a power cut between `erase` and `program` loses it. With it, `stage` keeps it in another page
    meanwhile, and `finish` completes the write at the next boot (harakiri_config.h).
    """

    def __init__(self, flash: NorFlash, options: SimOptions) -> None:
        self._flash = flash
        self._place = _SLOTS * slot_pages(options.capacity)
        self._default_cm = options.wp_radius_cm
        self._seconds = options.config_write_ms / 1000 / 2

    @property
    def is_valid(self) -> bool:
        return self._read(self._place) is not None

    def load(self) -> int:
        """gps_wp_radius, cm. The default if the place is not valid."""
        place = self._read(self._place)
        return place[0] if place else self._default_cm

    def finish(self) -> None:
        """Complete a write that a power cut has interrupted. FlashError, PowerCutError."""
        place, staged = self._read(self._place), self._read(self._place + 1)
        kept = self._settings(self._place + 1)
        if staged and (
            place is None or (place[1] == _CONFIG_SEAL and (place[0], self._settings(self._place)) != (staged[0], kept))
        ):
            self.erase()
            self.program(staged[0], kept, sealed=True)

    def stage(self, wp_radius_cm: int, settings: bytes = b"") -> None:
        """Stage the configuration about to be written. FlashError, PowerCutError."""
        self._flash.erase(self._place + 1, self._seconds / 4)
        self._program(self._place + 1, wp_radius_cm, settings, _CONFIG_SEAL, self._seconds / 4)

    def erase(self) -> None:
        """FlashError, PowerCutError."""
        self._flash.erase(self._place, self._seconds)

    def program(self, wp_radius_cm: int, settings: bytes = b"", *, sealed: bool = False) -> None:
        """Write the settings to the erased page. FlashError, PowerCutError."""
        self._program(self._place, wp_radius_cm, settings, _CONFIG_SEAL if sealed else _NO_SEAL, self._seconds)

    def load_settings(self, size: int) -> bytes:
        """The settings' bytes, or none if the place has none."""
        has_settings = self.is_valid and self._settings(self._place)
        return self._flash.read((self._place + 1) * PAGE_SIZE - _CONFIG.size - size, size) if has_settings else b""

    def _settings(self, page: int) -> bytes:
        """The settings without leading FF bytes, which are not programmed."""
        return self._flash.read(page * PAGE_SIZE, PAGE_SIZE - _CONFIG.size).lstrip(bytes((ERASED,)))

    def _program(self, page: int, wp_radius_cm: int, settings: bytes, seal: int, seconds: float) -> None:
        # A power cut leaves the first half: the part that makes the page valid comes last.
        data = settings + _CONFIG.pack(seal, wp_radius_cm, wp_radius_cm ^ 0xFFFF)
        self._flash.program((page + 1) * PAGE_SIZE - len(data), data, seconds)

    def _read(self, page: int) -> tuple[int, int] | None:
        seal, value, inverse = _CONFIG.unpack(self._flash.read((page + 1) * PAGE_SIZE - _CONFIG.size, _CONFIG.size))
        return (value, seal) if value ^ inverse == 0xFFFF else None
