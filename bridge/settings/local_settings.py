# SPDX-License-Identifier: GPL-3.0-or-later
"""The board's settings for the command line, the status page and zenoh: read, changed, saved and restored.

A restore sets each value in the board's RAM and reads it back, then saves all once and reads them again. Whatever fails
before the save leaves the saved settings as they were.
"""

from collections.abc import Callable, Collection, Generator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from bridge.fc.fc_settings import Cause, SettingRefusal
from bridge.fc.session import FcSession
from bridge.model.settings import BoardSetting, SettingTable, Value
from bridge.settings.board_settings import READ_WITHIN_S, BoardSettings, OnTable
from bridge.settings.parameter_names import LONGEST, parameter_names
from bridge.settings.setting_work import Answer
from bridge.voice import sentences
from protocols.param_file import is_equal

_MOST_NAMES = 8
_NO_BOARD = SettingRefusal(Cause.NO_LINK, sentences.NO_SETTINGS())
#: Reasons why a save was not started.
_BEFORE_SAVE = (Cause.ARMED, Cause.OCCUPIED, Cause.LIMIT, Cause.NO_LINK)
_RUNNING = SettingRefusal(Cause.OCCUPIED, sentences.RESTORE_RUNS())


@dataclass(frozen=True, slots=True)
class PlannedChange:
    """A setting that the restore writes."""

    name: str
    was: Value
    becomes: Value


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A setting that the restore cannot write. held: the value on the board, or None if the board lacks it."""

    name: str
    wanted: Value
    held: Value | None
    why: str


@dataclass(frozen=True, slots=True)
class RestorePlan:
    """notice: a warning, or empty."""

    changes: tuple[PlannedChange, ...]
    left_out: tuple[LeftOut, ...]
    notice: str = ""


def plan_restore(
    wanted: Mapping[str, Value], source: str, table: SettingTable, board: str
) -> RestorePlan | SettingRefusal:
    """Compare the wanted settings with the board's. source, board: their firmware and version; source "": unknown.

    Settings of another firmware are refused: equal names may mean something else there.
    """
    source = source.strip()
    if source and source.partition(" ")[0] != board.partition(" ")[0]:
        return SettingRefusal(Cause.REFUSED, sentences.OTHER_FIRMWARE(source, board))
    changes: list[PlannedChange] = []
    left_out: list[LeftOut] = []
    for name, value in wanted.items():
        setting = table.settings.get(name)
        if setting is None:
            left_out.append(LeftOut(name, value, None, "the board has no such setting"))
            continue
        becomes = setting.parse(value)
        if becomes is None:
            left_out.append(LeftOut(setting.name, value, setting.value, setting.wanted_text))
        elif is_equal(setting.value, becomes):
            continue
        elif why := _refusal(setting, becomes):
            left_out.append(LeftOut(setting.name, becomes, setting.value, why))
        else:
            changes.append(PlannedChange(setting.name, setting.value, becomes))
    if not wanted.keys() & table.settings.keys():
        return SettingRefusal(Cause.REFUSED, sentences.NONE_OF_THESE())
    is_other = source not in ("", board)
    notice = f"The settings are from {source}, but the board has {board}: some may have another meaning there"
    return RestorePlan(tuple(changes), tuple(left_out), notice if is_other else "")


def _refusal(setting: BoardSetting, value: Value) -> str:
    """The reason why the board would not take the value, or empty if it would."""
    if setting.fixed:
        return setting.fixed
    if not setting.accepts(value):
        return f"it must be {setting.range_text}"
    return setting.raised if setting.raised and float(value) > float(setting.value) else ""


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
    """The values by known settings, for files with names of parameters, or of Betaflight's command line (p_roll)."""
    pids = {f"{name[-1]}_{name[:-2]}".upper(): name for name in known if name[-2:-1] == "_"}
    names = {**pids, **parameter_names(known), **{name.upper(): name for name in known if len(name) > LONGEST}}
    return {name if name in known else names.get(name.upper(), name): value for name, value in values.items()}


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
        self._is_restoring = False
        self.change, self.save = settings.change, settings.save

    def reset(self) -> None:
        """Forget a restore that ended with a fault."""
        self._is_restoring = False

    @property
    def kind(self) -> str | None:
        """The board's firmware and the version, or None without a board."""
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

        is_checked: read the board's first, if it is disarmed, else they are compared as last read.
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
            read(self._settings.known.table or _NO_BOARD, now)

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
        refused = self._settings.obstacle() or (_RUNNING if self._is_restoring else None)
        if refused is not None:
            on_done(refused, now)
            return
        self._is_restoring = True
        plan = partial(self.plan, wanted, source)
        self._go_on(_restore(self._settings, plan, client, progress), on_done, None, now)

    def _go_on(self, steps: "_Steps", on_done: OnRestored, answer: object, now: float) -> None:
        """Take the next step. Each goes on with the answer."""
        try:
            step = steps.send(answer)
        except StopIteration as end:
            self._is_restoring = False
            on_done(end.value, now)
        else:
            step(lambda result, at: self._go_on(steps, on_done, result, at), now)


