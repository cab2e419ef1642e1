"""What the `[zenoh]` table of the configuration file says."""

import difflib
import re
import socket
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

#: What must be written to take commands from whoever reaches the session.
I_KNOW = "I know"
_FORBIDDEN = re.compile(r"[*$?#/\s\x00-\x1f\x7f]")
_MAX_NAME = 64


class ZenohSettingsError(ValueError):
    """A zenoh setting that cannot be used; the text is one sentence."""


class PayloadEncoding(Enum):
    """How payloads are written."""

    JSON = "json"
    CBOR = "cbor"


def host_name() -> str:
    """Return this machine's name as a vehicle's: what a key cannot hold becomes a dash."""
    return _FORBIDDEN.sub("-", socket.gethostname()).lstrip("@")[:_MAX_NAME] or "vehicle"


@dataclass(frozen=True, slots=True)
class ZenohSettings:
    """How the daemon joins zenoh. Endpoints are zenoh's: "tcp/192.168.4.1:7447".

    `config_file`: a zenoh configuration that is passed through; what it does not say is as without it.
    `commands`: whether @cmd is answered; `commands_without_authentication` must be "I know" to do so for strangers.
    """

    prefix: str = "fleet"
    vehicle: str = field(default_factory=host_name)
    encoding: PayloadEncoding = PayloadEncoding.JSON
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    config_file: Path | None = None
    commands: bool = False
    commands_without_authentication: str = ""
    mavlink_in: bool = False

    def __post_init__(self) -> None:
        check_name("prefix", self.prefix)
        check_name("vehicle", self.vehicle)


def check_name(setting: str, name: str) -> None:
    """Say what is wrong with a name that cannot be one chunk of a key: ZenohSettingsError."""
    bad = _FORBIDDEN.search(name)
    if not name:
        wrong = "empty"
    elif bad is not None:
        wrong = f"{name!r}, with {bad.group()!r} in it"
    elif name.startswith("@"):
        wrong = f"{name!r}, with @ in front"
    elif len(name) > _MAX_NAME:
        wrong = f"longer than {_MAX_NAME} letters"
    else:
        return
    raise ZenohSettingsError(f'zenoh.{setting} is {wrong}: make a name of letters, digits and dashes, as "naze-1"')


def parse_zenoh(table: Mapping[str, object], folder: Path) -> ZenohSettings:
    """Read the `[zenoh]` table; `folder`: where a relative `config_file` is looked for. ZenohSettingsError."""
    values: dict[str, Any] = {}
    for key, value in table.items():
        if key not in _READERS:
            near = difflib.get_close_matches(key, _READERS, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(_READERS)}"
            raise ZenohSettingsError(f"zenoh.{key} is no setting; {hint}")
        wanted, read = _READERS[key]
        try:
            values[key] = read(value)
        except (TypeError, ValueError):
            raise ZenohSettingsError(f"zenoh.{key} is {value!r}, but must be {wanted}") from None
    if "config_file" in values:
        values["config_file"] = folder / values["config_file"]
    return ZenohSettings(**values)


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


def _flag(value: object) -> bool:
    if not isinstance(value, bool):
        raise TypeError
    return value


def _endpoints(value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(each, str) and "/" in each for each in value):
        raise TypeError
    return tuple(value)


#: Setting -> what it must be, and how it is read.
_READERS: dict[str, tuple[str, Callable[[object], object]]] = {
    "prefix": ("text in quotes", _text),
    "vehicle": ("text in quotes", _text),
    "encoding": ('"json" or "cbor"', PayloadEncoding),
    "connect": ('a list of endpoints like ["tcp/192.168.4.1:7447"]', _endpoints),
    "listen": ('a list of endpoints like ["tcp/0.0.0.0:7447"]', _endpoints),
    "config_file": ("the name of a zenoh configuration file", _text),
    "commands": ("true or false", _flag),
    "commands_without_authentication": (f'"{I_KNOW}", or left away', _text),
    "mavlink_in": ("true or false", _flag),
}
