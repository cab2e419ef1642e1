# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of a fleet: problems of a vehicle are named, and a summary counts every one."""

from fleet.tables import complaints, fleet_lines, watch_lines
from fleet.vehicle import FleetVehicle, as_fleet


def test_problems_are_named_once_for_each_name() -> None:
    fleet = as_fleet(
        [
            FleetVehicle("naze-10", "1", answers=True, armed=True, battery_v=11.1),
            FleetVehicle("naze-2", "2", answers=True),
            FleetVehicle("naze-2", "3", answers=True),
            FleetVehicle("owl", "4"),
        ]
    )
    text = "\n".join(fleet_lines(fleet))
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


def test_watch_has_armed_vehicles_first_then_those_with_problems() -> None:
    fleet = as_fleet(
        [
            FleetVehicle("fine", "1", True, protocol="MSP", armed=False, mode="MANUAL"),
            FleetVehicle("flown", "2", True, protocol="MSP", armed=True, mode="AUTO"),
            FleetVehicle("lost", "3", True, protocol="searching"),
            FleetVehicle("mute", "4"),
            *(FleetVehicle("twin", each, True, protocol="MSP") for each in "56"),
        ]
    )
    head, _, _, *rows = watch_lines(fleet)
    assert head == "6 vehicles, 1 armed, 4 with problems"
    assert [row.split()[0] for row in rows] == ["flown", "lost", "mute", "twin", "twin", "fine"]
    ends = ["AUTO", "no flight controller", "does not answer", *["2 bridges use this name"] * 2, "MANUAL"]
    assert [row.endswith(end) for row, end in zip(rows, ends, strict=True)] == [True] * 6
    assert max(map(len, watch_lines(fleet))) <= 80
