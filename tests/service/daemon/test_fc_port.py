# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller's port on a pty: batched reads, writes faster than a UART, errors and losses."""

import asyncio
import os
import socket
import termios
import tty
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import suppress
from math import inf
from pathlib import Path
from unittest.mock import AsyncMock

import pytest
import serial
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.frame import MavlinkSplitter
from service.daemon.fc_connection import FcPort, Traffic
from service.links.fc_device import device_opener, open_serial
from service.machine.event_loop import running
from service.settings.addresses import SerialFc
from tests.support.packing import pack
from tests.support.programs import TIMEOUT_S, until_async

HOUR_S = 3600.0
_writer = FrameWriter(1, 1)


def attitude(number: int) -> bytes:
    return _writer.frame(pack(m.MAVLink_attitude_message(number, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)), 2)


class Line:
    """A pty with the port at one end and the test at the other, `wire`."""

    def __init__(self, directory: Path) -> None:
        self.wire, self._terminal = os.openpty()
        tty.setraw(self._terminal)
        os.set_blocking(self.wire, False)
        self.path = directory / "port"
        self.path.symlink_to(os.ttyname(self._terminal))
        self.received = bytearray()
        self.opened = 0
        self.lost: list[str] = []
        #: The number of reads.
        self.reads = 0

    def start(self) -> FcPort:
        opener = device_opener(SerialFc(str(self.path), None))
        port = FcPort(opener, self._on_open, self._on_data, self.lost.append, Traffic())
        port.may_gather = True
        self._task = asyncio.get_running_loop().create_task(port.run())
        return port

    async def stop(self) -> None:
        self._task.cancel()
        await asyncio.wait([self._task])

    def close(self) -> None:
        os.close(self.wire)
        os.close(self._terminal)

    def take(self, size: int = 65536) -> bytes:
        """Read at most this many bytes from the wire."""
        try:
            return os.read(self.wire, size)
        except BlockingIOError:
            return b""

    def numbers(self) -> list[int]:
        """The numbers of the received frames; nothing else may have been received."""
        frames = MavlinkSplitter().feed(bytes(self.received))
        assert b"".join(frame.raw for frame in frames) == self.received
        return [int.from_bytes(frame.payload[:4].ljust(4, b"\0"), "little") for frame in frames]

    async def has_come(self, count: int) -> None:
        """Wait until `count` frames have arrived in total."""
        await until_async(lambda: len(MavlinkSplitter().feed(bytes(self.received))) == count, "the sent frames")
        self.numbers()

    async def feed(self, first: int, count: int, rate_hz: int) -> int:
        """Send frames at a constant rate; return the number after the last."""
        loop = asyncio.get_running_loop()
        for number in range(first, first + count):
            due = loop.time() + 1 / rate_hz
            data = attitude(number)
            while data:
                with suppress(BlockingIOError):
                    data = data[os.write(self.wire, data) :]
                await asyncio.sleep(0)
            while loop.time() < due:  # noqa: ASYNC110 (a timer is rounded up to whole ms)
                await asyncio.sleep(0)
        return first + count

    async def feed_until_gathered(self, first: int = 0) -> int:
        """Send frames without a pause until there are fewer reads than frames; a busy machine needs several tries."""
        async with asyncio.timeout(TIMEOUT_S):
            while True:
                before = self.reads
                first = await self.feed(first, 500, 1_000_000)
                await self.has_come(first)
                if self.reads - before < 300:
                    return first

    def _on_open(self) -> None:
        self.opened += 1

    def _on_data(self, data: bytes, _now: float) -> None:
        self.reads += 1
        self.received += data


@pytest.fixture
def line(tmp_path: Path) -> Iterator[Line]:
    line = Line(tmp_path)
    yield line
    line.close()


@pytest.fixture
async def port(line: Line) -> AsyncIterator[FcPort]:
    """An open port that may gather."""
    port = line.start()
    await until_async(lambda: line.opened, "the port")
    yield port
    await line.stop()


async def test_reads_are_batched_only_at_high_rates(line: Line, port: FcPort) -> None:
    sent = 0
    for _ in range(3):
        sent = await line.feed_until_gathered(sent)
        # At a lower rate each frame is read on arrival.
        before = line.reads
        for _ in range(20):
            await asyncio.sleep(0.05)
            sent = await line.feed(sent, 1, 1_000_000)
            await line.has_come(sent)
        assert line.reads - before >= 20
    assert line.numbers() == list(range(sent))
    assert line.lost == []
    assert line.opened == 1


async def test_gathering_ends_when_a_reply_is_expected(line: Line, port: FcPort) -> None:
    sent = await line.feed_until_gathered()
    port.hold(asyncio.get_running_loop().time() + HOUR_S)
    port.write(b"a heartbeat")
    sent = await line.feed(sent, 1, 1000)
    assert len(line.numbers()) == sent - 1
    port.write(b"a request", asks=True)
    await line.has_come(sent)


