# SPDX-License-Identifier: GPL-3.0-or-later
"""QGroundControl's .plan and Mission Planner's .mission (JSON; docs.qgroundcontrol.com, "Plan File Format").

A fence and rally points next to a mission are ignored with a note.
An item's frame and params are as QGroundControl would send them; AltitudeMode only records their origin.
Surveys and corridor scans list the plain items they are flown as; these are read. The planned home position becomes
item 0, as QGroundControl sends it to an ArduPilot vehicle.
"""

import json
import math
from collections.abc import Iterator, Sequence
from typing import Any

from protocols.mission_file.error import MissionFileError, Note, file_degrees_to_e7, no_note, refuse_other_plans
from protocols.mission_item import Command, Frame, MissionItem
from protocols.plain_text import shown
from protocols.remedies import Fault

_PARAM_COUNT = 7
_VERSIONS = (1,)
#: Mission Planner leaves it at 0.
_MISSION_VERSIONS = (2, 1, 0)
#: MAV_AUTOPILOT_ARDUPILOTMEGA and MAV_TYPE_QUADROTOR, as which the bridge appears to QGroundControl.
_ARDUPILOT, _QUADROTOR = 3, 2


def read_qgc_plan(text: str, name: str, note: Note = no_note) -> list[MissionItem]:
    """Read the items, home first. MissionFileError names the file and the entry of mission.items, from 1."""
    plan = _parse(text, name)
    if not isinstance(plan, dict) or plan.get("fileType") not in ("Plan", None):
        raise _not_a_plan(name, "", 'this is not a QGroundControl plan, its fileType is not "Plan"')
    _refuse_unknown_version(plan.get("version", _VERSIONS[0]), _VERSIONS, "the plan", name)
    mission = plan.get("mission")
    entries = mission.get("items") if isinstance(mission, dict) else None
    if not isinstance(mission, dict) or not isinstance(entries, list):
        raise _not_a_plan(name, "", "the plan has no mission.items")
    _refuse_unknown_version(mission.get("version", _MISSION_VERSIONS[0]), _MISSION_VERSIONS, "its mission", name)
    other = _other_parts(plan)
    if other and not entries:
        raise MissionFileError(name, "", *Fault.OTHER_PLAN(kinds=f"{other} but not a mission"))
    if other:
        note(f"the plan also contains {other}: ignored")
    if plan.get("fileType") is None:
        note("read as Mission Planner's own JSON: it has no fileType")
    items = [_home(mission.get("plannedHomePosition"), name)]
    for number, entry in enumerate(entries, start=1):
        where = f"item {number}"
        for simple in _simple_items(entry, name, where):
            items.append(_item(simple, len(items), name, where))
    refuse_other_plans([item.command for item in items[1:]], name)
    return items


def _refuse_unknown_version(version: Any, known: tuple[int, ...], what: str, name: str) -> None:
    if version not in known:
        found = Fault.PLAN_VERSION(what=what, version=shown(version), known=" and ".join(map(str, known)))
        raise MissionFileError(name, "", *found)


def _other_parts(plan: dict[str, Any]) -> str:
    """The non-empty parts of a plan other than the mission."""
    parts = {"a fence": ("geoFence", "circles", "polygons", "polygon"), "rally points": ("rallyPoints", "points")}
    found = []
    for what, (part, *lists) in parts.items():
        held = plan.get(part)
        if isinstance(held, dict) and any(held.get(each) for each in lists):
            found.append(what)
    return " and ".join(found)


def write_qgc_plan(items: Sequence[MissionItem]) -> str:
    """The items as a file's text, the first as the planned home. `read_qgc_plan` reads the same again."""
    home = [_degrees(items[0].lat_e7), _degrees(items[0].lon_e7), items[0].alt_m] if items else [0, 0, 0]
    mission = {
        "version": 2,
        "firmwareType": _ARDUPILOT,
        "vehicleType": _QUADROTOR,
        "cruiseSpeed": 15,
        "hoverSpeed": 5,
        "plannedHomePosition": [value if value and math.isfinite(value) else 0 for value in home],
        "items": [_entry(item) for item in items[1:]],
    }
    parts = {"geoFence": {"circles": [], "polygons": [], "version": 2}, "rallyPoints": {"points": [], "version": 2}}
    plan = {"fileType": "Plan", "version": 1, "groundStation": "naze-bridge", "mission": mission, **parts}
    return json.dumps(plan, indent=4, allow_nan=False) + "\n"