#: Starts something, and gets a function for the answer.
_Step = Callable[[Callable[[Any, float], None], float], None]
_Steps = Generator[_Step, Any, RestoreResult | SettingRefusal]


def _restore(settings: BoardSettings, make_plan: _Step, client: str, progress: Callable[[int], None]) -> _Steps:
    """One restore. client: the name in the log."""
    plan: RestorePlan | SettingRefusal = yield make_plan
    if isinstance(plan, SettingRefusal):
        return plan
    changed: list[PlannedChange] = []
    left_out = [*plan.left_out]

    def ended(text: str, *, is_saved: bool = False) -> RestoreResult:
        return RestoreResult(is_saved, text, tuple(change.name for change in changed), tuple(left_out))

    def stopped(why: str) -> RestoreResult:
        if not changed:
            return ended(f"Nothing written: {why}")
        written = f"{len(changed)} of {len(plan.changes)} settings were changed in the board's memory"
        names = _listed([change.name for change in changed])
        go_back = "to return to the saved settings, switch the board off and on"
        return ended(f"Nothing saved: {why}. {written} ({names}): {go_back}")

    def missed(table: SettingTable | SettingRefusal) -> str:
        """The settings that the board does not hold as planned, or empty if it holds all."""
        known = {} if isinstance(table, SettingRefusal) else table.settings
        names = [
            each.name
            for each in changed
            if each.name not in known or not is_equal(known[each.name].value, each.becomes)
        ]
        return f"{_listed(names)} {'has' if len(names) == 1 else 'have'} another value" if names else ""

    for change in plan.changes:
        result: Answer = yield partial(settings.change, change.name, change.becomes, client=client)
        if not isinstance(result, SettingRefusal):
            changed.append(change)
            progress(len(changed))
        elif result.cause is Cause.FIXED:
            # The board accepts other values of this setting, but not this one.
            left_out.append(LeftOut(change.name, change.becomes, change.was, result.text))
        else:
            return stopped(result.text)
    if not changed:
        text = f"Nothing written: {_count(left_out)} cannot be set" if left_out else "Nothing to restore"
        return ended(text, is_saved=not left_out)
    # A later change may have had an effect on an earlier one, or another client may have changed it.
    read_again = partial(settings.current, within_s=READ_WITHIN_S)
    if why := missed((yield read_again)):
        return stopped(why)
    refused: Answer = yield settings.save
    if isinstance(refused, SettingRefusal) and refused.cause in _BEFORE_SAVE:
        return stopped(f"the save failed ({refused.text})")
    if isinstance(refused, SettingRefusal):
        # Also if the firmware has corrected a value after the save.
        return ended(f"Perhaps not saved: {refused.text}. The board has the old or the new settings")
    table: SettingTable | SettingRefusal = yield read_again
    if isinstance(table, SettingRefusal) or not settings.is_checked:
        return ended(f"{_count(changed)} saved, but they could not be read back: compare them later")
    if why := missed(table):
        return ended(f"Saved, but now {why}")
    more = f", {len(left_out)} left out" if left_out else ""
    return ended(f"{_count(changed)} restored, saved and verified{more}", is_saved=True)


def _count(settings: Sequence[object]) -> str:
    return "1 setting" if len(settings) == 1 else f"{len(settings)} settings"


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _MOST_NAMES
    return ", ".join(names[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")
