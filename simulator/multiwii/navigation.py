# SPDX-License-Identifier: GPL-3.0-or-later
"""MultiWii 2.4's return home, and the mission mode (GPS.cpp): it fetches one step after the other from the EEPROM.

Not simulated: the fence, the settling before a landing, creeping to a waypoint that is held from afar, and resuming an
interrupted mission.
"""

import math

from protocols.msp.nav import NavAction
from simulator.board.flight import METRES_PER_DEGREE, METRES_PER_DEGREE_EAST
from simulator.board.nav_status import Error, Mode, NavStatus, State
from simulator.board.nav_waypoint import FLAG_LAST, NavWaypoint
from simulator.board.waypoint_craft import WaypointCraft
from simulator.multiwii.mission import MultiWiiMission

_CRUISE_MS = 3.0
_HOVER_HEIGHT_M = 10.0
#: NAV_CONFIG's rth_altitude: the lowest altitude of an RTH, unless the step's own is higher.
_RTH_HEIGHT_M = 20.0
_NO_JUMP = -10
#: NAV_CONFIG's safe_wp_distance and nav_max_altitude: longer legs are not started, greater heights not flown.
SAFE_DISTANCE_M, HIGHEST_M = 500, 100
#: NAV_CONFIG's wp_radius: a waypoint counts as reached at this distance.
WP_RADIUS_M = 2


class MultiWiiNavigation:
    """Flies `craft`. `step` is the last used waypoint, by the mission or by MSP: its p1 decides if any RTH lands."""

    def __init__(self, mission: MultiWiiMission, craft: WaypointCraft) -> None:
        self._mission = mission
        self._craft = craft
        self._error = Error.DISARMED
        self._next_step = 1
        self._jumps = _NO_JUMP
        self._held_s = self._rth_height_m = 0.0
        self._leg_from = craft.position
        self._poi: tuple[int, int] | None = None
        self.home = craft.position
        self.mode = Mode.NONE
        self.state = State.NONE
        self.step = NavWaypoint(action=0, flag=0)
        self.number = 0

    def end(self, error: Error) -> None:
        """Stop: disarmed, or the switch is off."""
        self.mode, self.state = Mode.NONE, State.NONE
        self._error = error
        self._poi = None

    def status(self) -> NavStatus:
        return NavStatus(self.mode, self.state, self.step.action, self.number, self._error, round(self._craft.heading))

    def fly(self, seconds: float, mode: Mode) -> None:
        """Advance the flight. `mode`: as the pilot's switches select."""
        if mode is not self.mode:
            self.end(Error.NONE)
            self.mode = mode
            if mode is Mode.RTH:
                self._rth_height_m, self.state = max(self._craft.height_m, _RTH_HEIGHT_M), State.RTH_START
            elif mode is Mode.NAV:
                self._next_step, self._jumps = 1, _NO_JUMP
                self._leg_from = self._craft.position
                self.state = State.PROCESS_NEXT
        match self.state:
            case State.NONE:
                self._craft.hover(_HOVER_HEIGHT_M, seconds)
            case State.PROCESS_NEXT:
                self._process_next()
            case State.DO_JUMP:
                self._jump()
            case State.WP_ENROUTE:
                self._fly_leg(seconds)
            case State.RTH_START:
                self._craft.hover(self._rth_height_m, seconds)
                if self._craft.height_m >= self._rth_height_m:
                    self.state = State.RTH_ENROUTE
            case State.RTH_ENROUTE:
                if self._craft.fly_to(self.home, self._rth_height_m, _CRUISE_MS, seconds):
                    self.state = State.LAND_IN_PROGRESS if self.step.p1 else State.HOLD_INFINIT
            case State.HOLD_TIMED:
                self._hold(seconds)
            case State.HOLD_INFINIT:
                self._craft.hover(self._craft.height_m, seconds)
            case State.LAND_IN_PROGRESS:
                self._craft.hover(0.0, seconds)
                if self._craft.height_m <= 0:
                    self.state = State.LANDED

    def _abort(self, error: Error) -> None:
        self._error = error
        self.state = State.HOLD_INFINIT

    def _process_next(self) -> None:
        self._error = Error.NONE
        self.number, self.step, is_sound = self._mission.recall(self._next_step)
        if not is_sound:
            self._abort(Error.WP_CRC)
            return
        match self.step.action:
            case NavAction.WAYPOINT | NavAction.POSHOLD_TIME | NavAction.POSHOLD_UNLIM | NavAction.LAND:
                self._begin_leg()
            case NavAction.RTH:
                self._poi = None
                height_m = max(self._craft.height_m, self.step.alt_cm / 100 or _RTH_HEIGHT_M)
                self._rth_height_m = min(height_m, HIGHEST_M)
                self.state = State.RTH_START
            case NavAction.JUMP if 0 < self.step.p1 < self.number:
                self._jumps = self.step.p2 if self._jumps == _NO_JUMP else self._jumps
                self.state = State.DO_JUMP
            case NavAction.JUMP:
                self._abort(Error.INVALID_JUMP)
            case NavAction.SET_HEAD:
                self._poi = None
            case NavAction.SET_POI:
                self._poi = (self.step.lat_e7, self.step.lon_e7)
            case _:
                self._abort(Error.INVALID_DATA)
        self._next_step += 1

    def _begin_leg(self) -> None:
        start, self._leg_from = self._leg_from, (self.step.lat_e7, self.step.lon_e7)
        if _distance_m(start, self._leg_from) >= SAFE_DISTANCE_M:
            self._abort(Error.TOO_FAR)
        else:
            self.state = State.WP_ENROUTE

    def _jump(self) -> None:
        if self._jumps == 0:
            self._jumps = _NO_JUMP
            if self.step.flag == FLAG_LAST:
                self._abort(Error.FINISH)
                return
        else:
            self._jumps -= self._jumps > 0
            self._next_step = self.step.p1
        self.state = State.PROCESS_NEXT

    def _fly_leg(self, seconds: float) -> None:
        target = (self.step.lat_e7, self.step.lon_e7)
        arrived = self._craft.fly_to(target, min(self.step.alt_cm / 100, HIGHEST_M), _CRUISE_MS, seconds)
        # With a point of interest set, the distance replaces the waypoint's (GPS_adjust_heading). A waypoint that was
        # passed still counts.
        if not arrived and (self._poi is None or _distance_m(self._craft.position, self._poi) > WP_RADIUS_M):
            return
        if self.step.action == NavAction.LAND:
            self.state = State.LAND_IN_PROGRESS
        elif self.step.flag == FLAG_LAST or self.step.action == NavAction.POSHOLD_UNLIM:
            self._abort(Error.FINISH)
        elif self.step.action == NavAction.POSHOLD_TIME:
            self._held_s = 0.0
            self.state = State.HOLD_TIMED
        else:
            self.state = State.PROCESS_NEXT

    def _hold(self, seconds: float) -> None:
        """The AVR counts 1000 * p1 in 16 bits."""
        self._held_s += seconds
        self._craft.hover(self._craft.height_m, seconds)
        if self._held_s >= (1000 * self.step.p1 % 0x10000) / 1000:
            self._error = Error.TIMEWAIT
            self.state = State.PROCESS_NEXT


def _distance_m(start: tuple[int, int], end: tuple[int, int]) -> float:
    north, east = (end[0] - start[0]) * METRES_PER_DEGREE, (end[1] - start[1]) * METRES_PER_DEGREE_EAST
    return math.hypot(north, east) / 1e7
