# SPDX-License-Identifier: GPL-3.0-or-later
"""The location of documentation pages on this machine."""

from pathlib import Path

_INSTALLED = Path("/usr/share/doc/naze-bridge")
_IN_PACKAGE = Path(__file__).is_relative_to("/usr/lib/naze-bridge")


def page(name: str) -> str:
    """The path to give in a message for `name`, a path in the repository such as "docs/signing.md"."""
    return str(_INSTALLED / name) if _IN_PACKAGE else name
