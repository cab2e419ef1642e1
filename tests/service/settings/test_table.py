# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample file has every setting."""

import tomllib
from dataclasses import fields
from pathlib import Path

from generators.config_sample import sample
from service.settings import Settings
from service.settings.table import KEYS
from tests.service.settings.test_load import load

REPOSITORY = Path(__file__).parents[3]


def test_the_sample_is_up_to_date_and_has_the_defaults(folder: Path) -> None:
    checked_in = (REPOSITORY / "examples" / "config.toml").read_text()
    assert checked_in == sample(), "run make config-sample"
    assert load(folder, checked_in) == load(folder, "")


def test_every_line_of_the_sample_is_valid(folder: Path) -> None:
    lines = [line.removeprefix("#") for line in sample().splitlines() if line and not line.startswith("# ")]
    text = "\n".join(line for line in lines if not line.startswith(("config_file", "key_file")))
    assert load(folder, text).zenoh is not None
    tables = tomllib.loads("\n".join(lines))
    named = {name for name, value in tables.items() if not isinstance(value, dict)}
    named |= {f"{table}.{name}" for table, inner in tables.items() if isinstance(inner, dict) for name in inner}
    assert named == {key.name for key in KEYS}


def test_every_key_has_a_field_and_a_meaning() -> None:
    names = {field.name for field in fields(Settings)}
    assert {key.name.partition(".")[0] for key in KEYS} == names - {"access", "sources"}
    assert all(key.meaning.endswith(".") for key in KEYS)
