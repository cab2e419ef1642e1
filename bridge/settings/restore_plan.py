# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan of a restore: which settings it would write, and which it cannot write, with the reasons."""

from collections.abc import Mapping
from dataclasses import dataclass

from bridge.fc.fc_settings import Cause, SettingRefusal
from bridge.model.board_setting import BoardSetting, SettingTable, Value, ValueKind
from protocols.param_file import is_equal, shown_value


@dataclass(frozen=True, slots=True)
class PlannedChange:
    """A setting that the restore writes."""

    name: str
    was: Value
    becomes: Value


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A setting that the restore cannot write. held: its value on the board; None: the board lacks it."""

    name: str
    wanted: Value
    held: Value | None
    why: str


@dataclass(frozen=True, slots=True)
class RestorePlan:
    """notice: a warning; empty if there is nothing to warn of."""

    changes: tuple[PlannedChange, ...]
    left_out: tuple[LeftOut, ...]
    notice: str = ""


def plan_restore(
    wanted: Mapping[str, Value], source: str, table: SettingTable, board: str
) -> RestorePlan | SettingRefusal:
    """Compare the wanted settings with the board's. source, board: their firmware and version; source "": unknown.

    Settings of another firmware are refused: equal names may mean something else there.
    """
    if source and source.split()[0] != board.split()[0]:
        return SettingRefusal(Cause.REFUSED, f"These settings are from {source}, but the board has {board}")
    changes: list[PlannedChange] = []
    left_out: list[LeftOut] = []
    settings = table.find_all(wanted)
    for name, value in wanted.items():
        setting = settings.get(name)
        if setting is None:
            left_out.append(LeftOut(name, value, None, "the board has no such setting"))
            continue
        becomes = _of_kind(setting, value)
        if is_equal(setting.value, becomes):
            continue
        if why := _refusal(setting, becomes):
            left_out.append(LeftOut(setting.name, becomes, setting.value, why))
        else:
            changes.append(PlannedChange(setting.name, setting.value, becomes))
    if not settings:
        return SettingRefusal(Cause.REFUSED, f"The board ({board}) has none of these settings")
    is_other = source not in ("", board)
    notice = f"The settings are from {source}, the board has {board}: some may mean something else there"
    return RestorePlan(tuple(changes), tuple(left_out), notice if is_other else "")


def _refusal(setting: BoardSetting, value: Value) -> str:
    """The reason why the board would not take the value; empty if it would."""
    if setting.fixed:
        return setting.fixed
    if not setting.accepts(value):
        return f"it must be {setting.range_text}"
    return setting.raised if setting.raised and float(value) > float(setting.value) else ""


def _of_kind(setting: BoardSetting, value: Value) -> Value:
    """The value as the setting's kind: a file may have the text "5" as a number."""
    return shown_value(value) if setting.kind is ValueKind.TEXT else value
