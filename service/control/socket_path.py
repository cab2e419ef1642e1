# SPDX-License-Identifier: GPL-3.0-or-later
"""The path of a daemon's control socket: a systemd service's runtime directory, else the state directory."""

import os
from pathlib import Path
from tempfile import gettempdir
from zlib import crc32

from service.settings import SettingsError, default_state_dir

SOCKET_NAME = "control.sock"
#: The unit's RuntimeDirectory=. A service's state directory is closed to other users (DynamicUser=).
_SERVICE_FOLDER = "/run/naze-bridge"


def socket_of_daemon(state_dir: Path) -> Path:
    """The socket of this process's own daemon."""
    given = _runtime_directory()
    if given is None:
        given = state_dir if os.access(state_dir, os.W_OK) else _stand_in(state_dir)
    return given / SOCKET_NAME


def find_socket(state_dir: Path | None) -> Path:
    """The socket of a running daemon: on `state_dir`, else the user's own, else the service's.

    SettingsError if the user has no home and there is no service.
    """
    if state_dir is not None:
        own, stand_in = state_dir / SOCKET_NAME, _stand_in(state_dir) / SOCKET_NAME
        return stand_in if stand_in.exists() and not own.exists() else own
    service = (_runtime_directory() or Path(_SERVICE_FOLDER)) / SOCKET_NAME
    try:
        own = default_state_dir() / SOCKET_NAME
    except SettingsError:
        if service.exists():
            return service
        raise
    return service if service.exists() and not own.exists() else own


def _stand_in(state_dir: Path) -> Path:
    """The folder for the socket if the state directory cannot be written: private to this user."""
    base = os.environ.get("XDG_RUNTIME_DIR") or gettempdir()
    return Path(base) / f"naze-bridge-{os.getuid()}-{crc32(bytes(state_dir.absolute())):08x}"


def _runtime_directory() -> Path | None:
    given = os.environ.get("RUNTIME_DIRECTORY")
    return Path(given.split(":")[0]) if given else None
