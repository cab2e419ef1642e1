# SPDX-License-Identifier: GPL-3.0-or-later
"""A model of INAV as a copter with GPS and compass, versions 6.1.1 to 9.1.0 (src/main/fc/fc_msp.c).

Its frame sizes and special cases were compared with INAV's own simulator of each version.
"""

import struct
from enum import IntEnum

from simulator.board.flight import FIELD_ALTITUDE_M, FlightState
from simulator.board.msp_firmware import Boot, MspFirmware, PortHabits
from simulator.board.msp_port import error, reply
from simulator.board.msp_sensors import DRAWN_MAH, RSSI, MspCommand, SensorReplies
from simulator.board.nav_waypoint import FLAG_LAST, WAYPOINT_SIZE, NavWaypoint, unpack_waypoint
from simulator.board.waypoint_craft import WaypointCraft
from simulator.inav.boxes import ANGLE, ARM, BOXES, NAMES, NAV_ALTHOLD, NAV_RTH, NAV_WP, PLANE_BOXES
from simulator.inav.mission import CAPACITY, EEPROM_SIZE, FAKE, InavMission
from simulator.inav.navigation import InavNavigation
from simulator.inav.places import PLACES_SIZE, InavPlaces, PartialReplyError
from simulator.inav.settings import InavSettings

_PLANE = 1
_SENSORS = 0b1000_1111  # accelerometer, barometer, compass, GPS, thermometer. Bit 15 would be a failure
_PITOT = 1 << 6
_CYCLE_TIME_US = 500
_ARMED_FLAGS = 0b1100  # armed, and armed once
_IN_GEOZONE, _NAVIGATION_UNSAFE = 1 << 6, 1 << 11
_LOAD_PERCENT = 7
_WIND_CMS = 250  # from ahead
_CELLS, _BATTERY_PERCENT = 3, 88
_API_VERSION = bytes((0, 2, 5))
_HDOP_E2 = 130
_LONGEST_NAME = 16
_SELECTED = "nav_wp_multi_mission_index"
_FIELD_ALTITUDE_CM = round(FIELD_ALTITUDE_M * 100)
#: The sticks that load the saved missions have to be held for 20 ticks, each of the first receiver frame after 20 ms:
#: 0.4 s to 0.8 s (rc_controls.c). This is SBUS, at 14 ms.
_LOAD_AFTER_S, _STICKS_HELD_S = 0.56, 0.8
_STICK_END_US = 2000


class InavCommand(IntEnum):
    """The simulated commands that are INAV's own."""

    API_VERSION = 1
    FC_VARIANT = 2
    FC_VERSION = 3
    BOARD_INFO = 4
    BUILD_INFO = 5
    NAME = 10
    SET_NAME = 11
    WP_MISSION_LOAD = 18
    WP_MISSION_SAVE = 19
    WP_GETINFO = 20
    SONAR = 58
    STATUS_EX = 150
    SENSOR_STATUS = 151
    GPSSTATISTICS = 166
    RTC = 246
    SETTING = 0x1003
    SET_SETTING = 0x1004
    SETTING_INFO = 0x1007
    INAV_STATUS = 0x2000
    INAV_ANALOG = 0x2002
    INAV_AIR_SPEED = 0x2009
    INAV_MIXER = 0x2010
    INAV_DEBUG = 0x2019
    INAV_TEMPERATURES = 0x201E
    SET_WP_INDEX = 0x2221


#: Asked by INAV Configurator and mwp. Every sensor is healthy, and no rangefinder is on board.
_CONSTANT_REPLIES: dict[int, bytes] = {
    InavCommand.API_VERSION: _API_VERSION,
    InavCommand.FC_VARIANT: b"INAV",
    InavCommand.BOARD_INFO: b"SIMU\x00\x00\x02\x00\x04SIMU",
    InavCommand.BUILD_INFO: b"Jan  1 202600:00:00abcdef01",
    InavCommand.SONAR: b"\xff\xff\xff\xff",
    InavCommand.SENSOR_STATUS: bytes((1, 1, 1, 1, 1, 1, 0, 0, 0)),
    InavCommand.GPSSTATISTICS: bytes(20),
    InavCommand.INAV_DEBUG: bytes(32),
    InavCommand.INAV_TEMPERATURES: bytes(16),
}


