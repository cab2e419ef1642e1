# SPDX-License-Identifier: GPL-3.0-or-later
"""Carries out a dialogue with a board on a serial port (protocols.stm32_boot_loader)."""

import asyncio
import os
import termios
from contextlib import suppress
from typing import TypeVar

import serial

from protocols.stm32_boot_loader import Dialogue
from service.links.fc_device import DEVICE_ERRORS, PortError
from storage.os_error import reason

_READ_SIZE = 4096
T = TypeVar("T")


class _Line:
    """The received bytes of an open port."""

    def __init__(self, port: serial.Serial) -> None:
        self._descriptor = port.fileno()
        self._loop = asyncio.get_running_loop()
        self._received = bytearray()
        self._arrived = asyncio.Event()
        self._error: Exception | None = None

    def __enter__(self) -> "_Line":
        self._loop.add_reader(self._descriptor, self._readable)
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.remove_reader(self._descriptor)

    def send(self, data: bytes) -> None:
        """Drop unread input, and send a few bytes: the terminal's buffer has room for them."""
        self._readable()
        self._received.clear()
        os.write(self._descriptor, data)

    async def next_bytes(self) -> bytes:
        """Everything received since `send`, once there is more."""
        await self._arrived.wait()
        self._arrived.clear()
        if self._error is not None:
            raise self._error
        return bytes(self._received)

    def _readable(self) -> None:
        try:
            data = os.read(self._descriptor, _READ_SIZE)
            if not data:
                self._error = OSError("it was unplugged")
        except BlockingIOError:
            return
        except OSError as error:
            self._error, data = error, b""
        if self._error is not None:
            self._loop.remove_reader(self._descriptor)
        self._received += data
        self._arrived.set()


async def carry_out(dialogue: Dialogue[T], port: serial.Serial) -> T:
    """The dialogue's result. PortError if the port fails."""
    try:
        with _Line(port) as line:
            reply = b""
            step = next(dialogue)
            while True:
                line.send(step.data)
                reply = b""
                with suppress(TimeoutError):
                    async with asyncio.timeout(step.timeout_s):
                        while not step.is_complete(reply):
                            reply = await line.next_bytes()
                step = dialogue.send(reply)
    except StopIteration as end:
        result: T = end.value
        return result
    except DEVICE_ERRORS as error:
        raise PortError(f"{port.port} was lost: {reason(error)}") from error


def use_parity(port: serial.Serial) -> None:
    """Change to the boot loader's even parity."""
    with suppress(termios.error):  # a pseudo-terminal has none
        port.parity = serial.PARITY_EVEN
