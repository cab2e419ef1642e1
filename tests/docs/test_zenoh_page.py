# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/zenoh.md agrees with the code: every key and its delivery, and every field of every payload."""

import json
import re
from pathlib import Path

import pytest

from service.zenoh_link.compact import SCHEMAS as FOLDER
from service.zenoh_link.keys import KEYS, VERSION, ZenohKey

PAGE = (Path(__file__).parents[2] / "docs" / "zenoh.md").read_text()
SECTIONS = dict(re.findall(r"^##+ ([^\n]*)\n(.*?)(?=^##+ |\Z)", PAGE, re.MULTILINE | re.DOTALL))
SECTION_OF = {"mission_current": "mission/current", "mission_list": "mission/list", "mission_report": "mission/report",
              "command_reply": "Commands"}  # fmt: skip
ENVELOPE = {"v", "seq", "time_s"}


def test_the_table_has_every_key_and_its_version() -> None:
    rows = re.findall(r"^\| `([^`]*)` \| .* \| ([^|]*) \|$", SECTIONS[f"Keys, version {VERSION}"], re.MULTILINE)
    documented = {suffix: delivery for suffix, delivery in rows if not suffix.startswith("alive")}
    assert documented.keys() == {key.suffix for key in KEYS}
    for key in KEYS:
        assert key.delivery.value.startswith(documented[key.suffix]), key


@pytest.mark.parametrize("key", [key for key in KEYS if key.schema], ids=lambda key: key.suffix)
def test_each_field_is_on_the_page(key: ZenohKey) -> None:
    assert key.schema is not None
    schema = json.loads((FOLDER / f"{key.schema}.json").read_text())
    section = SECTIONS[SECTION_OF.get(key.schema, key.schema)] + SECTIONS["Payloads"]
    for name, field in schema.get("properties", {}).items():
        is_group = name in SECTIONS
        assert is_group or f"`{name}`" in section, name
        for inner in field.get("items", {}).get("properties", {}):
            assert f"`{inner}`" in PAGE or f"`{inner.rstrip('1234')}1` to" in PAGE, inner


def test_the_groups_tables_list_existing_fields() -> None:
    for path in FOLDER.glob("*.json"):
        schema = json.loads(path.read_text())
        documented = set(re.findall(r"^\| `([a-z0-9_]+)` \| ", SECTIONS.get(path.stem, ""), re.MULTILINE))
        assert not documented or documented | ENVELOPE == schema["properties"].keys(), path.stem
