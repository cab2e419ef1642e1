# SPDX-License-Identifier: GPL-3.0-or-later
"""Conditions of --where, as in `armed=true` or `battery_v<10.5`."""

import operator
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields
from fnmatch import fnmatchcase
from typing import Any, get_args

from fleet.vehicle import FleetVehicle

Condition = Callable[[FleetVehicle], bool]


#: With the type of a known value: of `float | None`, float.
FIELDS: dict[str, Any] = {each.name: (*get_args(each.type), each.type)[0] for each in fields(FleetVehicle)}
del FIELDS["session_id"]
_FORM = re.compile(r"\s*(?P<field>\w+)\s*(?P<sign>!=|<=|>=|=|<|>)\s*(?P<value>.*?)\s*")
_SIGNS: dict[str, Callable[[Any, Any], bool]] = {
    "=": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_TRUTH = {"true": True, "yes": True, "false": False, "no": False}


def parse_condition(text: str) -> Condition:
    """Read one condition. ValueError gives the reason. An unknown value satisfies only !=."""
    match = _FORM.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not a condition: write one like armed=true or battery_v<10.5")
    name, sign, value = match["field"], match["sign"], match["value"]
    kind = FIELDS.get(name)
    if kind is None:
        raise ValueError(f"vehicles have no {name!r}, only {', '.join(FIELDS)}")
    wanted, compare = _wanted(name, kind, sign, value)

    def holds(vehicle: FleetVehicle) -> bool:
        found = getattr(vehicle, name)
        return compare(found, wanted) if found is not None else sign == "!="

    return holds


def matching(fleet: Iterable[FleetVehicle], conditions: Sequence[Condition]) -> list[FleetVehicle]:
    return [vehicle for vehicle in fleet if all(condition(vehicle) for condition in conditions)]


def _wanted(name: str, kind: type, sign: str, value: str) -> tuple[Any, Callable[[Any, Any], bool]]:
    if kind is str:
        if sign not in ("=", "!="):
            raise ValueError(f"{name} is text: compare it with = or !=")
        return value, fnmatchcase if sign == "=" else lambda found, wanted: not fnmatchcase(found, wanted)
    if kind is bool:
        if value not in _TRUTH or sign not in ("=", "!="):
            raise ValueError(f"{name} is true or false, as in {name}=true")
        return _TRUTH[value], _SIGNS[sign]
    try:
        return float(value), _SIGNS[sign]
    except ValueError:
        raise ValueError(f"{name} is a number, but {value!r} is not") from None
