# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated USART and its DMA: bytes at line rate, both ways."""

from tests.support.table_program import RAM, Rig, Steps

SR, DR, BRR, CR1, CR3 = (0x4001_3800 + offset for offset in (0x00, 0x04, 0x08, 0x0C, 0x14))
RXNE, TC, TXE = 1 << 5, 1 << 6, 1 << 7
ENABLE, TRANSMITTER, RECEIVER, RXNE_INTERRUPT = 1 << 13, 1 << 3, 1 << 2, 1 << 5
DMA_FLAGS, DMA_CLEAR = 0x4002_0000, 0x4002_0004
BUFFER = RAM + 0x4000
#: From the internal oscillator, 8 MHz: 9600 baud.
DIVIDER = 833
BYTE_S = 10 / 9600


def channel(number: int) -> tuple[int, int, int, int]:
    """CCR, CNDTR, CPAR and CMAR."""
    first = 0x4002_0008 + 20 * (number - 1)
    return first, first + 4, first + 8, first + 12


def open_port(more: int = 0) -> Steps:
    return Steps().store(BRR, DIVIDER).store(CR1, ENABLE | TRANSMITTER | RECEIVER | more)


def receive_ring(size: int) -> Steps:
    ccr, cndtr, cpar, cmar = channel(5)
    steps = open_port().store(CR3, 1 << 6).store(cpar, DR).store(cmar, BUFFER).store(cndtr, size)
    return steps.store(ccr, 1 << 7 | 1 << 5 | 1)


def test_bytes_are_sent_singly() -> None:
    steps = open_port()
    for byte in b"hello":
        steps.wait(SR, TXE).store(DR, byte)
    rig = Rig(steps.wait(SR, TC).load(SR)).run(3.5 * BYTE_S)
    assert rig.board.baud == 9600
    assert rig.received == b"hel"
    assert rig.run(3 * BYTE_S).received == b"hello"
    assert rig.log(1) == [TC | TXE]


def test_bytes_are_received_singly() -> None:
    steps = open_port()
    for _ in range(3):
        steps.wait(SR, RXNE).load(DR)
    rig = Rig(steps.load(SR)).run(0.001).send(b"abc").run(10 * BYTE_S)
    assert rig.log(4) == [*b"abc", TC | TXE]


def test_an_unread_byte_is_overrun() -> None:
    rig = Rig(open_port(RXNE_INTERRUPT).wait(SR, 1 << 3).load(DR).load(SR)).run(0.001).send(b"ab").run(3 * BYTE_S)
    assert rig.log(2) == [ord("a"), TC | TXE]


def test_an_interrupt_for_each_received_byte() -> None:
    steps = open_port(RXNE_INTERRUPT).store(0xE000_E104, 1 << 5)
    rig = Rig(steps, handler=Steps().load(DR)).run(0.001).send(b"abc").run(4 * BYTE_S)
    assert rig.handler_log() == [*b"abc"]


def test_dma_sends_from_memory_and_interrupts_at_the_end() -> None:
    ccr, cndtr, cpar, cmar = channel(4)
    steps = open_port().store(CR3, 1 << 7).store(0xE000_E100, 1 << 14).store(BUFFER, int.from_bytes(b"ping", "little"))
    steps.store(cpar, DR).store(cmar, BUFFER).store(cndtr, 4).store(ccr, 1 << 7 | 1 << 4 | 1 << 1 | 1)
    rig = Rig(steps, handler=Steps().load(DMA_FLAGS).store(DMA_CLEAR, 1 << 12).store(ccr, 0)).run(6 * BYTE_S)
    assert rig.received == b"ping"
    (flags,) = rig.handler_log()
    assert flags & 0xF << 12 == (1 << 2 | 1 << 1 | 1) << 12


def test_dma_receives_into_a_ring_that_overwrites_itself() -> None:
    rig = Rig(receive_ring(8)).run(0.001).send(b"0123456789").run(11 * BYTE_S)
    assert rig.ram(0x4000, 8) == b"89234567"
    rig = Rig(receive_ring(8).wait(DMA_FLAGS, 1 << 17).load(channel(5)[1])).run(0.001).send(b"01234567").run(0.1)
    assert rig.log(1) == [8]


def test_without_a_receiver_bytes_are_lost() -> None:
    rig = Rig(Steps().store(BRR, DIVIDER).load(SR)).run(0.001).send(b"abc").run(0.1)
    assert rig.log(1) == [TC | TXE]
