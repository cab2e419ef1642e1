# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/zenoh-payloads.md, from the published schemas (`make zenoh-schemas`)."""

import textwrap
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

from generators.zenoh_schemas import object_schema, schemas
from payloads.keys import KEYS
from payloads.mission_data import Json

PAGE = Path(__file__).parents[1] / "docs" / "zenoh-payloads.md"
_HEAD = """\
<!-- made by: make zenoh-schemas -->
# Payloads over zenoh

The fields of each payload of [zenoh](zenoh.md), from the JSON Schemas in
[`payloads/schemas/`](../payloads/schemas/). "?": null if the value is unknown or the flight controller
cannot measure it. Ignore unknown fields: new fields do not change the version.

Every payload begins with the first three; those of `v1/telemetry/`, except link, end with the last:
"""
_WIDTH = 100
#: A command's reply is described in docs/zenoh.md: one of several objects.
_SCHEMAS = {name: schema for name, schema in schemas().items() if "properties" in schema}
_COMMON = ("v", "seq", "time_s")
_AGE = "age_s"
#: Objects within payloads, by the name of the field that holds them.
_INNER = {
    "items": "item",
    "sent": "item",
    "stored": "item",
    "findings": "finding",
    "missions": "stored mission",
    "mission": "mission",
    "settings": "settings",
    "last_heard": "last heard",
    "events": "event",
}
_TYPES = {
    "number": "number",
    "integer": "integer",
    "string": "text",
    "boolean": "true/false",
    "object": "object",
}
_NULL = {"type": "null"}


def page() -> str:
    """The whole page."""
    payloads = {_heading(key.suffix): (key.suffix, _SCHEMAS[key.schema]) for key in KEYS if key.schema in _SCHEMAS}
    common = {name: _SCHEMAS["attitude"]["properties"][name] for name in (*_COMMON, _AGE)}
    parts = [_HEAD, *_fields(common)]
    inner: dict[str, Json] = {}
    for heading, (suffix, schema) in payloads.items():
        fields = {name: field for name, field in schema["properties"].items() if name not in common}
        objects = {_INNER[name]: _object_in(field) for name, field in fields.items() if name in _INNER}
        inner |= {name: found for name, found in objects.items() if "properties" in found and name not in payloads}
        what = textwrap.fill(f"`{suffix}`. {schema['description']}", _WIDTH)
        parts += ["", f"## {heading}", "", what, "", *_fields(fields)]
    for name, schema in inner.items():
        parts += ["", f"## {name}", "", *_fields(schema["properties"])]
    return "\n".join(parts) + "\n"


def _heading(suffix: str) -> str:
    return suffix.partition("/")[2].removeprefix("telemetry/")


def _fields(fields: Json) -> Iterator[str]:
    """A line for each field. Neighbours with the same type and meaning share it."""
    for (kind, meaning), names in groupby(
        fields, lambda name: (_type(name, fields[name]), fields[name].get("description", ""))
    ):
        known = [", ".join(f"`{name}`" for name in names), kind, *([meaning] if meaning else [])]
        yield f"- {': '.join([' '.join(known[:2]), *known[2:]])}"


def _object_in(field: Json) -> Json:
    found = object_schema(field)
    inner: Json = found.get("items", found)
    return inner


def _type(name: str, field: Json) -> str:
    mark = "?" if _may_be_null(field) else ""
    if "properties" in _object_in(field):
        link = f"[{_INNER.get(name, name)}](#{_INNER.get(name, name).replace(' ', '-')})"
        return f"list of {link}{mark}" if "items" in object_schema(field) else f"{link}{mark}"
    if "const" in field:
        return str(field["const"])
    if "enum" in field:
        *others, last = map(str, field["enum"])
        return f"{', '.join(others)} or {last}"
    if "items" in object_schema(field):
        return f"list of {_type(name, _object_in(field))}s{mark}".replace("?s", "s?")
    if "anyOf" in field:
        return " or ".join(_type(name, each) for each in field["anyOf"] if each != _NULL) + mark
    kinds = field["type"] if isinstance(field["type"], list) else [field["type"]]
    return " or ".join(_TYPES[kind] for kind in kinds if kind != "null") + mark


def _may_be_null(field: Json) -> bool:
    return _NULL in field.get("anyOf", ()) or "null" in field.get("type", ())


if __name__ == "__main__":
    PAGE.write_text(page())