class InavFirmware(MspFirmware):
    """Boots with the saved missions in the EEPROM."""

    def __init__(self, boot: Boot) -> None:
        super().__init__(boot)
        self._version = tuple(int(part) for part in boot.options.version.split("."))
        self._boxes = PLANE_BOXES if boot.options.platform == _PLANE else BOXES[boot.options.version]
        channels = 34 if self._version >= (8, 0, 0) else 18
        self._sensors = SensorReplies(
            {box: NAMES[box] for box in self._boxes},
            _CYCLE_TIME_US,
            _SENSORS | (_PITOT if boot.options.pitot else 0),
            channels=channels if boot.options.receiver else 0,
            heading_from=0,
            fix_3d=2,
            currents_ca=(30, 1250),
        )
        self.habits = PortHabits(
            buffer_size=192,
            cli_guard_s=0.1,
            obeys_r=self._version <= (8, 0, 1),
            writes_first=frozenset((MspCommand.EEPROM_WRITE,)),
            speaks_v2=True,
        )
        self._mission = InavMission(boot.eeprom)
        self._craft = WaypointCraft()
        settings, places = boot.eeprom[EEPROM_SIZE:-PLACES_SIZE], boot.eeprom[-PLACES_SIZE:]
        self._settings = InavSettings(settings, self._version)
        self._places = InavPlaces(places, self._version)
        self._navigation = InavNavigation(
            self._mission, self._craft, self._settings, self._places, boot.options.platform, self._version
        )
        self._booted_at = boot.now
        self._received = bytearray(self.habits.buffer_size)
        self._stick_loads = boot.faults.stick_loads
        self._load_at: float | None = None
        self._sticks_released_at = boot.now

    @property
    def stored(self) -> list[bytes]:
        stored = self._mission.stored
        return [stored[at : at + WAYPOINT_SIZE] for at in range(0, len(stored), WAYPOINT_SIZE)]

    # -- the craft -------------------------------------------------------------------------------------------

    def follow_pilot(self, now: float) -> None:
        """Fly until `now`, arm and disarm. CrashError: the check before arming found a JUMP with an invalid target."""
        self._fly_until(now)
        self._follow_sticks(now)
        # Without this request only a JUMP has an effect: it may crash INAV.
        looks = not self.armed and (self._faults.armed or self._mission.had_jumps)
        if looks and not self._arming_blockers() and self._faults.armed:
            self.armed = True
            self._mission.follow_selection()
            self._home = self._craft.position
            self._navigation.arm()
        elif self.armed and not self._faults.armed:
            self.armed = False
            self._navigation.disarm()
            self._craft.rest()

    def _arming_blockers(self) -> int:
        """The arming flags that prevent it. CrashError: a JUMP has an invalid target."""
        flags = self._faults.arming_blockers
        is_near = self._mission.is_near(self._craft.position, int(self._settings["nav_wp_max_safe_distance"]))
        if not (self.armed or (is_near and self._mission.is_flyable())):
            flags |= _NAVIGATION_UNSAFE
        return flags | (_IN_GEOZONE if not self.armed and self._places.blocks_arming(self._craft.position) else 0)

    def _follow_sticks(self, now: float) -> None:
        if self._faults.selected_mission:
            self._mission.selected = self._faults.selected_mission
        if self._faults.stick_loads > self._stick_loads:
            self._stick_loads = self._faults.stick_loads
            self._load_at, self._sticks_released_at = now + _LOAD_AFTER_S, now + _STICKS_HELD_S
        if self._load_at is not None and now >= self._load_at:
            self._load_at = None
            if not self.armed:
                self._mission.load()

    def _state(self) -> FlightState:
        return self._craft.state()

    def _fly(self, seconds: float) -> None:
        if not self._navigation.is_in_mission:
            self._mission.follow_selection()
        self._navigation.step(seconds, self._is_on(NAV_WP), self._is_on(ANGLE))

    def _is_on(self, box: int) -> bool:
        return bool(self._faults.boxes >> self._boxes.index(box) & 1)

    def _flags(self) -> int:
        """The modes: navigation modes follow the flight, not the switch."""
        in_mission, returning = self._navigation.is_in_mission, self._navigation.is_returning
        flown = {ARM: self.armed, NAV_WP: in_mission, NAV_RTH: returning}
        if in_mission or returning:
            flown |= {ANGLE: True, NAV_ALTHOLD: True}
        flags = self._faults.boxes
        for box, is_on in flown.items():
            bit = 1 << self._boxes.index(box)
            flags = flags | bit if is_on else flags & ~bit
        return flags

    # -- MSP -------------------------------------------------------------------------------------------------

    def answer(self, command: int, payload: bytes, now: float) -> bytes | None:
        """The reply frame: an error frame for refused or unknown commands."""
        self._fly_until(now)
        self._received[: len(payload)] = payload
        match command:
            case MspCommand.SET_WP:
                return self._set_waypoint(payload)
            case MspCommand.WP:
                return reply(command, self._waypoint(payload))
            case InavCommand.SET_NAME:
                # Any length up to the longest, even an empty one.
                if len(payload) > _LONGEST_NAME:
                    return error(command)
                self._settings["name"] = payload.decode("ascii", "replace")
                return reply(command)
            case InavCommand.SETTING | InavCommand.SET_SETTING | InavCommand.SETTING_INFO:
                self._settings[_SELECTED] = self._mission.selected
                found = self._settings.answer(command, payload)
                self._mission.selected = int(self._settings[_SELECTED])
                return error(command) if found is None else reply(command, found)
            case InavCommand.SET_WP_INDEX if self._version >= (9, 1, 0):
                done = self.armed and len(payload) == 1 and self._navigation.jump_to(payload[0])
                return reply(command) if done else error(command)
            case InavCommand.WP_GETINFO:
                known = self._mission.known(self.armed)
                return reply(command, bytes((0, CAPACITY, self._mission.is_valid, known)))
            case InavCommand.WP_MISSION_SAVE:
                return self._when_disarmed(command, len(payload) == 1 and not self.armed and self._save())
            case InavCommand.WP_MISSION_LOAD:
                return self._when_disarmed(command, len(payload) == 1 and not self.armed and self._mission.load())
            case MspCommand.ACC_CALIBRATION | MspCommand.MAG_CALIBRATION:
                return self._when_disarmed(command, True)
            case MspCommand.EEPROM_WRITE:
                if not self.armed:
                    self._save_settings()
                    self._busy += self._options.eeprom_write_ms / 1000
                return self._when_disarmed(command, True)
        if not self.armed and self._settings.write(command, payload):
            return reply(command)
        answer = self._read(command)
        if answer is None:
            try:
                answer = self._places.answer(command, payload, bytes(self._received[len(payload) :]))
            except PartialReplyError as partial:
                return error(command, partial.payload)
        return error(command) if answer is None else reply(command, answer)

    def _when_disarmed(self, command: int, done: bool) -> bytes:
        return reply(command) if done and not self.armed else error(command)

    def _save(self) -> bool:
        saved = self._mission.save()
        if saved:
            self._save_settings()
            self._counters.flash_writes += 1
            self._busy += self._options.eeprom_write_ms / 1000
        return saved

    def _save_settings(self) -> None:
        """All of the configuration is written at once."""
        self._settings.save()
        self._places.save()

    def _set_waypoint(self, payload: bytes) -> bytes:
        """Acknowledge any waypoint of the right size, even if it is not stored."""
        if len(payload) != WAYPOINT_SIZE:
            return error(MspCommand.SET_WP)
        closed = self._navigation.is_in_mission if self._version >= (8, 0, 0) else self.armed
        number, waypoint = unpack_waypoint(payload)
        self._places.waypoint_set(number, is_last=waypoint.flag == FLAG_LAST)
        if not closed:
            self._mission.write(number, waypoint)
        return reply(MspCommand.SET_WP)

    def _waypoint(self, payload: bytes) -> bytes:
        number = payload[0] if payload else 0
        flight = self._craft.state()
        match number:
            case 0:
                # With a fix, which this craft always has, home is the position until it arms.
                waypoint = NavWaypoint(FAKE.action, *(self._home or self._craft.position), _FIELD_ALTITUDE_CM)
            case 255:
                waypoint = NavWaypoint(FAKE.action, flight.lat_e7, flight.lon_e7, round(flight.altitude_m * 100))
            case _:
                waypoint = self._mission.read(number, self.armed)
        return waypoint.pack(number)

    def _read(self, command: int) -> bytes | None:
        craft = self.craft_at(self._clock)
        flight = craft.flight
        match command:
            case InavCommand.NAME:
                return str(self._settings["name"]).partition("\0")[0].encode("ascii", "replace")
            case InavCommand.FC_VERSION:
                return bytes(self._version)
            case MspCommand.BOX:
                return craft.boxes.to_bytes(8, "little")
            case InavCommand.STATUS_EX:
                return (self._sensors.payload(MspCommand.STATUS, craft) or b"") + bytes(5)
            case InavCommand.INAV_STATUS:
                flags = self._arming_blockers() | (_ARMED_FLAGS if self.armed else 0)
                status = struct.pack("<HHHHBI", _CYCLE_TIME_US, 0, self._sensors.sensors, _LOAD_PERCENT, 0, flags)
                mixer_profile = b"\0" if self._version >= (7, 0, 0) else b""
                return status + craft.boxes.to_bytes(8, "little") + mixer_profile
            case InavCommand.INAV_ANALOG:
                current = self._sensors.currents_ca[self.armed]
                volts_e2 = round(flight.volts * 100)
                drawn = (volts_e2 * current // 100, DRAWN_MAH, 1300)
                return struct.pack("<BHHIIIIBH", _CELLS << 4, volts_e2, current, *drawn, 0, _BATTERY_PERCENT, RSSI)
            case InavCommand.INAV_AIR_SPEED:
                return struct.pack("<I", round(flight.speed_ms * 100) + _WIND_CMS if self._options.pitot else 0)
            case InavCommand.INAV_MIXER:
                stops_on_low, servos = (1, 18) if self._version >= (8, 0, 0) else (0, 16)
                return struct.pack("<BBBBBhBB", 0, 0, stops_on_low, self._options.platform, 0, -1, 12, servos)
            case InavCommand.RTC:
                unix_s = self._options.unix_s and self._options.unix_s + self._clock - self._booted_at
                return struct.pack("<IH", int(unix_s), int(unix_s % 1 * 1000))
            case MspCommand.NAV_STATUS:
                return self._navigation.status().pack()
        usual = self._settings.read(command) or _CONSTANT_REPLIES.get(command) or self._sensors.payload(command, craft)
        if command == MspCommand.RC and usual and self._clock < self._sticks_released_at:
            # Roll and pitch. The throttle is low.
            return struct.pack("<2H", _STICK_END_US, _STICK_END_US) + usual[4:]
        if command == MspCommand.RAW_GPS and usual is not None:
            return usual + struct.pack("<H", _HDOP_E2)
        if command == MspCommand.ALTITUDE and usual is not None:
            return usual + struct.pack("<i", round(flight.height_m * 100))
        return usual
