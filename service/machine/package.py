# SPDX-License-Identifier: GPL-3.0-or-later
"""The installed naze-bridge: its version, and the location of its documentation on this machine."""

from importlib import metadata
from pathlib import Path

_INSTALLED = Path("/usr/share/doc/naze-bridge")
_PLACEHOLDER = "/OWNER/"
_IN_PACKAGE = Path(__file__).is_relative_to("/usr/lib/naze-bridge")


def page(name: str) -> str:
    """The path to give in a message for `name`, a path in the repository such as "docs/signing.md"."""
    return str(_INSTALLED / name) if _IN_PACKAGE else name


def shipped(name: str) -> Path:
    """The file that is `name` in the repository, a path; it may be missing."""
    return (_INSTALLED if _IN_PACKAGE else Path(__file__).parents[2]) / name


def address(label: str) -> str | None:
    """The project's "Repository" or "Issues" address, from pyproject.toml; None if it is not published."""
    try:
        urls = metadata.metadata("naze-bridge").get_all("Project-URL") or []
    except metadata.PackageNotFoundError:
        return None
    found = dict(str(url).split(", ", 1) for url in urls).get(label)
    return None if found is None or _PLACEHOLDER in found else found


def version(package: str = "naze-bridge") -> str:
    """The installed version of a Python package; "unknown" if it is not installed."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "unknown"
