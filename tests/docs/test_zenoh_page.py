# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/zenoh.md has every key with its delivery; docs/zenoh-payloads.md is up to date with the schemas."""

import re
from pathlib import Path

from generators.zenoh_page import PAGE as PAYLOADS
from generators.zenoh_page import page
from payloads.keys import KEYS, VERSION

PAGE = (Path(__file__).parents[2] / "docs" / "zenoh.md").read_text()
SECTIONS = dict(re.findall(r"^##+ ([^\n]*)\n(.*?)(?=^##+ |\Z)", PAGE, re.MULTILINE | re.DOTALL))


def test_the_table_has_every_key_and_the_version() -> None:
    """But commands, which have tables of their own."""
    rows = re.findall(r"^\| (`[^|]*`) \| .* \| ([^|]*) \|$", SECTIONS[f"Keys, version {VERSION}"], re.MULTILINE)
    documented = {suffix: delivery for names, delivery in rows for suffix in re.findall(r"`([^`]*)`", names)}
    keys = {key.suffix: key.delivery.value for key in KEYS if key.schema != "command_reply"}
    assert documented.keys() == {*keys, "@cmd/v1/..."}
    for suffix, delivery in keys.items():
        assert delivery.startswith(documented[suffix]), suffix


def test_every_command_is_described() -> None:
    text = SECTIONS["Push a mission"] + SECTIONS["Settings"]
    described = re.findall(r"^\| `(@cmd/[^`]*)` \|", text, re.MULTILINE)
    assert described == [key.suffix for key in KEYS if key.schema == "command_reply"]


def test_the_page_of_payloads_is_up_to_date() -> None:
    assert PAYLOADS.read_text() == page(), "run make zenoh-schemas"