def _entry(item: MissionItem) -> dict[str, Any]:
    values = (item.p1, item.p2, item.p3, item.p4, _degrees(item.lat_e7), _degrees(item.lon_e7), item.alt_m)
    params = [None if value is None or not math.isfinite(value) else value for value in values]
    return {
        "type": "SimpleItem",
        "autoContinue": True,
        "doJumpId": item.seq,
        "command": item.command,
        "frame": item.frame,
        "params": params,
    }


def _degrees(e7: int | None) -> float | None:
    return None if e7 is None else e7 / 1e7


def _not_a_plan(name: str, where: str, why: str) -> MissionFileError:
    return MissionFileError(name, where, *Fault.NOT_A_PLAN(why=why))


def _parse(text: str, name: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise _not_a_plan(name, f"line {error.lineno}", f"not valid JSON ({error.msg})") from None
    except (ValueError, RecursionError):  # a number of thousands of digits; thousands of brackets
        raise _not_a_plan(name, "", "not a plan written by QGroundControl") from None


def _home(position: Any, name: str) -> MissionItem:
    """Make item 0. An unknown ground level (null) is 0. A missing position is left to the rules."""
    where = "plannedHomePosition"
    coordinates = position if position is not None else []
    if not isinstance(coordinates, list) or len(coordinates) not in (0, 2, 3):
        raise _not_a_plan(name, where, f"{shown(position)} instead of [latitude, longitude, altitude]")
    numbers = [_number(value, name, where) for value in coordinates]
    lat, lon, alt_m = (*numbers, *[math.nan] * 3)[:3]
    return MissionItem(
        seq=0,
        command=int(Command.NAV_WAYPOINT),
        frame=int(Frame.GLOBAL),
        p1=0.0,
        p2=0.0,
        p3=0.0,
        p4=0.0,
        lat_e7=file_degrees_to_e7(lat, "the latitude", name, where),
        lon_e7=file_degrees_to_e7(lon, "the longitude", name, where),
        alt_m=0.0 if math.isnan(alt_m) else alt_m,
    )


def _simple_items(entry: Any, name: str, where: str) -> Iterator[dict[str, Any]]:
    kind = entry.get("type") if isinstance(entry, dict) else None
    if kind == "SimpleItem" or (kind is None and isinstance(entry, dict) and "coordinate" in entry):
        yield entry
    elif kind == "ComplexItem":
        transects = entry.get("TransectStyleComplexItem")
        flown_as = transects.get("Items") if isinstance(transects, dict) else None
        if not isinstance(flown_as, list) or not all(isinstance(item, dict) for item in flown_as):
            raise MissionFileError(name, where, *Fault.SURVEY_WITHOUT_ITEMS(kind=shown(entry.get("complexItemType"))))
        yield from flown_as
    else:
        raise _not_a_plan(name, where, "its type is neither SimpleItem nor ComplexItem")


def _item(entry: dict[str, Any], seq: int, name: str, where: str) -> MissionItem:
    params = entry.get("params")
    coordinate = entry.get("coordinate")
    if isinstance(params, list) and isinstance(coordinate, list):
        # Mission Planner's .mission stores the place separately.
        params = params[:4] + coordinate
    if not isinstance(params, list) or len(params) != _PARAM_COUNT:
        raise _not_a_plan(name, where, f"it lacks a list of {_PARAM_COUNT} params")
    command = _integer(entry, "command", 65535, name, where)
    frame = _integer(entry, "frame", 255, name, where)
    p1, p2, p3, p4, lat, lon, alt_m = (_number(param, name, where) for param in params)
    lat_e7 = file_degrees_to_e7(lat, "params[4], the latitude,", name, where)
    lon_e7 = file_degrees_to_e7(lon, "params[5], the longitude,", name, where)
    return MissionItem(seq, command, frame, p1, p2, p3, p4, lat_e7, lon_e7, alt_m)


def _integer(entry: dict[str, Any], key: str, highest: int, name: str, where: str) -> int:
    value = entry.get(key)
    if type(value) is int and 0 <= value <= highest:
        return value
    raise MissionFileError(name, where, *Fault.NOT_WHOLE(what=f"its {key}", text=shown(value), most=highest))


def _number(value: Any, name: str, where: str) -> float:
    """Return a JSON number. Null is NaN, "not given"."""
    if value is None:
        return math.nan
    if type(value) in (int, float):
        try:
            return float(value)
        except OverflowError:  # an integer beyond 1.8e308
            pass
    raise MissionFileError(name, where, *Fault.NOT_A_NUMBER(what="a value", text=shown(value)))
