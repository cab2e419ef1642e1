# SPDX-License-Identifier: GPL-3.0-or-later
"""The fleet as a table for a terminal."""

from collections.abc import Iterable, Sequence

from rich import box
from rich.table import Table
from rich.text import Text

from service.cli.fleet.vehicle import FleetVehicle

_UNKNOWN = "-"


def watch_table(rows: Sequence[tuple[FleetVehicle, float | None, str]]) -> Table:
    """One row per bridge, each on one line of 80 columns: vehicle, age of its state, problem."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)
    table.add_column("Vehicle", no_wrap=True, overflow="ellipsis", max_width=20)
    table.add_column("Armed", no_wrap=True)
    for title in ("Battery", "Height"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("Mission", no_wrap=True)
    table.add_column("Heard", justify="right", no_wrap=True)
    table.add_column("Problem, or mode", no_wrap=True, overflow="ellipsis", max_width=20)
    for vehicle, age_s, problem in rows:
        name, _, armed, battery, _, _, height, mission = _cells(vehicle)
        age = Text(_UNKNOWN if age_s is None else f"{age_s:.0f} s")
        last = Text(problem, style="yellow") if problem else Text(vehicle.mode or _UNKNOWN)
        table.add_row(name, armed, battery, height, mission, age, last)
    return table


def fleet_table(fleet: Sequence[FleetVehicle]) -> Table:
    """Make one row per bridge."""
    caption = Text("".join(f"\n{line}" for line in complaints(fleet)), style="yellow")
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False, caption=caption, caption_justify="left")
    table.add_column("Vehicle", overflow="fold")
    table.add_column("Speaks", no_wrap=True)
    table.add_column("Armed")
    for title in ("Battery", "Latitude", "Longitude", "Height"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("Mission", no_wrap=True)
    for vehicle in fleet:
        table.add_row(*_cells(vehicle))
    return table


def complaints(fleet: Iterable[FleetVehicle]) -> list[str]:
    """The problems of the fleet, a line each."""
    lines: dict[str, None] = {}
    for vehicle in fleet:
        if vehicle.bridges > 1:
            line = f"{vehicle.name}: {vehicle.bridges} bridges use this name; give each one its own (zenoh.vehicle)"
            lines[line] = None
        if not vehicle.answers:
            lines[f"{vehicle.name}: alive, but sends no state"] = None
    return list(lines)


def _cells(vehicle: FleetVehicle) -> list[Text]:
    armed = {True: Text("ARMED", style="bold red"), False: Text("no"), None: Text(_UNKNOWN)}[vehicle.armed]
    mission = _UNKNOWN
    if vehicle.mission_count is not None:
        mission = f"{vehicle.mission_count:3} {vehicle.mission_checksum}" if vehicle.mission_count else "none"
    return [
        Text(vehicle.name),
        Text(vehicle.protocol or _UNKNOWN),
        armed,
        _number(vehicle.battery_v, ".1f", " V"),
        _number(vehicle.lat_deg, ".5f"),
        _number(vehicle.lon_deg, ".5f"),
        _number(vehicle.height_m, ".0f", " m"),
        Text(mission),
    ]


def _number(value: float | None, form: str, unit: str = "") -> Text:
    return Text(_UNKNOWN if value is None else f"{value:{form}}{unit}")
