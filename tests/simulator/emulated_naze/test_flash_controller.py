# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated flash: keys, the rules of NOR, a stalled core, and power cuts during an operation."""

import pytest

from simulator.board.simulated_board import Power
from tests.support.table_program import FLASH, RAM, Rig, Steps

KEYR, SR, CR, AR = 0x4002_2004, 0x4002_200C, 0x4002_2010, 0x4002_2014
PG, PER, STRT, LOCK = 1, 2, 1 << 6, 1 << 7
PROGRAM_ERROR, END = 1 << 2, 1 << 5
#: The first page beyond the test's program.
PAGE = 0x8000
PLACE = FLASH + PAGE


def unlock() -> Steps:
    return Steps().store(KEYR, 0x4567_0123).store(KEYR, 0xCDEF_89AB)


def erase(steps: Steps) -> Steps:
    return steps.store(CR, PER).store(AR, PLACE).store(CR, PER | STRT).store(CR, 0)


def test_flash_writes_need_the_keys() -> None:
    steps = Steps().load(CR).store(KEYR, 0x4567_0123).store(KEYR, 1).store(CR, PG).store_half(PLACE, 0x1234).load(CR)
    rig = Rig(steps.load(PLACE).load(SR)).run(0.01)
    assert rig.log(4) == [LOCK, LOCK, 0xFFFF_FFFF, PROGRAM_ERROR]


def test_half_words_can_only_be_programmed_into_erased_flash() -> None:
    steps = unlock().store(CR, PG).store_half(PLACE, 0x1234).load(SR).store(SR, END)
    steps.store_half(PLACE, 0x1230).load(SR).store(SR, PROGRAM_ERROR).load(PLACE).store_half(PLACE, 0).load(PLACE)
    assert Rig(steps).run(0.01).log(4) == [END, PROGRAM_ERROR, 0xFFFF_1234, 0xFFFF_0000]


def test_erasing_a_page_leaves_the_neighbours() -> None:
    flash = memoryview(bytearray(bytes(0x2_0000)))
    rig = Rig(erase(unlock()), flash=flash).run(0.1)
    assert bytes(flash[PAGE : PAGE + 1024]) == b"\xff" * 1024
    assert flash[PAGE - 1] == flash[PAGE + 1024] == 0
    assert rig.board.counters.flash_erases == 1


def test_the_core_stalls_while_a_page_is_erased() -> None:
    rig = Rig(erase(unlock()).store(RAM + 0x4000, 0xCAFE))
    assert rig.run(0.024).ram(0x4000, 2) != b"\xfe\xca"
    assert rig.run(0.003).ram(0x4000, 2) == b"\xfe\xca"


def test_a_given_number_of_operations_fail() -> None:
    steps = unlock().store(CR, PG).load(CR).store_half(PLACE, 1).load(SR).store(SR, PROGRAM_ERROR).store_half(PLACE, 2)
    rig = Rig(steps.load(PLACE))
    rig.board.faults.flash_failures = 1
    assert rig.run(0.01).log(3) == [PG, PROGRAM_ERROR, 0xFFFF_0002]
    assert rig.board.faults.flash_failures == 0


@pytest.mark.parametrize("operation", [1, 2, 3])
def test_a_power_cut_leaves_an_operation_half_done(operation: int) -> None:
    flash = memoryview(bytearray(b"\xff" * 0x2_0000))
    steps = erase(unlock()).store(CR, PG).store_half(PLACE, 0).store_half(PLACE + 2, 0).store_half(PLACE + 4, 0)
    rig = Rig(steps, flash=flash)
    rig.board.faults.power_cut_at_flash_operation = operation
    rig.run(0.1)
    assert rig.board.power is Power.OFF
    assert rig.board.flash_operations == operation
    # Half-words programmed earlier are intact, later ones were not started.
    done = 2 * max(operation - 2, 0)
    assert bytes(flash[PAGE : PAGE + done]) == bytes(done)
    assert bytes(flash[PAGE + done + 2 : PAGE + 1024]) == b"\xff" * (1022 - done)
    rig.board.power_on(rig.now)
    rig.run(0.1)
    assert rig.board.power.name == "RUNNING"
    assert bytes(flash[PAGE : PAGE + 8]) == bytes(6) + b"\xff\xff"
