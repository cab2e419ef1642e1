# SPDX-License-Identifier: GPL-3.0-or-later
"""The helper's program: answers the connection on its standard input (naze-bridge-helper-look@.service and others)."""

import fcntl
import os
import pwd
import socket
import struct
import sys
from collections.abc import Container, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

import click

from payloads.mission_data import Json, to_json
from service.cli.helper.action import Action, HelperRefusal, ThisPi, parse_action
from service.cli.helper.actions import ACTIONS
from service.cli.setup.change import SetupError
from service.machine.helper_socket import UNITS
from service.machine.host import Host
from service.settings import SettingsError
from storage.os_error import reason
from storage.small_files import open_regular

_USER = "naze-bridge"
#: Locked by the request that is carried out: a file that all units can open.
_LOCK = Path(__file__)
_MAX_REQUEST = _PIECE = 1 << 16
#: Between two pieces of an upload.
_TIMEOUT_S = 30.0


def answer(connection: socket.socket, pi: ThisPi, users: Container[int], lock: Path, unit: str) -> None:
    """Read the request for this unit, carry it out and reply. A request of another user is not even read."""
    _, uid, _ = struct.unpack("3i", connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i")))
    if uid not in users:
        reply: Json = {"error": f"Only the user {_USER} may ask for this."}
    else:
        reply = _carry_out(pi, lock, {name: ACTIONS[name] for name in UNITS[unit]})
    connection.sendall(to_json(reply).encode() + b"\n")
    # Closed with a part of the body unread, the connection would be reset, and the reply lost.
    with suppress(OSError):
        while pi.body.read(_PIECE):
            pass


def _carry_out(pi: ThisPi, lock: Path, actions: Mapping[str, Action]) -> Json:
    try:
        action = parse_action(pi.body.readline(_MAX_REQUEST), actions)
        with _alone(lock):
            return action(pi)
    except (HelperRefusal, SetupError, SettingsError) as error:
        return {"error": str(error)}
    except click.UsageError as error:
        return {"error": error.format_message()}
    except OSError as error:
        return {"error": f"{error.filename or 'this'}: {reason(error)}"}


@contextmanager
def _alone(lock: Path) -> Iterator[None]:
    with open_regular(lock) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise HelperRefusal("Another change is being made: wait until it has finished.") from None
        yield


def main() -> None:
    users = {pwd.getpwnam(_USER).pw_uid, os.geteuid()}
    with socket.socket(fileno=os.dup(0)) as connection, connection.makefile("rb") as body:
        connection.settimeout(_TIMEOUT_S)
        answer(connection, ThisPi(Host(), body), users, _LOCK, sys.argv[1])


if __name__ == "__main__":
    main()
