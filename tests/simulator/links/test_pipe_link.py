# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated Naze on a socket pair."""

import asyncio
import socket

import pytest

from protocols.mission_item import identify
from protocols.msp.frame import MspFrame, MspParser, request
from protocols.msp.mission import INFO_REQUEST, decode_info, encode_begin
from simulator.links.pipe_link import SimLink
from simulator.naze.board import SimulatedNaze
from tests.support.naze_bench import mission
from tests.support.programs import TIMEOUT_S

IDENT = request(100)


async def ask(far: socket.socket, frame: bytes) -> MspFrame:
    loop, parser = asyncio.get_running_loop(), MspParser()
    await loop.sock_sendall(far, frame)
    async with asyncio.timeout(TIMEOUT_S):
        while True:
            if frames := parser.feed(await loop.sock_recv(far, 4096)):
                return frames[0]


async def test_the_pipe_answers_at_once_and_the_board_survives_unplugging() -> None:
    link = SimLink(SimulatedNaze(), asyncio.get_running_loop())
    with await link.start() as far:
        assert (await ask(far, IDENT)).payload[0] == 211
        await ask(far, encode_begin(identify(mission(3))))
        link.stop()
        assert await asyncio.get_running_loop().sock_recv(far, 10) == b""
    with await link.start() as far:
        info = decode_info((await ask(far, INFO_REQUEST)).payload)
        assert info is not None
        assert info.flags.name == "TRANSFER_OPEN"
        link.stop()


@pytest.mark.parametrize("turns", [0, 3])
async def test_a_client_can_reconnect(turns: int) -> None:
    link = SimLink(SimulatedNaze(), asyncio.get_running_loop())
    (await link.start()).close()
    for _ in range(turns):
        await asyncio.sleep(0)
    with await link.start() as far:
        assert (await ask(far, IDENT)).payload[0] == 211
    link.stop()