class Gathering:
    """A port that may gather, on a socket: what the test sends is read when the test says."""

    async def open(self) -> socket.socket:
        near, self._far = socket.socketpair()
        near.setblocking(False)
        return near

    async def start(self) -> FcPort:
        opened = asyncio.Event()
        self.lane = running().lane
        self.port = FcPort(self.open, opened.set, lambda _data, _now: None, lambda _why: None, Traffic())
        self.port.may_gather = True
        self._task = asyncio.get_running_loop().create_task(self.port.run())
        await opened.wait()
        return self.port

    def delay_s(self, size: int, since_s: float, now: float) -> float:
        """The hold after a read of `size` bytes, `since_s` after another read; -infinity: none."""
        assert self.lane.on_readable is not None
        for part, at in ((1, now - since_s), (size, now)):
            self.port.hold(-inf)
            self._far.send(bytes(part))
            self.lane.on_readable(at)
        return self.lane.held_until - now

    async def stop(self) -> None:
        self._task.cancel()
        await asyncio.wait([self._task])
        self._far.close()


@pytest.mark.parametrize(
    ("size", "since_s", "delay_s"),
    [(50, 0.05, -inf), (110, 0.01, 0.02), (300, 0.1, 0.03), (4000, 0.01, 0.002)],
    ids=["slow", "until a datagram is full", "30 ms at most", "2 ms at least"],
)
async def test_the_next_read_follows_from_the_rate_of_the_last(size: int, since_s: float, delay_s: float) -> None:
    line = Gathering()
    port = await line.start()
    now = asyncio.get_running_loop().time() + HOUR_S
    assert line.delay_s(size, since_s, now) == pytest.approx(delay_s)
    port.may_gather = False
    assert line.delay_s(size, since_s, now + 1) == -inf
    await line.stop()


async def test_after_a_request_reads_are_not_gathered_for_a_while() -> None:
    line = Gathering()
    port = await line.start()
    now = asyncio.get_running_loop().time()
    port.write(b"a request", asks=True)
    assert line.delay_s(110, 0.01, now + 0.2) == -inf
    assert line.delay_s(110, 0.01, now + HOUR_S) > 0
    await line.stop()


async def test_a_closed_port_is_not_held() -> None:
    """It would not be read after it was opened again."""
    line = Gathering()
    port = await line.start()
    await line.stop()
    port.hold(asyncio.get_running_loop().time() + HOUR_S)
    assert line.lane.held_until == -inf


@pytest.mark.usefixtures("port")
async def test_a_port_that_disconnects_during_batched_reads_is_reopened(line: Line, tmp_path: Path) -> None:
    await line.feed_until_gathered()
    line.path.unlink()
    line.close()
    await until_async(lambda: line.lost, "the loss")
    again = Line(tmp_path)
    line.wire, line._terminal = again.wire, again._terminal
    await until_async(lambda: line.opened == 2, "the port")
    line.received.clear()
    await line.feed(7, 1, 50)
    await until_async(lambda: line.numbers() == [7], "a frame")


async def left_whole(line: Line, port: FcPort, sent: list[bytes], taken: bytearray) -> list[bytes]:
    """The frames that were not dropped, read to the end."""
    assert port.dropped_bytes

    def take() -> bool:
        taken.extend(line.take())
        return len(taken) == sum(map(len, sent)) - port.dropped_bytes

    await until_async(take, "all that was not dropped")
    frames = [frame.raw for frame in MavlinkSplitter().feed(bytes(taken))]
    assert b"".join(frames) == taken
    return frames


async def test_a_full_uart_drops_whole_frames(line: Line, port: FcPort) -> None:
    sent = [attitude(number) for number in range(2000)]
    for frame in sent:
        port.write(frame)
    frames = await left_whole(line, port, sent, bytearray())
    assert frames == sent[: len(frames)]
    # When it is read again, it gets the new frames.
    port.write(sent[-1])
    await until_async(lambda: line.take() == sent[-1], "a frame")


async def test_a_stuck_uart_resumes_with_whole_frames(line: Line, port: FcPort) -> None:
    """The wire is read in small pieces, so that the terminal splits frames anywhere."""
    sent = [attitude(number) for number in range(4000)]
    taken = bytearray()
    for number, frame in enumerate(sent):
        port.write(frame)
        if number % 40 == 0:
            taken += line.take(701)
            await asyncio.sleep(0)
    numbers = [sent.index(frame) for frame in await left_whole(line, port, sent, taken)]
    assert numbers == sorted(numbers)


async def test_queued_frames_are_dropped_when_the_speed_changes(line: Line, port: FcPort) -> None:
    """At another speed they would be arbitrary bytes to the flight controller."""
    port.set_speed(9600)
    await until_async(lambda: port.write(bytes(4000)) or port.dropped_bytes, "a full port")  # type: ignore[func-returns-value]
    port.set_speed(57600)
    while line.take():
        """Already on the wire."""
    port.write(b"for the new speed")
    came = bytearray()

    def has_come() -> bool:
        came.extend(line.take())
        return came.endswith(b"speed")

    await until_async(has_come, "the frame written afterwards")
    assert bytes(came) == b"for the new speed"


