# SPDX-License-Identifier: GPL-3.0-or-later
"""The pilot's answers, and the files that keep them until the next setup."""

import json
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from protocols.remedies import Fault
from service.machine.host import Host
from service.settings.config_files import read_files
from service.settings.load import SERVICE_CONFIG
from storage.small_files import read_bounded

SETTINGS_FILE = "/etc/naze-bridge/setup.toml"
KEY_FILE = "/etc/naze-bridge/gcs.key"
PAGE_PORT = 8080
GCS_PORT = 14550
_MAX_KEY_FILE = 4096


@dataclass(frozen=True, slots=True)
class SetupChoices:
    """The pilot's choices.

    `fc` None: the bridge looks for it. `hotspot`: its name and password; None keeps the network. `keeps_hotspot`: even
    if no device joins it. `name`: the host name, for NAME.local. `key`: the passphrase of MAVLink signing; None keeps
    the current key, or leaves writing open to the whole network.
    """

    fc: str | None = None
    page: bool = True
    hotspot: tuple[str, str] | None = None
    country: str | None = None
    name: str | None = None
    key: str | None = None
    keeps_hotspot: bool = False


def earlier_choices(host: Host) -> SetupChoices | None:
    """The answers of the last setup that lack another file, or None on a machine that was never set up."""
    text = host.read(SETTINGS_FILE)
    if not text:
        return None
    try:
        settings = tomllib.loads(text)
    except ValueError:
        return None
    fc = settings.get("fc")
    return SetupChoices(fc=fc if isinstance(fc, str) and fc != "auto" else None, page="web" in settings)


def current_key(host: Host) -> str:
    """The passphrase in the service's key file, which the service could have replaced, or empty if there is none."""
    try:
        return read_bounded(host.path(KEY_FILE), _MAX_KEY_FILE, follows_links=False).decode().strip()
    except (OSError, ValueError):
        return ""


def settings_text(host: Host, answers: SetupChoices) -> str:
    """The settings file with the choices that were made."""
    lines = ["# Written by `naze-bridge setup`, which can be run again. config.toml, in this folder, overrides this."]
    if answers.fc is not None:
        lines.append(f"fc = {json.dumps(answers.fc, ensure_ascii=False)}")  # also valid TOML
    if answers.key is not None or host.path(KEY_FILE).exists():
        lines.append(f'key_file = "{KEY_FILE}"')
    if answers.page:
        lines += ["", "[web]", f'listen = "0.0.0.0:{PAGE_PORT}"']
    return "\n".join(lines) + "\n"


def shadowed(host: Host, answers: SetupChoices) -> Iterator[str]:
    """Yield a sentence for each answer that another file of settings overrides."""
    answered = tomllib.loads(settings_text(host, answers))
    given = read_files(host.path(SERVICE_CONFIG), [])
    for name in ("fc", "key_file", "web.listen", "web"):
        where = given[name].where if name in given else ""
        file = "/" + str(Path(where).relative_to(host.root)) if where else ""
        if not file or file.startswith(SETTINGS_FILE):
            continue
        table, _, _ = name.partition(".")
        # The table alone turns the page on.
        if not answers.page if name == "web" else table in answered:
            yield Fault.SHADOWED_ANSWER.text(file=file, name=name)
