# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated board's core: clocks, time, interrupts, reset, and crashed programs."""

import logging
from itertools import pairwise

import pytest

from simulator.board.simulated_board import Power
from tests.support.table_program import RAM, Rig, Steps

RCC_CR, RCC_CFGR, RCC_CSR = 0x4002_1000, 0x4002_1004, 0x4002_1024
SYST_CSR, SYST_RVR, SYST_CVR, ICSR = 0xE000_E010, 0xE000_E014, 0xE000_E018, 0xE000_ED04
AIRCR = 0xE000_ED0C
#: Crystal, times nine, APB1 at half: 72 MHz.
AT_72_MHZ = (
    Steps()
    .store(RCC_CR, 1 << 16 | 1)
    .wait(RCC_CR, 1 << 17)
    .store(RCC_CFGR, 7 << 18 | 1 << 16 | 0b100 << 8)
    .store(RCC_CR, 1 << 24 | 1 << 16 | 1)
    .wait(RCC_CR, 1 << 25)
    .store(RCC_CFGR, 7 << 18 | 1 << 16 | 0b100 << 8 | 0b10)
    .wait(RCC_CFGR, 0b1000)
)


def at_72_mhz() -> Steps:
    return Steps(list(AT_72_MHZ.rows))


def ticking(every_cycles: int, interrupt: bool = True) -> Steps:
    return (
        at_72_mhz().store(SYST_RVR, every_cycles - 1).store(SYST_CVR, 0).store(SYST_CSR, 0b111 if interrupt else 0b101)
    )


def test_systick_interrupts_every_millisecond() -> None:
    rig = Rig(ticking(72_000), handler=Steps().load(ICSR)).run(0.0505)
    assert rig.handler_log() == [15] * 50


def test_systick_counts_down_and_the_flag_is_cleared_by_reading() -> None:
    steps = ticking(72_000, interrupt=False).load(SYST_CVR).load(SYST_CVR).wait(SYST_CSR, 1 << 16).load(SYST_CSR)
    first, second, control = Rig(steps).run(0.01).log(3)
    assert 71_000 < second < first < 72_000
    assert control == 0b101


def test_busy_waiting_takes_the_expected_time() -> None:
    steps = ticking(72_000, interrupt=False)
    for _ in range(20):
        steps.wait(SYST_CSR, 1 << 16)
    rig = Rig(steps.load(RCC_CSR)).run(0.0195)
    assert rig.ram(0x100, 4) != Rig(steps).run(0.025).ram(0x100, 4)


@pytest.mark.parametrize(("systick_priority", "order"), [(0xF0, [53, 15]), (0, [15, 15])])
def test_a_more_urgent_interrupt_preempts_a_handler(systick_priority: int, order: list[int]) -> None:
    """SysTick's handler sets interrupt 37 (exception 53) pending. If that preempts it, it overwrites its log."""
    enable, disable, pend, priorities = 0xE000_E104, 0xE000_E184, 0xE000_E204, 0xE000_ED20
    steps = at_72_mhz().store(priorities, systick_priority << 24).store(enable, 1 << 5).store(ICSR, 1 << 26)
    handler = Steps().load(ICSR).store(pend, 1 << 5).load(ICSR).store(disable, 1 << 5)
    assert Rig(steps, handler).run(0.001).handler_log() == order


def test_a_reset_keeps_ram_and_a_power_cut_does_not() -> None:
    request = 0x05FA << 16 | 1 << 2
    rig = Rig(Steps().load(RCC_CSR).store(RAM + 0x4000, 0xCAFE).store(AIRCR, request)).run(0.0001)
    assert rig.board.counters.resets > 0
    assert rig.log(1) == [1 << 28]
    assert rig.ram(0x4000, 2) == b"\xfe\xca"
    rig.board.power_off(rig.now)
    rig.board.power_on(rig.now)
    assert rig.ram(0x4000, 2) != b"\xfe\xca"


def test_a_reset_needs_the_key() -> None:
    assert Rig(Steps().store(AIRCR, 1 << 2)).run(0.001).board.counters.resets == 0


def test_invalid_code_stops_the_board(caplog: pytest.LogCaptureFixture) -> None:
    rig = Rig(Steps().load(0x6000_0000)).run(0.001)
    assert rig.board.power is Power.CRASHED
    assert rig.board.counters.crashes == 1
    assert "the core has crashed" in caplog.text
    rig.board.power_off(rig.now)
    rig.board.power_on(rig.now)
    assert rig.board.power.name == "RUNNING"


def test_an_access_to_a_missing_peripheral_is_reported_once(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        rig = Rig(Steps().load(0x4000_6400).load(0x4000_6404)).run(0.001)
    assert rig.log(2) == [0, 0]
    assert [record.message for record in caplog.records] == [
        "the image uses a peripheral at 0x40006400, which is not emulated"
    ]


def test_pins_read_their_driven_or_external_level() -> None:
    port_c, crh, idr, odr, bsrr, brr = 0x4001_1000, 4, 8, 12, 16, 20
    steps = Steps().load(port_c + idr).store(port_c + crh, 0x4444_4443).store(port_c + bsrr, 1 << 8).load(port_c + idr)
    steps.store(port_c + brr, 1 << 8).load(port_c + idr).store(port_c + bsrr, 1 << 8 | 1 << 24).load(port_c + odr)
    assert Rig(steps).run(0.001).log(4) == [0x7FFF, 0x7FFF, 0x7EFF, 1 << 8]


def test_a_timer_counts_at_the_prescaled_clock() -> None:
    timer, cr1, cnt, psc, arr = 0x4000_0000, 0, 0x24, 0x28, 0x2C
    steps = ticking(72_000, interrupt=False).store(timer + psc, 71).store(timer + arr, 0xFFFF).store(timer + cr1, 1)
    steps.store(timer + cnt, 0).wait(SYST_CSR, 1 << 16).wait(SYST_CSR, 1 << 16).load(timer + cnt)
    (microseconds,) = Rig(steps).run(0.01).log(1)
    assert 1900 < microseconds < 2010


def test_the_receiver_encodes_channels_as_times_between_edges() -> None:
    timer, cr1, dier, sr, psc, ccr1 = 0x4000_0000, 0, 0x0C, 0x10, 0x28, 0x34
    steps = at_72_mhz().store(0xE000_E100, 1 << 28).store(timer + psc, 71).store(timer + dier, 2).store(timer + cr1, 1)
    rig = Rig(steps, handler=Steps().load(timer + ccr1).store_half(timer + sr, 0))
    rig.board.faults.roll, rig.board.faults.aux4 = 1234, 2010
    rig.run(0.1)
    edges = rig.handler_log()
    pauses = [(after - before) % 0x10000 for before, after in pairwise(edges)]
    assert pauses[:8] == [1234, 1500, 1000, 1500, 1000, 1000, 1000, 2010]
    assert pauses[8] > 2700


def test_the_battery_is_measured_into_memory() -> None:
    dma, adc = 0x4002_0000, 0x4001_2400
    steps = Steps().store(dma + 0x10, adc + 0x4C).store(dma + 0x14, RAM + 0x4000).store(dma + 0x0C, 1)
    steps.store(dma + 0x08, 1 << 10 | 1 << 8 | 1 << 5 | 1).store(adc + 8, 1 << 8 | 0b1011)
    steps.load(adc + 8).store(adc + 8, 1 << 22 | 1 << 8 | 0b11)
    rig = Rig(steps).run(0.005)
    assert rig.log(1) == [1 << 8 | 0b11]
    assert int.from_bytes(rig.ram(0x4000, 2), "little") == 1550
