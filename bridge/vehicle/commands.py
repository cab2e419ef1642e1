# SPDX-License-Identifier: GPL-3.0-or-later
"""COMMAND_LONG and COMMAND_INT: all are acknowledged (https://mavlink.io/en/services/command.html).

No command may arm, steer or restart an aircraft. Those that would are refused with a reason. The exception is
DO_SET_MISSION_CURRENT on an INAV that flies the mission.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from bridge.fc.fc_settings import Cause, SettingRefusal
from bridge.fc.profile import Spoken
from bridge.fc.session import FcSession
from bridge.gcs.budget import Cost
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import Sender
from bridge.missions.fc_mission_store import FliesToItems
from bridge.missions.mission_service import HeldMission, MissionService
from bridge.model.craft import MISSION_BOXES
from bridge.model.missions import Refusal
from bridge.model.vehicle import MissionLeg, Switches
from bridge.settings.board_settings import BoardSettings
from bridge.settings.parameters import Parameters
from bridge.settings.setting_work import Answer
from bridge.vehicle.calibration import CALIBRATE_ACCELEROMETER, CALIBRATE_COMPASS, Calibration, FcAction
from bridge.vehicle.own_vehicle import OwnVehicle
from bridge.vehicle.readiness import ReadyState
from bridge.vehicle.vehicle_messages import auto_mode
from bridge.voice import sentences
from bridge.voice.happening import Happening, Sentence
from protocols.mavlink.dialect import CommandResult, command_name, messages
from protocols.mission_item import MissionResult
from protocols.rights import Effect

_MAX_MSGID = (1 << 24) - 1

#: Commands that would act on the aircraft.
_REFUSED: Mapping[int, Sentence[()]] = {
    messages.MAV_CMD_COMPONENT_ARM_DISARM: sentences.ARM,
    messages.MAV_CMD_DO_SET_MODE: sentences.MODE,
    messages.MAV_CMD_MISSION_START: sentences.MISSION_START,
    messages.MAV_CMD_DO_SET_MISSION_CURRENT: sentences.NOT_SET_TO_ITEM,
    messages.MAV_CMD_DO_PAUSE_CONTINUE: sentences.FLY,
    messages.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: sentences.REBOOT,
    messages.MAV_CMD_NAV_TAKEOFF: sentences.FLY,
    messages.MAV_CMD_NAV_LAND: sentences.FLY,
    messages.MAV_CMD_NAV_RETURN_TO_LAUNCH: sentences.FLY,
    messages.MAV_CMD_DO_CHANGE_SPEED: sentences.FLY,
    messages.MAV_CMD_DO_SET_HOME: sentences.HOME,
    messages.MAV_CMD_NAV_WAYPOINT: sentences.FLY,
    messages.MAV_CMD_NAV_LOITER_UNLIM: sentences.FLY,
    messages.MAV_CMD_DO_REPOSITION: sentences.FLY,
    messages.MAV_CMD_DO_DIGICAM_CONTROL: sentences.NO_CAMERA,
    messages.MAV_CMD_DO_FLIGHTTERMINATION: sentences.OUTPUTS,
    messages.MAV_CMD_DO_SET_SERVO: sentences.OUTPUTS,
    messages.MAV_CMD_DO_FENCE_ENABLE: sentences.NO_FENCE,
}
#: A ground station itself asks for these, and pilots do not wait for the answer.
_ASKED_BY_PROGRAMS = ("REQUEST_", "GET_", "SET_MESSAGE_INTERVAL")
#: Those that would start or move a mission flight.
_OF_A_MISSION = frozenset((messages.MAV_CMD_MISSION_START, messages.MAV_CMD_DO_SET_MISSION_CURRENT))
_NO_RESET = Refusal(MissionResult.DENIED, sentences.NO_MISSION_RESET())
_NOT_SET = {MissionResult.ERROR: CommandResult.FAILED}
#: param1 of MAV_CMD_PREFLIGHT_STORAGE.
_SAVE = 1
_NOT_STORED = {
    Cause.NO_ANSWER: CommandResult.FAILED,
    Cause.OCCUPIED: CommandResult.TEMPORARILY_REJECTED,
    Cause.LIMIT: CommandResult.TEMPORARILY_REJECTED,
}
_NOT_FLOWN = Refusal(MissionResult.DENIED, sentences.SET_IN_FLIGHT())
_UNKNOWN = Refusal(MissionResult.DENIED, sentences.SET_ON_CHANGED_LIST())
_BUSY = Refusal(MissionResult.DENIED, sentences.SET_TOO_SOON())


class SetWaypoint:
    """Set WP: the item that an armed craft flies to, on boards that have a request for that (INAV), one at a time.

    No other message of a ground station changes a flight. It takes the right to move a passed-through autopilot,
    which a station on an open link does not have.
    """

    def __init__(self, missions: MissionService, vehicle: OwnVehicle, ground: Ground) -> None:
        self._missions = missions
        self._vehicle = vehicle
        self._ground = ground
        #: The station and the item of the request in progress.
        self._present: tuple[Sender, float] | None = None

    @property
    def is_possible(self) -> bool:
        """True if the flight controller has a request for it."""
        return isinstance(self._missions.fc_store, FliesToItems)

    def begin(self, sender: Sender, seq: float, on_end: Callable[[Refusal | None], None], now: float) -> None:
        """Make the craft fly to item `seq`, in the station's numbers. `on_end` gets None once it does.

        A repetition of the request in progress is ignored.
        """
        if self._present == (sender, seq):
            return
        store, held = self._missions.fc_store, self._missions.on_board
        assert isinstance(store, FliesToItems)
        if (refusal := self._obstacle(sender)) is not None or held is None:
            on_end(refusal or _UNKNOWN)
            return
        item = self._as_read(held, sender, seq)
        if not (number := store.leg_of(held.records, item)):
            on_end(Refusal(MissionResult.DENIED, _why_not(held, item, seq)))
            return

        def ended(refused: Refusal | None, _at: float) -> None:
            self._present = None
            if refused is not None:
                self._vehicle.progress.set_to = 0
            else:
                self._vehicle.confirm_current(sender)
                self._ground.say(sentences.SET_BY_ANOTHER(), but=sender.station)
            on_end(refused)

        self._present = sender, seq
        self._vehicle.withhold_current(sender.station, now)
        self._vehicle.progress.set_to = number
        self._missions.run(store.fly_to(held.records, number), ended, now)

    def _obstacle(self, sender: Sender) -> Refusal | None:
        if (refused := sender.station.passing_refusal(Effect.MOVE)) is not None:
            return Refusal(MissionResult.DENIED, sentences.SET_WITHOUT_RIGHT(refused.why))
        if not self._missions.vehicle.armed:
            return _NOT_FLOWN
        if self._present is not None or self._missions.runner.needs_line:
            return _BUSY
        return None if sender.station.allows(Cost.BOARD) else _BUSY

    def _as_read(self, held: HeldMission, sender: Sender, seq: float) -> int:
        """The number in the list as read back of the item that the station calls `seq`, or 0 if there is none."""
        numbers = self._vehicle.sent_seqs(sender.station) or range(len(held.items))
        return next((number for number, shown in enumerate(numbers) if shown == seq), 0)


@dataclass(frozen=True, slots=True)
class CommandService:
    """Executes commands and acknowledges them. `_version`: of the bridge."""

    _ground: Ground
    _vehicle: OwnVehicle
    _session: FcSession
    _calibration: Calibration
    _settings: BoardSettings
    _parameters: Parameters
    _set_waypoint: SetWaypoint
    _version: str

    def take(self, sender: Sender, command: int, params: Sequence[float], now: float) -> None:
        """Execute a command and acknowledge it. `params`: param1..param7."""
        sender.station.behaviour.commands = True
        action = _action(command, params)
        if command == messages.MAV_CMD_PREFLIGHT_STORAGE:
            self._store(sender, command, params[0], now)
        elif command == messages.MAV_CMD_DO_SET_MISSION_CURRENT and self._set_waypoint.is_possible:
            self._do_set_current(sender, params[0], params[1], now)
        elif action is None:
            sender.command_ack(command, self._do(sender, command, params, now))
        else:
            self._calibration.take(sender, command, action, now)

    def set_current(self, sender: Sender, seq: int, now: float) -> None:
        """MISSION_SET_CURRENT, which is not acknowledged."""
        if self._set_waypoint.is_possible:
            self._set_waypoint.begin(sender, seq, lambda refusal: self._set(sender, refusal, now), now)
        else:
            self.refuse(sender, messages.MAV_CMD_DO_SET_MISSION_CURRENT)
            self._vehicle.refuse_current(sender, now)

    def _do_set_current(self, sender: Sender, seq: float, resets: float, now: float) -> None:
        """MAV_CMD_DO_SET_MISSION_CURRENT."""

        def ended(refusal: Refusal | None) -> None:
            self._set(sender, refusal, now)
            result = CommandResult.ACCEPTED if refusal is None else _NOT_SET.get(refusal.ack, CommandResult.DENIED)
            sender.command_ack(messages.MAV_CMD_DO_SET_MISSION_CURRENT, result)

        if resets == 1:
            ended(_NO_RESET)
        else:
            self._set_waypoint.begin(sender, seq, ended, now)

    def _set(self, sender: Sender, refusal: Refusal | None, now: float) -> None:
        if refusal is not None:
            sender.say(refusal.why)
            self._vehicle.refuse_current(sender, now)

    def refuse(self, sender: Sender, command: int, mode: Sequence[float] = (0, -1)) -> None:
        """Give the reason for refusing a command, or a message like it. `mode`: base_mode and custom_mode."""
        if command == messages.MAV_CMD_DO_SET_MODE and mode[0] == messages.MAV_MODE_FLAG_SAFETY_ARMED:
            command = messages.MAV_CMD_COMPONENT_ARM_DISARM  # Mission Planner's "Toggle Safety Switch"
        is_auto = command == messages.MAV_CMD_DO_SET_MODE and mode[1] == auto_mode(self._session.vehicle)
        of_mission = self._mission_refusal() if is_auto or command in _OF_A_MISSION else None
        if command == messages.MAV_CMD_DO_FENCE_ENABLE and self._vehicle.stores_fences:
            self.tell(sender, sentences.FENCE_SWITCH())
        else:
            self.tell(sender, of_mission or _REFUSED[command]())

    def tell(self, sender: Sender, why: Happening) -> None:
        """Give the reason why a button is without effect, which differs without a flight controller."""
        sender.say(why if self._vehicle.readiness.has_board else sentences.NO_BOARD_TO_COMMAND())

    def _mission_refusal(self) -> Happening | None:
        """The switch that flies the mission, or that none does now, or None if that is not known."""
        controller, vehicle = self._session.state.controller, self._session.vehicle
        if self._vehicle.readiness.state is ReadyState.CALIBRATING:
            return sentences.CALIBRATING_NOW()
        if vehicle.last(MissionLeg) is None:
            is_asked = controller is not None and controller.profile.spoken is Spoken.MSP
            return sentences.FLIES_NO_MISSIONS() if is_asked else None
        switches = vehicle.last(Switches)
        boxes = controller.boxes if controller is not None and controller.boxes else switches.boxes if switches else ()
        switch = next((box for box in boxes if box in MISSION_BOXES), None)
        return None if switch is None else sentences.MISSION_SWITCH(switch)

    def _do(self, sender: Sender, command: int, params: Sequence[float], now: float) -> CommandResult:
        match command:
            case messages.MAV_CMD_REQUEST_MESSAGE:
                return self._send_once(sender, _msgid(params[0]), now, max(_msgid(params[1]), 0))
            case messages.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES:
                return self._send_once(sender, messages.MAVLINK_MSG_ID_AUTOPILOT_VERSION, now)
            case messages.MAV_CMD_GET_HOME_POSITION:
                return self._send_once(sender, messages.MAVLINK_MSG_ID_HOME_POSITION, now)
            case messages.MAV_CMD_SET_MESSAGE_INTERVAL:
                return self._set_interval(sender, _msgid(params[0]), params[1])
            case messages.MAV_CMD_DO_SEND_BANNER:
                controller = self._session.state.controller
                name = "no flight controller" if controller is None else controller.name
                sender.say(sentences.BANNER(self._version, name))
                self._vehicle.send_once(sender, messages.MAVLINK_MSG_ID_HOME_POSITION, now)
                return CommandResult.ACCEPTED
            case messages.MAV_CMD_RUN_PREARM_CHECKS:
                self._vehicle.readiness.tell(sender.station)
                return CommandResult.ACCEPTED
            case messages.MAV_CMD_DO_CANCEL_MAG_CAL if self._calibration.is_endless:
                sender.say(sentences.NOT_CANCELLED())
                return CommandResult.DENIED
            case messages.MAV_CMD_DO_ACCEPT_MAG_CAL | messages.MAV_CMD_DO_CANCEL_MAG_CAL:
                # It is stored already. QGroundControl asks by a cancel if there is such a calibration.
                return CommandResult.ACCEPTED
        if command in _REFUSED:
            self.refuse(sender, command, params)
            return CommandResult.DENIED
        name = command_name(command)
        if not (name.isdigit() or name.startswith(_ASKED_BY_PROGRAMS)):
            self.tell(sender, sentences.NO_EFFECT(name))
        return CommandResult.UNSUPPORTED

    def _store(self, sender: Sender, command: int, what: float, now: float) -> None:
        """MAV_CMD_PREFLIGHT_STORAGE. Mission Planner sends it 10 s after any PARAM_SET, even in flight."""
        settings = self._settings
        if what != _SAVE:
            sender.say(sentences.ONLY_SAVED())
            sender.command_ack(command, CommandResult.DENIED)
        elif not settings.known.unsaved and (
            settings.known.is_saved or self._parameters.was_refused or settings.obstacle() is not None
        ):
            sender.command_ack(command, CommandResult.ACCEPTED)
        elif not sender.station.allows(Cost.FLASH):
            sender.say(sentences.FLASH_WEAR())
            sender.command_ack(command, CommandResult.TEMPORARILY_REJECTED)
        else:
            settings.save(lambda result, _at: self._stored(sender, command, result), now)

    def _stored(self, sender: Sender, command: int, result: Answer) -> None:
        if not isinstance(result, SettingRefusal):
            sender.say(sentences.SETTINGS_SAVED())
            sender.command_ack(command, CommandResult.ACCEPTED)
            return
        # Mission Planner sends it by itself.
        sender.say(result.why, is_routine=True)
        sender.command_ack(command, _NOT_STORED.get(result.cause, CommandResult.DENIED))

    def _send_once(self, sender: Sender, msgid: int, now: float, index: int = 0) -> CommandResult:
        is_known = self._vehicle.send_once(sender, msgid, now, index)
        if is_known is None:
            return CommandResult.UNSUPPORTED
        return CommandResult.ACCEPTED if is_known else CommandResult.TEMPORARILY_REJECTED

    def _set_interval(self, sender: Sender, msgid: int, interval_us: float) -> CommandResult:
        """SET_MESSAGE_INTERVAL: -1 never, 0 the default."""
        if interval_us == 0:
            interval_s = None
        elif interval_us == -1:
            interval_s = math.inf
        elif math.isfinite(interval_us) and interval_us > 0:
            interval_s = interval_us / 1e6
        else:
            return CommandResult.DENIED
        is_known = self._vehicle.set_interval(sender.station, msgid, interval_s)
        return CommandResult.ACCEPTED if is_known else CommandResult.UNSUPPORTED


def _msgid(param: float) -> int:
    """A message number, or -1: none."""
    return int(param) if 0 <= param <= _MAX_MSGID else -1


def _action(command: int, params: Sequence[float]) -> FcAction | None:
    """The flight controller action for a command, or None if there is none.

    MAV_CMD_PREFLIGHT_CALIBRATION: one sensor at a time. param2 for the compass, param5 for the accelerometers (1, 2 for
    "level", 4 for "simple": these boards have one for all).
    """
    if command == messages.MAV_CMD_DO_START_MAG_CAL and params[0] in (0, 1):  # all compasses, or the first
        return CALIBRATE_COMPASS
    if command == messages.MAV_CMD_PREFLIGHT_CALIBRATION:
        asked = {number: param for number, param in enumerate(params, 1) if param and not math.isnan(param)}
        if asked in ({5: 1}, {5: 2}, {5: 4}):
            return CALIBRATE_ACCELEROMETER
        return CALIBRATE_COMPASS if asked == {2: 1} else None
    return None


def _why_not(held: HeldMission, item: int, seq: float) -> Happening:
    if item:
        return sentences.SET_TO_ACTION(seq, command_name(held.items[item].command))
    return sentences.SET_TO_HOME() if seq == 0 else sentences.SET_TO_MISSING(seq)
