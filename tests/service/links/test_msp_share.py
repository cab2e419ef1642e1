# SPDX-License-Identifier: GPL-3.0-or-later
"""`[[share]]`: another program uses MSP through the bridge, alongside telemetry and missions."""

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from functools import partial
from pathlib import Path

import pytest

from protocols.msp.frame import Direction, MspFrame, MspParser
from service.daemon.api import DaemonApi
from service.daemon.daemon import Daemon
from service.settings import Settings
from service.settings.addresses import SimulatedFc, parse_gcs
from service.settings.settings import ShareSettings, parse_share
from simulator.board.options import Faults
from simulator.naze.board import SimulatedNaze
from terminal.files import load_mission
from tests.support.inside import inside
from tests.support.programs import TIMEOUT_S, free_port

#: Repeat like configurators, because the bridge also gives up late replies.
_ASKED_AGAIN_S = 2.0
IDENT, PID, SET_PID, REBOOT, SET_MOTOR, EEPROM_WRITE = 100, 112, 202, 68, 214, 250
DATAFLASH_ERASE, V2_FRAME, SET_AUX_RC = 72, 255, 0x2230
SET_RAW_GPS, MSP2_SENSOR_GPS = 201, 0x1F03
STATUS, WP = 101, 118
#: PIDs, rates, and the switches, among them ARM: the command that reads them, and the one that sets them.
SETTERS = {112: 202, 111: 204, 113: 203}
ARMED = 1 << 5


