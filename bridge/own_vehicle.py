"""The vehicle that ground stations see while the flight controller does not speak for itself. Sans-IO.

It is there from the start and keeps its ids whatever the flight controller does: no ground station loses it because
the craft was armed and speaks another protocol now.
"""

from collections.abc import Callable

from bridge import vehicle_messages
from bridge.fc_session import FcSession
from bridge.ground import Ground
from bridge.mission_desk import MissionDesk
from protocols.mavlink.dialect import Message, messages

_HEARTBEAT_INTERVAL_S = 1.0


class OwnVehicle:
    """Sends what is known of the vehicle, and answers who asks for one message of it."""

    def __init__(self, session: FcSession, desk: MissionDesk, ground: Ground, now: float) -> None:
        self._session = session
        self._desk = desk
        self._ground = ground
        self._started_at = now
        self._heartbeat_due = now
        self._announced_home: tuple[int, int] | None = None

    def newcomer(self) -> None:
        """Somebody new is there: who comes later must hear of home, too."""
        self._announced_home = None

    def tick(self, now: float) -> None:
        """Send what is due."""
        if now >= self._heartbeat_due:
            self._heartbeat_due = max(self._heartbeat_due + _HEARTBEAT_INTERVAL_S, now)
            self._every_second(now)

    def next_deadline(self) -> float:
        """Return when `tick` has something to do."""
        return self._heartbeat_due

    def on_demand(self) -> dict[int, Callable[[], Message | None]]:
        """Return who makes a message that is asked for, by its id."""
        return {
            messages.MAVLINK_MSG_ID_AUTOPILOT_VERSION: vehicle_messages.autopilot_version,
            messages.MAVLINK_MSG_ID_HOME_POSITION: lambda: vehicle_messages.home_position(self.home()),
            messages.MAVLINK_MSG_ID_MISSION_CURRENT: self._mission_current,
            messages.MAVLINK_MSG_ID_SYS_STATUS: lambda: vehicle_messages.sys_status(self._session.vehicle),
        }

    def home(self) -> tuple[int, int] | None:
        """Return where home is, degrees * 1e7."""
        return self._session.vehicle.home_or_position()

    def _every_second(self, now: float) -> None:
        vehicle = self._session.vehicle
        heartbeat = vehicle_messages.heartbeat(vehicle, linked=self._session.controller is not None)
        self._ground.broadcast(heartbeat)
        self._ground.introduce(heartbeat)
        boot_ms = int((now - self._started_at) * 1000) & 0xFFFFFFFF
        for message in (
            vehicle_messages.sys_status(vehicle),
            vehicle_messages.battery_status(vehicle),
            vehicle_messages.attitude(vehicle, boot_ms),
            vehicle_messages.gps_raw_int(vehicle, boot_ms),
            vehicle_messages.global_position_int(vehicle, boot_ms),
            self._mission_current(),
            self._changed_home(),
        ):
            if message is not None:
                self._ground.broadcast(message)

    def _mission_current(self) -> Message:
        held = self._desk.held
        return vehicle_messages.mission_current(0 if held is None else held.identity.count)

    def _changed_home(self) -> Message | None:
        """HOME_POSITION whenever it is another one; who asks gets it at any time."""
        home = self.home()
        if home == self._announced_home:
            return None
        self._announced_home = home
        return vehicle_messages.home_position(home)
