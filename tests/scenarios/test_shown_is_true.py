# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole flight in each protocol: every value on a ground station's screen is correct and current."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.dialect import Message
from protocols.mission_item import MissionItem, MissionResult
from simulator.board.flight import Craft
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.commands.fc_kinds import make_board
from simulator.inav.boxes import ANGLE as INAV_ANGLE
from simulator.inav.boxes import BOXES as INAV_BOXES
from simulator.inav.boxes import NAV_POSHOLD, NAV_WP
from tests.bridge.vehicle.test_vehicle_messages import battery_mv
from tests.support.conversations import Upload
from tests.support.world import GroundStation, World

STEP_S, STALE_S = 0.1, 1.5
FIELD = 453838000, 84733000
METRES_PER_UNIT = 0.01113
ANGLE, BARO, GPS_HOLD = 1 << 0, 1 << 2, 1 << 7
COPTER_STABILIZE, COPTER_ALT_HOLD, COPTER_AUTO, COPTER_LOITER = 0, 2, 3, 5
#: Boards that fly missions: the boxes of level flight, mission and position hold.
BOXES = {
    "inav": [1 << INAV_BOXES["9.1.0"].index(box) for box in (INAV_ANGLE, NAV_WP, NAV_POSHOLD)],
    "multiwii": [1 << 1, 1 << 10, 1 << 8],
}
#: Home and a 300 m path around the field.
MISSION = [
    MissionItem(seq, 16, 3 if seq else 0, 0, 0, 0, 0, FIELD[0] + north, FIELD[1] + east, height_m)
    for seq, (north, east, height_m) in enumerate(
        [(0, 0, 0.0), (8900, 0, 20.0), (9000, 9000, 12.0), (1000, 9000, 25.0), (1000, 1000, 20.0)]
    )
]


def of_home(craft: Craft) -> float:
    """Distance from the place of arming, m."""
    north = (craft.flight.lat_e7 - FIELD[0]) * METRES_PER_UNIT
    east = (craft.flight.lon_e7 - FIELD[1]) * METRES_PER_UNIT * math.cos(math.radians(45.38))
    return math.hypot(north, east)


def velocity_cm_s(craft: Craft, direction_deg: float) -> float:
    """The component of its ground speed in a direction."""
    return craft.flight.speed_ms * 100 * math.cos(math.radians(craft.flight.course - direction_deg))


def known_volts(message: Message) -> float | None:
    return None if message.voltage_battery == 65535 else message.voltage_battery


@dataclass(frozen=True)
class Shown:
    """One value on the screen: its message, its true value, and the resolution it is sent with."""

    kind: str
    value: Callable[[Message], float | None]
    truth: Callable[[Craft], float]
    resolution: float
    circle: bool = False


