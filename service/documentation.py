# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a page of the documentation is on this machine."""

from pathlib import Path

_INSTALLED = Path("/usr/share/doc/naze-bridge")
_IN_PACKAGE = Path(__file__).is_relative_to("/usr/lib/naze-bridge")


def page(name: str) -> str:
    """The file to name in a message: `name` is its path in the repository, "docs/signing.md"."""
    return str(_INSTALLED / name) if _IN_PACKAGE else name
