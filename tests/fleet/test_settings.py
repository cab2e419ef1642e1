# SPDX-License-Identifier: GPL-3.0-or-later
"""The differences between the settings of many vehicles."""

from fleet.settings import HeldSettings, SettingVariant, variants


def held(vehicle: str, board: str, **values: float | str) -> HeldSettings:
    return HeldSettings(vehicle, board, values, None)


def test_the_most_common_value_comes_first() -> None:
    found = variants([held("a", "X 1", p=1.0, q=2.0), held("b", "X 1", p=3.0, q=2.0), held("c", "X 1", p=3.0, q=2.0)])
    assert found == {"p": [SettingVariant(3.0, ("b", "c")), SettingVariant(1.0, ("a",))]}


def test_a_missing_setting_is_a_difference_only_on_the_same_firmware() -> None:
    found = variants([held("a", "X 1", p=1.0), held("b", "X 1"), held("c", "Y 1")])
    assert found == {"p": [SettingVariant(1.0, ("a",)), SettingVariant(None, ("b",))]}
    assert variants([held("a", "X 1", p=1.0), held("c", "Y 1")]) == {}


def test_single_precision_is_not_a_difference() -> None:
    assert variants([held("a", "X 1", p=0.1), held("b", "X 1", p=0.10000000149011612)]) == {}


def test_without_vehicles_there_are_no_differences() -> None:
    assert variants([]) == {}
