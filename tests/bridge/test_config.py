# SPDX-License-Identifier: GPL-3.0-or-later
"""A field of BridgeSettings is all that a setting of the bridge needs: it follows from the file to the bridge."""

from dataclasses import Field, fields
from enum import Enum
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest

from bridge.config import BridgeConfig, BridgeSettings
from service.daemon import daemon as daemon_module
from service.machine import event_loop
from service.settings import load_settings

_HINTS = get_type_hints(BridgeSettings, include_extras=True)


def another_value(field: Field[Any]) -> tuple[str, object]:
    """A value other than the default, as in a file and as it is used."""
    kind, *notes = get_args(_HINTS[field.name])
    if kind is bool:
        return str(not field.default).lower(), not field.default
    if issubclass(kind, Enum):
        other = next(each for each in kind if each is not field.default)
        return f'"{other.value}"', other
    (numbers,) = (note for note in notes if isinstance(note, range))
    return str(numbers[-1]), numbers[-1]


@pytest.mark.parametrize("field", fields(BridgeSettings), ids=lambda field: field.name)
def test_a_setting_of_the_bridge_reaches_it_from_the_file(
    field: Field[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text, value = another_value(field)
    config = tmp_path / "config.toml"
    config.write_text(f"{field.name} = {text}\n")
    settings = load_settings(config, fc="sim:", state_dir=tmp_path / "state")
    made: list[BridgeConfig] = []

    def note(*arguments: Any, **named: Any) -> BridgeConfig:
        made.append(BridgeConfig(*arguments, **named))
        return made[-1]

    async def start() -> None:
        monkeypatch.setattr(daemon_module, "BridgeConfig", note)
        daemon_module.Daemon(settings)

    event_loop.run(start())
    assert getattr(made[0].settings, field.name) == value != field.default
