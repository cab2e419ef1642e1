# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of a fleet: problems of a vehicle are named, and a summary counts every one."""

import io

from rich.console import Console

from fleet.tables import complaints, fleet_lines, fleet_table
from fleet.vehicle import FleetVehicle, as_fleet


def shown(table: object) -> str:
    console = Console(file=io.StringIO(), width=100)
    console.print(table)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_problems_are_named_once_for_each_name() -> None:
    fleet = as_fleet(
        [
            FleetVehicle("naze-10", "1", answers=True, armed=True, battery_v=11.1),
            FleetVehicle("naze-2", "2", answers=True),
            FleetVehicle("naze-2", "3", answers=True),
            FleetVehicle("owl", "4"),
        ]
    )
    text = shown(fleet_table(fleet))
    assert text.index("naze-2 ") < text.index("naze-10")
    assert "11.1" in text
    assert [line.partition(":")[0] for line in complaints(fleet)] == [
        "naze-2",
        "1 of 4 vehicles are alive, but did not answer",
    ]


def test_thousands_of_vehicles_are_listed_in_columns() -> None:
    fleet = [FleetVehicle("a-long-name", "1", True, protocol="MSP", armed=True), FleetVehicle("owl", "2")]
    title, first, second = fleet_lines(fleet)
    assert title.split() == ["Vehicle", "Speaks", "Armed", "Battery", "Latitude", "Longitude", "Height", "Mission"]
    assert [first.index("MSP"), first.index("ARMED"), second.index("-")] == [
        title.index("Speaks"),
        title.index("Armed"),
        title.index("Speaks"),
    ]
