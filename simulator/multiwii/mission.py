# SPDX-License-Identifier: GPL-3.0-or-later
"""MultiWii's waypoints: each has its own EEPROM slot and checksum (EEPROM.cpp)."""

import struct

from simulator.board.nav_waypoint import WAYPOINT_SIZE, NavWaypoint, unpack_waypoint

SLOT_SIZE = WAYPOINT_SIZE + 1
#: At the end of the EEPROM.
SETTINGS_SIZE = 128
_ERASED = b"\xff" * SLOT_SIZE


def blank_eeprom(capacity: int) -> bytearray:
    """A factory-new EEPROM: no waypoint's checksum is valid."""
    return bytearray(_ERASED * (capacity + 1) + bytes(SETTINGS_SIZE))


class MultiWiiMission:
    """Waypoints 1 to `capacity`. There is no list: a mission reads waypoints 1, 2, 3, ... as it is flown."""

    def __init__(self, eeprom: memoryview, capacity: int) -> None:
        self._eeprom = eeprom
        self._capacity = capacity

    @property
    def stored(self) -> list[bytes]:
        """The waypoints from number 1 on with a valid checksum."""
        found = []
        for number in range(1, self._capacity + 1):
            slot = self._slot(number)
            if not _is_sound(slot):
                break
            found.append(slot[:-1])
        return found

    def recall(self, number: int) -> tuple[int, NavWaypoint, bool]:
        """A waypoint with the number in its slot, and True if the checksum is valid.

        Above the capacity are the EEPROM's other contents. Here it is erased.
        """
        slot = self._slot(number) if number <= self._capacity else _ERASED
        return *unpack_waypoint(slot[:-1]), _is_sound(slot)

    def store(self, number: int, waypoint: NavWaypoint) -> bool:
        """Write one. Returns False if the number is out of range."""
        if not 1 <= number <= self._capacity:
            return False
        packed = waypoint.pack(number)
        self._eeprom[number * SLOT_SIZE : (number + 1) * SLOT_SIZE] = packed + struct.pack("B", sum(packed) % 256)
        return True

    def _slot(self, number: int) -> bytes:
        return bytes(self._eeprom[number * SLOT_SIZE : (number + 1) * SLOT_SIZE])


def _is_sound(slot: bytes) -> bool:
    return len(slot) == SLOT_SIZE and sum(slot[:-1]) % 256 == slot[-1]
