# SPDX-License-Identifier: GPL-3.0-or-later
"""The compact encoding is lossless, its numbers are unique, and a new field changes none."""

import json
from contextlib import suppress
from pathlib import Path
from typing import Any

import cbor2
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generators.zenoh_schemas import numbered
from payloads import compact
from payloads.compact import CBOR_KEY, SCHEMAS

NAMES = sorted(path.stem for path in SCHEMAS.iterdir() if path.stem != "command_reply")
NUMBERS = st.none() | st.floats(allow_nan=False) | st.integers(-(2**63), 2**63) | st.booleans() | st.text(max_size=9)


def payloads(schema: dict[str, Any]) -> st.SearchStrategy[Any]:
    """Payloads with a schema's fields and arbitrary values."""
    inner = compact.object_schema(schema)
    if "properties" in inner:
        fields = st.fixed_dictionaries({}, optional={key: payloads(each) for key, each in inner["properties"].items()})
        return fields if inner is schema else st.none() | fields
    if "items" in inner:
        return st.none() | st.lists(payloads(inner["items"]), max_size=3)
    return NUMBERS


@pytest.mark.parametrize("name", NAMES)
def test_a_payload_is_decoded_unchanged(name: str) -> None:
    @given(payloads(compact.read_schema(name)))
    def round_trip(payload: Any) -> None:
        assert compact.loads(name, compact.dumps(name, payload)) == payload

    round_trip()


def objects(schema: Any) -> list[dict[str, Any]]:
    if isinstance(schema, list):
        return [found for each in schema for found in objects(each)]
    if not isinstance(schema, dict):
        return []
    own = [schema["properties"]] if isinstance(schema.get("properties"), dict) else []
    return own + [found for each in schema.values() for found in objects(each)]


@pytest.mark.parametrize("name", NAMES)
def test_each_field_has_a_unique_number(name: str) -> None:
    for properties in objects(json.loads((SCHEMAS / f"{name}.json").read_text())):
        numbers = [each[CBOR_KEY] for each in properties.values()]
        assert len(set(numbers)) == len(numbers)


def test_a_new_field_changes_no_number() -> None:
    published = compact.read_schema("position")
    first = next(iter(published["properties"]))
    wanted = published | {"properties": {"new": {"type": "number"}, **published["properties"]}}
    after = numbered(wanted, published)["properties"]
    assert {name: each[CBOR_KEY] for name, each in after.items() if name != "new"} == {
        name: each[CBOR_KEY] for name, each in published["properties"].items()
    }
    assert after["new"][CBOR_KEY] == max(each[CBOR_KEY] for each in published["properties"].values()) + 1
    assert first in after


def test_an_unknown_number_is_kept() -> None:
    assert compact.loads("battery", cbor2.dumps({99: "news", 3: 11.1})) == {"voltage_v": 11.1}


@given(st.binary(max_size=60))
def test_garbage_is_a_value_error(data: bytes) -> None:
    with suppress(ValueError, RecursionError, cbor2.CBORError):
        compact.loads("state", data)


@pytest.mark.parametrize("name", ["", "nothing", "../keys", "/etc/passwd", "state/../state"])
def test_a_missing_schema_is_a_value_error(name: str) -> None:
    with pytest.raises(ValueError, match="no schema"):
        compact.read_schema(name)
    assert Path(SCHEMAS).is_dir()
