# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes schemas/*.json, the published JSON Schema of each key, from the payload types.

Run by `make zenoh-schemas`. A test checks that the files are up to date.
"""

import inspect
import json
import types
from dataclasses import is_dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from payloads.keys import VERSION
from payloads.mission_data import Json
from payloads.overview import CBOR_NUMBERS, Overview
from protocols.mission_item import MissionItem
from reports import vehicle_groups as groups
from reports.finding import Finding
from reports.vehicle_groups import Group, VehicleReport
from reports.verdict import FlownLeg
from storage.mission_store import MissionSummary

SCHEMAS = Path(__file__).parents[1] / "payloads" / "schemas"
_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_TYPES = {float: "number", int: "integer", str: "string", bool: "boolean", types.NoneType: "null"}
_ENVELOPE: Json = {
    "v": {"const": VERSION, "description": "the version of keys and payloads"},
    "seq": {
        "type": "integer",
        "minimum": 0,
        "description": "counts the key's samples from 0 since the daemon's start: a gap is a loss, a step back a "
        "restart; a reply has the number of the last sample",
    },
    "time_s": {
        "type": "number",
        "description": "when the bridge made the sample, seconds since 1970 (UTC); see time_source in the state",
    },
}
_NUMBER: Json = {"type": ["number", "null", "string"], "description": "null: not given; inf or -inf as text"}
_PLACE: Json = {"type": ["integer", "null"], "description": "degrees * 1e7; null: not given"}
_MAV_NUMBER: Json = {"type": "integer", "description": "MAVLink's number"}
_ITEM_FIELDS: Json = {
    **dict.fromkeys(("command", "frame"), _MAV_NUMBER),
    **dict.fromkeys(("p1", "p2", "p3", "p4"), _NUMBER),
    **dict.fromkeys(("lat_e7", "lon_e7"), _PLACE),
    "alt_m": _NUMBER,
}
_COUNT: Json = {
    "type": ["integer", "null"],
    "minimum": 0,
    "description": "records; on a Harakiri home is one; null: not known",
}
_CHECKSUM: Json = {"type": "string", "pattern": "^[0-9a-f]{8}$", "description": "CRC-32 over the records"}
_SENT_SEQS: Json = {
    "type": "array",
    "items": {"type": ["integer", "null"]},
    "description": "for each stored item, its number as sent; null: inserted",
}
_FINDING_FIELDS = {
    "seq": "the item as sent; null: the whole list",
    "field": "of the item, or count",
    "was": "as sent; null: not given",
    "becomes": "as stored; or dropped (the item), rejected or cleared (the list)",
    "why": "the reason",
    "command": "the item's MAV_CMD",
    "news": "its importance to the pilot",
}
_SUMMARY_FIELDS = {
    "source": "the sender",
    "verdict": "of the rules",
    "item_count": "as received",
    "finding_count": "without filled-in defaults",
    "record_count": "for the flight controller; on a Harakiri home is one",
    "detail": "the reason for the outcome",
}
_WHAT = {
    "state": "The whole vehicle: the newest values of every group.",
    "overview": "The state in 80 bytes, for programs that watch thousands of vehicles: always CBOR, whole numbers. "
    "null: not known, or stale.",
    "event": "An event, as in the daemon's log.",
    "mission_current": "The flight controller's mission. All fields are null while it is unknown.",
    "mission_list": "The stored missions, newest first.",
    "mission_report": "The result of an upload.",
}


def schemas() -> dict[str, Json]:
    """The schema of each payload, by file name."""
    items = {"type": "array", "items": _of(MissionItem) | {"properties": _fields(MissionItem) | _ITEM_FIELDS}}
    findings = {
        "type": "array",
        "items": _object(_described(_fields(Finding), _FINDING_FIELDS)),
        "description": "every changed value, dropped item or reason for a refusal",
    }
    upload = {
        "ack": {"type": "string", "pattern": "^MAV_MISSION_", "description": "MAVLink's result"},
        "text": {"type": "string", "description": "the result in a sentence, with the reason for a refusal"},
        "verdict": {"enum": ["ACCEPTED", "CLEARED", "REJECTED"], "description": "of the rules"},
        "findings": findings,
        "sent": items | {"description": "as received"},
        "stored": items | {"description": "as the flight controller holds them"},
        "sent_seqs": _SENT_SEQS,
        "mission": {"type": ["integer", "null"], "description": "its number in the store; null: it is not stored"},
    }
    made = {group.value: _fields(_group(group.value)) for group in Group}
    made["state"] = {
        "vehicle": {"type": "string", "description": "its name, as in the key"},
        "others_of_this_name": {
            "type": "integer",
            "minimum": 0,
            "description": "other bridges that use it: normally 0",
        },
        "time_source": {
            "type": "string",
            "description": "ntp: the Pi's clock was set over the network since the start; pi: it may be hours off",
        },
        **_fields(VehicleReport),
    }
    made["overview"] = _fields(Overview)
    made["event"] = {
        "level": {"enum": ["debug", "info", "warning", "error"]},
        "event": {
            "type": "string",
            "pattern": r"^[a-z0-9_]+(\.[a-z0-9_]+)+$",
            "description": "its name in the log; gcs.text: a text shown on ground stations",
        },
        "facts": {
            "type": "object",
            "additionalProperties": {"type": ["string", "number", "boolean", "null"]},
            "description": "as in the log",
        },
    }
    made["mission_current"] = {
        "count": _COUNT,
        "checksum": _CHECKSUM | {"type": ["string", "null"]},
        "items": items | {"type": ["array", "null"], "description": "as read back, numbered like that"},
    }
    summary = _described(_fields(MissionSummary), _SUMMARY_FIELDS) | {"checksum": _CHECKSUM}
    for name in ("received_at", "concluded_at"):
        summary[f"{name}_s"] = summary.pop(name) | {"description": "seconds since 1970 (UTC)"}
    missions = {"missions": {"type": "array", "items": _object(summary), "description": "newest first"}}
    made["mission_list"] = missions
    made["mission_report"] = upload | {"source": {"type": "string", "description": "the sender"}}
    files = {name: _file(name, _ENVELOPE | body) for name, body in made.items()}
    files["command_reply"] = _reply(_object(upload, required=("ack", "text")), items, findings)
    for name, number in CBOR_NUMBERS.items():
        files["overview"]["properties"][name] |= {"cborKey": number}
    return files


def object_schema(schema: Json) -> Json:
    """The object's schema, possibly one of several types."""
    for choice in schema.get("anyOf", ()):
        if "properties" in choice or "items" in choice:
            found: Json = choice
            return found
    return schema


