# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge's settings on the page: those in force, and the file of those made there (page.toml)."""

import tomllib
from pathlib import Path

from payloads.mission_data import Json, to_json
from service.cli.helper.action import HelperRefusal, ThisPi
from service.cli.setup.change import Machine, Run, Step, WriteFile
from service.cli.setup.steps import restart_changes
from service.machine.host import Host
from service.settings import load_settings
from service.settings.config_files import PAGE_FILE, read_files
from service.settings.load import SERVICE_CONFIG, SERVICE_STATE
from service.settings.table import KEYS

_FILE = str(SERVICE_CONFIG.with_name(PAGE_FILE))
_HEAD = "# Written by the status page. setup.toml, config.toml and conf.d, in this folder, override this.\n"
_RELOAD = ("systemctl", "reload", "naze-bridge.service")
_MAX_TEXT = 4096


def settings_in_force(host: Host) -> Json:
    """The given settings by name: each as in the configuration file, and the file and line that decide."""
    given = read_files(host.path(SERVICE_CONFIG), [])
    return {
        key.name: {"text": toml_text(given[key.name].value), "where": _on_machine(host, given[key.name].where)}
        for key in KEYS
        if key.name in given
    }


def known_settings() -> list[Json]:
    shown = ("name", "meaning", "default", "example", "is_live")
    return [{name: getattr(key, name) for name in shown} for key in KEYS]


def change_settings(pi: ThisPi, *, values: dict) -> Json:  # type: ignore[type-arg]  # its contents are checked here
    """Write the settings, if all files together can then be used; the bridge takes them over.

    `values`: by name, each text as in the file; None: the default.
    """
    host = pi.host
    in_force, keys = settings_in_force(host), {key.name: key for key in KEYS}
    before = host.read(_FILE)
    lines = {name: found["text"] for name, found in in_force.items() if found["where"].startswith(_FILE)}
    for name, text in values.items():
        where = in_force.get(name, {"where": _FILE})["where"]
        if name not in keys:
            raise HelperRefusal(f"{name!r} is not a setting.")
        if not where.startswith(_FILE):
            raise HelperRefusal(f"{name} is set in {where}, which overrides the page: change it there.")
        if text is None:
            lines.pop(name, None)
        else:
            lines[name] = _one_value(name, text)
    file = WriteFile(_FILE, _HEAD + "".join(f"{name} = {text}\n" for name, text in sorted(lines.items())))
    if file.text == before or (not lines and not before):
        return pi.shown([])
    _try(host, file, before)
    is_live = all(keys[name].is_live for name in values)
    take_over = [Run(_RELOAD, undo=_RELOAD)] if is_live else restart_changes(host)
    return pi.make([Step("save the settings", [file, *take_over])])


def toml_text(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name} = {toml_text(each)}" for name, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml_text, value)) + "]"
    if isinstance(value, str):
        return to_json(value)  # also valid TOML
    return str(value).lower() if isinstance(value, bool) else str(value)


def _one_value(name: str, text: object) -> str:
    try:
        if isinstance(text, str) and len(text) <= _MAX_TEXT and "\n" not in text:
            return toml_text(tomllib.loads(f"value = {text}")["value"])
    except (ValueError, RecursionError):
        pass
    raise HelperRefusal(f"{name}: this is no value: text needs quotes, a list brackets.")


def _try(host: Host, file: WriteFile, before: str) -> None:
    """Load the settings with the new file; SettingsError if they cannot be used, and the file is as before."""
    path, machine = host.path(_FILE), Machine(host)
    machine.carry_out(file)
    try:
        load_settings(host.path(SERVICE_CONFIG), state_dir=host.path(SERVICE_STATE))
    finally:
        if before:
            machine.carry_out(WriteFile(_FILE, before))
        else:
            path.unlink()


def _on_machine(host: Host, where: str) -> str:
    return "/" + str(Path(where).relative_to(host.root))
