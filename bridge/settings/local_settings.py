# SPDX-License-Identifier: GPL-3.0-or-later
"""The board's settings for the command line, the status page and zenoh: read, changed, saved and restored.

A restore sets each value in the board's RAM and reads it back, then saves all once and reads them again. Whatever fails
before the save leaves the saved settings as they were.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field

from bridge.fc.fc_settings import Cause, SettingRefusal
from bridge.fc.session import FcSession
from bridge.model.board_setting import BoardSetting, SettingTable, Value
from bridge.settings.board_settings import READ_WITHIN_S, BoardSettings
from bridge.settings.parameter_names import parameter_names
from bridge.settings.restore_plan import LeftOut, PlannedChange, RestorePlan, is_restored, plan_restore
from bridge.settings.setting_clients import OnTable

_MOST_NAMES = 8
_NO_BOARD = SettingRefusal(Cause.NO_LINK, "The flight controller is not connected")
#: Reasons why a save was not started.
_BEFORE_SAVE = (Cause.ARMED, Cause.OCCUPIED, Cause.LIMIT, Cause.NO_LINK)
_RUNNING = SettingRefusal(Cause.OCCUPIED, "Another restore is running: wait until it has ended")


@dataclass(frozen=True, slots=True)
class RestoreResult:
    """is_saved: the board has saved the planned settings, and they were read from it again. changed: in its RAM."""

    is_saved: bool
    text: str
    changed: tuple[str, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


OnPlan = Callable[[RestorePlan | SettingRefusal, float], None]
OnRestored = Callable[[RestoreResult | SettingRefusal, float], None]


def by_setting(values: Mapping[str, Value], known: Collection[str]) -> dict[str, Value]:
    """The values by the names of known settings, where a ground station's file has a parameter's shorter name."""
    names = parameter_names(known)
    return {name if name in known else names.get(name, name): value for name, value in values.items()}


def by_parameter(values: Mapping[str, Value]) -> dict[str, Value]:
    """The values by the names that ground stations use."""
    return {parameter: values[setting] for parameter, setting in parameter_names(values).items()}


class LocalSettings:
    """The settings for the command line, the status page and zenoh, by the same rules as parameters.

    Restores are planned, and run one at a time.
    """

    def __init__(self, settings: BoardSettings, session: FcSession) -> None:
        self._settings = settings
        self._session = session
        self._running: _Restore | None = None
        self.change, self.save = settings.change, settings.save

    @property
    def kind(self) -> str | None:
        """The board's firmware and its version; None without a board."""
        controller = self._session.state.controller
        return None if controller is None else controller.kind

    @property
    def is_checked(self) -> bool:
        """True if the settings were read from this board since anything else may have changed them."""
        return self._settings.is_checked

    def read(self, on_done: OnTable, now: float) -> None:
        """The table, checked against the board if that is possible now, else as last read."""
        self._settings.current(on_done, now, READ_WITHIN_S)

    def plan(
        self, wanted: Mapping[str, Value], source: str, on_done: OnPlan, now: float, *, is_checked: bool = True
    ) -> None:
        """Compare settings with those of the board. source: see `plan_restore`.

        is_checked: read the board's first, if it is disarmed; else they are compared as last read.
        """

        def read(table: SettingTable | SettingRefusal, at: float) -> None:
            kind = self.kind
            if isinstance(table, SettingRefusal):
                on_done(table, at)
            elif kind is None:
                on_done(_NO_BOARD, at)
            else:
                on_done(plan_restore(by_setting(wanted, table.settings), source, table, kind), at)

        if is_checked:
            self.read(read, now)
        else:
            read(self._settings.table or _NO_BOARD, now)

    def restore(
        self,
        wanted: Mapping[str, Value],
        source: str,
        client: str,
        progress: Callable[[int], None],
        on_done: OnRestored,
        now: float,
    ) -> None:
        """Make the plan again and carry it out. progress: gets the number of settings set so far."""

        def planned(plan: RestorePlan | SettingRefusal, at: float) -> None:
            if isinstance(plan, SettingRefusal):
                on_done(plan, at)
                return
            self._running = _Restore(self._settings, plan, client, progress, done)
            self._running.start(at)

        def done(result: RestoreResult, at: float) -> None:
            self._running = None
            on_done(result, at)

        refused = self._settings.obstacle() or (_RUNNING if self._running is not None else None)
        if refused is not None:
            on_done(refused, now)
        else:
            self.plan(wanted, source, planned, now)


