# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge's settings on the page: those in force, and the file of those made there (page.toml).

Only settings with a choice of values: none of them names a file or an address, or lets anyone do more.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from payloads.mission_data import Json
from service.cli.helper.action import HelperRefusal, ThisPi
from service.cli.setup.change import Step, WriteFile
from service.cli.setup.steps import restart_changes
from service.machine.host import Host
from service.settings import load_settings
from service.settings.config_files import PAGE_FILE, read_files
from service.settings.key import Key
from service.settings.load import SERVICE_CONFIG, SERVICE_STATE
from service.settings.table import KEYS

_FILE = str(SERVICE_CONFIG.with_name(PAGE_FILE))
_HEAD = "# Written by the status page. setup.toml and config.toml, in this folder, override this.\n"
#: The label and the unit on the page.
_LABELS = {
    "sysid": ("MAVLink system id", ""),
    "takeoff_max_m": ("Highest take-off", "m"),
    "record_tlog": ("Record telemetry", ""),
    "tlog_total_mb": ("Size of all telemetry logs", "MB"),
    "log_level": ("Minimum log level", ""),
}
_KEYS: Mapping[str, Key] = {key.name: key for key in KEYS if key.name in _LABELS}


def page_settings(host: Host) -> list[Json]:
    """Each setting: label, choices, the value in force (None if the default), and the other file that decides it."""
    given = _given(host)
    return [_page_setting(key, *given.get(key.name, (None, _FILE))) for key in _KEYS.values()]


def _page_setting(key: Key, value: object, where: str) -> Json:
    choices = key.reader.choices
    return {
        "name": key.name,
        "label": _LABELS[key.name][0],
        "unit": _LABELS[key.name][1],
        "meaning": key.meaning,
        "default": json.loads(key.default),
        "choices": {"least": choices[0], "most": choices[-1]} if isinstance(choices, range) else list(choices),
        "value": value if value is None or _is_choice(key, value) else str(value),
        "elsewhere": None if where.startswith(_FILE) else where,
    }


def change_settings(pi: ThisPi, *, values: dict) -> Json:  # type: ignore[type-arg]  # its contents are checked here
    """Write the settings, if all files together can then be used. The bridge takes them over.

    `values`: by name, each one of the setting's choices, or None if the default.
    """
    host, given = pi.host, _given(pi.host)
    before = host.read(_FILE)
    chosen = {name: value for name, (value, where) in given.items() if where.startswith(_FILE)}
    for name, value in values.items():
        if name not in _KEYS:
            raise HelperRefusal("The page cannot change this setting.")
        if name in given and name not in chosen:
            raise HelperRefusal(
                f"{_LABELS[name][0]} is set in {given[name][1]}, which overrides the page: change it there."
            )
        chosen[name] = value
    kept = {name: value for name, value in chosen.items() if value is not None}
    if odd := [name for name, value in kept.items() if not _is_choice(_KEYS[name], value)]:
        raise HelperRefusal(f"{_LABELS[odd[0]][0]} cannot have this value. {_KEYS[odd[0]].meaning}")
    text = _HEAD + "".join(f"{name} = {json.dumps(value)}\n" for name, value in sorted(kept.items()))
    if text == before or (not kept and not before):
        return pi.shown([])
    load_settings(host.path(SERVICE_CONFIG), (), text, state_dir=host.path(SERVICE_STATE))
    return pi.make([Step("save the settings", [WriteFile(_FILE, text), *restart_changes(host)])])


def _given(host: Host) -> Mapping[str, tuple[Any, str]]:
    """The given settings by name: the value, and the file and line that decide."""
    found = read_files(host.path(SERVICE_CONFIG), [])
    return {
        name: (found[name].value, "/" + str(Path(found[name].where).relative_to(host.root)))
        for name in _KEYS
        if name in found
    }


def _is_choice(key: Key, value: object) -> bool:
    choices = key.reader.choices
    return type(value) is type(choices[0]) and value in choices
