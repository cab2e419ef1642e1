# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the bridge's time comes from, so that a reader knows what a timestamp is worth."""

from pathlib import Path

#: systemd-timesyncd makes it when it has set the clock. adjtimex(2) is forbidden to the hardened service.
_SYNCHRONIZED = Path("/run/systemd/timesync/synchronized")


def time_source() -> str:
    """Either ntp (the clock was set over the network since the start) or pi: it may be hours off."""
    return "ntp" if _SYNCHRONIZED.exists() else "pi"
