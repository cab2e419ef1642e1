# SPDX-License-Identifier: GPL-3.0-or-later
"""The installed naze-bridge: its version, and the location of its documentation on this machine."""

from importlib import metadata
from pathlib import Path

_INSTALLED = Path("/usr/share/doc/naze-bridge")
_IN_PACKAGE = Path(__file__).is_relative_to("/usr/lib/naze-bridge")


def page(name: str) -> str:
    """The path to give in a message for `name`, a path in the repository such as "docs/signing.md"."""
    return str(_INSTALLED / name) if _IN_PACKAGE else name


def version(package: str = "naze-bridge") -> str:
    """The installed version of a Python package; "unknown" if it is not installed."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "unknown"
