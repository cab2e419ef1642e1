# SPDX-License-Identifier: GPL-3.0-or-later
"""A push under every fault: the flight controller ends with the confirmed new list or the whole old one.

Only a push interrupted during COMMIT may end with "read the mission back". Afterwards the line always works.
"""

import random
from collections import Counter
from collections.abc import Callable

import pytest

from bridge.missions.fc_mission_store import PushFailure
from bridge.missions.mission_service import DeliveryResult, HeldMission
from bridge.model.missions import ARMED
from protocols.mission_item import MissionResult
from protocols.msp.mission import MissionCommand
from simulator.board.options import Faults, SimOptions
from tests.support.conversations import records_of, waypoints
from tests.support.seeds import seeds
from tests.support.world import World, flash_holding, ready_world

OLD = waypoints(20, seed=77)
NEW = waypoints(146, seed=5)
OLD_RECORDS, NEW_RECORDS = records_of(OLD), records_of(NEW)
OLD_FLASH = flash_holding(OLD_RECORDS)

BUSY_TEXT = "Flight controller is busy writing: try again"

Injection = Callable[[World, random.Random], None]


def holding_the_old_list(seed: int, options: SimOptions | None = None) -> World:
    options = options or SimOptions(seed=seed, boot_ms=500)
    world = ready_world(options, seed=seed, flash=OLD_FLASH)
    assert world.stored == OLD_RECORDS
    return world


def push_under(inject: Injection, seed: int, options: SimOptions | None = None) -> tuple[str, World]:
    """Push the new list during faults; return the result after checking that it is true."""
    world = holding_the_old_list(seed, options)
    world.written.clear()
    inject(world, random.Random(seed))
    result = world.pushed(NEW, 90)
    stored = world.stored
    committed = MissionCommand.COMMIT in [frame.command for frame in world.requests()]
    if isinstance(result, DeliveryResult) and result.ack is MissionResult.ACCEPTED:
        assert stored == NEW_RECORDS
        reported = "ACCEPTED"
    else:
        reported = result.text
        # INVALID: the last of three attempts ended with a record whose damage passed the checksum.
        assert result.ack in (MissionResult.DENIED, MissionResult.NO_SPACE, MissionResult.INVALID)
        if result.text == PushFailure.UNCERTAIN.value.text:
            assert committed
            assert stored in (OLD_RECORDS, NEW_RECORDS)
        else:
            assert stored == OLD_RECORDS
    works_again(world)
    return reported, world


def works_again(world: World) -> None:
    """Without the faults, the same push succeeds and the list reads back."""
    world.run(1)
    world.run_until(lambda w: not w._events, 3)  # the last fault has begun and ended
    faults = world.faults
    for name in Faults.__dataclass_fields__:
        setattr(faults, name, getattr(Faults(), name))
    world.power_on()
    world.run(3)
    world.wait_until(lambda w: w.is_found, 5)
    assert world.pushed(NEW, 5).ack is MissionResult.ACCEPTED
    assert world.stored == NEW_RECORDS
    assert world.naze.counters.hazard_runs == 0 or world.faults.bit_error_rate


def outcomes(inject: Injection, short: int, options: SimOptions | None = None) -> Counter[str]:
    return Counter(push_under(inject, seed, options)[0] for seed in seeds(short))


def setting(**faults: float) -> Injection:
    def inject(world: World, _: random.Random) -> None:
        for name, value in faults.items():
            setattr(world.faults, name, value)

    return inject


def switching(fault: str, latest: float, longest: float) -> Injection:
    """Switch a fault on at some moment of the push and off later."""

    def inject(world: World, draw: random.Random) -> None:
        begin = draw.random() * latest
        world.after(begin, lambda: setattr(world.faults, fault, True))
        world.after(begin + draw.random() * longest, lambda: setattr(world.faults, fault, False))

    return inject


def test_a_push_without_faults_is_limited_only_by_the_line() -> None:
    reported, world = push_under(lambda world, draw: None, 0)
    assert reported == "ACCEPTED"
    world.assert_line_was_clean()


def busy_for(seconds: float) -> Injection:
    def inject(world: World, _: random.Random) -> None:
        world.faults.busy = True
        world.after(seconds, lambda: setattr(world.faults, "busy", False))

    return inject


