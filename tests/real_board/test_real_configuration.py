# SPDX-License-Identifier: GPL-3.0-or-later
"""The configuration's two slots on the image: power cuts, import, an unpatched build in between, and the write budget.

NAZE_PLAIN_IMAGE is the same tree's unpatched image.
"""

import os
import struct
from collections import Counter
from pathlib import Path

import pytest

from protocols.msp.frame import Direction, request
from simulator.board.msp_sensors import MspCommand
from simulator.emulated_naze.image import Image, load_image
from tests.support.copies import in_a_copy
from tests.support.naze_bench import mission
from tests.support.real_bench import Figure, RealBench

_CUTS = int(os.environ.get("NAZE_CUTS", "200"))
_SET_PID, _EEPROM_WRITE = 202, 250
#: Harakiri's configuration, FLASH_WRITE_ADDR, and its size field.
_PLACE, _SIZE_AT = 0x1_F400, 2
#: From power-on until the firmware has loaded its configuration, after finishing an interrupted write.
_LOADED_S = 0.8
_WRITTEN_S = 0.5
#: Half-words of a slot's header.
_HEADER = 9
_LIST = mission(146, 1)


@pytest.fixture
def slotted(bench: RealBench) -> RealBench:
    if "ConfigIsWritten" not in bench.image.symbols:
        pytest.skip("NOT RUN: an image without harakiri_config.c")
    return bench


@pytest.fixture(scope="session")
def plain() -> Image:
    path = os.environ.get("NAZE_PLAIN_IMAGE")
    if not path:
        pytest.skip("NOT RUN: needs the same tree's unpatched image: NAZE_PLAIN_IMAGE=path/to/X.elf")
    return load_image(Path(path).read_bytes(), path)


def pids(bench: RealBench) -> bytes:
    return bench.payload(request(MspCommand.PID))


def save(bench: RealBench, change: int) -> bytes:
    """Change the PIDs and have them stored; return the configuration's place."""
    values = bytearray(pids(bench))
    for index in range(3, 30):
        values[index] = (values[index] + change) % 200
    bench.ask(request(_SET_PID, bytes(values)))
    bench.ask(request(_EEPROM_WRITE))
    bench.run(_WRITTEN_S)
    return place(bench)


def place(bench: RealBench) -> bytes:
    (size,) = struct.unpack_from("<H", bench.flash, _PLACE + _SIZE_AT)
    return bytes(bench.flash[_PLACE : _PLACE + min(size, 3 * 1024)])


def test_a_power_cut_at_any_operation_leaves_a_whole_configuration(slotted: RealBench, figure: Figure) -> None:
    """Each cut hits a copy of one booted board: the old configuration or the new one, all bytes of it."""
    bench = slotted
    bench.push(_LIST)
    save(bench, 1)
    old = save(bench, 1)
    operations, new = in_a_copy(lambda: operations_of_a_save(bench))
    assert old != new
    erases_at = erase_operations(operations, len(old))
    found: Counter[str] = Counter()
    erases = 0
    for cut in range(_CUTS):
        operation = 1 + cut * (operations - 1) // max(_CUTS - 1, 1)
        if cut % 10 == 0:  # the erases: the staged page is the first, the place's pages follow its seal
            operation = erases_at[cut // 10 % 4]
        erases += operation in erases_at
        found[in_a_copy(lambda: configuration_after_a_cut(bench, cut, operation, old, new))] += 1  # noqa: B023
    assert found.keys() <= {"old", "new"}, found
    figure(
        f"{_CUTS} power cuts at {operations} operations of a configuration write, {erases} of them in an erase",
        f"old {found['old']}, new {found['new']}, lost 0",
    )


def operations_of_a_save(bench: RealBench) -> tuple[int, bytes]:
    before = bench.naze.flash_operations
    new = save(bench, 1)
    return bench.naze.flash_operations - before, new


def erase_operations(operations: int, size: int) -> list[int]:
    """The staged page's erase, and those of the place: its words and a header of nine half-words follow them."""
    first = operations - _HEADER - 2 * -(-size // 4) - 2
    return [1, first, first + 1, first + 2]


def configuration_after_a_cut(bench: RealBench, cut: int, operation: int, old: bytes, new: bytes) -> str:
    naze = bench.naze
    # Copies that start at the same time would get the same damage.
    bench.run(0.003 * (cut // 10))
    naze.faults.power_cut_at_flash_operation = operation
    try:
        save(bench, 1)
    except AssertionError:
        assert bench.is_off, f"operation {operation}: no reply, and no power cut"
    assert bench.is_off, f"operation {operation}: the power stayed on"
    naze.power_on(bench.now)
    bench.run(_LOADED_S)
    configurations = {"old": old, "new": new}
    name = next((name for name, content in configurations.items() if place(bench) == content), "neither")
    assert bench.has_loaded(_LIST), f"operation {operation}: another list"
    if cut % 9 == 0 and name in configurations:
        bench.wait_for_boot()
        assert save(bench, 1) not in (b"", configurations[name])
    return name


def test_an_unchanged_configuration_is_not_written_again(slotted: RealBench) -> None:
    save(slotted, 1)
    save(slotted, 0)  # the firmware corrects some of the values
    before = slotted.naze.flash_operations
    save(slotted, 0)
    assert slotted.naze.flash_operations == before


def test_requests_that_write_are_refused_when_the_budget_is_spent(slotted: RealBench, figure: Figure) -> None:
    bench = slotted
    values = bytearray(pids(bench))
    for number in range(600):
        values[5] = number % 200
        bench.ask(request(_SET_PID, bytes(values)))
        reply = bench.ask(request(_EEPROM_WRITE))
        if reply is not None and reply.direction is Direction.ERROR:
            break
    assert 240 <= number <= 260
    figure("EEPROM_WRITE requests with a change until the write budget is spent", number)


def test_the_unpatched_build_finds_the_last_configuration_and_its_own_is_imported(
    slotted: RealBench, plain: Image, figure: Figure
) -> None:
    """Patched, unpatched, patched again: each starts with what the one before has saved."""
    bench = slotted
    save(bench, 1)
    save(bench, 1)
    patched_pids, patched_list = pids(bench), mission(5, 1)
    bench.push(patched_list)

    unpatched = RealBench(plain, bytes(bench.flash))
    assert pids(unpatched) == patched_pids
    save(unpatched, 3)
    unpatched_pids = pids(unpatched)
    assert unpatched_pids != patched_pids

    again = RealBench(bench.image, bytes(unpatched.flash))
    assert pids(again) == unpatched_pids
    # The unpatched build has not changed the list: the pushed one is newer than the copy that it saved again.
    assert again.pull() == patched_list
    again.power_cycle()
    assert pids(again) == unpatched_pids
    figure("patched, unpatched, patched again", "each build starts with the settings saved last")


def test_the_first_start_after_patching_imports_the_configuration(
    slotted: RealBench, plain: Image, figure: Figure
) -> None:
    before = RealBench(plain)
    save(before, 7)
    patched = RealBench(slotted.image, bytes(before.flash))
    assert pids(patched) == pids(before)
    patched.power_cycle()
    assert pids(patched) == pids(before)
    figure("settings of the unpatched build", "imported")
