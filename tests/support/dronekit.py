# SPDX-License-Identifier: GPL-3.0-or-later
"""The real DroneKit 2.9, adapted here because it was written for Python before 3.10."""

import collections
import collections.abc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

collections.MutableMapping = collections.abc.MutableMapping  # type: ignore[attr-defined]
# It needs one name from the package `future`, but does not require it.
_PAST = ModuleType("past.builtins")
_PAST.basestring = str  # type: ignore[attr-defined]
sys.modules.setdefault("past", ModuleType("past"))
sys.modules.setdefault("past.builtins", _PAST)

import dronekit  # noqa: E402
from dronekit import Command, connect  # noqa: E402

#: Raised by `upload` and `wait_ready`.
GaveUp = dronekit.TimeoutError


@contextmanager
def vehicle_at(port: int) -> Iterator[Any]:
    """Connect as in DroneKit's examples; return the Vehicle."""
    vehicle = connect(f"udpout:127.0.0.1:{port}", wait_ready=True, timeout=60)
    try:
        yield vehicle
    finally:
        vehicle.close()


def command(number: int, lat_deg: float, lon_deg: float, height_m: float) -> Any:
    """A Command with altitude relative to home."""
    return Command(0, 0, 0, 3, number, 0, 0, 0, 0, 0, 0, lat_deg, lon_deg, height_m)
