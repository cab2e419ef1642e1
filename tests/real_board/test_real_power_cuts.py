# SPDX-License-Identifier: GPL-3.0-or-later
"""Power goes in the middle of an upload's flash operations: afterwards the old list or the new one is there, whole."""

import os

from tests.support.naze_bench import mission
from tests.support.real_bench import Figure, RealBench

_CUTS = int(os.environ.get("NAZE_CUTS", "200"))
#: Long enough for 200 operations: a page to erase, eight half-words a record, the header and the seal.
_SIZE = 30


def test_a_power_cut_at_any_operation_leaves_a_whole_list(bench: RealBench, figure: Figure) -> None:
    """One board goes through all cuts: it boots after each, and the next upload erases what the cut has torn."""
    naze, faults = bench.naze, bench.naze.faults
    # Both slots in use: from the third upload on, each erases one.
    for seed in range(2):
        bench.push(mission(_SIZE, seed))
    before = naze.flash_operations
    bench.push(mission(_SIZE, seed=2))
    operations = naze.flash_operations - before
    found = {"old": 0, "new": 0}
    for cut in range(_CUTS):
        old, new = (mission(_SIZE, seed=3 + 2 * cut + i) for i in range(2))
        bench.push(old)
        operation = 1 + cut * (operations - 1) // max(_CUTS - 1, 1)
        faults.power_cut_at_flash_operation = operation
        try:
            bench.push(new)
        except AssertionError:
            assert bench.is_off, f"operation {operation}: no reply, and no power cut"
        assert bench.is_off, f"operation {operation}: the power stayed on"
        naze.power_on(bench.now)
        bench.wait_for_boot()
        records = bench.pull()
        assert records in (old, new), f"operation {operation}"
        found["old" if records == old else "new"] += 1
    figure(
        f"{_CUTS} power cuts at {operations} operations", f"old list {found['old']}, new list {found['new']}, else 0"
    )
