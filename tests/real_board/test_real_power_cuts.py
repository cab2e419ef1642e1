# SPDX-License-Identifier: GPL-3.0-or-later
"""Power cuts during an upload's flash operations: afterwards the complete old or new list is stored."""

import os
from collections import Counter

from tests.support.copies import in_a_copy
from tests.support.naze_bench import mission
from tests.support.real_bench import Figure, RealBench

_CUTS = int(os.environ.get("NAZE_CUTS", "200"))
#: The maximum number of records, for which BEGIN erases three pages.
_SIZE, _ERASES = 146, 3
#: From power-on until the firmware has loaded the stored list into RAM.
_LOADED_S = 0.5
_OLD, _NEW, _NEXT = (mission(_SIZE, seed) for seed in range(3))


def test_a_power_cut_at_any_operation_leaves_a_whole_list(bench: RealBench, figure: Figure) -> None:
    """Each cut hits a copy of one booted board with lists in both slots."""
    bench.push(_NEXT)
    bench.push(_OLD)
    operations = in_a_copy(lambda: operations_of_a_push(bench))
    found: Counter[str] = Counter()
    erases = 0
    for cut in range(_CUTS):
        operation = 1 + cut * (operations - 1) // max(_CUTS - 1, 1)
        if cut % 10 == 0:
            # Few operations erase, but the results of an interrupted erase differ most.
            operation = 1 + cut // 10 % _ERASES
        erases += operation <= _ERASES
        found[in_a_copy(lambda: list_after_a_cut(bench, cut, operation))] += 1  # noqa: B023
    assert found.keys() <= {"old", "new"}, found
    figure(
        f"{_CUTS} power cuts at {operations} operations, {erases} of them in an erase",
        f"old list {found['old']}, new list {found['new']}, else 0",
    )


def operations_of_a_push(bench: RealBench) -> int:
    before = bench.naze.flash_operations
    bench.push(_NEW)
    return bench.naze.flash_operations - before


def list_after_a_cut(bench: RealBench, cut: int, operation: int) -> str:
    """The firmware's list after a power cut: "old", "new", or neither.

    It is loaded early in the boot, where most copies end. Every ninth boots completely: the list is read through the
    UART, and another upload overwrites the remains.
    """
    naze = bench.naze
    # Copies that start at the same time would get the same damage.
    bench.run(0.003 * (cut // 10))
    naze.faults.power_cut_at_flash_operation = operation
    try:
        bench.push(_NEW)
    except AssertionError:
        assert bench.is_off, f"operation {operation}: no reply, and no power cut"
    assert bench.is_off, f"operation {operation}: the power stayed on"
    naze.power_on(bench.now)
    bench.run(_LOADED_S)
    lists = {"old": _OLD, "new": _NEW}
    found = next((name for name, records in lists.items() if bench.has_loaded(records)), "neither")
    if cut % 9 == 0:
        bench.wait_for_boot()
        assert bench.pull() == lists[found], f"operation {operation}"
        bench.push(_NEXT)
        assert bench.pull() == _NEXT, f"operation {operation}"
    return found
