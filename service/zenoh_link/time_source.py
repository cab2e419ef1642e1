# SPDX-License-Identifier: GPL-3.0-or-later
"""The source of the bridge's time, so that a reader can judge a timestamp."""

from pathlib import Path

#: Made by systemd-timesyncd when it has set the clock. adjtimex(2) is forbidden to the hardened service.
_SYNCHRONIZED = Path("/run/systemd/timesync/synchronized")


def time_source() -> str:
    """Either "ntp" (the clock was set over the network since the start) or "pi" (it may be hours off)."""
    return "ntp" if _SYNCHRONIZED.exists() else "pi"
