# SPDX-License-Identifier: GPL-3.0-or-later
"""The fleet, and the progress and result of a push to it, as tables for a terminal."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager

from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TaskID, TextColumn
from rich.progress import Progress as Bars
from rich.table import Table
from rich.text import Text

from bridge.model.finding import without_defaults
from service.cli.fleet.payload import text
from service.cli.fleet.push import FleetPush, PushState
from service.cli.fleet.trial import Trial
from service.cli.fleet.vehicle import FleetVehicle
from service.daemon.mission_data import Json

_UNKNOWN = "-"
_ANSWERS = {
    True: Text("yes", style="green"),
    False: Text("no", style="bold red"),
    None: Text("not known", style="yellow"),
}


def _table(caption: Text | None = None) -> Table:
    padding = (0, 1, 0, 0)
    return Table(box=box.SIMPLE_HEAD, padding=padding, show_edge=False, caption=caption, caption_justify="left")


def watch_table(rows: Sequence[tuple[FleetVehicle, float | None, str]]) -> Table:
    """One row per bridge, each on one line of 80 columns: vehicle, age of its state, problem."""
    table = _table()
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
    caption = Text("".join(f"\n{line}" for line in complaints(fleet)), style="yellow")
    table = _table(caption)
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


@contextmanager
def progress_bars(item_count: int) -> Iterator[Callable[[FleetPush], None]]:
    """Show the count of finished vehicles and a progress bar per transfer on standard error, if that is a terminal."""
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn())
    console = Console(stderr=True)
    with Bars(*columns, console=console, transient=True, disable=not console.is_terminal) as bars:
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


def push_table(fleet: FleetPush) -> Table:
    table = _table()
    table.add_column("Vehicle", overflow="fold")
    table.add_column("Push", no_wrap=True)
    table.add_column("Details")
    for progress in fleet.vehicles.values():
        table.add_row(Text(progress.vehicle), _result(progress), Text(_words(progress)))
    return table


def _result(progress: PushState) -> Text:
    if progress.error is not None:
        return Text("failed", style="bold red")
    if progress.is_done:
        return Text("verified", style="green")
    return Text("in progress" if progress.is_begun else "not started", style="yellow")


def dry_run_table(trials: Sequence[Trial]) -> Table:
    """One row per vehicle, and below them the corrections, once for all vehicles that would hold the same records."""
    corrections = {
        trial.checksum: [finding.text() for finding in without_defaults(trial.findings)]
        for trial in trials
        if trial.is_taken
    }
    lines = [line for checksum, said in corrections.items() if said for line in ("", f"Stored as {checksum}:", *said)]
    return _trial_table(trials, "Accepts it", lambda trial: (trial.is_taken, ""), "\n".join(lines))


def verify_table(trials: Sequence[Trial]) -> Table:
    """One row per vehicle: whether it holds the mission, and if not, what it holds instead."""
    return _trial_table(trials, "Holds it", lambda trial: (trial.is_held, "" if trial.is_held else _held(trial)))


def _held(trial: Trial) -> str:
    if trial.held_count is None:
        return "its mission is not known"
    return f"holds {trial.held_count} records, {trial.held}" if trial.held_count else "holds no mission"


def _trial_table(
    trials: Sequence[Trial], question: str, answer: Callable[[Trial], tuple[bool | None, str]], caption: str = ""
) -> Table:
    table = _table(Text(caption))
    table.add_column("Vehicle", overflow="fold")
    table.add_column("Records", justify="right", no_wrap=True)
    table.add_column("Checksum", no_wrap=True)
    table.add_column(question, no_wrap=True)
    table.add_column("Details")
    for trial in trials:
        known, details = answer(trial)
        count = "" if trial.count is None else str(trial.count)
        row = (Text(trial.vehicle), count, trial.checksum or "", _ANSWERS[known], Text(trial.error or details))
        table.add_row(*row)
    return table


def push_data(fleet: FleetPush) -> Json:
    return {
        "vehicles": [
            {"vehicle": each.vehicle, "ok": each.result is not None, "error": each.error, "result": each.result}
            for each in fleet.vehicles.values()
        ],
        "failed": len(fleet.failed),
    }


def push_summary(fleet: FleetPush) -> str:
    count, failed = len(fleet.vehicles), len(fleet.failed)
    held = sum(each.result is not None for each in fleet.vehicles.values())
    return f"{held} of {count} vehicles hold the mission, verified" + (f"; {failed} failed" if failed else "")


def _words(progress: PushState) -> str:
    if progress.error is not None:
        return progress.error
    if progress.result is None:
        return f"{progress.records} of {progress.total} records" if progress.total else ""
    findings = progress.result.get("findings")
    count = len(findings) if isinstance(findings, list) else 0
    corrections = f"; {count} correction{'s' if count > 1 else ''}" if count else ""
    return (text(progress.result, "text") or "") + corrections
