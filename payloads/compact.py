# SPDX-License-Identifier: GPL-3.0-or-later
"""The compact encoding: CBOR with a number per field instead of its name, half the size of JSON.

The numbers are part of the published schemas (`cborKey`), so that a reader needs only these files. A field keeps its
number as long as the keys keep their version; a reader ignores unknown numbers.
"""

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import cbor2

from payloads.mission_data import Json

SCHEMAS = Path(__file__).parent / "schemas"
#: The schema field with a property's number.
CBOR_KEY = "cborKey"


def dumps(schema: str, body: Json) -> bytes:
    """Encode a payload; `schema`: the name of its file."""
    return cbor2.dumps(_shortened(body, read_schema(schema)))


def loads(schema: str, data: bytes) -> Any:
    """Decode a payload; ValueError or cbor2.CBORError if that is impossible."""
    return _lengthened(cbor2.loads(data), read_schema(schema))


@cache
def read_schema(name: str) -> Json:
    """Read a published schema; ValueError if the name is unknown."""
    path = SCHEMAS / f"{name}.json"
    if path.parent != SCHEMAS or not path.is_file():
        raise ValueError(f"there is no schema {name!r}")
    schema: Json = json.loads(path.read_text())
    return schema


def object_schema(schema: Json) -> Json:
    """The object's schema, possibly one of several types."""
    for choice in schema.get("anyOf", ()):
        if "properties" in choice or "items" in choice:
            found: Json = choice
            return found
    return schema


def _shortened(value: Any, schema: Json) -> Any:
    schema = object_schema(schema)
    if isinstance(value, dict) and (properties := schema.get("properties")):
        return {properties[name][CBOR_KEY]: _shortened(each, properties[name]) for name, each in value.items()}
    if isinstance(value, list) and (items := schema.get("items")):
        return [_shortened(each, items) for each in value]
    return value


def _lengthened(value: Any, schema: Json) -> Any:
    schema = object_schema(schema)
    if isinstance(value, Mapping) and (properties := schema.get("properties")):
        names = {each[CBOR_KEY]: name for name, each in properties.items()}
        return {names[key]: _lengthened(each, properties[names[key]]) for key, each in value.items() if key in names}
    if isinstance(value, list) and (items := schema.get("items")):
        return [_lengthened(each, items) for each in value]
    return value
