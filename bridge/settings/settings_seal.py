# SPDX-License-Identifier: GPL-3.0-or-later
"""Reports settings of the flight controller that changed without the bridge: by its sticks, its display or its USB.

PIDs, modes, rates and MISC, and the checksum of all settings where the board has one, are read when the board is found,
and again while it is disarmed and the line is idle. The seal of each board is remembered, so that a change between two
flights is also noticed.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf

from bridge.fc.profile import FlightController, Spoken
from bridge.fc.session import FcSession
from bridge.gcs.ground import Ground
from bridge.gcs.station import Severity
from bridge.line.conversation import Conversation, LinkLost, ask, ask_surely
from bridge.missions.mission_service import MissionService
from bridge.model.events import Emit, SettingsChangedOnBoard
from bridge.model.settings import BoardId, ChangedPart, Seal, SealMemory, SettingsChange, SettingsState
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame, request
from protocols.msp.settings import SETTINGS, Part, SettingNames, SettingsRequest, changed_names
from protocols.msp.telemetry import decode_box_names
from protocols.rights.effect import Effect
from protocols.rights.msp import Firmware, msp_right

#: After a board was found, its list is read first. A program that changes settings sends several requests.
_FIRST_S, _AFTER_CHANGE_S = 3.0, 5.0
#: Five requests each time.
_INTERVAL_S = 60.0
#: Not in step with the checks of the mission, which run every second or two.
_RETRY_S = 0.3
#: Two chunks of STATUSTEXT.
_MOST_TEXT = 99
_UID_SIZE = 12


@dataclass(eq=False)
class SettingsSeal:
    """Starts a reading at `due` if the craft is disarmed and the line idle.

    `_is_transferring`: True while a mission is received or written.
    """

    _session: FcSession
    _missions: MissionService
    _ground: Ground
    _emit: Emit
    _memory: SealMemory
    _is_transferring: Callable[[], bool]
    _controller: FlightController | None = None
    _board: BoardId | None = None
    #: Commands that this board answered, and those that it did not.
    _known: set[int] = field(default_factory=set)
    _unknown: set[int] = field(default_factory=set)
    #: True if the settings were changed through the bridge since the last reading.
    _is_ours: bool = False
    _is_reading: bool = False
    #: The text for ground stations that connect later.
    _told: str = ""
    #: Called when it is known which board was found.
    on_identified: Callable[[BoardId], None] = lambda _board: None
    #: Called when settings have changed without the bridge.
    on_found_change: Callable[[float], None] = lambda _now: None
    #: None until the settings of a board were read; those of a lost board stay.
    state: SettingsState | None = None
    due: float = inf

    def found(self, controller: FlightController | None, now: float) -> None:
        """Follow another flight controller; None: it was lost."""
        self._controller, self._board = controller, None
        self._known.clear()
        self._unknown.clear()
        is_readable = controller is not None and controller.profile.spoken is Spoken.MSP
        self.due = now + _FIRST_S if is_readable else inf

    def changed_here(self, now: float) -> None:
        """A program changed settings through the bridge: the next reading is compared with no earlier one."""
        self._is_ours = True
        if self._board is not None:
            self._memory.keep(self._board, Seal({}))  # the daemon may end before that reading
        if self._controller is not None:
            self.due = now + _AFTER_CHANGE_S

    def armed(self) -> None:
        """The pilot has decided to fly: stations that connect later get no text about an earlier change."""
        self._tell_newcomers("")

    def tick(self, now: float) -> None:
        controller, runner = self._controller, self._missions.runner
        self.due = now + _RETRY_S
        if controller is not None and not self._is_reading and not runner.needs_line and self._may_ask():
            self._is_reading = True
            runner.start(self._read(controller), self._done, now, in_background=True)

    def _may_ask(self) -> bool:
        is_free = self._missions.occupied() is None and not self._is_transferring()
        return is_free and self._session.vehicle.armed is False

    def _done(self, changed: list[ChangedPart] | LinkLost | None, now: float) -> None:
        self._is_reading = False
        if self._controller is None or isinstance(changed, LinkLost) or changed is None:
            return
        self.due = now + _INTERVAL_S
        if not changed or self.state is None:
            return
        self.on_found_change(now)
        change = SettingsChange(changed, now)
        self.state = replace(self.state, change=change)
        self._ground.say(Severity.WARNING, change.text(_MOST_TEXT))
        self._tell_newcomers(change.text(_MOST_TEXT))
        self._emit(SettingsChangedOnBoard(detail=change.text(), seal=str(self.state.seal)))

    def _tell_newcomers(self, text: str) -> None:
        """A board is mostly found before the first ground station connects. An empty text: no more."""
        if self._told in self._ground.notices:
            self._ground.notices.remove(self._told)
        self._told = text
        if text:
            self._ground.notices.append(text)

    def _read(self, controller: FlightController) -> Conversation[list[ChangedPart] | None]:
        """Read the settings; returns the parts that changed without the bridge, None if it was interrupted."""
        if self._board is None:
            self._board = yield from self._identify(controller)
            self.on_identified(self._board)
        is_ours, self._is_ours = self._is_ours, False
        if is_ours:
            self._memory.keep(self._board, Seal({}))  # the line may be lost before the end of this reading
        former = self._memory.recall(self._board)
        parts = {} if former is None else dict(former.parts)
        changed: list[ChangedPart] = []
        for wanted in SETTINGS[controller.firmware]:
            if not self._may_ask():
                return None
            before = parts.get(wanted.part)
            after = yield from self._part(wanted, controller.firmware, before)
            if after is None:
                continue
            parts[wanted.part] = after
            if before is not None and after != before:
                names = yield from self._names(wanted, controller)
                changed.append(ChangedPart(wanted.part, changed_names(wanted, before, after, names)))
        if not parts:
            return changed
        if len(changed) > 1:
            # The checksum also changes with the parts that are named.
            changed = [each for each in changed if each.part is not Part.OTHERS]
        seal = Seal(parts)
        if seal != former:
            self._memory.keep(self._board, seal)
        is_same_board = self.state is not None and self.state.board == self._board
        self.state = SettingsState(self._board, seal, self.state.change if self.state and is_same_board else None)
        return changed

    def _identify(self, controller: FlightController) -> Conversation[BoardId]:
        uid = yield from self._ask(Msp.UID, controller.firmware, surely=True)
        is_one = len(uid or b"") == _UID_SIZE and len(set(uid or b"")) > 1
        return BoardId(controller.kind, uid.hex() if uid is not None and is_one else "")

    def _part(self, wanted: SettingsRequest, firmware: Firmware, before: bytes | None) -> Conversation[bytes | None]:
        """A part's settings; None if the board does not have it, or did not reply."""
        command = wanted.command
        if wanted.instead is not None:
            instead = yield from self._ask(wanted.instead, firmware)
            if instead is None and wanted.instead not in self._unknown:
                return None
            command = wanted.instead if instead and instead[0] else command
        payload = yield from self._ask(command, firmware, wanted.body)
        if payload is not None and wanted.settings(payload) != before:
            payload = yield from self._ask(command, firmware, wanted.body, surely=True)
        return wanted.settings(payload) if payload is not None and payload.startswith(wanted.begins) else None

    def _names(self, wanted: SettingsRequest, controller: FlightController) -> Conversation[SettingNames]:
        if wanted.part is Part.PIDS:
            pids = yield from self._ask(Msp.PIDNAMES, controller.firmware, surely=True)
            return SettingNames(pids=decode_box_names(pids or b""))
        if wanted.command != Msp.MODE_RANGES:
            return SettingNames(boxes=controller.boxes)
        ids = yield from self._ask(Msp.BOXIDS, controller.firmware, surely=True)
        names = yield from self._ask(Msp.BOXNAMES, controller.firmware, surely=True)
        return SettingNames(boxes_by_id=dict(zip(ids or b"", decode_box_names(names or b""), strict=False)))

    def _ask(
        self, command: int, firmware: Firmware, body: bytes = b"", *, surely: bool = False
    ) -> Conversation[bytes | None]:
        """The payload of a reply; None without one. A command that the board does not know is asked only once."""
        right = msp_right(firmware, command, body)
        if right.effect is not Effect.READ or command in self._unknown:
            return None
        asking = ask_surely if surely else partial(ask, tries=1)
        reply: MspFrame | None = yield from asking(request(command, body), command, right.reply)
        if reply is not None and reply.direction is Direction.REPLY:
            self._known.add(command)
            return reply.payload
        if command not in self._known:
            self._unknown.add(command)
        return None
