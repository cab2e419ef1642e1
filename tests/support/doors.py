# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon in this process, on a simulated board, with all its doors open; the work of each step of its loop."""

import asyncio
import json
import socket
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from payloads.mission_data import to_json
from service.daemon.control_server import ControlServer
from service.daemon.daemon import Daemon
from service.machine import event_loop
from service.settings import Settings
from service.settings.addresses import SimulatedFc, parse_gcs
from service.settings.settings import ShareSettings
from service.settings.web import WebSettings, parse_listen
from service.web.server import WebServer
from simulator.commands.fc_kinds import make_board
from simulator.inav.setting_table import SETTINGS as INAV_SETTINGS
from simulator.links.pipe_link import SimLink
from tests.support.programs import free_port
from tests.support.work import Work, counted

_LOOK_S = 0.1
#: Settings of INAV 8, apart from the mode ranges. The simulated one has those that matter.
_INAV_HAS = 821
#: The longest reply is that about a thousand missions.
_MOST = 1 << 22


@dataclass(frozen=True, slots=True)
class Doors:
    """The daemon's ports, and the path of its control socket."""

    daemon: Daemon
    udp: int
    tcp: int
    share: int
    web: int
    control: Path

    async def ask(self, request: object) -> Any:
        """The last line that the control socket answers."""
        line = request if isinstance(request, bytes) else to_json(request).encode()
        reader, writer = await asyncio.open_unix_connection(self.control, limit=_MOST)
        writer.write(line + b"\n")
        answer = b""
        with suppress(ConnectionResetError):  # a request that is too long is answered before it was read
            while block := await reader.read(_MOST):
                answer += block
        writer.close()
        return json.loads(answer.splitlines()[-1])

    async def http(self, method: str, path: str, body: bytes = b"") -> bytes:
        """The whole response."""
        head = f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/octet-stream\r\n"
        reader, writer = await asyncio.open_connection("127.0.0.1", self.web)
        writer.write(f"{head}Content-Length: {len(body)}\r\n\r\n".encode() + body)
        answer = await reader.read(-1)
        writer.close()
        return answer

    async def tcp_sends(self, port: int, data: bytes) -> None:
        """Send as much as the daemon takes, and stay until it has had time to read it."""
        _, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(data)
        await asyncio.sleep(3 * _LOOK_S)
        writer.transport.abort()

    async def udp_sends(self, datagrams: list[bytes]) -> None:
        """Send all at once; what the socket's buffer does not take is lost."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.connect(("127.0.0.1", self.udp))
            sender.setblocking(False)
            for datagram in datagrams:
                with suppress(BlockingIOError):
                    sender.send(datagram)
            await asyncio.sleep(_LOOK_S)


Story = Callable[[Doors], Awaitable[None]]


@asynccontextmanager
async def _opened(folder: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Doors]:
    many = [
        INAV_SETTINGS[0]._replace(name=f"nav_long_setting_{at}", place=at)
        for at in range(len(INAV_SETTINGS), _INAV_HAS)
    ]
    monkeypatch.setattr("simulator.inav.settings.SETTINGS", (*INAV_SETTINGS, *many))
    monkeypatch.setattr("simulator.inav.settings.InavSettings.save", lambda _: None)
    monkeypatch.setattr("bridge.settings.board_settings.BoardSettings._pace", lambda *_: 0.0)  # else it takes 12 s
    link = SimLink(make_board("inav"), asyncio.get_running_loop())  # type: ignore[arg-type]  # any board will do
    monkeypatch.setattr("service.daemon.fc_connection.device_opener", lambda _address: link.start)
    udp, tcp, share, web = free_port(socket.SOCK_DGRAM), *(free_port(socket.SOCK_STREAM) for _ in range(3))
    settings = Settings(
        SimulatedFc(),
        gcs=[parse_gcs(f"udpin:127.0.0.1:{udp}"), parse_gcs(f"tcpin:127.0.0.1:{tcp}")],
        state_dir=folder,
        share=[ShareSettings(parse_gcs(f"tcpin:127.0.0.1:{share}"))],
    )
    daemon = Daemon(settings)
    parts = ControlServer(daemon, folder / "control"), WebServer(daemon, WebSettings(parse_listen(f"127.0.0.1:{web}")))
    await parts[0].start()
    running = asyncio.create_task(daemon.run())
    await daemon.started.wait()
    parts[1].start()
    doors = Doors(daemon, udp, tcp, share, web, folder / "control")
    try:
        while "error" in await doors.ask({"do": "settings"}):  # noqa: ASYNC110  # the daemon has no such event
            await asyncio.sleep(_LOOK_S)
        yield doors
    finally:
        for part in parts:
            await part.close()
        running.cancel()
        await asyncio.wait([running])
        link.stop()


@contextmanager
def open_doors(folder: Path) -> Iterator[Callable[[Story], Work]]:
    """A function for the work of the loop's steps during a story. The board's settings were read before."""
    with pytest.MonkeyPatch.context() as monkeypatch, asyncio.Runner(loop_factory=event_loop.EventLoop) as runner:
        opened = _opened(folder, monkeypatch)
        doors = runner.run(opened.__aenter__())

        async def counts(story: Story) -> Work:
            with counted() as work:
                await story(doors)
            return work

        yield lambda story: runner.run(counts(story))
        runner.run(opened.__aexit__(None, None, None))
