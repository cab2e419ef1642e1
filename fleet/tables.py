# SPDX-License-Identifier: GPL-3.0-or-later
"""The fleet, and the progress and result of a push to it, as tables for a terminal."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich import box
from rich.progress import TaskID
from rich.table import Table
from rich.text import Text

from fleet.missions import Trial
from fleet.payload import text
from fleet.push import FleetPush, PushState
from fleet.vehicle import FleetVehicle
from payloads.mission_data import Json
from terminal.printing import console, progress_bars

_UNKNOWN = "-"
#: The number of vehicles named if many have the same problem.
_NAMED = 5
_ANSWERS = {
    True: Text("yes", style="green"),
    False: Text("no", style="bold red"),
    None: Text("not known", style="yellow"),
}


#: Titles of columns whose cells are aligned to the right, and of those that may take several lines.
_NUMBERS = ("Battery", "Latitude", "Longitude", "Height", "Heard", "Records")
_FOLDED = ("Vehicle", "Details")
_LISTED = ("Vehicle", "Speaks", "Armed", "Battery", "Latitude", "Longitude", "Height", "Mission")


def _table(*titles: str, caption: Text | None = None) -> Table:
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False, caption=caption, caption_justify="left")
    for title in titles:
        is_folded, is_number = title in _FOLDED, title in _NUMBERS
        table.add_column(title, justify="right" if is_number else "left", no_wrap=not is_folded, overflow="fold")
    return table


def watch_table(rows: Sequence[tuple[FleetVehicle, float | None, str]]) -> Table:
    """One row per bridge, each on one line of 80 columns: vehicle, age of the state, problem."""
    table = _table("Vehicle", "Armed", "Battery", "Height", "Mission", "Heard", "Problem, or mode")
    for column in (table.columns[0], table.columns[-1]):
        column.no_wrap, column.overflow, column.max_width = True, "ellipsis", 20
    for vehicle, age_s, problem in rows:
        name, _, armed, battery, _, _, height, mission = _cells(vehicle)
        age = Text(_UNKNOWN if age_s is None else f"{age_s:.0f} s")
        last = Text(problem, style="yellow") if problem else Text(vehicle.mode or _UNKNOWN)
        table.add_row(name, armed, battery, height, mission, age, last)
    return table


def fleet_table(fleet: Sequence[FleetVehicle]) -> Table:
    table = _table(*_LISTED)
    for vehicle in fleet:
        table.add_row(*_cells(vehicle))
    return table


def fleet_lines(fleet: Sequence[FleetVehicle]) -> Iterator[str]:
    """The same table for thousands of vehicles, which a Table would take seconds for."""
    rows = [list(_LISTED), *([cell.plain for cell in _cells(vehicle)] for vehicle in fleet)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = zip(_LISTED, row, widths, strict=True)
        aligned = (cell.rjust(width) if title in _NUMBERS else cell.ljust(width) for title, cell, width in cells)
        yield " ".join(aligned).rstrip()


def complaints(fleet: Sequence[FleetVehicle]) -> list[str]:
    """The problems of the fleet, a line each."""
    lines = [
        f"{vehicle.name}: {vehicle.bridges} bridges use this name; give each its own (zenoh.vehicle)"
        for vehicle in fleet
        if vehicle.bridges > 1
    ]
    silent = [vehicle.name for vehicle in fleet if not vehicle.answers]
    if silent:
        count = f"{len(silent):,} of {len(fleet):,} vehicles"
        lines.append(f"{count} are alive, but did not answer: {in_few_words(silent)}")
    return list(dict.fromkeys(lines))


def in_few_words(names: Sequence[str]) -> str:
    """The first of these names."""
    return ", ".join(names[:_NAMED]) + ", ..." * (len(names) > _NAMED)


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


@contextmanager
def push_bars(item_count: int) -> Iterator[Callable[[FleetPush], None]]:
    """Show the count of finished vehicles and a progress bar per transfer on standard error, if that is a terminal."""
    with progress_bars(console(to_error=True)) as bars:
        # First, because only the last lines are cut off if there are more than the terminal has.
        whole_fleet = bars.add_task("")
        tasks: dict[str, TaskID] = {}

        def show(now: FleetPush) -> None:
            count, failed = len(now.vehicles), len(now.failed)
            title = f"Vehicles, {failed} failed" if failed else "Vehicles"
            bars.update(whole_fleet, description=title, completed=count - len(now.waiting), total=count)
            for name in tasks.keys() - now.running:
                bars.remove_task(tasks.pop(name))
            for name in now.running:
                if name not in tasks:
                    tasks[name] = bars.add_task(name)
                progress = now.vehicles[name]
                bars.update(tasks[name], completed=progress.records, total=progress.total or item_count)

        yield show


def push_table(fleet: FleetPush, what: str) -> Table:
    table = _table("Vehicle", what, "Details")
    for progress in fleet.vehicles.values():
        table.add_row(Text(progress.vehicle), _result(progress), Text(_words(progress)))
    return table


def _result(progress: PushState) -> Text:
    if progress.is_left_out:
        return Text("not started", style="yellow")
    if progress.error is not None:
        return Text("failed", style="bold red")
    if progress.is_done:
        return Text("verified", style="green")
    return Text("in progress" if progress.is_begun else "not started", style="yellow")


def dry_run_table(trials: Sequence[Trial]) -> Table:
    """One row per vehicle, and below them the corrections, once for all vehicles that would hold the same records."""
    corrections = {trial.checksum: trial.corrections for trial in trials if trial.is_accepted}
    lines = [line for checksum, said in corrections.items() if said for line in ("", f"Stored as {checksum}:", *said)]
    table = _table("Vehicle", "Records", "Checksum", "Accepts it", "Details", caption=Text("\n".join(lines)))
    for trial in trials:
        count = "" if trial.count is None else str(trial.count)
        answer = _ANSWERS[trial.is_accepted]
        table.add_row(Text(trial.vehicle), count, trial.checksum or "", answer, Text(trial.error or ""))
    return table


def verify_table(trials: Sequence[Trial]) -> Table:
    """One row per vehicle: the mission that it holds, and if that is another, how it would hold the file."""
    table = _table("Vehicle", "Records", "Checksum", "Holds it", "Details")
    for trial in trials:
        wanted = f"the file would be {trial.count} records, {trial.checksum}"
        details = trial.error or ("" if trial.is_held else wanted)
        held = ("", "not known") if trial.held_count is None else (str(trial.held_count), trial.held or "")
        if trial.held_count == 0:
            held = ("0", "none")
        table.add_row(Text(trial.vehicle), *held, _ANSWERS[trial.is_held], Text(details))
    return table


def push_data(fleet: FleetPush) -> Json:
    return {
        "vehicles": [
            {"vehicle": each.vehicle, "ok": each.result is not None, "error": each.error, "result": each.result}
            for each in fleet.vehicles.values()
        ],
        "failed": len(fleet.failed),
        "not_started": len(fleet.left_out),
    }


def push_summary(fleet: FleetPush, held_words: str) -> str:
    count, failed, left_out = len(fleet.vehicles), len(fleet.failed), len(fleet.left_out)
    held = sum(each.result is not None for each in fleet.vehicles.values())
    more = (f"; {failed} failed" if failed else "") + (f"; {left_out} not started" if left_out else "")
    return f"{held} of {count} vehicles {held_words}, verified{more}"


def _words(progress: PushState) -> str:
    if progress.error is not None:
        return progress.error
    if progress.result is None:
        return f"{progress.records} of {progress.total} records" if progress.total else ""
    findings = progress.result.get("findings")
    count = len(findings) if isinstance(findings, list) else 0
    corrections = f"; {count} correction{'s' if count > 1 else ''}" if count else ""
    return (text(progress.result, "text") or "") + corrections
