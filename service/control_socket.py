# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a daemon's control socket is: as a service of systemd in its runtime directory, else in its state directory."""

import os
from pathlib import Path

from service.settings import SettingsError, default_state_dir

SOCKET_NAME = "control.sock"
#: The unit's RuntimeDirectory=. A service's state directory is closed to everybody else (DynamicUser=).
_SERVICE_FOLDER = "/run/naze-bridge"


def socket_of_daemon(state_dir: Path) -> Path:
    """Return where the daemon of this process listens."""
    given = _runtime_directory()
    return (state_dir if given is None else given) / SOCKET_NAME


def find_socket(state_dir: Path | None) -> Path:
    """Return where the daemon that is meant listens: on `state_dir`, else the user's own, else the service's.

    SettingsError if this is a user without a home, and there is no service.
    """
    if state_dir is not None:
        return state_dir / SOCKET_NAME
    service = (_runtime_directory() or Path(_SERVICE_FOLDER)) / SOCKET_NAME
    try:
        own = default_state_dir() / SOCKET_NAME
    except SettingsError:
        if service.exists():
            return service
        raise
    return service if service.exists() and not own.exists() else own


def _runtime_directory() -> Path | None:
    given = os.environ.get("RUNTIME_DIRECTORY")
    return Path(given.split(":")[0]) if given else None
