# SPDX-License-Identifier: GPL-3.0-or-later
"""A model of MultiWii 2.4.1 with navigation, as a quadrocopter on an AVR (Protocol.cpp)."""

import struct
from dataclasses import replace

from simulator.board.flight import FlightState
from simulator.board.msp_firmware import Boot, MspFirmware, PortHabits
from simulator.board.msp_port import error, reply
from simulator.board.msp_sensors import MspCommand, SensorReplies
from simulator.board.nav_status import Error, Mode, State
from simulator.board.nav_waypoint import WAYPOINT_SIZE, NavWaypoint, unpack_waypoint
from simulator.board.part_settings import PartSettings
from simulator.board.transmitter import switch_positions
from simulator.board.waypoint_craft import WaypointCraft
from simulator.multiwii.mission import SETTINGS_SIZE, MultiWiiMission
from simulator.multiwii.navigation import HIGHEST_M, SAFE_DISTANCE_M, WP_RADIUS_M, MultiWiiNavigation

_VERSION, _QUADX, _MSP_VERSION = 241, 3, 0
_CAPABILITY = 0x7000_0010  # navigation version 7, and the navigation bit
_EEPROM_BYTE_S = 0.0033
_BOX_NAMES = {
    0: "ARM", 1: "ANGLE", 2: "HORIZON", 3: "BARO", 5: "MAG", 6: "HEADFREE", 7: "HEADADJ", 10: "GPS HOME",
    11: "GPS HOLD", 13: "BEEPER", 20: "MISSION", 21: "LAND",
}  # fmt: skip
_BOXES = tuple(_BOX_NAMES)
_ARM, _RETURN, _MISSION = _BOXES.index(0), _BOXES.index(10), _BOXES.index(20)
_FLAG_CRC_ERROR, _FLAG_HOME, _FLAG_HOLD, _FLAG_IN_PROGRESS = 0xFE, 0x01, 0x02, 0xFF
_HOME, _HOLD = 0, 255
_ACKNOWLEDGED = frozenset((MspCommand.ACC_CALIBRATION, MspCommand.MAG_CALIBRATION))
#: ARM is on aux 1 high.
_SETTINGS: dict[int, bytes] = {
    MspCommand.PID: bytes((33, 30, 23)) * 10,
    MspCommand.BOX: b"\x04" + bytes(2 * len(_BOXES) - 1),
    MspCommand.RC_TUNING: bytes((90, 65, 0, 0, 0, 50, 0)),
    MspCommand.MISC: bytes(22),
}
_SENSORS = SensorReplies(_BOX_NAMES, 2800, currents_ca=(0, 0))


class MultiWiiFirmware(MspFirmware):
    """Its EEPROM is the mission: each waypoint is written as it arrives."""

    habits = PortHabits(buffer_size=64, writes_first=frozenset((MspCommand.SET_WP,)), reads_buffer=True)

    def __init__(self, boot: Boot) -> None:
        super().__init__(boot)
        self._mission = MultiWiiMission(boot.eeprom, boot.options.capacity)
        self._craft = WaypointCraft()
        self._navigation = MultiWiiNavigation(self._mission, self._craft)
        self._settings = PartSettings(_SETTINGS, boot.eeprom[-SETTINGS_SIZE:])

    @property
    def stored(self) -> list[bytes]:
        return self._mission.stored

    def follow_pilot(self, now: float) -> None:
        self._fly_until(now)
        if self._is_arm_on() == self.armed:
            return
        self.armed = not self.armed
        if self.armed:
            self._home = self._navigation.home = self._craft.position
        else:
            self._navigation.end(Error.DISARMED)
            self._craft.rest()

    def _is_arm_on(self) -> bool:
        """The switches other than ARM only select modes here, which `faults.boxes` has."""
        boxes = self._settings.read(MspCommand.BOX)
        return bool(boxes and boxes[0] & switch_positions(self._faults.armed, 0))

    def _state(self) -> FlightState:
        return self._craft.state()

    def _fly(self, seconds: float) -> None:
        returns, in_mission = (self._faults.boxes >> box & 1 for box in (_RETURN, _MISSION))
        self._navigation.fly(seconds, Mode.RTH if returns else Mode.NAV if in_mission else Mode.NONE)

    def _flags(self) -> int:
        kept = self._faults.boxes & ~(1 << _ARM | 1 << _RETURN | 1 << _MISSION)
        mode = self._navigation.mode
        return kept | self.armed << _ARM | (mode is Mode.RTH) << _RETURN | (mode is Mode.NAV) << _MISSION

    def answer(self, command: int, payload: bytes, now: float) -> bytes | None:
        """The reply frame, or none for a waypoint while a mission is flown."""
        self._fly_until(now)
        match command:
            case MspCommand.SET_WP:
                return self._set_waypoint(payload[:WAYPOINT_SIZE])
            case MspCommand.WP:
                return reply(command, self._waypoint(payload[0]))
            case MspCommand.EEPROM_WRITE:
                self._settings.save()
                return reply(command)
        if self._settings.write(command, payload) or command in _ACKNOWLEDGED:
            return reply(command)
        answer = self._read(command)
        return error(command) if answer is None else reply(command, answer)

    def _set_waypoint(self, payload: bytes) -> bytes | None:
        navigation = self._navigation
        if navigation.state is not State.NONE:
            return None
        navigation.number, navigation.step = unpack_waypoint(payload)
        if navigation.number == _HOME:
            self._home = navigation.home = (navigation.step.lat_e7, navigation.step.lon_e7)
        elif self._mission.store(navigation.number, navigation.step):
            self._counters.flash_writes += 1
            self._busy += WAYPOINT_SIZE * _EEPROM_BYTE_S
        return reply(MspCommand.SET_WP)

    def _waypoint(self, number: int) -> bytes:
        """Reply with the last used step. Only some of the fields are replaced."""
        navigation = self._navigation
        home = self._home or (0, 0)
        if number in (_HOME, _HOLD):
            lat, lon = home if number == _HOME else self._craft.position
            flag = _FLAG_HOME if number == _HOME else _FLAG_HOLD
            return self._shown(navigation.step, navigation.step.action, (lat, lon), flag).pack(number)
        if navigation.state is not State.NONE:
            return self._shown(navigation.step, 0, home, _FLAG_IN_PROGRESS).pack(number)
        navigation.number, navigation.step, is_sound = self._mission.recall(number)
        return (navigation.step if is_sound else replace(navigation.step, flag=_FLAG_CRC_ERROR)).pack(number)

    @staticmethod
    def _shown(step: NavWaypoint, action: int, position: tuple[int, int], flag: int) -> NavWaypoint:
        return replace(step, action=action, lat_e7=position[0], lon_e7=position[1], flag=flag)

    def _read(self, command: int) -> bytes | None:
        match command:
            case MspCommand.IDENT:
                return struct.pack("<BBBI", _VERSION, _QUADX, _MSP_VERSION, _CAPABILITY)
            case MspCommand.NAV_STATUS:
                return self._navigation.status().pack()
            case MspCommand.NAV_CONFIG:
                speeds = (100 * WP_RADIUS_M, SAFE_DISTANCE_M, HIGHEST_M, 400, 100)
                limits = (40, 3000, 20, 100, 600)
                return struct.pack("<BB5HBHHBHBB", 0x83, 3, *speeds, *limits, self._options.capacity, 0)
            case MspCommand.PIDNAMES:
                return b"ROLL;PITCH;YAW;ALT;Pos;PosR;NavR;LEVEL;MAG;VEL;"
        return self._settings.read(command) or _SENSORS.payload(command, self.craft_at(self._clock))