class Program:
    """A configurator on a TCP connection."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader = reader
        self._writer = writer
        self._parser = MspParser(takes_low_v2=True)

    async def ask(self, command: int, payload: bytes = b"", *, is_v2: bool = False, times: int = 1) -> list[MspFrame]:
        """Send requests at once and wait for as many replies. Unanswered ones are repeated."""
        frame = MspFrame(Direction.REQUEST, command, payload, is_v2=is_v2).encode()
        replies: list[MspFrame] = []
        async with asyncio.timeout(TIMEOUT_S):
            while len(replies) < times:
                self._writer.write(frame * (times - len(replies)))
                with suppress(TimeoutError):
                    async with asyncio.timeout(_ASKED_AGAIN_S):
                        while len(replies) < times:
                            data = await self._reader.read(4096)
                            assert data, "the share has disconnected"
                            replies += self._parser.feed(data)
        return replies[:times]

    async def is_closed_after(self, command: int, payload: bytes = b"") -> bool:
        """Send a request; True if the connection is closed without a reply."""
        self._writer.write(MspFrame(Direction.REQUEST, command, payload).encode())
        async with asyncio.timeout(TIMEOUT_S):
            return await self._reader.read(4096) == b""


@asynccontextmanager
async def sharing(address: str, *, write: bool = False) -> AsyncIterator[Daemon]:
    daemon = Daemon(Settings(SimulatedFc(), share=[ShareSettings(parse_gcs(address), write)]))
    task = asyncio.create_task(daemon.run())
    try:
        async with asyncio.timeout(TIMEOUT_S):
            bridge = daemon.bridge
            while bridge.vehicle.armed is None or bridge.is_busy:  # noqa: ASYNC110
                await asyncio.sleep(0.01)
        yield daemon
    finally:
        task.cancel()
        await asyncio.wait([task])


@asynccontextmanager
async def shared(*, write: bool = False) -> AsyncIterator[tuple[Daemon, Program]]:
    port = free_port(socket.SOCK_STREAM)
    async with sharing(f"tcpin:127.0.0.1:{port}", write=write) as daemon:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        yield daemon, Program(reader, writer)
        writer.close()
        with suppress(ConnectionError):
            await writer.wait_closed()


@pytest.mark.parametrize("is_v2", [False, True])
async def test_requests_are_answered_alongside_telemetry(is_v2: bool) -> None:
    async with shared() as (daemon, program):
        received = daemon.traffic["fc"].bytes_received
        replies = await program.ask(IDENT, is_v2=is_v2, times=10)
        seen = {(reply.direction, reply.payload[0], reply.is_v2) for reply in replies}
        assert seen == {(Direction.REPLY, 211, is_v2)}
        async with asyncio.timeout(TIMEOUT_S):
            while daemon.traffic["fc"].bytes_received < received + 600:  # noqa: ASYNC110
                await asyncio.sleep(0.01)
        assert inside(daemon.bridge).session.state.controller is not None


@pytest.mark.parametrize(
    ("write", "command", "payload", "why"),
    [
        (False, SET_PID, bytes(30), "read-only share"),
        (False, EEPROM_WRITE, b"", "read-only share"),
        (True, SET_RAW_GPS, bytes(14), "never forwarded"),
        (True, SET_MOTOR, bytes(16), "unknown on this board"),
        (False, DATAFLASH_ERASE, b"", "unknown"),
        (True, REBOOT, b"", "unknown"),
        (True, SET_AUX_RC, bytes(3), "unknown"),
        (True, V2_FRAME, bytes(9), "unknown"),
        (True, MSP2_SENSOR_GPS, bytes(52), "unknown"),
        (True, SET_PID, b"\x0d\x0d\x0d" + bytes(27), "bytes that open the command line"),
    ],
)
async def test_a_refused_request_closes_the_connection(write: bool, command: int, payload: bytes, why: str) -> None:
    async with shared(write=write) as (daemon, program):
        assert await program.is_closed_after(command, payload)
        (refusal,) = DaemonApi(daemon).status()["refused"]
        assert why in refusal


async def test_a_change_is_passed_on_if_allowed() -> None:
    async with shared(write=True) as (_, program):
        (reply,) = await program.ask(EEPROM_WRITE)
        assert reply.direction is Direction.REPLY


async def test_no_change_is_passed_on_while_armed(monkeypatch: pytest.MonkeyPatch) -> None:
    async with shared(write=True) as (daemon, program):
        armed = property(lambda _: True, lambda _vehicle, _value: None)  # whatever the board reports
        monkeypatch.setattr(type(daemon.bridge.vehicle), "armed", armed, raising=False)
        (reply,) = await program.ask(IDENT)  # the bridge knows it
        assert reply.direction is Direction.REPLY
        assert await program.is_closed_after(EEPROM_WRITE)
        assert list(inside(daemon.bridge).sharing.refused) == ["armed"]


async def test_a_mission_transfer_is_not_disturbed() -> None:
    async with shared() as (daemon, program):
        items = load_mission(Path(__file__).parents[3] / "examples" / "long-146.waypoints")
        pushing = asyncio.create_task(DaemonApi(daemon).push(items, "test", lambda _: None))
        async with asyncio.timeout(TIMEOUT_S):
            while not daemon.bridge.is_busy:  # noqa: ASYNC110
                await asyncio.sleep(0)
            (known,) = await program.ask(IDENT)
            assert not pushing.done()
            (waiting,) = await program.ask(PID)
            assert {known.direction, waiting.direction} == {Direction.REPLY}
            assert (await pushing)["ack"] == "MAV_MISSION_ACCEPTED"
        assert inside(daemon.bridge).sharing.refused == {}


async def test_a_further_client_displaces_the_silent_client(monkeypatch: pytest.MonkeyPatch) -> None:
    """A laptop that was switched off never closes its connection."""
    monkeypatch.setattr("service.links.msp_share._MAX_PROGRAMS", 2)
    async with shared() as (daemon, first):
        address = daemon.settings.share[0].address
        silent, silent_writer = await asyncio.open_connection(address.host, address.port)
        await first.ask(IDENT)
        further, further_writer = await asyncio.open_connection(address.host, address.port)
        for program in (Program(further, further_writer), first):
            (reply,) = await program.ask(IDENT)
            assert reply.direction is Direction.REPLY
        async with asyncio.timeout(TIMEOUT_S):
            with suppress(ConnectionError):
                assert await silent.read() == b""
        silent_writer.close()
        further_writer.close()


async def test_connections_of_one_host_displace_only_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.links.msp_share._MAX_PROGRAMS", 2)
    async with shared() as (daemon, silent):
        address = daemon.settings.share[0].address
        writers: list[asyncio.StreamWriter] = []
        for _ in range(3):
            reader, writer = await asyncio.open_connection(address.host, address.port, local_addr=("127.0.0.2", 0))
            writers.append(writer)
            await Program(reader, writer).ask(IDENT)
        (reply,) = await silent.ask(IDENT)
        assert reply.direction is Direction.REPLY
        for writer in writers:
            writer.close()


async def test_a_flood_is_dropped_and_another_program_is_answered() -> None:
    async with shared() as (daemon, flooder):
        address = daemon.settings.share[0].address
        reader, writer = await asyncio.open_connection(address.host, address.port)
        before = daemon.traffic["fc"].bytes_received
        flooder._writer.write(MspFrame(Direction.REQUEST, PID).encode() * 50_000)
        replies = await Program(reader, writer).ask(IDENT, times=50)
        assert len(replies) == 50
        assert daemon.traffic["fc"].bytes_received < before + 100_000
        writer.close()


async def test_noise_is_not_passed_on() -> None:
    async with shared() as (daemon, program):
        program._writer.write(b"###\r\r\rRRR#\n" * 100)
        (reply,) = await program.ask(IDENT)
        assert reply.direction is Direction.REPLY
        assert inside(daemon.bridge).sharing.refused == {}


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("tcpin:5761", "is not a table with address"),
        ({"address": "udpout:h:1"}, "write tcpin:ADDR:PORT"),
        ({"address": "tcpin:5761", "writes": True}, "'writes' is not a setting of this table"),
        ({"address": "tcpin:5761", "write": "yes"}, "must be true or false"),
    ],
)
def test_an_invalid_share_is_reported_in_one_sentence(entry: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        parse_share(entry, Path())


async def test_an_empty_setter_is_not_a_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """A Harakiri without the patch executes it with what the request before it left in the receive buffer."""
    unpatched = partial(SimulatedNaze, faults=Faults(extension=False))
    monkeypatch.setattr("simulator.naze.board.SimulatedNaze", unpatched)
    async with shared() as (daemon, program):
        for setting, setter in SETTERS.items():
            (before,) = await program.ask(setting)
            for command, payload in ((WP, b"\xff" * 58), (setter, b"")):
                address = daemon.settings.share[0].address
                reader, writer = await asyncio.open_connection(address.host, address.port)
                assert await Program(reader, writer).is_closed_after(command, payload)
                writer.close()
            (after,) = await program.ask(setting)
            assert after == before
        (status,) = await program.ask(STATUS)
        assert not int.from_bytes(status.payload[6:10], "little") & ARMED
        assert daemon.bridge.vehicle.armed is False
