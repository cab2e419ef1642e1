"""COMMAND_LONG and COMMAND_INT: every one is acknowledged (https://mavlink.io/en/services/command.html).

Nothing here may arm, steer or restart an aircraft; such commands are refused with a reason.
"""

from collections.abc import Callable, Mapping
from enum import IntEnum

from bridge.station import Post, Severity, Station
from protocols.mavlink.dialect import Message, messages


class CommandResult(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3


_REQUEST_MESSAGE = messages.MAV_CMD_REQUEST_MESSAGE
_SET_MESSAGE_INTERVAL = messages.MAV_CMD_SET_MESSAGE_INTERVAL
_DO_SEND_BANNER = 42428

#: Commands that only ask for a message: command number -> message number.
_ASKS_FOR = {
    messages.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: messages.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
    messages.MAV_CMD_GET_HOME_POSITION: messages.MAVLINK_MSG_ID_HOME_POSITION,
}

#: Commands that would act on the aircraft: command number -> what the pilot is told.
_REFUSED = {
    messages.MAV_CMD_COMPONENT_ARM_DISARM: "Arm and disarm with the transmitter sticks",
    messages.MAV_CMD_DO_SET_MODE: "Modes are set with the transmitter switches",
    messages.MAV_CMD_MISSION_START: "A mission is started with the transmitter",
    messages.MAV_CMD_DO_SET_MISSION_CURRENT: "The current waypoint cannot be set",
    messages.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: "The flight controller is not rebooted from here",
    messages.MAV_CMD_NAV_TAKEOFF: "Take off with the transmitter",
    messages.MAV_CMD_NAV_LAND: "Land with the transmitter",
    messages.MAV_CMD_NAV_RETURN_TO_LAUNCH: "Return with the transmitter switches",
}


class Commands:
    """Acknowledges commands. `on_demand` makes the messages that can be asked for; None: not known yet."""

    def __init__(
        self, post: Post, on_demand: Mapping[int, Callable[[], Message | None]], banner: Callable[[], str]
    ) -> None:
        self._post = post
        self._on_demand = on_demand
        self._banner = banner

    def take(self, station: Station, command: int, param1: float) -> None:
        """Do what a command asks for, and acknowledge it."""
        result = self._do(station, command, param1)
        self._post.to(
            station,
            messages.MAVLink_command_ack_message(command, result, 0, 0, station.sysid, station.compid),
        )

    def refuse_mode(self) -> None:
        """SET_MODE has no acknowledgement; the text is all there is."""
        self._post.say(Severity.ERROR, _REFUSED[messages.MAV_CMD_DO_SET_MODE])

    def send_on_demand(self, station: Station, msgid: int) -> CommandResult:
        """Send one message that was asked for."""
        make = self._on_demand.get(msgid)
        if make is None:
            return CommandResult.UNSUPPORTED
        message = make()
        if message is None:
            return CommandResult.TEMPORARILY_REJECTED
        self._post.to(station, message)
        return CommandResult.ACCEPTED

    def _do(self, station: Station, command: int, param1: float) -> CommandResult:
        if command == _REQUEST_MESSAGE:
            return self.send_on_demand(station, int(param1) if 0 <= param1 < 1 << 24 else -1)
        if command in _ASKS_FOR:
            return self.send_on_demand(station, _ASKS_FOR[command])
        if command == _DO_SEND_BANNER:
            self._post.say(Severity.INFO, self._banner())
            return CommandResult.ACCEPTED
        if command == _SET_MESSAGE_INTERVAL:
            return CommandResult.ACCEPTED
        if command in _REFUSED:
            self._post.say(Severity.ERROR, _REFUSED[command])
            return CommandResult.DENIED
        return CommandResult.UNSUPPORTED
