# SPDX-License-Identifier: GPL-3.0-or-later
"""Dialogues with a board on a pty."""

import asyncio
import os
import tty
from collections.abc import Iterator

import pytest
import serial

from protocols.stm32_boot_loader import Dialogue, Exchange
from service.links.fc_device import PortError, open_serial
from service.links.serial_dialogue import carry_out, use_parity


class Wire:
    """The board's end."""

    def __init__(self) -> None:
        self.board, self._terminal = os.openpty()
        tty.setraw(self._terminal)
        self.port: serial.Serial = open_serial(os.ttyname(self._terminal))

    def close(self) -> None:
        self.port.close()
        os.close(self._terminal)
        os.close(self.board)


@pytest.fixture
def wire() -> Iterator[Wire]:
    wire = Wire()
    yield wire
    wire.close()


def ask(data: bytes, size: int, timeout_s: float = 5.0) -> Dialogue[bytes]:
    return (yield Exchange(data, timeout_s, lambda reply: len(reply) >= size))


async def test_a_reply_in_pieces_is_waited_for(wire: Wire) -> None:
    job = asyncio.create_task(carry_out(ask(b"?", 4), wire.port))
    for piece in (b"an", b"sw"):
        await asyncio.sleep(0.01)
        os.write(wire.board, piece)
    assert await job == b"answ"
    assert os.read(wire.board, 10) == b"?"


async def test_earlier_input_is_not_a_reply(wire: Wire) -> None:
    os.write(wire.board, b"noise")
    assert await carry_out(ask(b"?", 1, 0.05), wire.port) == b""


async def test_silence_is_an_empty_reply_and_the_next_exchange_follows(wire: Wire) -> None:
    def twice() -> Dialogue[tuple[bytes, bytes]]:
        return (yield from ask(b"1", 1, 0.01)), (yield from ask(b"2", 1, 0.01))

    assert await carry_out(twice(), wire.port) == (b"", b"")
    assert os.read(wire.board, 10) == b"12"


async def test_an_unplugged_port_is_reported_in_one_sentence(wire: Wire) -> None:
    job = asyncio.create_task(carry_out(ask(b"?", 1), wire.port))
    await asyncio.sleep(0.01)
    os.close(wire.board)
    os.close(wire._terminal)
    wire.board, wire._terminal = os.openpty()
    with pytest.raises(PortError, match="was lost"):
        await job


async def test_a_pseudo_terminal_without_parity_is_used_as_it_is(wire: Wire) -> None:
    use_parity(wire.port)
    job = asyncio.create_task(carry_out(ask(b"\x7f", 1), wire.port))
    await asyncio.sleep(0.01)
    os.write(wire.board, b"\x79")
    assert await job == b"\x79"
