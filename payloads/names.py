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
    is_plain = name and plain_text(name) == name and not name.startswith("@")
    if is_plain and len(name) <= _MAX_NAME and _FORBIDDEN.search(name) is None:
        return name
    remedy = f'at most {_MAX_NAME} letters, digits and dashes, as "naze-1"'
    raise ZenohSettingsError(f"{what} is {name[:_MAX_NAME]!a}: use {remedy}")
