# SPDX-License-Identifier: GPL-3.0-or-later
"""Power goes in the middle of an upload's flash operations: afterwards the old list or the new one is there, whole."""

import os

from simulator.emulated_naze.image import Image
from tests.support.naze_bench import mission
from tests.support.real_bench import Figure, RealBench

#: An upload of 12 records: three erases, 96 half-words, the header.
_CUTS = int(os.environ.get("NAZE_CUTS", "200"))
_OLD, _NEW = mission(9, seed=1), mission(12, seed=2)


def test_a_power_cut_at_any_operation_leaves_a_whole_list(image: Image, flash: bytes, figure: Figure) -> None:
    prepared = RealBench(image, flash)
    prepared.push(mission(12, seed=3))
    prepared.push(_OLD)
    used = bytes(prepared.flash)
    operations = operations_of_a_push(image, used)
    step = max(operations // _CUTS, 1)
    found = {"old": 0, "new": 0}
    for cut in range(_CUTS):
        operation = 1 + cut * step % operations
        bench = RealBench(image, used, seed=cut)
        bench.naze.faults.power_cut_at_flash_operation = operation
        try:
            bench.push(_NEW)
        except AssertionError:
            assert bench.is_off, f"operation {operation}: no reply, and no power cut"
        assert bench.is_off, f"operation {operation}: the power stayed"
        bench.naze.power_on(bench.now)
        bench.wait_for_boot()
        records = bench.pull()
        assert records in (_OLD, _NEW), f"operation {operation}"
        found["old" if records == _OLD else "new"] += 1
    figure(
        f"{_CUTS} power cuts at {operations} operations", f"old list {found['old']}, new list {found['new']}, else 0"
    )


def operations_of_a_push(image: Image, flash: bytes) -> int:
    bench = RealBench(image, flash)
    before = bench.naze.flash_operations
    bench.push(_NEW)
    return bench.naze.flash_operations - before
