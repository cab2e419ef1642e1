# SPDX-License-Identifier: GPL-3.0-or-later
"""Vehicles in the order of their names."""

from fleet.vehicle import in_order


def test_numbers_in_names_are_ordered_by_value() -> None:
    names = ["kite-10", "kite-2", "2kites", "kite", "kite-02b", "Kite-1"]
    assert sorted(names, key=in_order) == ["2kites", "Kite-1", "kite", "kite-2", "kite-02b", "kite-10"]