def failing_flash(failures: int) -> Injection:
    def inject(world: World, draw: random.Random) -> None:
        world.after(draw.random() * 0.2, lambda: setattr(world.faults, "flash_failures", failures))

    return inject


@pytest.mark.parametrize(
    ("inject", "short", "ends"),
    [
        *((setting(bit_error_rate=rate), 4, {"ACCEPTED"}) for rate in (1e-5, 1e-4, 3e-4)),
        *((setting(lost_byte_rate=rate), 4, {"ACCEPTED"}) for rate in (1e-4, 3e-3)),
        (switching("hang", 0.4, 1.0), 5, {"ACCEPTED"}),
        (switching("armed", 0.4, 0.1), 5, {"ACCEPTED", PushFailure.ARMED.value.text, ARMED.text}),
        # It waits for up to a second.
        (busy_for(0.5), 2, {"ACCEPTED"}),
        (busy_for(3.0), 2, {BUSY_TEXT}),
        (switching("busy", 0.4, 2), 5, {"ACCEPTED", PushFailure.BUSY.value.text, BUSY_TEXT}),
        # A failed write is retried twice. Successive failures may each hit one page of an erase: one failure of BEGIN.
        *((failing_flash(failures), 4, {"ACCEPTED"}) for failures in (1, 2)),
        (failing_flash(3), 4, {PushFailure.FLASH.value.text}),
    ],
)
def test_a_push_under_a_fault_ends_as_it_must(inject: Injection, short: int, ends: set[str]) -> None:
    assert set(outcomes(inject, short)) <= ends


def test_a_damaged_chunk_costs_less_than_its_timeout() -> None:
    """Chunk by chunk, none of these ended in time: each loss was only noticed by silence."""
    ends = outcomes(setting(bit_error_rate=1e-3), 5)
    assert ends["ACCEPTED"] >= 1


def test_many_bit_errors_are_recovered() -> None:
    """A third of the long frames are damaged, and some pass an 8-bit checksum: of 120 pushes, 2 end with a reason."""
    found = outcomes(setting(bit_error_rate=5e-4), 5)
    assert set(found) <= {"ACCEPTED", PushFailure.NO_ANSWER.value.text}
    assert found["ACCEPTED"] >= 4


def test_a_repeated_push_continues_where_it_ended() -> None:
    for seed in range(4):
        world = holding_the_old_list(seed)
        world.faults.bit_error_rate = 1e-3
        for _ in range(3):
            if world.pushed(NEW, 4.9).ack is MissionResult.ACCEPTED:
                break
            assert world.stored == OLD_RECORDS
        assert world.stored == NEW_RECORDS


@pytest.mark.parametrize("rate", [1e-3, 4e-3])
def test_a_push_over_a_bad_line_ends_before_mission_planner_times_out(rate: float) -> None:
    for seed in range(3):
        world = holding_the_old_list(seed)
        world.faults.bit_error_rate = rate
        is_accepted = world.pushed(NEW, 4.9).ack is MissionResult.ACCEPTED
        assert world.stored == (NEW_RECORDS if is_accepted else OLD_RECORDS)


def test_a_damaged_reply_is_not_trusted() -> None:
    """Seeds with damage that passed the checksum: INFO's radius and COMMIT's reply."""
    for seed in (1073, 1171, 1339, 1540):
        reported, _ = push_under(setting(bit_error_rate=1e-3), seed)
        assert reported in ("ACCEPTED", PushFailure.OUT_OF_TIME.value.text)


def test_a_pull_over_a_bad_line_is_exact_or_fails() -> None:
    """A READ reply with a damaged position once raised a KeyError in one run of fifty."""
    held = 0
    for seed in seeds(8):
        world = holding_the_old_list(seed)
        world.pushed(NEW, 5)
        world.faults.bit_error_rate = 4e-4
        world.inside.missions.held = None
        answer = world.pull()
        if isinstance(answer, HeldMission):
            held += 1
            assert answer.records == NEW_RECORDS
    assert held >= 2