#: Read as in Mission Planner: position, height and course from GLOBAL_POSITION_INT, volts from BATTERY_STATUS.
SCREEN = {
    "roll": Shown("ATTITUDE", lambda msg: math.degrees(msg.roll), lambda c: c.flight.roll, 0.1),
    "pitch": Shown("ATTITUDE", lambda msg: math.degrees(msg.pitch), lambda c: -c.flight.pitch, 0.1),
    "yaw": Shown("ATTITUDE", lambda msg: math.degrees(msg.yaw), lambda c: c.flight.heading, 0.6, circle=True),
    "lat": Shown("GLOBAL_POSITION_INT", lambda msg: msg.lat, lambda c: c.flight.lat_e7, 1),
    "lon": Shown("GLOBAL_POSITION_INT", lambda msg: msg.lon, lambda c: c.flight.lon_e7, 1),
    "height": Shown("GLOBAL_POSITION_INT", lambda msg: msg.relative_alt, lambda c: c.flight.height_m * 1e3, 11),
    "altitude": Shown("GLOBAL_POSITION_INT", lambda msg: msg.alt, lambda c: c.flight.altitude_m * 1e3, 501),
    "climb": Shown("GLOBAL_POSITION_INT", lambda msg: -msg.vz, lambda c: c.flight.climb_ms * 100, 1.1),
    "heading": Shown("GLOBAL_POSITION_INT", lambda msg: msg.hdg / 100, lambda c: c.flight.heading, 0.6, circle=True),
    "raw lat": Shown("GPS_RAW_INT", lambda msg: msg.lat, lambda c: c.flight.lat_e7, 1),
    "raw lon": Shown("GPS_RAW_INT", lambda msg: msg.lon, lambda c: c.flight.lon_e7, 1),
    "raw altitude": Shown("GPS_RAW_INT", lambda msg: msg.alt, lambda c: c.flight.altitude_m * 1e3, 501),
    "satellites": Shown("GPS_RAW_INT", lambda msg: msg.satellites_visible, lambda c: c.flight.satellites, 0),
    "speed": Shown("GPS_RAW_INT", lambda msg: msg.vel, lambda c: c.flight.speed_ms * 100, 1),
    "ground speed": Shown("VFR_HUD", lambda msg: msg.groundspeed, lambda c: c.flight.speed_ms, 0.01),
    "HUD altitude": Shown("VFR_HUD", lambda msg: msg.alt, lambda c: c.flight.altitude_m, 0.501),
    "volts": Shown("BATTERY_STATUS", battery_mv, lambda c: c.flight.volts * 1e3, 51),
    "volts too": Shown("SYS_STATUS", known_volts, lambda c: c.flight.volts * 1e3, 51),
    "speed north": Shown("GLOBAL_POSITION_INT", lambda msg: msg.vx, lambda c: velocity_cm_s(c, 0), 30),
    "speed east": Shown("GLOBAL_POSITION_INT", lambda msg: msg.vy, lambda c: velocity_cm_s(c, 90), 30),
    "throttle": Shown("RC_CHANNELS", lambda msg: msg.chan3_raw, lambda c: 1450 if c.armed else 1000, 0),
    "arm switch": Shown("RC_CHANNELS", lambda msg: msg.chan5_raw, lambda c: 2000 if c.armed else 1000, 0),
}

SCREEN_BY_KIND = {
    kind: [each for each in SCREEN.items() if each[1].kind == kind] for kind in {w.kind for w in SCREEN.values()}
}


@dataclass
class Screen:
    """Compares the shown values with the craft every 100 ms."""

    world: World
    station: GroundStation
    past: list[tuple[float, Craft]] = field(default_factory=list)
    shown: dict[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.look()
        self.station.on_message.append(self.take)

    def take(self, message: Message) -> None:
        """Show a message; each of its values was true a moment ago."""
        for name, what in SCREEN_BY_KIND.get(message.get_type(), ()):
            value = what.value(message)
            if value is None or math.isnan(value):  # unknown
                continue
            self.shown[name] = self.world.now, value
            if not self.is_true(name, value):
                self.look()  # the craft may have just changed
                assert self.is_true(name, value), (self.world.now, name, value, what.truth(self.past[-1][1]))

    def look(self) -> None:
        craft = self.world.naze.truth(self.world.now)
        if craft is not None:
            self.past.append((self.world.now, craft))

    def is_true(self, name: str, value: float) -> bool:
        """True if the craft had this value at some time within the last 1.5 s."""
        what = SCREEN[name]
        truths = [what.truth(craft) for craft in self.recent()]
        if what.circle:
            return min(abs((value - truth + 180) % 360 - 180) for truth in truths) <= what.resolution + 1
        return min(truths) - what.resolution <= value <= max(truths) + what.resolution

    def recent(self) -> Iterator[Craft]:
        for at, craft in reversed(self.past):
            if at < self.world.now - STALE_S - 0.05:
                return
            yield craft

    def fly(self, seconds: float, *, linked: bool = True) -> None:
        """Let time pass; while the link is up, nothing on the screen is older than 1.5 s."""
        for _ in range(round(seconds / STEP_S)):
            self.world.run(STEP_S)
            self.look()
            for name, (at, _) in self.shown.items():
                assert not linked or self.world.now - at <= STALE_S, (self.world.now, name, at)

    @property
    def heartbeat(self) -> Message:
        return self.station.messages("HEARTBEAT")[-1]


def send_heartbeats(station: GroundStation) -> None:
    station.send(m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3))
    station.world.after(1.0, lambda: send_heartbeats(station))


