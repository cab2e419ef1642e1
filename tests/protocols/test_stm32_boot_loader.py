# SPDX-License-Identifier: GPL-3.0-or-later
"""The boot loader's protocol against its model, with the cable pulled after every byte."""

import pytest

from protocols.firmware_image import FLASH_BASE
from protocols.stm32_boot_loader import (
    BLOCK_SIZE,
    PAGE_SIZE,
    BootLoaderError,
    Dialogue,
    end_command,
    erase_page,
    read_chip_id,
    read_memory,
    start_program,
    synchronise,
    write_memory,
)
from simulator.board.simulated_board import Power
from tests.support.boot_loader_bench import CablePulledError, DialogueBench, board_in_boot_loader

PAGE = 5
AT = FLASH_BASE + PAGE * PAGE_SIZE


def session(data: bytes) -> Dialogue[bytes]:
    """One of each command."""
    yield from synchronise(1.0)
    assert (yield from read_chip_id()) == 0x410
    yield from erase_page(PAGE)
    yield from write_memory(AT, data)
    return (yield from read_memory(AT, len(data)))


def test_a_page_is_erased_written_and_read() -> None:
    bench = DialogueBench(board_in_boot_loader())
    data = bytes(range(BLOCK_SIZE))
    assert bench.run(session(data)) == data


def all_cuts() -> int:
    bench = DialogueBench(board_in_boot_loader())
    bench.run(session(b"0123456789abcdef"))
    return bench.sent


def test_after_any_cut_the_next_session_works_and_other_pages_are_unchanged() -> None:
    for cut in range(all_cuts()):
        board = board_in_boot_loader()
        before = board.flash_contents
        bench = DialogueBench(board)
        bench.cut_after = cut
        with pytest.raises(CablePulledError):
            bench.run(session(b"0123456789abcdef"))
        bench.wait(0.001 * cut)
        again = DialogueBench(board, bench.now)
        again.run(synchronise(1.0))
        after = board.flash_contents
        pages = {at // PAGE_SIZE for at in range(len(after)) if after[at] != before[at]}
        assert pages <= {0, PAGE}, cut
        assert again.run(session(b"fedcba9876543210")) == b"fedcba9876543210", cut
        assert board.flash_contents[0x1D800:] == before[0x1D800:]


@pytest.mark.parametrize("cut", [3, 100, 257])
def test_a_long_write_broken_off_is_ended(cut: int) -> None:
    board = board_in_boot_loader()
    bench = DialogueBench(board)
    bench.run(synchronise(1.0))
    bench.cut_after = bench.sent + 7 + cut
    with pytest.raises(CablePulledError):
        bench.run(write_memory(AT, bytes(BLOCK_SIZE)))
    again = DialogueBench(board, bench.now)
    assert again.run(session(b"fedcba9876543210")) == b"fedcba9876543210"


def test_a_missing_boot_loader_is_not_found() -> None:
    board = board_in_boot_loader()
    board.power_off(0.0)
    waiting: list[bool] = []
    with pytest.raises(BootLoaderError, match="no boot loader answers"):
        DialogueBench(board).run(synchronise(1.0, lambda: waiting.append(True)))
    assert waiting == [True]


def test_a_board_switched_on_during_the_wait_is_found() -> None:
    board = board_in_boot_loader()
    board.power_off(0.0)
    bench = DialogueBench(board)
    bench.run(synchronise(20.0, lambda: board.power_on(bench.now)))
    assert bench.run(read_chip_id()) == 0x410


def test_a_refusal_names_the_command() -> None:
    bench = DialogueBench(board_in_boot_loader())
    bench.run(synchronise(1.0))
    with pytest.raises(BootLoaderError, match="refuses a read"):
        bench.run(read_memory(0x4000_0000, 16))
    with pytest.raises(BootLoaderError, match="refuses a write"):
        bench.run(write_memory(AT, b"odd"))
    assert bench.run(end_command())


def test_the_start_ends_the_boot_loader() -> None:
    board = board_in_boot_loader()
    bench = DialogueBench(board)
    bench.run(synchronise(1.0))
    board.faults.boot_pads = False
    bench.run(start_program())
    assert board.power is Power.BOOTING
