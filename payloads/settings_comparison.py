# SPDX-License-Identifier: GPL-3.0-or-later
"""Two tables of settings side by side: files, backups, flight controllers."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

from protocols.float32 import single
from protocols.param_file import MOST_SETTINGS, is_equal, is_setting_name

#: By name. A text where the setting is one.
SettingValues = Mapping[str, float | str]


@dataclass(frozen=True, slots=True)
class SettingRow:
    """A setting that differs. None if that side does not have it."""

    name: str
    left: float | str | None
    right: float | str | None


def settings_difference(left: SettingValues, right: SettingValues) -> list[SettingRow]:
    """The settings that differ, in the order of `left`, then those only in `right`."""
    rows = [SettingRow(name, value, right.get(name)) for name, value in left.items()]
    rows += [SettingRow(name, None, value) for name, value in right.items() if name not in left]
    return [row for row in rows if row.left is None or row.right is None or not is_equal(row.left, row.right)]


def setting_values(data: object) -> SettingValues:
    """Read a table of settings from plain data. ValueError gives the reason.

    Left out are settings that are NaN (null), and names that settings cannot have.
    """
    if not isinstance(data, dict):
        raise ValueError("settings must be an object")
    if len(data) > MOST_SETTINGS:
        raise ValueError(f"settings must be at most {MOST_SETTINGS}: no flight controller has more")
    data = {name: value for name, value in data.items() if value is not None and is_setting_name(name)}
    for name, value in data.items():
        is_number = isinstance(value, int | float) and not isinstance(value, bool) and isfinite(single(value))
        if not is_number and not isinstance(value, str):
            raise ValueError(f"the setting {name} must be a number or text")
    return {name: value if isinstance(value, str) else float(value) for name, value in data.items()}
