# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's waypoint mode: the navigation states of a mission.

After navOnEnteringState_NAV_STATE_WAYPOINT_..., getActiveSpeed and performeFenceAction of INAV 9.1.0
(src/main/navigation). Not simulated: the pilot's sticks, safe distances, the climb before a return home, and its way
around geozones.
"""

from enum import Enum, IntEnum

from protocols.msp.inav_places import FenceAction
from protocols.msp.nav import NavAction
from simulator.board.flight import FIELD_ALTITUDE_M
from simulator.board.msp_firmware import CrashError
from simulator.board.nav_status import Error, Mode, NavStatus, State
from simulator.board.nav_waypoint import FLAG_HOME, FLAG_LAST
from simulator.board.waypoint_craft import WaypointCraft
from simulator.inav.mission import CAPACITY, InavMission
from simulator.inav.places import InavPlaces
from simulator.inav.settings import InavSettings

_CRUISE_MS = 3.0
_MIN_MISSION_CMS = 50
_HOVER_HEIGHT_M = 10.0
_MEAN_SEA_LEVEL = 1


class Platform(IntEnum):
    """INAV's platform types whose missions differ."""

    MULTIROTOR = 0
    AEROPLANE = 1
    ROVER = 4
    BOAT = 5


_ON_THE_GROUND = (Platform.ROVER, Platform.BOAT)


class Phase(Enum):
    """The flight phases, with their values in MSP_NAV_STATUS: mode, state, error."""

    IDLE = (Mode.NONE, State.NONE, Error.NONE)
    PRE_ACTION = (Mode.NAV, State.PROCESS_NEXT, Error.NONE)
    ENROUTE = (Mode.NAV, State.WP_ENROUTE, Error.NONE)
    HOLD = (Mode.NAV, State.HOLD_TIMED, Error.NONE)
    LANDING = (Mode.NAV, State.LAND_IN_PROGRESS, Error.LANDING)
    FINISHED = (Mode.NAV, State.WP_ENROUTE, Error.FINISH)
    ZONE_HOLD = (Mode.HOLD, State.HOLD_INFINIT, Error.NONE)
    RTH_ENROUTE = (Mode.RTH, State.RTH_ENROUTE, Error.NONE)
    RTH_HOVER = (Mode.RTH, State.HOVER_ABOVE_HOME, Error.NONE)
    RTH_LANDING = (Mode.RTH, State.LAND_IN_PROGRESS, Error.LANDING)
    RTH_LANDED = (Mode.RTH, State.LANDED, Error.NONE)


_RETURNING = frozenset((Phase.RTH_ENROUTE, Phase.RTH_HOVER, Phase.RTH_LANDING, Phase.RTH_LANDED))


