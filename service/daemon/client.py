# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests to a running daemon through the control socket (service.daemon.control_server).

Does not import the daemon, so that a command starts quickly.
"""

import json
import os
import socket
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import gettempdir
from typing import Any
from zlib import crc32

from payloads.mission_data import Json, printable, to_json
from service.settings import SettingsError, default_state_dir

#: The request for the bridge's status.
STATUS = {"do": "status"}
#: The values of "do" that write the flight controller's firmware.
FIRMWARE_REQUESTS = frozenset(("flash-firmware", "restore-firmware"))
SOCKET_NAME = "control.sock"
_ANSWERS = {"progress", "result", "error"}
#: The unit's RuntimeDirectory=. A service's state directory is closed to other users (DynamicUser=).
_SERVICE_FOLDER = "/run/naze-bridge"


class ControlError(Exception):
    """The daemon refused or is not running, in one sentence."""


class Interrupted(Exception):
    """The user interrupted the request. One sentence about the end."""


def ask_daemon(state_dir: Path | None, request: Json, progress: Callable[[Any], None] = lambda _: None) -> Json:
    """Ask the daemon that runs on `state_dir` (None: see find_socket). ControlError if there is none or it refuses."""
    path = find_socket(state_dir)
    line = to_json(request).encode() + b"\n"  # before connecting: the daemon waits only 5 s for the request
    with (
        socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection,
        connection.makefile(errors="replace") as answers,
    ):
        try:
            connection.connect(str(path))
        except PermissionError as error:
            remedy = "use sudo, or join the group that the daemon runs as (dialout, as a service)"
            raise ControlError(f"no permission to ask the daemon on {path}: {remedy}") from error
        except OSError as error:
            remedy = "start one (sudo systemctl start naze-bridge, or naze-bridge run), or use --fc FC"
            raise ControlError(f"no daemon answers on {path}: {remedy}") from error
        with suppress(ConnectionError):
            # A refusal may arrive in the middle of a long request: read it.
            connection.sendall(line)
        with suppress(ConnectionError):
            for answer in map(_answer, answers):
                if "progress" in answer:
                    progress(answer["progress"])
                elif "error" in answer:
                    raise ControlError(answer["error"])
                else:
                    result: Json = answer["result"]
                    return result
    raise ControlError("the daemon ended before it answered")


def _answer(line: str) -> Json:
    try:
        answer: Json = printable(json.loads(line))
        if _ANSWERS & answer.keys():
            return answer
    except (ValueError, AttributeError, RecursionError):
        pass
    raise ControlError("the daemon's answer cannot be read: is it from another release?")


def socket_of_daemon(state_dir: Path) -> Path:
    """The socket of this process's own daemon."""
    given = _runtime_directory()
    if given is None:
        given = state_dir if os.access(state_dir, os.W_OK) else _stand_in(state_dir)
    return given / SOCKET_NAME


def find_socket(state_dir: Path | None) -> Path:
    """The socket of a running daemon: on `state_dir`, else the user's own, else the service's.

    SettingsError if the user lacks a home and there is no service.
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
