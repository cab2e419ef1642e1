# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole bridge against the compiled firmware core on the simulated board, in simulated time.

After every fault the board's flash holds the whole old or new list, and another push works.
"""

import random
from collections.abc import Callable, Sequence
from functools import cache

import pytest

from protocols.mission_item import MissionItem, MissionResult
from simulator.board.flash import ERASED
from simulator.board.options import Faults, SimOptions
from simulator.board.simulated_board import Power
from simulator.naze.board import SimulatedNaze
from simulator.naze.compiled_core import load_core
from simulator.naze.mission_slots import flash_size
from tests.support.c_core import library
from tests.support.conversations import records_of, waypoints
from tests.support.world import World

OLD, NEW = waypoints(20, seed=77), waypoints(146, seed=5)
OLD_RECORDS, NEW_RECORDS = records_of(OLD), records_of(NEW)
# Three erased pages, the records (here every 20th), the header, the seal.
OPERATIONS = [1, 2, 3, 4, *range(5, 3 + len(NEW), 20), 3 + len(NEW), 3 + len(NEW) + 1, 3 + len(NEW) + 2]

Inject = Callable[[World, random.Random], None]


def make_world(flash: bytearray, seed: int = 0) -> World:
    options, faults = SimOptions(seed=seed, boot_ms=500), Faults()
    naze = SimulatedNaze(options, faults, memoryview(flash), load_core(library()))
    world = World(options, faults, speeds=(115200,), seed=seed, peer=naze)
    world.wait_ready()
    return world


def pushed(world: World, items: Sequence[MissionItem], seconds: float = 90) -> bool:
    """Push the items; True if the push was accepted."""
    outcome = world.push(items)
    world.wait_until(lambda _: bool(outcome), seconds)
    return outcome[0][0].ack is MissionResult.ACCEPTED


@cache
def old_flash() -> bytes:
    flash = bytearray((ERASED,)) * flash_size(SimOptions())
    world = make_world(flash)
    # An earlier list that BEGIN has to erase.
    assert pushed(world, waypoints(146, seed=6))
    assert pushed(world, OLD)
    return bytes(flash)


def push_under(inject: Inject, seed: int) -> bool:
    """Push the new list under faults; True if it was accepted."""
    world = make_world(bytearray(old_flash()), seed)
    assert world.stored == OLD_RECORDS
    inject(world, random.Random(seed))
    accepted = pushed(world, NEW)
    if accepted:
        assert world.stored == NEW_RECORDS
    assert world.stored in (OLD_RECORDS, NEW_RECORDS)
    world.run(4)
    for name in Faults.__dataclass_fields__:
        setattr(world.faults, name, getattr(Faults(), name))
    world.power_on()
    world.run(3)
    world.wait_until(lambda w: w.is_found, 5)
    assert pushed(world, NEW, 10)
    assert world.stored == NEW_RECORDS
    return accepted


def setting(fault: str, value: float) -> Inject:
    return lambda world, _: setattr(world.faults, fault, value)


def resetting(world: World, draw: random.Random) -> None:
    begin = draw.random() * 0.4
    world.after(begin, world.power_off)
    world.after(begin + draw.random(), world.power_on)


def arming(world: World, draw: random.Random) -> None:
    world.after(draw.random() * 0.4, lambda: setattr(world.faults, "armed", True))


def test_146_records_are_written_read_back_and_cleared() -> None:
    flash = bytearray(old_flash())
    world = make_world(flash)
    assert pushed(world, NEW, 5)
    assert world.stored == NEW_RECORDS
    # As in naze_mission.h: the first of two slots, its header and seal, and the records bit for bit.
    assert flash[0:2] == b"NM"
    assert flash[16:18] == b"\0\0"
    assert flash[32 : 32 + 16 * 146] == b"".join(record.pack() for record in NEW_RECORDS)
    assert world.naze.counters.flash_writes == 3
    assert pushed(world, NEW, 5)
    assert world.naze.counters.flash_writes == 3
    assert pushed(world, (), 5)
    assert world.stored == ()
    world.assert_line_was_clean()


def test_a_power_cut_at_any_flash_operation_leaves_the_old_list() -> None:
    for operation in OPERATIONS:
        world = make_world(bytearray(old_flash()))
        world.faults.power_cut_at_flash_operation = operation
        outcome = world.push(NEW)
        world.wait_until(lambda w: w.naze.power is Power.OFF, 2)
        assert world.stored == OLD_RECORDS
        world.power_on()
        world.wait_until(lambda _, outcome=outcome: bool(outcome), 20)  # type: ignore[misc]
        assert world.stored == (NEW_RECORDS if outcome[0][0].ack is MissionResult.ACCEPTED else OLD_RECORDS)


@pytest.mark.parametrize(
    ("inject", "least"),
    [
        (setting("bit_error_rate", 5e-4), 3),
        (setting("lost_byte_rate", 1e-3), 4),
        (setting("flash_failures", 2), 4),
        (setting("flash_failures", 50), 0),
        (resetting, 0),
        (arming, 0),
    ],
    ids=["bit errors", "lost bytes", "flash fails twice", "flash fails", "resets", "arming"],
)
def test_faults_delay_or_fail_the_push_but_keep_lists_intact(inject: Inject, least: int) -> None:
    assert sum(push_under(inject, seed) for seed in range(4)) >= least
