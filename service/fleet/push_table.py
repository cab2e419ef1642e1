# SPDX-License-Identifier: GPL-3.0-or-later
"""How a push to the fleet goes, and how it went, for a terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
from rich.progress import Progress as Bars
from rich.table import Table
from rich.text import Text

from service.fleet.payload import text
from service.fleet.push import FleetPush, PushState
from service.mission_data import Json


@contextmanager
def progress_bars(fleet: FleetPush, item_count: int) -> Iterator[Callable[[FleetPush], None]]:
    """Show a bar for each vehicle on standard error, if that is a terminal, as long as the push runs."""
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn())
    console = Console(stderr=True)
    with Bars(*columns, console=console, transient=True, disable=not console.is_terminal) as bars:
        tasks = {name: bars.add_task(name, total=item_count) for name in fleet.vehicles}

        def show(now: FleetPush) -> None:
            for name, progress in now.vehicles.items():
                total = progress.total or item_count
                bars.update(tasks[name], completed=total if progress.result else progress.records, total=total)

        yield show


def push_table(fleet: FleetPush) -> Table:
    """Make one row per vehicle: what came of it, and why."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)
    table.add_column("Vehicle", overflow="fold")
    table.add_column("Push", no_wrap=True)
    table.add_column("What it says")
    for progress in fleet.vehicles.values():
        result = Text("failed", style="bold red") if progress.has_failed else Text("verified", style="green")
        table.add_row(Text(progress.vehicle), result, Text(_words(progress)))
    return table


def push_data(fleet: FleetPush) -> Json:
    """Return what came of it as plain data."""
    return {
        "vehicles": [
            {"vehicle": each.vehicle, "ok": not each.has_failed, "error": each.error, "result": each.result}
            for each in fleet.vehicles.values()
        ],
        "failed": len(fleet.failed),
    }


def push_summary(fleet: FleetPush) -> str:
    """Return one line."""
    count, failed = len(fleet.vehicles), len(fleet.failed)
    return f"{count - failed} of {count} vehicles hold the mission, verified" + (f"; {failed} failed" if failed else "")


def _words(progress: PushState) -> str:
    if progress.error is not None:
        return progress.error
    assert progress.result is not None
    findings = progress.result.get("findings")
    count = len(findings) if isinstance(findings, list) else 0
    corrections = f"; {count} correction{'s' if count > 1 else ''}" if count else ""
    return (text(progress.result, "text") or "") + corrections