def on_the_ground(board: str | TelemetryProtocol) -> Screen:
    """A ground station connected to a craft that is ready to arm."""
    if isinstance(board, TelemetryProtocol):
        world = World(SimOptions(tele_prot=board))
    else:
        world = World(peer=make_board(board, faults=(faults := Faults(boxes=0))), faults=faults)
    world.wait_ready(30)
    station = GroundStation(world)
    send_heartbeats(station)
    world.run(6)  # long enough for the switches' ranges to be read
    if board in BOXES:
        assert Upload(station, MISSION).run() is MissionResult.ACCEPTED
    return Screen(world, station)


def is_found(world: World) -> bool:
    return world.inside.session.state.controller is not None


def arm(screen: Screen) -> None:
    screen.world.faults.armed = True
    while not (screen.world.bridge.vehicle.armed and is_found(screen.world)):
        screen.fly(STEP_S, linked=False)


ALL = [*TelemetryProtocol, *BOXES]


def modes_of(board: str | TelemetryProtocol) -> tuple[tuple[int, int], ...]:
    """The boxes of three parts of a flight, each with the resulting mode."""
    if isinstance(board, TelemetryProtocol):
        return (ANGLE, COPTER_STABILIZE), (ANGLE | BARO, COPTER_ALT_HOLD), (ANGLE | BARO | GPS_HOLD, COPTER_LOITER)
    level, mission, hold = BOXES[board]
    return (level, COPTER_STABILIZE), (mission, COPTER_AUTO), (hold, COPTER_LOITER)


@pytest.mark.parametrize("board", ALL)
def test_every_shown_value_is_true_in_flight(board: str | TelemetryProtocol) -> None:
    screen = on_the_ground(board)
    screen.fly(3)
    assert set(screen.shown) == set(SCREEN)
    arm(screen)
    screen.fly(2.5, linked=False)
    screen.shown.clear()
    for boxes, mode in modes_of(board):
        screen.world.faults.boxes = boxes
        screen.fly(15)
        assert screen.heartbeat.custom_mode == mode
        assert screen.heartbeat.base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED
        home = screen.station.messages("HOME_POSITION")[-1]
        assert (home.latitude, home.longitude) == FIELD
        place = screen.world.bridge.report(screen.world.now).position
        assert (place.home_lat_deg, place.home_lon_deg) == (home.latitude / 1e7, home.longitude / 1e7)
        shown = [screen.shown[name][1] / 1e7 for name in ("lat", "lon")]
        assert (place.lat_deg, place.lon_deg) == pytest.approx(shown)
    assert max(of_home(craft) for _, craft in screen.past) > 20
    assert set(screen.shown) == set(SCREEN)


@pytest.mark.parametrize("board", ALL)
def test_values_from_before_a_lost_link_are_not_shown_as_current(board: str | TelemetryProtocol) -> None:
    screen = on_the_ground(board)
    boxes, mode = modes_of(board)[2]
    screen.world.faults.boxes = boxes
    screen.fly(2)
    arm(screen)
    screen.fly(10, linked=False)
    screen.world.faults.hang = True
    screen.fly(20, linked=False)
    assert screen.heartbeat.system_status == m.MAV_STATE_CRITICAL
    assert screen.heartbeat.base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED
    assert screen.heartbeat.custom_mode == mode
    status = screen.station.messages("SYS_STATUS")[-1]
    assert status.onboard_control_sensors_present & m.MAV_SYS_STATUS_SENSOR_GPS
    assert not status.onboard_control_sensors_health & m.MAV_SYS_STATUS_SENSOR_GPS
    assert status.voltage_battery == 65535
    lost = [text for text in screen.station.texts() if "lost" in text]
    assert lost == ["Flight controller lost: silent for 3 s", "Flight controller lost: silent for 12 s"]
    screen.world.faults.hang = False
    screen.fly(8, linked=False)
    assert is_found(screen.world)
    assert screen.heartbeat.system_status == m.MAV_STATE_ACTIVE
    assert any(text.startswith("Flight controller back after 2") for text in screen.station.texts())
    screen.shown.clear()
    screen.fly(5)
    assert set(screen.shown) == set(SCREEN)
    home = screen.station.messages("HOME_POSITION")[-1]
    assert (home.latitude, home.longitude) == FIELD
