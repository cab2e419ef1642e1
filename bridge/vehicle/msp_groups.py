# SPDX-License-Identifier: GPL-3.0-or-later
"""A vehicle's groups from what MSP telemetry has told: the values of docs/telemetry.md, not in MAVLink's units."""

from functools import cache

from bridge.model.vehicle_groups import Attitude, Battery, Gps, Group, Position, Rc, Status
from bridge.model.vehicle_state import Fix, VehicleState
from protocols.msp.commands import Msp
from protocols.msp.telemetry import Sensor

#: Which groups the answer to a poll brings news of, and how often it is to be asked while somebody reads one, seconds.
TOLD_BY: dict[int, tuple[Group, ...]] = {
    Msp.ATTITUDE: (Group.ATTITUDE,),
    Msp.RAW_GPS: (Group.GPS, Group.POSITION),
    Msp.STATUS: (Group.STATUS,),
    Msp.ANALOG: (Group.BATTERY,),
    Msp.RC: (Group.RC,),
}
POLLED_FOR: dict[Group, dict[Msp, float]] = {
    Group.ATTITUDE: {Msp.ATTITUDE: 0.1},
    Group.POSITION: {Msp.RAW_GPS: 0.2, Msp.ALTITUDE: 0.2, Msp.COMP_GPS: 1.0},
    Group.GPS: {Msp.RAW_GPS: 0.2},
    Group.BATTERY: {Msp.ANALOG: 1.0},
    Group.RC: {Msp.RC: 0.5},
    Group.STATUS: {Msp.STATUS: 0.25},
    Group.LINK: {},
}
_FIXES = {Fix.NO_FIX: "none", Fix.TWO_D: "2D", Fix.THREE_D: "3D"}
_MAX_RSSI = 1020


class MspGroups:
    """Looks at a vehicle's state."""

    def __init__(self, vehicle: VehicleState) -> None:
        self._vehicle = vehicle

    def attitude(self) -> Attitude:
        """MSP's pitch is nose-down positive."""
        vehicle = self._vehicle
        now = vehicle.attitude
        if now is None:
            return Attitude()
        heading = float(now.heading_deg % 360) if vehicle.has_compass else None
        return Attitude(now.roll_ddeg / 10, -now.pitch_ddeg / 10, heading)

    def position(self) -> Position:
        """A home that is only a guess (where the vehicle stands) is none."""
        vehicle = self._vehicle
        gps = vehicle.gps if vehicle.has_fix else None
        height, home = vehicle.height, vehicle.home
        vector = None if home is None else vehicle.home_vector
        north, east = vehicle.velocity or (None, None)
        return Position(
            lat_deg=None if gps is None else gps.lat_e7 / 1e7,
            lon_deg=None if gps is None else gps.lon_e7 / 1e7,
            altitude_m=None if gps is None else float(gps.altitude_m),
            height_m=None if height is None else height.height_cm / 100,
            climb_m_s=None if height is None else height.climb_cms / 100,
            north_m_s=None if north is None else round(north, 2),
            east_m_s=None if east is None else round(east, 2),
            home_lat_deg=None if home is None else home.lat_e7 / 1e7,
            home_lon_deg=None if home is None else home.lon_e7 / 1e7,
            home_distance_m=None if vector is None else float(vector.distance_m),
            home_direction_deg=None if vector is None else float(vector.direction_deg % 360),
        )

    def gps(self) -> Gps:
        """Speed and course are those of a fix."""
        vehicle = self._vehicle
        now = vehicle.gps
        if now is None:
            return Gps()
        return Gps(
            fix=_FIXES[vehicle.fix],
            satellites=now.satellites,
            hdop=None if now.hdop_e2 is None else now.hdop_e2 / 100,
            ground_speed_m_s=now.speed_cms / 100 if vehicle.has_fix else None,
            course_deg=now.course_ddeg / 10 if vehicle.has_fix and now.course_ddeg is not None else None,
        )

    def battery(self) -> Battery:
        """A voltage of 0 is not measured, nor is a current when nothing was ever drawn."""
        analog = self._vehicle.analog
        if analog is None:
            return Battery()
        voltage = analog.battery_dv / 10 or None
        if analog.current_ca is None or analog.drawn_mah is None or not (analog.current_ca or analog.drawn_mah):
            return Battery(voltage)
        return Battery(voltage, analog.current_ca / 100, analog.drawn_mah)

    def rc(self) -> Rc:
        """MSP sends roll, pitch, yaw, throttle."""
        vehicle = self._vehicle
        if vehicle.channels is None:
            return Rc()
        roll, pitch, yaw, throttle, *aux = vehicle.channels
        rssi = None
        if vehicle.analog is not None and vehicle.measures_rssi:
            rssi = round(min(vehicle.analog.rssi / _MAX_RSSI, 1.0) * 100, 1)
        return Rc((roll, pitch, throttle, yaw, *aux), rssi)

    def status(self) -> Status:
        """Boxes are told apart by the flight controller's own names for them."""
        vehicle = self._vehicle
        mode = None if vehicle.mode is None else vehicle.mode.name
        now = vehicle.status
        if now is None:
            return Status(vehicle.armed, mode)
        return Status(vehicle.armed, mode, _names(now.sensors), now.cycle_time_us, now.i2c_errors)


@cache
def _names(sensors: Sensor) -> tuple[str, ...]:
    return tuple(str(sensor.name).lower() for sensor in Sensor if sensor & sensors)
