# SPDX-License-Identifier: GPL-3.0-or-later
"""Long-term limits on a ground station's requests, in simulated time."""

import gc
from collections import Counter

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.gcs.budget import Budget, Budgets, Cost
from tests.support.world import GroundStation, World


def spent(budget: Budget, cost: Cost, now: float = 0.0, *, is_proven: bool = False) -> int:
    """The number of messages that it allows until it has refused a hundred."""
    allowed = refused = 0
    while refused < 100 and allowed < 20_000:
        if budget.allows(cost, now, is_proven=is_proven):
            allowed += 1
        else:
            refused += 1
    return allowed


@pytest.mark.parametrize("cost", Cost)
def test_a_crowd_uses_up_the_total_but_not_the_budget_of_a_station_with_rights(cost: Cost) -> None:
    budgets = Budgets()
    crowd = [spent(budgets.of(f"10.0.0.{number}"), cost) for number in range(60)]
    assert crowd[0] == min(cost.each.burst, cost.total.burst)
    assert sum(crowd) == cost.total.burst
    assert spent(budgets.of("pilot"), cost, is_proven=True) == cost.each.burst


def test_an_address_that_comes_back_has_the_budget_that_it_left() -> None:
    budgets = Budgets()
    assert spent(budgets.of("10.0.0.1"), Cost.BOARD) == 20
    assert spent(budgets.of("10.0.0.1"), Cost.BOARD) == 0


def test_thousands_of_addresses_are_not_remembered() -> None:
    budgets = Budgets()
    for number in range(5000):
        budgets.of(("made up", number)).allows(Cost.ANSWER, 0.0)
    gc.collect()
    assert sum(isinstance(each, Budget) for each in gc.get_objects()) < 2000


def test_limits_do_not_depend_on_when_the_clock_starts() -> None:
    stranger = Budgets().of("10.0.0.1")
    for now in (1e5, 1e5 + 1, 1e9, 1e9):
        assert stranger.allows(Cost.RECEIVED, now)


@pytest.mark.parametrize("hosts", [1, 15, 60])
def test_a_flash_page_survives_a_month_of_writes_by_strangers(hosts: int) -> None:
    """A page endures 10,000 erases."""
    budgets = Budgets()
    writes = 0
    for minute in range(0, 30 * 24 * 60, 5):
        writes += sum(budgets.of(host).allows(Cost.FLASH, minute * 60.0) for host in range(hosts))
    assert writes < 10_000


def test_one_stranger_leaves_half_of_the_flash_writes_to_others() -> None:
    budgets = Budgets()
    assert spent(budgets.of("stranger"), Cost.FLASH) == 200
    assert spent(budgets.of("pilot"), Cost.FLASH) == 200


def test_a_flood_of_counts_is_not_logged(world: World) -> None:
    station = GroundStation(world)
    world.arm(5)
    for number in range(2000):
        world.after(number / 500, lambda: station.send(m.MAVLink_mission_count_message(1, 1, 999)))
    world.run(5)
    limit = Cost.UPLOAD.each
    assert limit.burst / 2 < len(world.events("mission.refused")) <= limit.burst + limit.per_s * 5
    assert {ack.type for ack in station.messages("MISSION_ACK")} == {m.MAV_MISSION_DENIED}
    assert "Too many uploads: wait a few seconds" in station.texts()


def test_strangers_requests_do_not_reach_an_armed_board(world: World) -> None:
    """MISSION_CLEAR_ALL while armed once made it send eight times as much as telemetry does."""
    stranger = GroundStation(world)
    stranger.send(m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    world.arm(5)
    asked = (
        m.MAVLink_mission_clear_all_message(1, 1),
        m.MAVLink_mission_count_message(1, 1, 9),
        m.MAVLink_mission_request_int_message(1, 1, 0),
        m.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", 300, 9),
        m.MAVLink_command_long_message(1, 1, 241, 0, 0, 1, 0, 0, 0, 0, 0),
    )

    def requests(seconds: float) -> Counter[int]:
        return Counter(frame.command for frame in world.requests_during(seconds))

    def ask_all() -> None:
        for message in asked:
            stranger.send(message)

    world.run(3)
    usual = requests(4)
    for number in range(400):
        world.after(number / 100, ask_all)
    attacked = requests(4)
    assert set(attacked) == set(usual)
    assert attacked.total() <= usual.total() + 5
