# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of many vehicles: read, compared, and what a file would change."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import zenoh

from fleet.payload import decode, part, text
from fleet.session import NO_COMMANDS, ask_each
from payloads.keys import SETTINGS_LIST, SETTINGS_PLAN
from payloads.mission_data import Json
from payloads.settings_comparison import SettingValues, setting_values
from protocols.param_file import is_equal

#: INAV's table takes some seconds.
_TIMEOUT_S = 40.0


@dataclass(slots=True)
class HeldSettings:
    """One vehicle's settings. board: the firmware and its version. error: why they are not known."""

    vehicle: str
    board: str = ""
    values: SettingValues = field(default_factory=dict)
    error: str | None = NO_COMMANDS


@dataclass(frozen=True, slots=True)
class SettingVariant:
    """A value of a setting, and the vehicles that have it. None: they lack it."""

    value: float | str | None
    vehicles: tuple[str, ...]


@dataclass(slots=True)
class SettingsTrial:
    """The plan of a restore on one vehicle; `plan`: of SettingsApi.plan, None with an error."""

    vehicle: str
    plan: Json | None = None
    error: str | None = NO_COMMANDS


def read_settings(session: zenoh.Session, prefix: str, names: Collection[str]) -> list[HeldSettings]:
    """Each vehicle's settings, checked against its flight controller unless it is armed."""
    found = {name: HeldSettings(name) for name in names}
    for name, reply in ask_each(session, prefix, names, SETTINGS_LIST.suffix, _TIMEOUT_S):
        if reply is None:
            continue
        result, found[name].error = _result(reply)
        if result is None:
            continue
        try:
            found[name].values = setting_values(part(result, "values"))
            found[name].board = text(result, "board") or ""
        except ValueError as error:
            found[name].error = f"this version does not understand its reply: {error}"
    return list(found.values())


def try_settings(session: zenoh.Session, prefix: str, names: Collection[str], file: bytes) -> list[SettingsTrial]:
    """The plans of restoring this .param file, for each vehicle."""
    trials = {name: SettingsTrial(name) for name in names}
    for name, reply in ask_each(session, prefix, names, SETTINGS_PLAN.suffix, _TIMEOUT_S, file):
        if reply is not None:
            result, trials[name].error = _result(reply)
            trials[name].plan = result
    return list(trials.values())


def variants(held: Sequence[HeldSettings]) -> dict[str, list[SettingVariant]]:
    """The settings in which vehicles differ, by name, the most common value first.

    A setting that a vehicle lacks is a difference only from vehicles with the same firmware and version.
    """
    found: dict[str, list[SettingVariant]] = {}
    for name in dict.fromkeys(name for each in held for name in each.values):
        groups: list[tuple[float | str | None, list[str]]] = []
        boards = {each.board for each in held if name in each.values}
        for each in held:
            if name not in each.values and each.board not in boards:
                continue
            value = each.values.get(name)
            group = next((names for known, names in groups if _is_same(known, value)), None)
            if group is None:
                groups.append((value, [each.vehicle]))
            else:
                group.append(each.vehicle)
        if len(groups) > 1:
            groups.sort(key=lambda group: -len(group[1]))
            found[name] = [SettingVariant(value, tuple(names)) for value, names in groups]
    return found


def _is_same(value: float | str | None, other: float | str | None) -> bool:
    return value is other or (value is not None and other is not None and is_equal(value, other))


def _result(reply: zenoh.Reply) -> tuple[Json | None, str | None]:
    """The result in a reply, or the error."""
    answer = reply.ok or reply.err
    data = None if answer is None else decode(answer)
    result = None if data is None else part(data, "result")
    if reply.ok is not None and isinstance(result, dict):
        return result, None
    return None, (None if data is None else text(data, "error")) or "this version does not understand its reply"
