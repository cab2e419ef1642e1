# SPDX-License-Identifier: GPL-3.0-or-later
"""Loads a daemon's settings from all sources, and reports all problems at once."""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any

from service.settings.addresses import GcsAddress, parse_gcs
from service.settings.config_files import Given, read_files
from service.settings.key import Problem, SettingsError, Unfit
from service.settings.settings import DEFAULT_GCS, Settings
from service.settings.table import KEYS
from service.settings.web import WebSettings
from service.settings.write_access import WriteAccess, signing_access
from service.settings.zenoh import ZenohSettings

#: The environment variable for the configuration file itself.
CONFIG_VARIABLE = "NAZE_BRIDGE_CONFIG"
#: The service's configuration file and state directory, as in its unit.
SERVICE_CONFIG = Path("/etc/naze-bridge/config.toml")
SERVICE_STATE = Path("/var/lib/naze-bridge")


def default_state_dir() -> Path:
    """Systemd's StateDirectory, else the user's own state folder. Raises SettingsError if there is no such user."""
    given = os.environ.get("STATE_DIRECTORY")
    if given:
        return Path(given.split(":")[0])
    try:
        base = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    except RuntimeError:
        raise SettingsError("this user has no home folder: name a folder for missions with --state-dir") from None
    return Path(base) / "naze-bridge"


def load_settings(
    config: Path | None, gcs: Sequence[str] = (), page: str | None = None, /, **flags: object
) -> Settings:
    """Load the settings for `run`. SettingsError lists all problems. `flags`: settings by name, None if not given.

    `page`: a draft of the status page's file, which is not read then.
    """
    problems: list[Problem] = []
    given, values = _read(config, flags, problems, page)
    links: Sequence[tuple[GcsAddress, WriteAccess]] = values.get("gcs", ())
    addresses = _named_links(gcs, problems) or [address for address, _ in links] or [parse_gcs(DEFAULT_GCS)]
    zenoh = ZenohSettings(**_table("zenoh", values)) if "zenoh" in given else None
    web = WebSettings(**_table("web", values)) if "web" in given else None
    if zenoh is not None:
        from service.settings.zenoh_config import make_config  # loads zenoh, 10 MB

        with _noting(problems, given["zenoh"].where):
            make_config(zenoh)
    key = WriteAccess()
    if (file := values.get("key_file")) is not None:
        with _noting(problems, given["key_file"].where):
            key = signing_access(file)
    if problems:
        raise SettingsError(problems)
    # A link that is also given by a flag keeps the file's access rules.
    own_access = {str(address): access for address, access in links}
    access = {link: own_access.get(link, WriteAccess()).with_key(key) for link in map(str, addresses)}
    composed = {
        "gcs": [*dict.fromkeys(addresses)],  # one listed twice is one link
        "access": {link: rules for link, rules in access.items() if not rules.is_open},
        "sources": {name: found.where for name, found in given.items()},
        "state_dir": values.get("state_dir") or default_state_dir(),
        "zenoh": zenoh,
        "web": web,
    }
    plain = {field.name: values[field.name] for field in fields(Settings) if field.name in values}
    return Settings(**plain | composed)


def takeoff_limit_m() -> int:
    """The takeoff_max_m of a daemon on this machine, for commands without one. Raises SettingsError if unusable."""
    named = os.environ.get(CONFIG_VARIABLE)
    config = Path(named or SERVICE_CONFIG)
    problems: list[Problem] = []
    _, values = _read(config if named or config.exists() else None, {}, problems)
    limit: int = values.get("takeoff_max_m", Settings().takeoff_max_m)
    if problems:
        raise SettingsError(problems)
    return limit


def _read(
    config: Path | None, flags: Mapping[str, object], problems: list[Problem], page: str | None = None
) -> tuple[dict[str, Given], dict[str, Any]]:
    """The settings given in files and flags, and their values."""
    given = {} if config is None else read_files(config, problems, page)
    named = {name: str(value) for name, value in flags.items() if value is not None}
    given |= {name: Given(value, f"--{name.replace('_', '-')}") for name, value in named.items()}
    return given, _read_values(given, problems)


def _read_values(given: Mapping[str, Given], problems: list[Problem]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for key in KEYS:
        found = given.get(key.name)
        if found is None:
            continue
        try:
            values[key.name] = key.reader.read(found.value, found.folder)
        except Unfit as error:
            problems.append(Problem(found.where, f"{key.name} {error} ({key.meaning.rstrip('.')})"))
        except ValueError as error:
            problems.append(Problem(found.where, str(error)))
    return values


@contextmanager
def _noting(problems: list[Problem], where: str) -> Iterator[None]:
    try:
        yield
    except ValueError as error:
        problems.append(Problem(where, str(error)))


def _named_links(gcs: Sequence[str], problems: list[Problem]) -> list[GcsAddress]:
    links: list[GcsAddress] = []
    for text in gcs:
        with _noting(problems, "--gcs"):
            links.append(parse_gcs(text))
    return links


def _table(table: str, values: Mapping[str, Any]) -> dict[str, Any]:
    start = f"{table}."
    return {name.removeprefix(start): value for name, value in values.items() if name.startswith(start)}
