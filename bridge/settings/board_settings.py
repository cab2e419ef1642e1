# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller's settings for all clients: the table as last read, one change at a time, and the save.

The table is read when the board is found, or when a client asks for it if reading disturbs the board; only while it is
disarmed and no mission needs the line. It is kept when the board is lost or armed, and read again when something else
may have changed it. Changes are in the board's RAM until they are saved.
"""

from collections.abc import Callable
from math import inf

from bridge.fc.fc_settings import (
    ARMED,
    NO_ANSWER,
    Cause,
    FcSettings,
    SettingRefusal,
    fixed,
    out_of_range,
    while_disarmed,
)
from bridge.fc.profile import FlightController
from bridge.fc.session import FcSession
from bridge.line.conversation import LinkLost
from bridge.missions.mission_service import MissionService
from bridge.model.board_setting import BoardSetting, SettingTable, Value, shown
from bridge.model.events import Emit, SettingChanged, SettingsRead, SettingsSaved
from bridge.settings.setting_clients import Change, Changes, OnChanged, OnTable, TableClients
from bridge.settings.table_reader import TableReader

#: After the board was found: its list is read first.
_FIRST_S, _RETRY_S, _AFTER_CHANGE_S = 0.2, 0.3, 5.0
#: Names in the log of settings that have changed.
_MOST_NAMED = 20
#: A change is a handful of short requests.
_CHANGE_SIZE = 200
#: A client waits this long for a table: INAV's takes 20 s, a Harakiri's over MAVLink 24 s, and again for a lost value.
READ_WITHIN_S = 60.0

_NO_BOARD = SettingRefusal(Cause.NO_LINK, "No flight controller whose settings can be read")
_OCCUPIED = SettingRefusal(Cause.OCCUPIED, "A mission is being transferred: try again when it has ended")
_UNREAD = SettingRefusal(Cause.OCCUPIED, "The settings have not been read yet: try again in a few seconds")
_TOO_MANY = SettingRefusal(Cause.OCCUPIED, "Too many changes at once: try again")
_NO_ARM_FLAG = SettingRefusal(Cause.REFUSED, "Nothing is changed: this board does not report whether it is armed")

OnSaved = Callable[[SettingRefusal | None, float], None]


class BoardSettings:
    """`is_transferring`: True while a mission is received or written. `others_wait`: for a reply from the board."""

    def __init__(
        self,
        session: FcSession,
        missions: MissionService,
        emit: Emit,
        is_transferring: Callable[[], bool],
        others_wait: Callable[[], bool],
    ) -> None:
        self._session = session
        self._missions = missions
        self._emit = emit
        self._is_transferring = is_transferring
        self._others_wait = others_wait
        self._controller: FlightController | None = None
        self._fc_settings: FcSettings | None = None
        #: The one that the table was read from.
        self._read_from: FcSettings | None = None
        #: Something else may have changed the table since; a client waits for it.
        self._is_doubtful, self._is_asked = True, False
        self._reader = TableReader(missions.runner, self._pace, self._paused, self._read)
        self._table_clients = TableClients()
        self._changes, self._is_changing = Changes(), False
        #: When the line has carried the last change.
        self._line_free_at = 0.0
        #: As last read; also of a board that is armed or lost since.
        self.table: SettingTable | None = None
        #: The settings that were changed here, and not saved since.
        self.unsaved: dict[str, Value] = {}
        #: True if the board's flash is known to hold the settings in its RAM.
        self.is_saved = False
        #: Called after each reading of the whole table; when the table has changed; after a save; after a change here
        #: that others must not mistake for one from elsewhere.
        self.on_read: Callable[[SettingTable], None] = lambda _table: None
        self.on_table: Callable[[SettingTable, float], None] = lambda _table, _now: None
        self.on_saved: Callable[[], None] = lambda: None
        self.on_change: Callable[[float], None] = lambda _now: None
        self.due = inf

    # The board.

    def found(self, controller: FlightController | None, now: float) -> None:
        """Follow another flight controller, or another protocol of the same; None: it was lost."""
        opens = None if controller is None else controller.profile.settings
        self._controller = controller
        self._fc_settings = None if opens is None or controller is None else opens(controller)
        self._reader.forget_failures()
        self._reader.stop()
        self._is_asked = False
        if self._fc_settings is not None:
            self._is_doubtful = True
            self.due = now + _FIRST_S
        else:
            self._table_clients.answer(self._as_last_read(), now)

    def may_have_changed(self, now: float) -> None:
        """Something else may have changed settings: read them again."""
        self._is_doubtful, self.is_saved = True, False
        if self._fc_settings is not None:
            self.due = min(self.due, now + _AFTER_CHANGE_S)

    def changed_with_others(self, now: float) -> None:
        """The bridge has begun a calibration, which may change settings."""
        self.on_change(now)
        self.may_have_changed(now)

    def saved_with_mission(self, now: float) -> None:
        """The board has written its whole configuration, to store a setting of the mission's."""
        self.changed_with_others(now)
        self.unsaved.clear()
        self.is_saved = True

    def obstacle(self) -> SettingRefusal | None:
        """The reason why settings can be neither read nor changed now; None if they can."""
        armed = self._session.vehicle.armed
        if armed:
            return ARMED
        if self._fc_settings is None or self._controller is None:
            return _NO_BOARD
        if self._missions.occupied() is not None or self._is_transferring():
            return _OCCUPIED
        return None if armed is False else _UNREAD

    @property
    def is_checked(self) -> bool:
        """True if the table was read from this board since anything else may have changed it."""
        is_read = self._read_from is not None and self._read_from is self._fc_settings
        return is_read and not self._is_doubtful and self._session.vehicle.armed is False

    # For clients.

    def current(self, on_done: OnTable, now: float, within_s: float) -> None:
        """The table, checked against the board if that is possible within this time, else as last read."""
        if self._fc_settings is None or self._session.vehicle.armed or self._missions.occupied() is not None:
            on_done(self._as_last_read(), now)
            return
        self._table_clients.add(now + within_s, on_done)
        self._is_asked, self.due = True, now

    def change(self, name: str, value: Value, on_done: OnChanged, now: float, client: str = "") -> None:
        """Change a setting in the board's RAM; `on_done` gets it as read back, maybe before this returns.

        The same request of a client that still waits is not repeated, and gets no answer of its own.
        """
        change = Change(name, value, client, on_done)
        if change in self._changes:
            return
        refused = self._refusal(name, value)
        if refused is None and not self._changes.has_room_for(change):
            refused = _TOO_MANY
        if refused is not None:
            on_done(refused, now)
            return
        self._changes.append(change)
        self._next(now)

    def save(self, on_done: OnSaved, now: float) -> None:
        """Write the settings to the board's flash."""
        obstacle, fc_settings, controller = self.obstacle(), self._fc_settings, self._controller
        if obstacle is None and fc_settings is not None and fc_settings.read_only:
            obstacle = SettingRefusal(Cause.FIXED, f"Nothing is saved: {fc_settings.read_only}")
        if obstacle is not None or fc_settings is None or controller is None:
            on_done(obstacle or _NO_BOARD, now)
            return

        def done(result: SettingRefusal | LinkLost | None, at: float) -> None:
            refused = NO_ANSWER if isinstance(result, LinkLost) else result
            if refused is None:
                self._emit(SettingsSaved(changed=", ".join(self.unsaved)))
                self.unsaved.clear()
            self.on_change(at)
            on_done(refused, at)
            if refused is None and self.table is not None:
                self.on_saved()
            # A firmware may correct settings that contradict each other.
            self._is_doubtful, self.due = True, at
            self.is_saved = refused is None

        self._missions.runner.start(while_disarmed(controller.arm_bit, fc_settings.save()), done, now)

    def tick(self, now: float) -> None:
        self.due = inf
        self._table_clients.answer(self.table or self.obstacle() or _UNREAD, now, if_late=True)
        self._next(now)
        if self._fc_settings is None or not (self._is_wanted(self._fc_settings) or self._changes):
            self._reader.stop()
            return
        next_at = max(self._line_free_at, self._reader.next_at)
        self.due = next_at if next_at > now else now + _RETRY_S
        if self._session.vehicle.armed:
            self._reader.stop()
        elif now >= next_at and self._may_read():
            self._reader.read_on(self._fc_settings, self.table, self._is_doubtful, now)

    # Reading.

    def _is_wanted(self, fc_settings: FcSettings) -> bool:
        return self._is_asked or (self._is_doubtful and not fc_settings.is_read_when_asked)

    def _may_read(self) -> bool:
        is_busy = self._reader.is_asking or self._is_changing or self._changes
        is_free = not (is_busy or self._others_wait() or self._missions.runner.needs_line)
        return is_free and self.obstacle() is None

    def _paused(self, now: float) -> None:
        self.due = self._reader.line_free_at
        self._next(now)

    def _read(self, table: SettingTable | None, now: float) -> None:
        """The reader has ended; None: without a table."""
        fc_settings = self._fc_settings
        if table is not None:
            self._is_doubtful = self._is_asked = False
            self._read_from = fc_settings
            self._take(table, now)
            self.on_read(table)
            self._table_clients.answer(self._as_last_read(), now)
        elif fc_settings is not None and fc_settings.is_read_when_asked:
            self._is_asked = False
            self._table_clients.answer(NO_ANSWER, now)
        else:
            self.due = self._reader.next_at
        self._next(now)

    def _pace(self, size: int) -> float:
        """The rest of the line carries these bytes in this time, which has already passed in part."""
        link = self._session.state.link
        return 0.0 if link is None else max(self._session.polls.rest_s(size) - size * link.byte_s, 0.0)

    def _take(self, table: SettingTable, now: float) -> None:
        former, self.table = self.table, table
        changed = table.differences(former or table)
        if former is None or changed:
            self._emit(
                SettingsRead(settings=len(table), changed=", ".join(changed[:_MOST_NAMED]), left_out=table.left_out)
            )
            self.on_table(table, now)

    def _as_last_read(self) -> SettingTable | SettingRefusal:
        return self.table or self.obstacle() or _NO_BOARD

    # Changing.

    def _refusal(self, name: str, value: Value) -> SettingRefusal | None:
        table = self.table
        setting = None if table is None else table.find(name)
        if table is not None and setting is None:
            return SettingRefusal(Cause.UNKNOWN_NAME, f"This flight controller has no setting {name[:32]}")
        if (obstacle := self.obstacle()) is not None:
            return obstacle
        if setting is None:
            return _UNREAD
        read_only = "" if self._fc_settings is None else self._fc_settings.read_only
        if (read_only or setting.fixed) and value != setting.value:
            return fixed(setting, read_only)
        if not setting.accepts(value):
            return out_of_range(setting, value)
        if self._read_from is not self._fc_settings:
            return _UNREAD
        if setting.holds(value):
            return None
        return _NO_ARM_FLAG if self._controller is not None and self._controller.arm_bit is None else None

    def _next(self, now: float) -> None:
        """Carry out the next change."""
        if self._reader.is_asking or self._is_changing or not self._changes:
            return
        line_free_at = max(self._line_free_at, self._reader.line_free_at)
        if now < line_free_at:
            self.due = min(self.due, line_free_at)
            return
        change, fc_settings, table, controller = self._changes[0], self._fc_settings, self.table, self._controller
        refused = self._refusal(change.name, change.value)
        setting = None if table is None else table.find(change.name)
        if refused is not None or fc_settings is None or table is None or setting is None or controller is None:
            self._end(change, refused or _NO_BOARD, now)
            return
        if setting.holds(change.value):
            self._end(change, setting, now)
            return

        def done(result: SettingTable | SettingRefusal | LinkLost, at: float) -> None:
            self._is_changing = False
            self._line_free_at = at + self._pace(_CHANGE_SIZE)
            # Without a reply it may still have changed.
            self.on_change(at)
            # The values read so far may be out of date.
            self._reader.stop()
            self.is_saved = False
            if isinstance(result, SettingTable) and self._fc_settings is fc_settings:
                self._take(result, at)
                self._end(change, self._changed(change, setting), at)
            else:
                self.may_have_changed(at)
                self._end(change, result if isinstance(result, SettingRefusal) else NO_ANSWER, at)

        self._is_changing = True
        conversation = while_disarmed(controller.arm_bit, fc_settings.change(table, setting, change.value))
        self._missions.runner.start(conversation, done, now, in_background=True)

    def _changed(self, change: Change, before: BoardSetting) -> BoardSetting | SettingRefusal:
        after = None if self.table is None else self.table.find(before.name)
        if after is None or not after.holds(change.value):
            value = shown(before.value if after is None else after.value)
            return SettingRefusal(Cause.REFUSED, f"{before.name} stays {value}: the flight controller refused it")
        self.unsaved[after.name] = after.value
        self._emit(
            SettingChanged(setting=after.name, before=shown(before.value), after=shown(after.value), by=change.client)
        )
        return after

    def _end(self, change: Change, result: BoardSetting | SettingRefusal, now: float) -> None:
        self._changes.popleft()
        change.on_done(result, now)
        self._next(now)
