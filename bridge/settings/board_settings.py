# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller's settings for all clients: read, watched for changes without the bridge, changed and saved.

They are read when the board is found, or when a client asks if reading disturbs the board, and again once a minute and
after each change; only while it is disarmed and missions do not need the line. A reading without changes costs a few
requests. Changes are in the board's RAM until they are saved.
"""

from collections.abc import Callable, Sequence
from math import inf

from bridge.fc.fc_settings import ARMED, NO_ANSWER, Cause, FcSettings, SettingRefusal, TableReading, fixed, out_of_range
from bridge.fc.profile import FlightController, Spoken
from bridge.fc.session import FcSession
from bridge.gcs.ground import Ground
from bridge.line.conversation import Conversation, LinkLost, Pause, ask_surely
from bridge.missions.mission_service import MissionService
from bridge.model.events import BridgeEvent, SettingChanged, SettingsChangedOnBoard, SettingsRead, SettingsSaved
from bridge.model.missions import Refusal
from bridge.model.settings import BoardId, SettingsChange, SettingsMemory, SettingTable, TakenBackup, Value, shown
from bridge.settings.known_settings import Freshness, KnownSettings
from bridge.settings.setting_work import Answer, OnDone, SettingChange, SettingsSave, SettingWork, WorkEvent
from bridge.voice import sentences
from bridge.voice.happening import Happening
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, request
from protocols.plain_text import plain_text
from protocols.rights import Effect
from protocols.rights.msp import msp_right

#: After the board was found: the list is read first. A program that changes settings sends several requests.
_FIRST_S, _AFTER_CHANGE_S, _INTERVAL_S = 0.2, 5.0, 60.0
#: While the line is needed for something else, and after a failure, doubled after each further one.
_RETRY_S, _MOST_RETRY_S = 0.3, 60.0
#: A change is a handful of short requests.
_CHANGE_SIZE = 200
#: Items that wait. A flood of changes would fill the memory.
_MOST_WAITING = 64
_UID_SIZE = 12
#: A client waits this long for a table: INAV's takes 20 s, a Harakiri's over MAVLink 24 s, and again for a lost value.
READ_WITHIN_S = 60.0

_NO_BOARD = SettingRefusal(Cause.NO_LINK, sentences.NO_SETTINGS())
_OCCUPIED = SettingRefusal(Cause.OCCUPIED, sentences.SETTINGS_OCCUPIED())
_UNREAD = SettingRefusal(Cause.OCCUPIED, sentences.SETTINGS_UNREAD())
_TOO_MANY = SettingRefusal(Cause.OCCUPIED, sentences.TOO_MANY_CHANGES())
_NO_ARM_FLAG = SettingRefusal(Cause.REFUSED, sentences.NO_ARM_FLAG())

OnTable = Callable[[SettingTable | SettingRefusal, float], None]


class BoardSettings:
    """The one owner of a board's settings.

    >>> settings.change("p_roll", 44, on_done, now, client="the page")  # on_done gets it as read back
    >>> settings.save(on_done, now)
    """

    def __init__(
        self,
        session: FcSession,
        missions: MissionService,
        ground: Ground,
        emit: Callable[[BridgeEvent | TakenBackup], None],
        memory: SettingsMemory,
    ) -> None:
        self._session = session
        self._missions = missions
        self._ground = ground
        self._emit = emit
        self.known = KnownSettings(memory)
        self._controller: FlightController | None = None
        self._arm_bit: int | None = None
        self._fc_settings: FcSettings | None = None
        self._work: list[SettingWork] = []
        #: Clients that wait for the table, with their deadlines.
        self._readers: list[tuple[float, OnTable]] = []
        self._reading: Conversation[SettingTable | None] | None = None
        #: A part of the work or of the reading is on the line, which has carried the one before at this time.
        self._is_on_line, self._line_free_at = False, 0.0
        self._read_at, self._retry_s = inf, _RETRY_S
        #: The text for ground stations that connect later.
        self._told: Happening | None = None
        self.due = inf

    @property
    def is_checked(self) -> bool:
        """True if the table was read from this board since anything else may have changed it."""
        return self.known.freshness >= Freshness.CHANGED and self._session.vehicle.armed is False

    def obstacle(self) -> SettingRefusal | None:
        """The reason why settings cannot be read or changed now, or None if they can."""
        armed, missions = self._session.vehicle.armed, self._missions.fc_store
        if self._controller is None and isinstance(missions, Refusal):
            # It is lost, was never found, or calibrates.
            return SettingRefusal(Cause.NO_LINK, missions.why)
        if armed:
            return ARMED
        if self._fc_settings is None:
            return _NO_BOARD
        if self._missions.occupied() is not None or self._missions.is_arriving:
            return _OCCUPIED
        return None if armed is False else _UNREAD

    # The board.

    def found(self, controller: FlightController | None, now: float) -> None:
        """Follow another flight controller, or another protocol of the same, or None if it was lost."""
        opens = None if controller is None else controller.profile.settings
        self._controller = controller
        self._arm_bit = None if controller is None else controller.arm_bit
        self._fc_settings = fc_settings = None if opens is None or controller is None else opens(controller)
        self.known.found()
        self._stop_reading()
        self._retry_s = _RETRY_S
        self._read_at = inf if fc_settings is None else now + _FIRST_S
        if fc_settings is None:
            self._answer_readers(self._as_last_read(), now)
        self.due = now

    def arming_changed(self, now: float, *, is_armed: bool) -> None:
        """A pilot who has armed has decided to fly: stations that connect later are not told of earlier changes."""
        if is_armed:
            self._tell_newcomers(None)
        else:
            self._read_again(now + _FIRST_S)

    def may_have_changed(self, now: float) -> None:
        """The bridge, or a program through it, may have changed settings."""
        self.known.may_have_changed()
        self._stop_reading()
        self._missions.settings_changed()
        self._read_again(now + _AFTER_CHANGE_S)

    # For clients.

    def current(self, on_done: OnTable, now: float, within_s: float) -> None:
        """The table, checked against the board if that is possible within this time, else as last read."""
        if self._fc_settings is None or self._session.vehicle.armed or self._missions.occupied() is not None:
            on_done(self._as_last_read(), now)
            return
        self._readers.append((now + within_s, on_done))
        if self._retry_s == _RETRY_S:
            self._read_at = now
        self.due = now

    def change(self, name: str, value: Value, on_done: OnDone, now: float, client: str = "") -> None:
        """Change a setting in the board's RAM. `on_done` gets it as read back, maybe before this returns.

        The same request of a client that still waits is not repeated, and does not get an answer of its own.
        """
        for each in self._work:
            if isinstance(each, SettingChange) and (each.client, each.name, each.value) == (client, name, value):
                return
        change = SettingChange(client, on_done, name=name, value=value)
        if len(self._work) >= _MOST_WAITING:
            change.end(_TOO_MANY, now)
            return
        self._work.append(change)
        self._next(now)

    def save(self, on_done: OnDone, now: float) -> None:
        """Write the settings to the board's flash."""
        self._work.append(SettingsSave("", on_done))
        self._next(now)

    # The line: one part of the work or of a reading after the other.

    def tick(self, now: float) -> None:
        late = [reader for reader in self._readers if now >= reader[0]]
        self._answer_readers(self.known.table or self.obstacle() or _UNREAD, now, late)
        self._next(now)

    def _next(self, now: float) -> None:
        """Start the next work, else the next part of a reading."""
        while self._work and not self._is_on_line and now >= self._line_free_at:
            self._begin(self._work[0], now)
        waits_until = min((until for until, _ in self._readers), default=inf)
        if self._is_on_line:
            self.due = waits_until
            return
        next_at = self._line_free_at if self._work else max(self._line_free_at, self._read_at)
        if next_at <= now:
            self._read_on(now)
            next_at = inf if self._is_on_line or self._session.vehicle.armed else now + _RETRY_S
        self.due = min(next_at, waits_until)

    def _begin(self, work: SettingWork, now: float) -> None:
        fc_settings, answer = self._fc_settings, self._known_answer(work)
        if answer is not None or fc_settings is None:
            self._work.remove(work)
            work.end(_NO_BOARD if answer is None else answer, now)
            return

        def done(result: Answer | LinkLost, at: float) -> None:
            self._is_on_line = False
            self._line_free_at = at + self._pace(_CHANGE_SIZE)
            # The values read so far may be out of date.
            self._stop_reading()
            self._work.remove(work)
            result = NO_ANSWER if isinstance(result, LinkLost) else result
            if isinstance(work, SettingChange):
                result = self._changed(work, result, at)
            elif not isinstance(result, SettingRefusal):
                self._emit(SettingsSaved(changed=", ".join(self.known.unsaved)))
                self.known.saved()
            if isinstance(result, SettingRefusal) and work.may_have_acted:
                self.known.may_have_changed()
            if work.may_have_acted:
                self._missions.settings_changed()
                self._read_again(at if isinstance(work, SettingsSave) else at + _AFTER_CHANGE_S)
            work.end(result, at)
            self._next(at)

        work.advance(WorkEvent.TURN)
        self._is_on_line = True
        is_change = isinstance(work, SettingChange)
        self._missions.runner.start(work.carry_out(fc_settings, self._arm_bit), done, now, in_background=is_change)

    def _known_answer(self, work: SettingWork) -> Answer | None:
        """The answer without asking the board, if there is one."""
        table, obstacle = self.known.table, self.obstacle()
        if not isinstance(work, SettingChange):
            return obstacle
        name, value = work.name, work.value
        work.before = setting = None if table is None else table.find(name)
        if table is not None and setting is None:
            return SettingRefusal(Cause.UNKNOWN_NAME, sentences.NO_SUCH_SETTING(plain_text(name[:32])))
        if obstacle is not None:
            return obstacle
        if setting is None or self.known.freshness is Freshness.UNREAD:
            return _UNREAD
        if setting.fixed and value != setting.value:
            return fixed(setting)
        if not setting.accepts(value):
            return out_of_range(setting, value)
        if setting.holds(value):
            return (setting,)
        return _NO_ARM_FLAG if self._arm_bit is None else None

    def _changed(self, work: SettingChange, result: Answer, now: float) -> Answer:
        """The answer to a change, from the settings read back."""
        before = work.before
        assert before is not None
        if isinstance(result, SettingRefusal):
            if result.cause is Cause.NO_ANSWER and work.may_have_acted:
                self.known.unsaved[before.name] = work.value
            return result
        self.known.changed(result)
        after = next((each for each in result if each.name == before.name), before)
        if not after.holds(work.value):
            return SettingRefusal(Cause.REFUSED, sentences.REFUSED_BY_BOARD(before.name, shown(after.value)))
        self.known.unsaved[after.name] = after.value
        self._emit(
            SettingChanged(setting=after.name, before=shown(before.value), after=shown(after.value), by=work.client)
        )
        return (after,)

    # Reading.

    def _read_again(self, at: float) -> None:
        if self._fc_settings is not None:
            self._read_at = at
            self.due = min(self.due, at)

    def _read_on(self, now: float) -> None:
        """Begin to read the table, or continue until the next pause; unless that must wait."""
        fc_settings, runner = self._fc_settings, self._missions.runner
        if self._session.vehicle.armed or fc_settings is None:
            self._stop_reading()
        if fc_settings is None or runner.programs_wait or runner.needs_line or self.obstacle() is not None:
            return
        if self._reading is None:
            self._reading = self._whole(fc_settings)
        reading = self._reading

        def done(result: SettingTable | Pause | LinkLost | None, at: float) -> None:
            self._is_on_line = False
            if self._reading is reading and isinstance(result, Pause):
                self._line_free_at = at + result.seconds
            elif self._reading is reading:
                self._reading = None
                self._read(result if isinstance(result, SettingTable) else None, at)
            self._next(at)

        self._is_on_line = True
        runner.start(_up_to_pause(reading), done, now, in_background=True)

    def _stop_reading(self) -> None:
        """Forget the values read so far: they may be out of date."""
        if self._reading is not None and not self._is_on_line:
            self._reading.close()
        self._reading = None

    def _whole(self, fc_settings: FcSettings) -> Conversation[SettingTable | None]:
        controller, known = self._controller, self.known
        if known.board is None and controller is not None and controller.profile.spoken is Spoken.MSP:
            known.identified((yield from _identify(controller)))
        is_doubtful = known.freshness <= Freshness.DOUBTFUL
        return (yield from fc_settings.read(known.table, TableReading(self._pace, is_doubtful)))

    def _read(self, table: SettingTable | None, now: float) -> None:
        """A reading has ended; None: without a table."""
        if table is None:
            self._retry_s = min(2 * self._retry_s, _MOST_RETRY_S)
            self._read_at = now + self._retry_s
            return
        self._retry_s, self._read_at = _RETRY_S, inf
        self._read_again(now + _INTERVAL_S)
        if self.known.table is None or self.known.table.is_remembered:
            self._emit(SettingsRead(settings=len(table)))
        elsewhere, backup = self.known.read(table, now)
        if elsewhere is not None:
            self._report(elsewhere)
        if backup is not None:
            self._emit(backup)
        self._answer_readers(table, now)

    def _report(self, change: SettingsChange) -> None:
        self._missions.settings_changed()
        happening = sentences.settings_changed(change.names)
        self._ground.say(happening)
        self._tell_newcomers(happening)
        assert self.known.state is not None
        self._emit(SettingsChangedOnBoard(detail=change.text, seal=self.known.state.seal))

    def _tell_newcomers(self, change: Happening | None) -> None:
        """A board is mostly found before the first ground station connects. None: no more."""
        if self._told in self._ground.notices:
            self._ground.notices.remove(self._told)
        self._told = change
        if change is not None:
            self._ground.notices.append(change)

    def _pace(self, size: int) -> float:
        """The rest of the line carries these bytes in this time, which has already passed in part."""
        link = self._session.state.link
        return 0.0 if link is None else max(self._session.polls.rest_s(size) - size * link.byte_s, 0.0)

    def _as_last_read(self) -> SettingTable | SettingRefusal:
        return self.known.table or self.obstacle() or _NO_BOARD

    def _answer_readers(
        self, answer: SettingTable | SettingRefusal, now: float, readers: Sequence[tuple[float, OnTable]] | None = None
    ) -> None:
        """Answer these clients, or all that wait."""
        readers = self._readers if readers is None else readers
        self._readers = [each for each in self._readers if each not in readers]
        for _, on_done in readers:
            on_done(answer, now)


def _identify(controller: FlightController) -> Conversation[BoardId]:
    right = msp_right(controller.firmware, Msp.UID, b"")
    reply = None
    if right.effect is Effect.READ:
        reply = yield from ask_surely(request(Msp.UID), Msp.UID, right.reply)
    uid = reply.payload if reply is not None and reply.direction is Direction.REPLY else b""
    return BoardId(controller.kind, uid.hex() if len(uid) == _UID_SIZE and len(set(uid)) > 1 else "")


def _up_to_pause(conversation: Conversation[SettingTable | None]) -> Conversation[SettingTable | Pause | None]:
    """Go on with a conversation up to the next pause, or the end."""
    answer = None
    try:
        while not isinstance(effect := conversation.send(answer), Pause):
            answer = yield effect
    except StopIteration as end:
        table: SettingTable | None = end.value
        return table
    return effect
