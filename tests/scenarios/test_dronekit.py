# SPDX-License-Identifier: GPL-3.0-or-later
"""A client with the habits of DroneKit 2.9: MAVLink 1, float items, and every wait of its `wait_ready`.

It does not repeat MISSION_COUNT, ignores MISSION_ACK, and gets home only from a download. Given an empty list it
would ask for item 0 and wait forever.
"""

from collections.abc import Callable

from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.dialect import Message
from protocols.mission_item import Command
from simulator.board.flight import FIELD_LAT_E7, FIELD_LON_E7
from tests.support.world import GroundStation, World, ready_world

_TIMEOUT_S = 30.0
_GAP_REQUESTED_AFTER_S = 0.2


class DroneKit:
    """DroneKit's Vehicle and its `commands`."""

    def __init__(self, world: World) -> None:
        self.world = world
        self._station = GroundStation(world, "dronekit", version=1)
        self._station.on_message.append(self._take)
        self.parameters: dict[str, float] = {}
        self._parameter_names: list[str | None] = []
        self.received: set[str] = set()
        self.home: tuple[float, float, float] | None = None
        self.commands: list[Message] = []
        self.expected = 0
        self._is_loaded = True
        self._uploaded: list[bool] | None = None
        self._send_heartbeat()

    def connect(self) -> None:
        """`connect(wait_ready=True)`: parameters, gps_0, armed, mode, attitude."""
        self._wait(lambda: "HEARTBEAT" in self.received)
        self._station.send(m.MAVLink_request_data_stream_message(0, 0, m.MAV_DATA_STREAM_ALL, 4, 1))
        self._station.send(m.MAVLink_param_request_list_message(0, 0))
        self._request_gaps()
        self._wait(lambda: self._has_parameters and self.received >= {"GPS_RAW_INT", "ATTITUDE"})

    def download(self) -> None:
        """`commands.download()` and `commands.wait_ready()`."""
        self._is_loaded = False
        self._station.send(m.MAVLink_mission_request_list_message(1, 1))
        self._wait(lambda: self._is_loaded)

    def upload(self, commands: list[Message]) -> None:
        """`commands.clear()`, `add` and `upload()`; item 0 stays as downloaded."""
        self.commands = [self.commands[0], *commands]
        for seq, command in enumerate(self.commands):
            command.seq, command.target_system, command.target_component = seq, 1, 1
        self._uploaded = [False] * len(self.commands)
        self._station.send(m.MAVLink_mission_clear_all_message(1, 1))
        self._station.send(m.MAVLink_mission_count_message(1, 1, len(self.commands)))
        self._wait(lambda: all(self._uploaded or ()))
        self._uploaded = None

    def _send_heartbeat(self) -> None:
        self._station.send(m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3))
        self.world.after(1.0, self._send_heartbeat)

    @property
    def _has_parameters(self) -> bool:
        return bool(self._parameter_names) and None not in self._parameter_names

    def _request_gaps(self) -> None:
        for index, name in enumerate(self._parameter_names):
            if name is None:
                self._station.send(m.MAVLink_param_request_read_message(0, 0, b"", index))
        if not self._has_parameters:
            self.world.after(_GAP_REQUESTED_AFTER_S, self._request_gaps)

    def _wait(self, done: Callable[[], bool]) -> None:
        self.world.wait_until(lambda _: done(), _TIMEOUT_S)

    def _take(self, message: Message) -> None:
        self.received.add(message.get_type())
        match message.get_type():
            case "PARAM_VALUE":
                self._parameter_names = self._parameter_names or [None] * message.param_count
                self._parameter_names[message.param_index] = message.param_id
                self.parameters[message.param_id] = message.param_value
            case "MISSION_COUNT" if not self._is_loaded:
                self.commands, self.expected = [], message.count
                self._station.send(m.MAVLink_mission_request_message(1, 1, 0))
            case "MISSION_ITEM" if not self._is_loaded:
                self._take_item(message)
            case "MISSION_REQUEST" if self._uploaded is not None:
                self._station.send(self.commands[message.seq])
                self._uploaded[message.seq] = True

    def _take_item(self, item: Message) -> None:
        if item.seq == 0 and any((item.x, item.y, item.z)):
            self.home = item.x, item.y, item.z
        if item.seq != len(self.commands):
            return
        self.commands.append(item)
        if item.seq + 1 < self.expected:
            self._station.send(m.MAVLink_mission_request_message(1, 1, item.seq + 1))
        else:
            self._is_loaded = True


def command(number: int, lat: float, lon: float, height_m: float) -> Message:
    return m.MAVLink_mission_item_message(0, 0, 0, 3, number, 0, 0, 0, 0, 0, 0, lat, lon, height_m)


def test_a_mission_is_added_to_the_home_of_an_empty_board() -> None:
    world = ready_world()
    vehicle = DroneKit(world)
    vehicle.connect()
    assert vehicle.parameters["SYSID_THISMAV"] == 1
    vehicle.download()
    assert (vehicle.expected, len(vehicle.commands)) == (1, 1)
    assert vehicle.home is not None
    assert [round(degrees * 1e5) for degrees in vehicle.home[:2]] == [FIELD_LAT_E7 // 100, FIELD_LON_E7 // 100]
    lat, lon, _ = vehicle.home
    legs = [(Command.NAV_TAKEOFF, 0, 0, 10), (Command.NAV_WAYPOINT, lat + 1e-3, lon, 20), (Command.NAV_LAND, 0, 0, 0)]
    vehicle.upload([command(*leg) for leg in legs])
    world.run(3)  # it does not wait for the flash
    assert [record.command for record in world.stored] == [0, 6, 0, 5]
    home = world.stored[0]
    assert (home.lat_e7 // 100, home.lon_e7 // 100) == (FIELD_LAT_E7 // 100, FIELD_LON_E7 // 100)
    vehicle.download()
    assert [item.command for item in vehicle.commands] == [16, *(number for number, *_ in legs)]
    # Its only MISSION_COUNT arrives while the previous list is being erased.
    vehicle.upload([command(Command.NAV_WAYPOINT, lat, lon + step * 1e-4, 20) for step in range(1, 40)])
    world.run(3)
    assert len(world.stored) == 40
