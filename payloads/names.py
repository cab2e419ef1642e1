# SPDX-License-Identifier: GPL-3.0-or-later
"""The names that a key begins with: the fleet's prefix and the vehicle."""

import re
import socket

from protocols.plain_text import plain_text

DEFAULT_PREFIX = "fleet"
_FORBIDDEN = re.compile(r"[*$?#/\s]")
_MAX_NAME = 64


class ZenohSettingsError(ValueError):
    """A zenoh setting that cannot be used. The text is one sentence."""


def host_name() -> str:
    """The machine's name as a vehicle name: characters that a key cannot hold become dashes."""
    return _FORBIDDEN.sub("-", plain_text(socket.gethostname())).lstrip("@")[:_MAX_NAME] or "vehicle"


def check_name(what: str, name: str) -> str:
    """The name; ZenohSettingsError, which begins with `what`, if it cannot be one chunk of a key."""
    bad = _FORBIDDEN.search(name)
    if not name:
        wrong = "empty"
    elif bad is not None:
        wrong = f"{name!r}, with {bad.group()!r} in it"
    elif plain_text(name) != name:
        wrong = f"{name!a}, with characters that cannot be shown"
    elif name.startswith("@"):
        wrong = f"{name!r}, with @ in front"
    elif len(name) > _MAX_NAME:
        wrong = f"longer than {_MAX_NAME} characters"
    else:
        return name
    raise ZenohSettingsError(f'{what} is {wrong}: make a name of letters, digits and dashes, as "naze-1"')