def _reply(upload: Json, items: Json, findings: Json) -> Json:
    check = _object(
        {
            "result": {"enum": ["ACCEPTED", "CLEARED", "REJECTED"]},
            "ack": {"type": "string", "pattern": "^MAV_MISSION_"},
            "items": items | {"description": "as they would be read back"},
            "sent_seqs": _SENT_SEQS,
            "records": {"type": "array", "items": {"type": "string", "pattern": "^([0-9a-f]{2})+$"}},
            "count": {"type": "integer", "minimum": 0, "description": "of the records"},
            "checksum": _CHECKSUM,
            "findings": findings,
            "flight": {"type": "string", "description": "its length, heights and end in words"},
            "path": {"type": "array", "items": _of(FlownLeg), "description": "the legs flown, in m and degrees * 1e7"},
            "assumed": {"type": "string", "description": "what the rules had to assume about board and craft"},
        }
    )
    status = {"type": "object", "required": ["state"], "description": "as `naze-bridge status --json`"}
    count = {"type": "integer", "minimum": 0}
    error = {"type": "string", "description": "the reason, one sentence"}
    return {
        "$schema": _DIALECT,
        "title": "@cmd",
        "oneOf": [
            _object({"progress": count, "of": count}),
            _object({"result": {"anyOf": [upload, check, status]}}),
            _object({"error": error, "result": upload}, required=("error",)),
        ],
    }


def _file(name: str, properties: Json) -> Json:
    what = _WHAT.get(name) or inspect.getdoc(_group(name))
    return {"$schema": _DIALECT, "title": name, "description": what, **_object(properties)}


def _group(name: str) -> type:
    found: type = getattr(groups, name.capitalize())
    return found


def _described(properties: Json, descriptions: dict[str, str]) -> Json:
    more = {name: properties[name] | {"description": text} for name, text in descriptions.items()}
    return properties | more


def _object(properties: Json, required: tuple[str, ...] | None = None) -> Json:
    must = list(properties) if required is None else list(required)
    return {"type": "object", "properties": properties, "required": must}


def _fields(kind: type) -> Json:
    return {name: _of(hint) for name, hint in get_type_hints(kind, include_extras=True).items()}


def _of(hint: Any) -> Json:
    """The schema of a type."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _of(arguments[0]) | {"description": arguments[1]}
    if is_dataclass(hint):
        return _object(_fields(hint))  # type: ignore[arg-type]
    if origin in (Union, types.UnionType):
        several = [_of(argument) for argument in arguments]
        if all(list(each) == ["type"] for each in several):
            return {"type": [each["type"] for each in several]}
        return {"anyOf": several}
    if origin is tuple:
        return {"type": "array", "items": _of(arguments[0])}
    if issubclass(hint, Enum):
        return {"enum": [each.value for each in hint]}
    return {"type": _TYPES[hint]}


def text(schema: Json) -> str:
    return json.dumps(schema, indent=2) + "\n"


def write() -> None:
    SCHEMAS.mkdir(exist_ok=True)
    for name, schema in schemas().items():
        (SCHEMAS / f"{name}.json").write_text(text(schema))


if __name__ == "__main__":
    write()