class InavNavigation:
    """Flies `craft`. An index is a waypoint's number less 1."""

    def __init__(
        self,
        mission: InavMission,
        craft: WaypointCraft,
        settings: InavSettings,
        places: InavPlaces,
        platform: int,
        version: tuple[int, ...],
    ) -> None:
        self._mission = mission
        self._settings = settings
        self._places = places
        self._platform = platform
        #: Before, only climbs by the stick end at nav_max_altitude.
        self._limits_missions = version >= (8, 0, 0)
        self._has_zone_return = False
        self._craft = craft
        self._home = craft.position
        self._restarts = True
        self._held_s = self._rth_height_m = 0.0
        self.phase = Phase.IDLE
        self.index = 0

    @property
    def is_in_mission(self) -> bool:
        """True if the flight mode is NAV WP. During a mission's RTH it is NAV RTH."""
        return self.phase not in (Phase.IDLE, Phase.ZONE_HOLD) and not self.is_returning

    @property
    def is_returning(self) -> bool:
        return self.phase in _RETURNING

    def arm(self) -> None:
        """Take off: home is here."""
        self._home = self._craft.position

    def disarm(self) -> None:
        """Stop. The mission restarts after the next arming."""
        self.phase = Phase.IDLE
        self._restarts = True
        self.index = 0

    def status(self) -> NavStatus:
        """The content of MSP_NAV_STATUS, which always names a waypoint."""
        mode, state, error = self.phase.value
        number = self.index + 1
        return NavStatus(mode, state, self._mission[self.index].action, number, error, round(self._craft.heading))

    def jump_to(self, index: int) -> bool:
        """Fly to a waypoint of the mission in flight (MSP2_INAV_SET_WP_INDEX); False: refused. CrashError.

        A landing goes on, although NAV_STATUS then names the waypoint.
        """
        if not (self.is_in_mission and index < self._mission.count):
            return False
        self.index = index
        if self.phase is not Phase.LANDING:
            self._pre_action()
        return True

    def step(self, seconds: float, is_requested: bool, is_fenced: bool = False) -> None:
        """Advance the flight. CrashError. is_requested: the pilot's switch NAV WP is on. is_fenced: that of ANGLE."""
        if not is_requested:
            self.phase = Phase.IDLE
        elif not is_fenced and (self.phase is Phase.ZONE_HOLD or self._has_zone_return):
            self._pre_action()
        elif self.phase is Phase.IDLE and self._mission.is_valid and self._mission.count:
            self._begin()
        match self.phase:
            case Phase.IDLE:
                self._craft.hover(_HOVER_HEIGHT_M, seconds)
            case Phase.PRE_ACTION:
                self.phase = Phase.ENROUTE
            case Phase.ENROUTE:
                self._fly_leg(seconds, is_fenced)
            case Phase.HOLD:
                self._hold(seconds)
            case Phase.LANDING | Phase.RTH_LANDING:
                self._land(seconds)
            case Phase.FINISHED | Phase.RTH_HOVER | Phase.ZONE_HOLD:
                self._craft.hover(self._craft.height_m, seconds)
            case Phase.RTH_ENROUTE:
                if self._craft.fly_to(self._home, self._rth_height_m, _CRUISE_MS, seconds):
                    lands = self._has_zone_return or self._mission.lands_after_rth
                    self.phase = Phase.RTH_LANDING if lands else Phase.RTH_HOVER

    def _begin(self) -> None:
        if self._restarts or self.index == 0:
            self._mission.start_jumps()
            self.index = 0
        self._restarts = False
        self._pre_action()

    def _pre_action(self) -> None:
        """Execute waypoints without a place up to the next leg, which takes INAV 10 ms each. CrashError."""
        self._has_zone_return = False
        for _ in range(CAPACITY):
            waypoint = self._mission[self.index]
            match waypoint.action:
                case NavAction.RTH:
                    self._restarts = True
                    self._rth_height_m = self._height_home_m()
                    self.phase = Phase.RTH_ENROUTE
                    return
                case NavAction.JUMP if waypoint.p3:
                    if waypoint.p1 < 0:
                        raise CrashError
                    if waypoint.p3 > 0:
                        self._mission.set_jump(self.index, waypoint.p3 - 1)
                    self.index = min(waypoint.p1, CAPACITY - 1)
                case NavAction.JUMP | NavAction.SET_POI | NavAction.SET_HEAD:
                    if waypoint.action == NavAction.JUMP:
                        self._mission.set_jump(self.index, waypoint.p2)
                    if self._is_last():
                        self._finish()
                        return
                    self.index += 1
                case _:
                    self.phase = Phase.PRE_ACTION
                    return

    def _height_home_m(self) -> float:
        """By nav_rth_alt_mode. MAX is simulated as AT_LEAST."""
        here_m, setting_m = self._craft.height_m, int(self._settings["nav_rth_altitude"]) / 100
        return (here_m, here_m + setting_m, setting_m, *[max(here_m, setting_m)] * 2)[
            int(self._settings["nav_rth_alt_mode"])
        ]

    def _fly_leg(self, seconds: float, is_fenced: bool) -> None:
        waypoint = self._mission[self.index]
        height = waypoint.alt_cm / 100
        if waypoint.p3 & _MEAN_SEA_LEVEL:
            height -= FIELD_ALTITUDE_M
        highest_cm = int(self._settings["nav_max_altitude"])
        if self._limits_missions and highest_cm and not self._settings["nav_wp_enforce_altitude"]:
            height = min(height, highest_cm / 100)
        if self._platform in _ON_THE_GROUND:
            height = 0.0
        flies_home = waypoint.flag == FLAG_HOME or not (waypoint.lat_e7 or waypoint.lon_e7)
        target = self._home if flies_home else (waypoint.lat_e7, waypoint.lon_e7)
        wanted = waypoint.p2 if waypoint.action == NavAction.POSHOLD_TIME else waypoint.p1
        has_speed = wanted >= _MIN_MISSION_CMS and self._platform == Platform.MULTIROTOR
        speed = min(wanted, int(self._settings["nav_max_auto_speed"])) / 100 if has_speed else _CRUISE_MS
        if is_fenced and (action := self._places.action_ahead(self._craft.position, target)):
            self._has_zone_return = action == FenceAction.RTH
            self._rth_height_m = self._height_home_m()
            self.phase = Phase.RTH_ENROUTE if self._has_zone_return else Phase.ZONE_HOLD
            return
        if not self._craft.fly_to(target, height, speed, seconds):
            return
        match waypoint.action:
            case NavAction.LAND:
                self.phase = Phase.LANDING
            case NavAction.POSHOLD_TIME:
                self.phase = Phase.HOLD
                self._held_s = 0.0
            case _:
                self._next()

    def _hold(self, seconds: float) -> None:
        self._held_s += seconds
        self._craft.hover(self._craft.height_m, seconds)
        if self._held_s >= self._mission[self.index].p1:
            self._next()

    def _land(self, seconds: float) -> None:
        self._craft.hover(0.0, seconds)
        if self._craft.height_m <= 0:
            if self.is_returning:
                self.phase = Phase.RTH_LANDED
            else:
                self._finish()

    def _next(self) -> None:
        if self._is_last():
            self._finish()
        else:
            self.index += 1
            self._pre_action()

    def _is_last(self) -> bool:
        return self.index >= self._mission.count - 1 or self._mission[self.index].flag == FLAG_LAST

    def _finish(self) -> None:
        self._mission.end_jumps()
        self._restarts = True
        self.phase = Phase.FINISHED