@pytest.mark.parametrize("window", [1, 2, 4])
@pytest.mark.parametrize("chunk", [1, 15])
def test_losses_are_recovered_with_any_window_and_chunk_size(window: int, chunk: int) -> None:
    options = SimOptions(boot_ms=500, chunk_window=window, chunk_records=chunk)
    assert set(outcomes(setting(lost_byte_rate=1e-3), 2, options)) == {"ACCEPTED"}


def test_replies_pending_during_a_stall_fit_the_ring() -> None:
    for seed in seeds(4):
        _, world = push_under(switching("hang", 0.4, 1.5), seed)
        assert world.naze.counters.tx_overflows == 0


def test_a_push_fails_after_a_long_stall() -> None:
    reported = outcomes(
        lambda world, draw: world.after(draw.random() * 0.4, lambda: setattr(world.faults, "hang", True)), 6
    )
    failures = {PushFailure.NO_ANSWER.value.text, PushFailure.UNCERTAIN.value.text, "No link to the flight controller"}
    assert set(reported) <= failures | {"ACCEPTED"}
    assert reported["ACCEPTED"] < reported.total()


def test_a_power_cut_at_any_moment_leaves_the_old_or_the_new_list() -> None:
    def inject(world: World, draw: random.Random) -> None:
        begin = draw.random() * 0.4
        world.after(begin, world.power_off)
        world.after(begin + draw.random() * draw.choice((0.1, 3)), world.power_on)

    assert len(outcomes(inject, 8)) > 1


def test_a_port_lost_at_any_moment_leaves_the_old_or_the_new_list() -> None:
    """The push ends with the line, and never continues on the next one."""

    def inject(world: World, draw: random.Random) -> None:
        def unplug() -> None:
            world.unplug()
            world.after(0, lambda: busy.append(world.bridge.is_busy))

        begin = draw.random() * 0.6
        world.after(begin, unplug)
        world.after(begin + draw.random() * draw.choice((0.1, 3)), world.plug)

    busy: list[bool] = []
    assert len(outcomes(inject, 8)) > 1
    assert not any(busy)


def test_arming_during_a_push_keeps_the_old_list() -> None:
    def inject(world: World, draw: random.Random) -> None:
        world.after(draw.random() * 0.45, lambda: setattr(world.faults, "armed", True))

    reported = outcomes(inject, 8)
    assert set(reported) <= {"ACCEPTED", PushFailure.ARMED.value.text, ARMED.text}
    assert reported[PushFailure.ARMED.value.text] > 2


def test_a_refusal_for_flash_wear_is_not_reported_as_busy() -> None:
    world = holding_the_old_list(0)
    results = [world.pushed(waypoints(2, seed=1000 + seed)) for seed in range(251)]
    assert [result.ack for result in results] == [MissionResult.ACCEPTED] * 250 + [MissionResult.DENIED]
    assert results[-1].text == PushFailure.WRITES_SPENT.value.text
    assert world.stored == records_of(waypoints(2, seed=1249))


def test_an_identical_list_is_not_written_again() -> None:
    world = holding_the_old_list(0)
    writes, operations = world.naze.counters.flash_writes, world.naze.flash_operations
    for _ in range(3):
        assert world.pushed(OLD, 5).text.startswith("20 of 20 unchanged: ")
    assert (world.naze.counters.flash_writes, world.naze.flash_operations) == (writes, operations)


def test_an_empty_list_is_not_cleared_again() -> None:
    world = holding_the_old_list(0)
    for expected in ("Mission on the flight controller cleared", "No mission to clear on the flight controller"):
        assert world.pushed([], 5).text == expected
        assert world.stored == ()
    assert world.naze.counters.flash_writes == 2


def test_telemetry_continues_alongside_a_push_and_the_bounds_hold() -> None:
    """Arming must be noticed during a push; polls and chunks share the board's ring."""
    world = holding_the_old_list(0)
    outcome = world.push(NEW)
    world.run(0.3)
    polls = [frame for frame in world.requests() if frame.command == 101]
    world.wait_until(lambda _: bool(outcome), 2)
    assert polls
    world.run(20)
    world.assert_line_was_clean()
    assert world.naze.counters.max_outstanding_reply_bytes <= 224
