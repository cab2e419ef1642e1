# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m benchmarks [NAME...]`: measures, prints a table, saves it as JSON; exits 1 if a limit is exceeded."""

import logging
import os
import signal
import sys
from collections.abc import Callable

import structlog

from benchmarks import forward, idle, mission_planner, push
from benchmarks.figure import Figure
from benchmarks.report import keep_json, print_table

_BENCHMARKS: dict[str, Callable[[], list[Figure]]] = {
    "idle": idle.measure,
    "push": push.measure,
    "mission-planner": mission_planner.measure,
    "forward": forward.measure,
}


def main() -> int:
    """Run the named benchmarks, or all; returns the exit status."""
    names = sys.argv[1:] or list(_BENCHMARKS)
    unknown = [name for name in names if name not in _BENCHMARKS]
    if unknown:
        print(f"There is no benchmark {unknown[0]!r}; there are {', '.join(_BENCHMARKS)}.", file=sys.stderr)
        return 2
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(os.EX_TEMPFAIL))  # also ends the measured programs
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.ERROR))
    load, cores = os.getloadavg()[0], os.cpu_count() or 1
    if load > cores / 2:
        print(f"This machine is busy (load {load:.1f} on {cores} cores): the figures will be worse.")
    figures: list[Figure] = []
    for name in names:
        print(f"Measuring {name} ...", flush=True)
        figures += _BENCHMARKS[name]()
    print_table(figures)
    print(f"Saved in {keep_json(figures, load)}")
    missed = sum(figure.is_missed for figure in figures)
    if missed:
        print(f"{missed} targets missed")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
