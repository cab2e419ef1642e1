# SPDX-License-Identifier: GPL-3.0-or-later
"""The board's UART: line rate both ways, and rings that overflow like the DMA's."""

from hypothesis import given
from hypothesis import strategies as st

from simulator.board.line import garble
from simulator.board.options import Counters
from simulator.naze.uart import Uart

BAUD = 115200
BYTE = 10 / BAUD


def make(baud: int = BAUD) -> tuple[Uart, Counters]:
    counters = Counters()
    return Uart(baud, counters), counters


def drain(uart: Uart, now: float) -> bytes:
    data = bytearray()
    while (byte := uart.read(now)) is not None:
        data.append(byte)
    return bytes(data)


def test_bytes_arrive_one_after_the_other_at_line_rate() -> None:
    uart, _ = make()
    uart.receive(b"abc", 1.0)
    assert drain(uart, 1.0 + 0.99 * BYTE) == b""
    assert drain(uart, 1.0 + 1.01 * BYTE) == b"a"
    assert drain(uart, 1.0 + 3.0 * BYTE) == b"bc"


@given(count=st.integers(0, 1200), read_before=st.integers(0, 255))
def test_an_unread_ring_holds_only_the_newest_bytes(count: int, read_before: int) -> None:
    """Compared with a ring with positions, as in drv_uart.c."""
    uart, counters = make()
    uart.receive(b"." * read_before, 0.0)
    assert drain(uart, 1.0) == b"." * read_before
    ring, head = bytearray(256), read_before
    data = bytes((7 * i + i // 256) & 0xFF for i in range(count))
    for byte in data:
        ring[head % 256] = byte
        head += 1
    waiting = (head - read_before) % 256
    uart.receive(data, 2.0)
    assert drain(uart, 9.0) == bytes(ring[(read_before + i) % 256] for i in range(waiting))
    assert counters.rx_overflows == (1 if count >= 256 else 0)


def test_sent_bytes_leave_at_line_rate() -> None:
    uart, _ = make()
    uart.write(bytes(range(200)), 0.0)
    assert uart.transmitted(100 * BYTE) == bytes(range(100))
    assert uart.transmitted(199.5 * BYTE) == bytes(range(100, 199))
    assert uart.transmitted(201 * BYTE) == bytes((199,))


def test_more_than_255_outstanding_bytes_corrupt_each_other() -> None:
    uart, counters = make()
    first, second = b"a" * 200, b"b" * 100
    uart.write(first, 0.0)
    assert counters.tx_overflows == 0
    uart.write(second, 0.0)
    assert counters.tx_overflows == 1
    assert counters.max_outstanding_reply_bytes == 300
    out = uart.transmitted(1.0)
    # The head has passed the tail by 44: the driver sees only these, and sends the newer bytes.
    assert out == b"b" * 44


def test_the_end_of_a_burst_is_the_departure_time() -> None:
    uart, _ = make()
    uart.write(b"q" * 90, 1.0)
    departure = uart.next_departure()
    assert departure is not None
    assert abs(departure - (1.0 + 90 * BYTE)) < 1e-9
    assert len(uart.transmitted(departure)) == 90
    assert uart.next_departure() is None


def test_changing_the_speed_clears_the_rings() -> None:
    uart, _ = make()
    uart.receive(b"r" * 20, 0.0)
    assert uart.read(20 * BYTE) == ord("r")
    uart.write(b"t" * 100, 20 * BYTE)
    uart.set_baud(9600, 20 * BYTE)
    assert uart.transmitted(1.0) == b""
    assert uart.read(1.0) is None
    uart.write(b"n" * 10, 1.0)
    assert uart.transmitted(1.0 + 5.5 * 10 / 9600) == b"n" * 5


def test_half_the_speed_doubles_each_bit() -> None:
    # 'U' is 0 10101010 1 on the wire; a receiver at twice the speed starts with 0 01100110 and a low stop bit.
    assert garble(b"U", 9600, 19200)[0] == 0x66


@given(
    st.binary(max_size=60),
    st.sampled_from([9600, 19200, 38400, 57600, 115200]),
    st.sampled_from([9600, 19200, 38400, 57600, 115200]),
)
def test_a_wrong_speed_never_yields_more_than_the_line_can_carry(data: bytes, sent: int, read: int) -> None:
    assert len(garble(data, sent, read)) <= len(data) * read / sent + 1