@dataclass
class _Restore:
    """One restore. _client: its name in the log."""

    _settings: BoardSettings
    _plan: RestorePlan
    _client: str
    _progress: Callable[[int], None]
    _on_done: Callable[[RestoreResult, float], None]
    _changed: list[PlannedChange] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._waiting = [*reversed(self._plan.changes)]
        self._left_out = [*self._plan.left_out]

    def start(self, now: float) -> None:
        """Set the first value; everything else follows from the board's answers."""
        if not self._waiting:
            self._save(now)
            return
        change = self._waiting.pop()

        def done(result: BoardSetting | SettingRefusal, at: float) -> None:
            if isinstance(result, BoardSetting):
                self._changed.append(change)
                self._progress(len(self._changed))
            elif result.cause is Cause.FIXED:
                # The board accepts other values of this setting, but not this one.
                self._left_out.append(LeftOut(change.name, change.becomes, change.was, result.text))
            else:
                self._stop(result.text, at)
                return
            self.start(at)

        self._settings.change(change.name, change.becomes, done, now, self._client)

    def _save(self, now: float) -> None:
        if not self._changed:
            text = (
                f"Nothing written: {_count(self._left_out)} cannot be set" if self._left_out else "Nothing to restore"
            )
            self._end(text, now, is_saved=not self._left_out)
            return
        # A later change may have had an effect on an earlier one, or another client may have changed it.
        if missed := self._missed(self._settings.table):
            self._stop(missed, now)
            return
        self._settings.save(self._saved, now)

    def _saved(self, refusal: SettingRefusal | None, now: float) -> None:
        if refusal is None:
            self._settings.current(self._verified, now, READ_WITHIN_S)
        elif refusal.cause in _BEFORE_SAVE:
            self._stop(f"the save failed ({refusal.text})", now)
        else:
            # Also if the firmware has corrected a value after the save.
            self._end(f"Not known to be saved: {refusal.text}. The board has its old or its new settings", now)

    def _verified(self, table: SettingTable | SettingRefusal, now: float) -> None:
        if isinstance(table, SettingRefusal) or not self._settings.is_checked:
            self._end(f"{_count(self._changed)} saved, but they could not be read again: compare them later", now)
        elif missed := self._missed(table):
            self._end(f"Saved, but now {missed}", now)
        else:
            left_out = f", {len(self._left_out)} left out" if self._left_out else ""
            self._end(f"{_count(self._changed)} restored, saved and verified{left_out}", now, is_saved=True)

    def _missed(self, table: SettingTable | None) -> str:
        """The settings that the board does not hold as planned; empty if it holds all."""
        names = [change.name for change in self._changed if table is None or not is_restored(table, change)]
        return f"{_listed(names)} {'has' if len(names) == 1 else 'have'} another value" if names else ""

    def _stop(self, why: str, now: float) -> None:
        if not self._changed:
            self._end(f"Nothing written: {why}", now)
            return
        written = f"{len(self._changed)} of {len(self._plan.changes)} settings were changed in the board's memory"
        names = _listed([change.name for change in self._changed])
        go_back = "to return to the saved settings, switch its power off and on"
        self._end(f"Nothing saved: {why}. {written} ({names}): {go_back}", now)

    def _end(self, text: str, now: float, *, is_saved: bool = False) -> None:
        changed = tuple(change.name for change in self._changed)
        self._on_done(RestoreResult(is_saved, text, changed, tuple(self._left_out)), now)


def _count(settings: Sequence[object]) -> str:
    return "1 setting" if len(settings) == 1 else f"{len(settings)} settings"


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _MOST_NAMES
    return ", ".join(names[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")
