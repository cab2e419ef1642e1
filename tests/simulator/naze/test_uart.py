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


def test_later_bytes_follow_earlier_bytes_on_the_wire() -> None:
    uart, _ = make(9600)
    uart.receive(b"x" * 10, 0.0)
    uart.receive(b"y", 0.001)
    assert drain(uart, 10.5 * 10 / 9600) == b"x" * 10
    assert drain(uart, 11 * 10 / 9600) == b"y"


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


@given(st.lists(st.tuples(st.binary(min_size=1, max_size=100), st.floats(0.0005, 0.03)), max_size=30))
def test_loses_bytes_only_if_the_ring_overflows(writes: list[tuple[bytes, float]]) -> None:
    uart, counters = make()
    sent, now, outstanding = b"", 0.0, 0.0
    received = b""
    for data, pause in writes:
        outstanding = max(outstanding - pause / BYTE, 0)
        now += pause
        if outstanding + len(data) > 255:
            continue
        outstanding += len(data)
        uart.write(data, now)
        sent += data
        received += uart.transmitted(now)
    assert received + uart.transmitted(now + 1) == sent
    assert counters.tx_overflows == 0
    assert counters.max_outstanding_reply_bytes <= 255


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


def test_bursts_that_end_close_together_depart_together() -> None:
    uart, _ = make()
    for _ in range(3):
        uart.write(b"q" * 12, 0.0)
    departure = uart.next_departure()
    assert departure is not None
    assert uart.transmitted(departure) == b"q" * 36


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


def test_at_equal_speeds_bytes_are_unchanged() -> None:
    assert garble(bytes(range(256)), 57600, 57600) == bytes(range(256))


def test_half_the_speed_doubles_each_bit() -> None:
    # 'U' is 0 10101010 1 on the wire; a receiver at twice the speed starts with 0 01100110 and a low stop bit.
    assert garble(b"U", 9600, 19200)[0] == 0x66


def test_a_disconnected_port_is_silent() -> None:
    assert garble(b"hello", 0, 115200) == b""


@given(
    st.binary(max_size=60),
    st.sampled_from([9600, 19200, 38400, 57600, 115200]),
    st.sampled_from([9600, 19200, 38400, 57600, 115200]),
)
def test_a_wrong_speed_never_yields_more_than_the_line_can_carry(data: bytes, sent: int, read: int) -> None:
    assert len(garble(data, sent, read)) <= len(data) * read / sent + 1
