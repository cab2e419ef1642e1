# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures as a table for people, and as JSON for comparing runs."""

import json
import platform
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from benchmarks.figure import Figure
from benchmarks.processes import RESULTS, ROOT

_WIDTH_IN_FILES = 150


def print_table(figures: Sequence[Figure]) -> None:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("Figure")
    table.add_column("Measured", justify="right", no_wrap=True)
    table.add_column("Floor", justify="right", no_wrap=True)
    table.add_column("the cost of")
    table.add_column("Ratio", justify="right")
    table.add_column("Target", justify="right", no_wrap=True)
    table.add_column("")
    for figure in figures:
        table.add_row(
            figure.name,
            _amount(figure.value, figure.unit),
            _amount(figure.floor.value, figure.unit) if figure.floor else "",
            figure.floor.of if figure.floor else "",
            "" if figure.ratio is None else f"{figure.ratio:.2f}",
            _target(figure),
            _judgement(figure),
        )
    Console(width=None if sys.stdout.isatty() else _WIDTH_IN_FILES).print(table)


def keep_json(figures: Sequence[Figure], load: float) -> Path:
    """Write the figures, and the machine's load before, to a new file below benchmarks/results; returns its path."""
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / time.strftime("%Y-%m-%dT%H-%M-%S.json")
    commit = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False)  # noqa: S607
    result = {
        "commit": commit.stdout.strip() or None,
        "python": platform.python_version(),
        "machine": f"{platform.machine()}, {platform.system()} {platform.release()}",
        "load_before": load,
        "figures": [asdict(figure) | {"ratio": figure.ratio, "missed": figure.is_missed} for figure in figures],
    }
    path.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    return path


def _amount(value: float, unit: str) -> str:
    digits = f"{value:.0f}" if value == int(value) or value >= 1000 else f"{value:.3g}"
    return f"{digits} {unit}".rstrip()


def _target(figure: Figure) -> str:
    if figure.limit is None:
        return ""
    return f"<= {figure.limit:.2f} floors" if figure.times_floor else f"<= {_amount(figure.limit, figure.unit)}"


def _judgement(figure: Figure) -> Text:
    if figure.limit is None:
        return Text("")
    return Text("MISSED", style="bold red") if figure.is_missed else Text("ok", style="green")
