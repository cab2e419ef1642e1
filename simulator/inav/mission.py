# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's waypoint list in RAM and the copy in the EEPROM, including requests that it acknowledges but ignores.

After setWaypoint, getWaypoint, loadNonVolatileWaypointList and saveNonVolatileWaypointList of INAV 6.1.1 to 9.1.0
(src/main/navigation/navigation.c).
"""

from dataclasses import replace
from math import hypot

from protocols.msp.nav import NavAction
from simulator.board.flight import METRES_PER_DEGREE, METRES_PER_DEGREE_EAST
from simulator.board.msp_firmware import CrashError
from simulator.board.nav_waypoint import FLAG_HOME, FLAG_LAST, WAYPOINT_SIZE, NavWaypoint, unpack_waypoint, wrap16

CAPACITY = 120
EEPROM_SIZE = CAPACITY * WAYPOINT_SIZE
_STORED_ACTIONS = frozenset(NavAction) - {NavAction.POSHOLD_UNLIM}
_GEO_ACTIONS = frozenset((NavAction.WAYPOINT, NavAction.POSHOLD_TIME, NavAction.LAND))
#: The reply past the end of the list, and for home until it is known.
FAKE = NavWaypoint()


class InavMission:
    """`eeprom`: EEPROM_SIZE bytes. Blank bytes are zeros, an invalid action for INAV."""

    def __init__(self, eeprom: memoryview) -> None:
        self._eeprom = eeprom
        # Deleted waypoints stay in memory; only the counts change.
        self._list = [NavWaypoint(action=0, flag=0)] * CAPACITY
        #: False if no JUMP was ever written: then none is searched for.
        self.had_jumps = False
        #: nav_wp_multi_mission_index: the number of the mission to fly, from 1. The pilot's sticks change it.
        self.selected = 1
        self._forget()

    def _forget(self) -> None:
        self.count = 0
        self.is_valid = False
        self._start = self._total = 0
        self._missions = self._loaded = 0

    @property
    def stored(self) -> bytes:
        """The waypoints in the EEPROM, each of WAYPOINT_SIZE bytes, up to the record with the flag LAST."""
        for number in range(1, CAPACITY + 1):
            if self._saved(number).flag == FLAG_LAST:
                return bytes(self._eeprom[: number * WAYPOINT_SIZE])
        return b""

    def known(self, armed: bool) -> int:
        """The count in MSP_WP_GETINFO: of all missions in the list while disarmed."""
        return self._total if self._total and not armed else self.count

    def __getitem__(self, index: int) -> NavWaypoint:
        """A waypoint of the loaded mission by its index from 0, as flown: a JUMP's p1 is also an index."""
        return self._list[min(self._start + index, CAPACITY - 1)]

    @property
    def lands_after_rth(self) -> bool:
        """True if a mission's RTH ends with a landing. The last waypoint's p1 decides, regardless of the action."""
        return self[self.count - 1].p1 > 0

    def read(self, number: int, armed: bool) -> NavWaypoint:
        """Waypoint 1..255 as in MSP_WP: FAKE if there is none."""
        if not 1 <= number <= min(self.known(armed), CAPACITY):
            return FAKE
        waypoint = self._list[number - 1 + (self._start if armed else 0)]
        return replace(waypoint, p1=wrap16(waypoint.p1 + 1)) if waypoint.action == NavAction.JUMP else waypoint

    def write(self, number: int, waypoint: NavWaypoint) -> None:
        """Store a waypoint if it is valid. The flight controller acknowledges it either way."""
        if not 1 <= number <= CAPACITY or waypoint.action not in _STORED_ACTIONS:
            return
        if number not in (1, self.count + 1):
            return
        if number == 1:
            self._forget()
        if waypoint.action == NavAction.JUMP:
            self.had_jumps = True
            waypoint = replace(waypoint, p1=wrap16(waypoint.p1 - 1))
        self._list[number - 1] = waypoint
        self.count = number
        self.is_valid = waypoint.flag == FLAG_LAST

    def save(self) -> bool:
        """Copy the list into the EEPROM. Returns False if it is not complete."""
        if not self.is_valid:
            return False
        for number in range(1, CAPACITY + 1):
            start = (number - 1) * WAYPOINT_SIZE
            self._eeprom[start : start + WAYPOINT_SIZE] = self.read(number, armed=False).pack(number)
        self.selected = 1
        return True

    def load(self) -> bool:
        """Copy the EEPROM's missions to RAM. A blank EEPROM changes nothing, and is an error only if RAM is empty."""
        for number in range(1, CAPACITY + 1):
            saved = self._saved(number)
            self.write(number, saved)
            if saved.flag == FLAG_LAST:
                self._missions += 1
                after = self._saved(number + 1) if number < CAPACITY else None
                if after and (after.flag, after.action) == (FLAG_LAST, NavAction.RTH):
                    break
        self._total = self.count
        if self.selected > self._missions:
            self.selected = 1
        self._load_selected()
        if not (self.is_valid and self.count):
            self._forget()
        return self.is_valid

    def follow_selection(self) -> None:
        """Load the selected mission. An armed INAV does so outside of its waypoint mode."""
        if self._missions >= 2 and self._loaded != self.selected:
            self._load_selected()

    def _load_selected(self) -> None:
        ends = [index for index in range(CAPACITY) if self._list[index].flag == FLAG_LAST]
        self._loaded = self.selected
        self._start = ends[self.selected - 2] + 1 if self.selected > 1 else 0
        self.count = ends[self.selected - 1] + 1 - self._start if len(ends) >= self.selected else 0

    def is_flyable(self) -> bool:
        """True if INAV allows arming with these JUMPs. Checked whenever it is disarmed. CrashError."""
        if not self.had_jumps:
            return True
        for index in range(self.count):
            waypoint = self[index]
            if waypoint.action != NavAction.JUMP:
                continue
            target = waypoint.p1
            is_near = index - 2 < target < index + 2
            if index == 0 or target >= self.count or is_near or waypoint.p2 < -1:
                return False
            if target < 0:
                # INAV reads the target as unsigned and accesses a waypoint 65,000 places further.
                raise CrashError
            if self[target].action not in _GEO_ACTIONS:
                return False
        return True

    def is_near(self, position: tuple[int, int], within_m: int) -> bool:
        """True if INAV allows arming here: the first waypoint, whatever the action, is near. 0 m: anywhere."""
        first = self[0]
        is_at_home = first.flag == FLAG_HOME or not (first.lat_e7 or first.lon_e7)
        if not (self.count and within_m) or is_at_home:
            return True
        north = (first.lat_e7 - position[0]) / 1e7 * METRES_PER_DEGREE
        east = (first.lon_e7 - position[1]) / 1e7 * METRES_PER_DEGREE_EAST
        return hypot(north, east) <= within_m

    def start_jumps(self) -> None:
        """Set the counter of each JUMP, which INAV keeps in p3."""
        for index in range(self.count):
            if self[index].action == NavAction.JUMP:
                self.set_jump(index, self[index].p2)

    def end_jumps(self) -> None:
        """Clear the counters at the mission's end."""
        for index in range(self.count):
            if self[index].action == NavAction.JUMP:
                self.set_jump(index, 0)

    def set_jump(self, index: int, repeats: int) -> None:
        self._list[self._start + index] = replace(self[index], p3=repeats)

    def _saved(self, number: int) -> NavWaypoint:
        start = (number - 1) * WAYPOINT_SIZE
        return unpack_waypoint(bytes(self._eeprom[start : start + WAYPOINT_SIZE]))[1]
