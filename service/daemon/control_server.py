# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon's local control socket, through which commands such as `push` and `status` reach a running daemon.

A Unix socket in the state directory. One JSON object a line. A request has the key "do". The daemon answers with
any number of {"progress": ...} lines and one last line with "result" or "error".
"""

import asyncio
import errno
import json
import os
import socket
from contextlib import suppress
from pathlib import Path

import structlog

from payloads.mission_data import Json, to_json
from service.daemon.api import DaemonApi
from service.daemon.client import ControlError
from service.daemon.daemon import Daemon
from storage.os_error import reason
from storage.store_error import StoreError

#: asyncio buffers twice as much for each client. A list of 146 items has 40 kB.
_MAX_LINE = 1 << 18
#: Further clients are disconnected.
_MAX_CLIENTS = 16
#: The timeout for receiving a request, and for sending the reply.
_REQUEST_TIMEOUT_S = 5.0
_ANSWER_TIMEOUT_S = 10.0
#: For finished replies, when the daemon ends.
_LAST_ANSWERS_S = 0.05

_LOOK = "`pull` and `settings list` show what the flight controller holds"

_log = structlog.get_logger()


class ControlServer:
    """Serves the socket."""

    def __init__(self, daemon: Daemon, path: Path) -> None:
        self._api = DaemonApi(daemon)
        self._path = path
        self._server: asyncio.Server | None = None
        self._clients: set[asyncio.Task[None]] = set()

    async def start(self) -> None:
        """Listen. Raises ControlError if that fails.

        A socket that a killed daemon left behind is replaced, but not a live one: in an unusable state directory there
        is not a state lock.
        """
        if _is_live(self._path):
            raise ControlError(f"another daemon answers on {self._path}: stop it, or use another --state-dir")
        try:
            if not self._path.parent.exists():
                self._path.parent.mkdir(0o700)
            if self._path.parent.stat().st_uid not in (os.getuid(), 0):
                raise PermissionError(f"{self._path.parent} belongs to another user")
            self._path.unlink(missing_ok=True)
            # Python 3.13's start_unix_server removes the socket at the end, and logs an error if the folder is gone.
            listening = socket.socket(socket.AF_UNIX)
            try:
                listening.bind(str(self._path))
                self._path.chmod(0o660)
            except OSError:
                listening.close()
                raise
            # The backlog also limits the connections that asyncio accepts in one turn of the loop.
            self._server = await asyncio.start_server(
                self._serve, sock=listening, limit=_MAX_LINE, backlog=_MAX_CLIENTS
            )
        except OSError as error:
            text = f"the control socket {self._path} cannot be created: {reason(error)}"
            raise ControlError(f"{text}; name a writable folder with --state-dir") from error

    async def close(self) -> None:
        """Stop listening, and fail the requests of waiting clients."""
        if self._server is not None:
            self._server.close()
            with suppress(OSError):  # in a folder that became read-only it stays, and the next start replaces it
                self._path.unlink()
        if self._clients:
            # Finished replies are still sent.
            await asyncio.wait(self._clients, timeout=_LAST_ANSWERS_S)
        for client in self._clients:
            client.cancel()
        await asyncio.gather(*self._clients)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self._clients) >= _MAX_CLIENTS:
            _log.warning("control.too_many_clients", limit=_MAX_CLIENTS)
            writer.transport.abort()
            return
        client = asyncio.current_task()
        assert client is not None
        self._clients.add(client)
        try:
            await self._answer(reader, writer)
        finally:
            self._clients.discard(client)
            if writer.transport.get_write_buffer_size():
                # Replies to a client that does not read would pile up in memory.
                writer.transport.abort()
            writer.close()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        def send(answer: Json) -> None:
            writer.write(to_json(answer).encode() + b"\n")

        try:
            line = await asyncio.wait_for(_read_line(reader), _REQUEST_TIMEOUT_S)
            send({"result": await self._api.do(_request(line), send)})
            await _send_all(writer)
        except TimeoutError:
            send({"error": f"no complete request within {_REQUEST_TIMEOUT_S:.0f} s"})
        except (ControlError, StoreError) as error:
            send({"error": str(error)})
        except ValueError as error:
            send({"error": f"request not understood: {error}"})
        except ConnectionError:
            pass
        except asyncio.CancelledError:  # by close(). asyncio's streams would log it as an error
            send({"error": f"the daemon stopped before it could reply; {_LOOK}"})


def _is_live(path: Path) -> bool:
    with suppress(OSError), socket.socket(socket.AF_UNIX) as connection:
        connection.setblocking(False)
        return connection.connect_ex(str(path)) in (0, errno.EAGAIN)  # EAGAIN: many clients wait
    return False


async def _send_all(writer: asyncio.StreamWriter) -> None:
    """Wait until the client has read everything, with a timeout."""
    writer.transport.set_write_buffer_limits(high=0)
    with suppress(TimeoutError):
        await asyncio.wait_for(writer.drain(), _ANSWER_TIMEOUT_S)


async def _read_line(reader: asyncio.StreamReader) -> bytes:
    try:
        return await reader.readline()
    except ValueError:
        limit = f"a request is limited to {_MAX_LINE >> 10} kB"
        raise ControlError(f"{limit}: this mission is longer than any flight controller stores") from None


def _request(line: bytes) -> Json:
    try:
        request = json.loads(line)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    if not isinstance(request, dict):
        raise ValueError("it must be one JSON object on one line")
    return request
