# SPDX-License-Identifier: GPL-3.0-or-later
"""The installed naze-bridge: the version, and the location of its documentation on this machine."""

import sys
from contextlib import suppress
from pathlib import Path

_INSTALLED = Path("/usr/share/doc/naze-bridge")
_PLACEHOLDER = "/OWNER/"
_IN_PACKAGE = Path(__file__).is_relative_to("/usr/lib/naze-bridge")


def page(name: str) -> str:
    """The path to give in a message for `name`, a path in the repository such as "docs/signing.md"."""
    return str(_INSTALLED / name) if _IN_PACKAGE else name


def shipped(name: str) -> Path:
    """The file that is `name` in the repository, a path. It may be missing."""
    return (_INSTALLED if _IN_PACKAGE else Path(__file__).parents[2]) / name


def address(label: str) -> str | None:
    """The project's "Repository" or "Issues" address, from pyproject.toml, or None if it is not published."""
    folder = _metadata_of("naze-bridge")
    lines = [] if folder is None else (folder / "METADATA").read_text(encoding="utf-8").splitlines()
    head = f"Project-URL: {label}, "
    found = next((line.removeprefix(head) for line in lines if line.startswith(head)), None)
    return None if found is None or _PLACEHOLDER in found else found


def version(package: str = "naze-bridge") -> str:
    """The installed version of a Python package; "unknown" if it is not installed."""
    folder = _metadata_of(package)
    return "unknown" if folder is None else folder.stem.partition("-")[2]


def _metadata_of(package: str) -> Path | None:
    """The folder with a package's metadata, found as by importlib.metadata, whose import takes 1.4 MB."""
    folders = f"{package.replace('-', '_')}-*.dist-info"
    for entry in sys.path:
        with suppress(OSError):  # a failing disk must not prevent the start
            if (found := next(Path(entry).glob(folders), None)) is not None:
                return found
    return None
