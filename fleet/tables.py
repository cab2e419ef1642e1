# SPDX-License-Identifier: GPL-3.0-or-later
"""The fleet, and the progress and result of a push to it, as tables for a terminal."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager

from rich import box
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
_NUMBERS = ("Battery", "Latitude", "Longitude", "Height", "Records")
_FOLDED = ("Vehicle", "Details")
_LISTED = ("Vehicle", "Speaks", "Armed", "Battery", "Latitude", "Longitude", "Height", "Mission")
_WATCHED = ("Vehicle", "Armed", "Battery", "Height", "Mission", "Problem, or mode")
_LINKED = ("MSP", "MAVLink")


def _table(*titles: str, caption: Text | None = None) -> Table:
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False, caption=caption, caption_justify="left")
    for title in titles:
        is_folded, is_number = title in _FOLDED, title in _NUMBERS
        table.add_column(title, justify="right" if is_number else "left", no_wrap=not is_folded, overflow="fold")
    return table


def watch_lines(fleet: Iterable[FleetVehicle]) -> list[str]:
    """Counts, then the armed vehicles, those with problems, and the others, each by name."""
    rows = sorted(fleet, key=lambda vehicle: (not vehicle.armed, not _problem(vehicle)))
    if not rows:
        return ["No vehicle is alive."]
    armed, troubled = sum(vehicle.armed is True for vehicle in rows), sum(bool(_problem(vehicle)) for vehicle in rows)
    return [f"{len(rows):,} vehicles, {armed:,} armed, {troubled:,} with problems", "", *fleet_lines(rows, _WATCHED)]


def _problem(vehicle: FleetVehicle) -> str:
    """The reason why it needs attention, or empty."""
    if vehicle.bridges > 1:
        return f"{vehicle.bridges} bridges use this name"
    if not vehicle.answers:
        return "does not answer"
    return "" if vehicle.protocol in _LINKED else "no flight controller"


def fleet_lines(fleet: Sequence[FleetVehicle], titles: Sequence[str] = _LISTED) -> Iterator[str]:
    """A line for each vehicle. A Table of thousands would take seconds."""
    cells = map(_cells, fleet)
    rows = [list(titles), *([known[title] for title in titles] for known in cells)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        placed = zip(titles, row, widths, strict=True)
        aligned = (cell.rjust(width) if title in _NUMBERS else cell.ljust(width) for title, cell, width in placed)
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


def _cells(vehicle: FleetVehicle) -> dict[str, str]:
    """By title."""
    mission = _UNKNOWN
    if vehicle.mission_count is not None:
        mission = f"{vehicle.mission_count:3} {vehicle.mission_checksum}" if vehicle.mission_count else "none"
    return {
        "Vehicle": vehicle.name,
        "Speaks": vehicle.protocol or _UNKNOWN,
        "Armed": {True: "ARMED", False: "no", None: _UNKNOWN}[vehicle.armed],
        "Battery": _number(vehicle.battery_v, ".1f", " V"),
        "Latitude": _number(vehicle.lat_deg, ".5f"),
        "Longitude": _number(vehicle.lon_deg, ".5f"),
        "Height": _number(vehicle.height_m, ".0f", " m"),
        "Mission": mission,
        "Problem, or mode": _problem(vehicle) or vehicle.mode or _UNKNOWN,
    }


def _number(value: float | None, form: str, unit: str = "") -> str:
    return _UNKNOWN if value is None else f"{value:{form}}{unit}"


@contextmanager
def push_bar() -> Iterator[Callable[[FleetPush], None]]:
    """Show the count of finished vehicles as a bar on standard error, if that is a terminal."""
    with progress_bars(console(to_error=True)) as bars:
        task = bars.add_task("")

        def show(now: FleetPush) -> None:
            count, failed = len(now.vehicles), len(now.failed)
            title = f"Vehicles, {failed} failed" if failed else "Vehicles"
            bars.update(task, description=title, completed=count - len(now.waiting), total=count)

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
