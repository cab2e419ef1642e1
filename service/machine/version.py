# SPDX-License-Identifier: GPL-3.0-or-later
"""The version of naze-bridge."""

from importlib import metadata


def version() -> str:
    """The installed version; "unknown" in a folder that was never installed."""
    try:
        return metadata.version("naze-bridge")
    except metadata.PackageNotFoundError:
        return "unknown"
