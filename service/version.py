# SPDX-License-Identifier: GPL-3.0-or-later
"""Which naze-bridge this is."""

from importlib import metadata


def version() -> str:
    """Return the installed version; "unknown" where it runs out of a folder that was never installed."""
    try:
        return metadata.version("naze-bridge")
    except metadata.PackageNotFoundError:
        return "unknown"
