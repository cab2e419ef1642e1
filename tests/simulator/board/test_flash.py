# SPDX-License-Identifier: GPL-3.0-or-later
"""NOR flash: programming, erasing, and power cuts during both."""

import pytest

from simulator.board.flash import PAGE_SIZE, FlashError, NorFlash, PowerCutError
from simulator.board.options import Faults


def make() -> tuple[NorFlash, Faults, bytearray]:
    memory = bytearray(b"\xff" * (2 * PAGE_SIZE))
    faults = Faults()
    return NorFlash(memoryview(memory), faults), faults, memory


def test_programming_clears_bits_and_only_an_erase_sets_them() -> None:
    flash, _, _ = make()
    flash.program(16, b"\x0f" * 16, 0.1)
    assert flash.read(16, 16) == b"\x0f" * 16
    with pytest.raises(FlashError):
        flash.program(16, b"\xf0" * 16, 0.1)
    assert flash.read(16, 16) == b"\x00" * 16
    flash.erase(0, 0.1)
    assert flash.read(0, PAGE_SIZE) == b"\xff" * PAGE_SIZE


def test_an_erase_leaves_the_other_page_alone() -> None:
    flash, _, memory = make()
    flash.program(PAGE_SIZE, b"kept", 0.1)
    flash.erase(0, 0.1)
    assert memory[PAGE_SIZE : PAGE_SIZE + 4] == b"kept"


def test_the_duration_of_an_operation_is_reported_once() -> None:
    flash, _, _ = make()
    flash.erase(0, 0.02)
    flash.program(0, b"ab", 0.001)
    assert flash.take_busy_seconds() == pytest.approx(0.021)
    assert flash.take_busy_seconds() == 0


def test_a_power_cut_leaves_an_operation_half_done() -> None:
    flash, faults, _ = make()
    faults.power_cut_at_flash_operation = 2
    flash.erase(0, 0.0)
    with pytest.raises(PowerCutError):
        flash.program(0, b"12345678", 0.0)
    assert flash.read(0, 8) == b"1234\xff\xff\xff\xff"


def test_the_given_number_of_operations_fail() -> None:
    flash, faults, _ = make()
    faults.flash_failures = 1
    with pytest.raises(FlashError):
        flash.program(0, b"12", 0.0)
    flash.erase(0, 0.0)
    flash.program(0, b"12", 0.0)
    assert flash.read(0, 2) == b"12"
