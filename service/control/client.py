# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests to a running daemon through its control socket (service.daemon.api).

Imports no part of the daemon, so that a command starts quickly.
"""

import json
import socket
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from service.control.mission_data import Json, to_json
from service.control.socket_path import find_socket

#: The request for the bridge's status.
STATUS = {"do": "status"}


class ControlError(Exception):
    """The daemon refused or is not running; one sentence."""


class Interrupted(Exception):
    """The user interrupted the request; one sentence about its end."""


class NoDaemonError(ControlError):
    """No daemon answers."""


def ask_daemon(state_dir: Path | None, request: Json, progress: Callable[[int], None] = lambda _: None) -> Json:
    """Ask the daemon that runs on `state_dir` (None: see find_socket); ControlError if there is none or it refuses."""
    path = find_socket(state_dir)
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        try:
            connection.connect(str(path))
        except PermissionError as error:
            remedy = "use sudo, or join the group that the daemon runs as (dialout, as a service)"
            raise ControlError(f"no permission to ask the daemon on {path}: {remedy}") from error
        except OSError as error:
            remedy = "start one (sudo systemctl start naze-bridge, or naze-bridge run), or use --fc directly"
            raise NoDaemonError(f"no daemon answers on {path}: {remedy}") from error
        with suppress(ConnectionError):
            # A refusal may arrive in the middle of a long request: read it.
            connection.sendall(to_json(request).encode() + b"\n")
        with suppress(ConnectionError):
            for answer in _lines(connection):
                if "progress" in answer:
                    progress(answer["progress"])
                elif "error" in answer:
                    raise ControlError(answer["error"])
                else:
                    result: Json = answer["result"]
                    return result
    raise ControlError("the daemon ended before it answered")


def _lines(connection: socket.socket) -> Iterator[Json]:
    with connection.makefile() as stream:
        for line in stream:
            yield json.loads(line)
