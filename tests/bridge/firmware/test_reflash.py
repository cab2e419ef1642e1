# SPDX-License-Identifier: GPL-3.0-or-later
"""A flash rewritten through the boot loader, broken off at many places and resumed."""

import random

import pytest

from bridge.firmware.reflash import (
    CommandLineError,
    FlashingError,
    Progress,
    find_chip,
    read_dump,
    read_flash,
    rewrite_flash,
    settings_in,
    start_boot_loader,
)
from protocols.stm32_boot_loader import Dialogue, start_program
from simulator.board.options import SimOptions
from simulator.board.simulated_board import Power
from simulator.naze.board import SimulatedNaze
from simulator.naze.whole_flash import stand_in
from tests.support.boot_loader_bench import CablePulledError, DialogueBench, board_in_boot_loader
from tests.support.naze_bench import BOOT_SECONDS

_PAGES = 6
#: Bytes in a page of a medium-density STM32F103's flash (ST PM0075, 2.1).
_PAGE = 1024
PROGRAM = stand_in(patched=True) + random.Random(1).randbytes(_PAGES * _PAGE - 500)


def quiet(_name: str, _done: int, _total: int) -> None:
    """No progress is shown."""


def flash(progress: Progress = quiet) -> Dialogue[None]:
    yield from find_chip(5.0, lambda: None)
    present = yield from read_flash(progress)
    yield from rewrite_flash(present, PROGRAM.ljust(0x1D800, b"\xff") + present[0x1D800:], progress)


def assert_flashed(board: SimulatedNaze, reserved: bytes) -> None:
    contents = board.flash_contents
    assert contents[:0x1D800].rstrip(b"\xff") == PROGRAM.rstrip(b"\xff")
    assert contents[0x1D800:] == reserved


def test_a_program_is_written_and_everything_above_it_is_kept() -> None:
    board = board_in_boot_loader()
    reserved = board.flash_contents[0x1D800:]
    steps: dict[str, tuple[int, int]] = {}
    bench = DialogueBench(board)
    bench.run(flash(lambda name, done, total: steps.update({name: (done, total)})))
    assert_flashed(board, reserved)
    assert steps == {
        "reading": (128, 128),
        "erasing": (_PAGES, _PAGES),
        "writing": (_PAGES, _PAGES),
        "verifying": (_PAGES, _PAGES),
    }
    board.faults.boot_pads = False
    bench.run(start_program())
    assert board.faults.extension
    operations = board.flash_operations
    board.faults.boot_pads = True
    board.reset(bench.now)
    bench.run(flash())
    assert board.flash_operations == operations, "an equal flash was written again"


def session_bytes() -> tuple[int, int]:
    """How many bytes are sent before the first erase, and in total."""
    bench = DialogueBench(board_in_boot_loader())
    marks: dict[str, int] = {}
    bench.run(flash(lambda name, _done, _total: marks.update({name: bench.sent})))
    return marks["reading"], bench.sent


def test_an_interrupted_flash_resumes_and_never_starts_half_a_program() -> None:
    read, total = session_bytes()
    dice = random.Random(2)
    for cut in sorted((dice.randrange(read), *dice.sample(range(read, total), 3))):
        board = board_in_boot_loader(cut)
        before = board.flash_contents
        bench = DialogueBench(board)
        bench.cut_after = cut
        with pytest.raises(CablePulledError):
            bench.run(flash())
        half = board.flash_contents
        if not half.startswith(b"\xff" * 8):
            is_whole = half[:0x1D800].rstrip(b"\xff") in (PROGRAM, before[:0x1D800].rstrip(b"\xff"))
            assert is_whole, f"a half-written program would start, cut {cut}"
        again = DialogueBench(board, bench.now + 1)
        again.run(flash())
        assert_flashed(board, before[0x1D800:])


@pytest.mark.parametrize("operation", [1, 7, 20, 30])
def test_after_a_power_cut_the_boot_pads_resume_it(operation: int) -> None:
    board = board_in_boot_loader(operation)
    reserved = board.flash_contents[0x1D800:]
    board.faults.power_cut_at_flash_operation = operation
    bench = DialogueBench(board)
    with pytest.raises(FlashingError, match="no longer answers"):
        bench.run(flash())
    assert board.power is Power.OFF
    board.power_on(bench.now)
    bench.run(flash())
    assert_flashed(board, reserved)


def test_lost_bytes_and_failed_operations_are_repeated() -> None:
    board = board_in_boot_loader()
    reserved = board.flash_contents[0x1D800:]
    board.faults.lost_byte_rate = 2e-5
    board.faults.flash_failures = 2
    bench = DialogueBench(board)
    bench.run(flash())
    assert_flashed(board, reserved)


def test_a_flash_that_keeps_failing_is_given_up() -> None:
    board = board_in_boot_loader()
    bench = DialogueBench(board)
    bench.run(find_chip(1.0, lambda: None))
    present = bench.run(read_flash(quiet))
    board.faults.flash_failures = 1000
    with pytest.raises(FlashingError, match="does not keep what is written at 0x08000000"):
        bench.run(rewrite_flash(present, bytes(_PAGE) + present[_PAGE:], quiet))


def booted() -> DialogueBench:
    board = SimulatedNaze(SimOptions(wp_radius_cm=345))
    board.power_on(0.0)
    bench = DialogueBench(board)
    bench.wait(BOOT_SECONDS + 0.1)
    return bench


def test_the_settings_are_printed_before_the_boot_loader_starts() -> None:
    bench = booted()
    assert bench.run(read_dump()).splitlines()[-1] == "gps_wp_radius = 345"
    bench.run(start_boot_loader())
    assert isinstance(bench.board, SimulatedNaze)
    assert bench.board.power is Power.BOOTLOADER


def test_an_armed_board_does_not_open_a_command_line() -> None:
    bench = booted()
    assert isinstance(bench.board, SimulatedNaze)
    bench.board.faults.armed = True
    bench.wait(0.5)
    with pytest.raises(CommandLineError, match="does not open"):
        bench.run(read_dump())
    assert bench.board.power is Power.RUNNING
    assert bench.board.armed


def test_the_settings_in_a_dump_are_the_numbers() -> None:
    dump = "Config:\nFW: x = 3 y\n00|ANGLE   : ---\nrc_db = 20\nrc_trm_rll =  -0.500\nEnabled features: PPM\n"
    assert settings_in(dump) == {"rc_db": 20.0, "rc_trm_rll": -0.5}