async def test_unsent_bytes_are_dropped_when_the_port_closes(line: Line, port: FcPort) -> None:
    """Closing would wait for them: up to 30 s on a USB board that hangs."""
    await until_async(lambda: port.write(bytes(4000)) or port.dropped_bytes, "a full port")  # type: ignore[func-returns-value]
    await line.stop()
    on_the_wire = 4096
    assert len(line.take()) <= on_the_wire
    assert line.take() == b""


async def test_a_frame_is_sent_whole_before_the_port_closes(line: Line, monkeypatch: pytest.MonkeyPatch) -> None:
    """A pty has no slow wire, so the driver's count of unsent bytes is replaced."""
    unsent = [6, 4, 2, 0]
    left_at_drop: list[int] = []
    monkeypatch.setattr(serial.Serial, "out_waiting", property(lambda _port: unsent.pop(0)))
    monkeypatch.setattr(serial.Serial, "reset_output_buffer", lambda _port: left_at_drop.append(len(unsent)))
    line.start()
    await until_async(lambda: line.opened, "the port")
    await line.stop()
    assert left_at_drop == [0]


async def test_dtr_stays_on_when_the_port_closes(line: Line) -> None:
    """Boards with an Arduino's reset circuit restart when it comes on again."""
    attributes = termios.tcgetattr(line._terminal)
    attributes[2] |= termios.HUPCL
    termios.tcsetattr(line._terminal, termios.TCSANOW, attributes)
    port = line.start()
    await until_async(lambda: line.opened, "the port")
    port.set_speed(57600)
    await line.stop()
    assert not termios.tcgetattr(line._terminal)[2] & termios.HUPCL


async def test_usb_chips_deliver_short_replies_at_once(line: Line, monkeypatch: pytest.MonkeyPatch) -> None:
    """Like most drivers, a pty's has no such mode: the port is used all the same."""
    asked: list[bool] = []
    real = serial.Serial.set_low_latency_mode

    def set_mode(port: serial.Serial, is_low: bool) -> None:
        asked.append(is_low)
        real(port, is_low)

    monkeypatch.setattr(serial.Serial, "set_low_latency_mode", set_mode)
    line.start()
    await until_async(lambda: line.opened, "the port")
    assert asked == [True]
    await line.stop()


@pytest.mark.parametrize("error", [OSError("unplugged"), termios.error(5, "unplugged"), ValueError("unplugged")])
async def test_a_port_that_does_not_take_a_speed_counts_as_lost(
    line: Line, port: FcPort, error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:

    def refuse(*_args: object) -> None:
        raise error

    monkeypatch.setattr(serial.Serial, "baudrate", property(refuse, refuse))
    port.set_speed(57600)
    assert "unplugged" in line.lost[0]


async def tried_once(port: FcPort, opener: AsyncMock, failed: Callable[[], object]) -> None:
    running = asyncio.get_running_loop().create_task(port.run())
    await until_async(failed, "the failure")
    for _ in range(50):
        await asyncio.sleep(0)
    assert opener.await_count == 1
    running.cancel()
    await asyncio.wait([running])


async def test_after_each_loss_there_is_a_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    """A TCP adapter that is in use accepts a connection and closes it at once."""
    monkeypatch.setattr("service.daemon.fc_connection._RETRY_S", 3600)
    near, far = socket.socketpair()
    far.close()
    opener, lost = AsyncMock(return_value=near), list[str]()
    port = FcPort(opener, lambda: None, lambda _data, _now: None, lost.append, Traffic())
    await tried_once(port, opener, lambda: lost)


async def test_a_port_in_use_is_tried_less_often(line: Line, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each try searches all processes for the program that uses it."""
    monkeypatch.setattr("service.daemon.fc_connection._RETRY_S", 0)
    monkeypatch.setattr("service.daemon.fc_connection._IN_USE_RETRY_S", 3600)
    opener = AsyncMock(side_effect=lambda: open_serial(str(line.path)))
    port = FcPort(opener, lambda: None, lambda _data, _now: None, lambda _why: None, Traffic())
    with serial.Serial(str(line.path), exclusive=True):
        await tried_once(port, opener, lambda: port.trouble)


async def test_a_lent_port_is_closed_until_it_comes_back(line: Line, port: FcPort) -> None:
    async with port.lend():
        assert line.lost == ["the port is used for new firmware"]
        device = open_serial(str(line.path))  # exclusive
        await asyncio.sleep(0.4)
        assert line.opened == 1
        device.close()
    await until_async(lambda: line.opened == 2, "the port again")


async def test_a_port_is_lent_while_it_cannot_be_opened_and_comes_back_after_an_error(line: Line) -> None:
    device = open_serial(str(line.path))
    port = line.start()
    await until_async(lambda: bool(port.trouble), "the refusal")
    with suppress(ZeroDivisionError):
        async with asyncio.timeout(TIMEOUT_S), port.lend():
            device.close()
            raise ZeroDivisionError
    await until_async(lambda: line.opened == 1, "the port")
