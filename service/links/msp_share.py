# SPDX-License-Identifier: GPL-3.0-or-later
"""`[[share]]`: TCP ports on which other programs speak MSP through the bridge."""

import asyncio
from collections import Counter
from collections.abc import Callable

from bridge.bridge import Bridge
from bridge.sharing.msp_sharing import Program
from service.links.gcs_links import LinkError
from service.settings.addresses import family_of
from service.settings.settings import ShareSettings
from storage.os_error import reason

#: A program that does not read the replies is disconnected.
_MAX_UNSENT = 65536
#: A further program displaces the program that has been silent for longest, of the host with the most programs: the
#: laptop may have been switched off.
_MAX_PROGRAMS = 8


async def open_share(share: ShareSettings, bridge: Bridge, flush: Callable[[], None]) -> Callable[[], None]:
    """Listen. LinkError if that fails. Returns a function that closes the port and its connections.

    `flush` carries out the bridge's outputs.
    """
    loop = asyncio.get_running_loop()
    address = share.address
    where, family = (address.host, address.port), family_of(address.host)
    port = _SharePort(bridge, flush, may_write=share.write)
    try:
        server = await loop.create_server(lambda: _TcpProgram(port), *where, family=family)
    except OSError as error:
        raise LinkError(f"share {address} cannot be opened: {reason(error)}") from error

    def close() -> None:
        server.close()
        port.close()

    return close


class _SharePort:
    """The programs on one port."""

    def __init__(self, bridge: Bridge, flush: Callable[[], None], *, may_write: bool) -> None:
        self._bridge = bridge
        self._flush = flush
        self._may_write = may_write
        self._loop = asyncio.get_running_loop()
        self._programs: dict[Program, Callable[[], None]] = {}  # the program silent for longest first

    def join(
        self,
        address: tuple[str, int],
        send: Callable[[bytes], None],
        close: Callable[[], None],
        forget: Callable[[], None],
    ) -> Program:
        """A program has connected. `forget` drops it to make room for another."""
        host, number = address[:2]
        if len(self._programs) >= _MAX_PROGRAMS:
            programs = Counter([host, *(program.host for program in self._programs)])
            silent = max(self._programs, key=lambda program: programs[program.host])  # the first of several
            forget_silent = self._programs[silent]
            self.leave(silent)
            forget_silent()
        name = f"[{host}]:{number}" if ":" in host else f"{host}:{number}"
        program = Program(name, host, send, close, may_write=self._may_write)
        self._programs[program] = forget
        self._bridge.program_joined(program)
        return program

    def received(self, program: Program, data: bytes) -> None:
        if program in self._programs:
            self._programs[program] = self._programs.pop(program)
            self._bridge.program_received(program, data, self._loop.time())
            self._flush()

    def leave(self, program: Program) -> None:
        if self._programs.pop(program, None) is not None:
            self._bridge.program_left(program)

    def close(self) -> None:
        for program, forget in tuple(self._programs.items()):
            self.leave(program)
            forget()


class _TcpProgram(asyncio.Protocol):
    def __init__(self, port: _SharePort) -> None:
        self._port = port

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        address = transport.get_extra_info("peername") or ("", 0)
        self._program = self._port.join(address, self._send, transport.close, transport.abort)

    def connection_lost(self, exc: Exception | None) -> None:
        self._port.leave(self._program)

    def data_received(self, data: bytes) -> None:
        self._port.received(self._program, data)

    def _send(self, frame: bytes) -> None:
        if self._transport.is_closing():
            return
        self._transport.write(frame)
        if self._transport.get_write_buffer_size() > _MAX_UNSENT:
            self._transport.abort()
