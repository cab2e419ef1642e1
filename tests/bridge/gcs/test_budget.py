# SPDX-License-Identifier: GPL-3.0-or-later
"""Long-term limits on a ground station's requests, in simulated time."""

import gc
from collections import Counter

from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.gcs.budget import Budget, HostBudget, HostBudgets
from bridge.gcs.cost import SEATS, Cost
from protocols.msp.frame import MspParser
from tests.support.world import GroundStation, ready_world


def test_texts_are_limited() -> None:
    world = ready_world()
    station = GroundStation(world)
    banner = m.MAVLink_command_long_message(1, 1, 42428, 0, 0, 0, 0, 0, 0, 0, 0)
    for number in range(1000):
        world.after(number / 100, lambda: station.send(banner))
    world.run(10)
    assert 200 < len(station.texts()) <= 200 + 5 * 10 + 5


def host(hosts: HostBudgets, number: int, *, may_sit: bool = False) -> HostBudget:
    """A host with one connected station."""
    host = hosts.host(f"10.0.0.{number}")
    host.join(may_sit=may_sit)
    return host


def spent(budget: Budget, cost: Cost, now: float = 0.0) -> int:
    """The number of messages that it allows until it has refused a hundred."""
    allowed = refused = 0
    while refused < 100 and allowed < 10_000:
        if budget.allows(cost, now):
            allowed += 1
        else:
            refused += 1
    return allowed


def test_hosts_without_a_seat_share_the_total_in_equal_parts() -> None:
    hosts = HostBudgets()
    crowd = [host(hosts, number) for number in range(20)]
    for cost in Cost:
        parts = [spent(one, cost) for one in crowd]
        assert sum(parts) <= max(cost.total.burst, len(crowd))
        assert min(parts) >= min(max(1, int(cost.total.burst / 20)), int(cost.each.burst)), cost


def test_a_crowd_uses_up_neither_a_seat_nor_the_budget_of_a_proven_station() -> None:
    hosts = HostBudgets()
    pilot = host(hosts, 1)
    pilot.stays()
    crowd = [host(hosts, number) for number in range(2, 60)]
    for cost in Cost:
        for stranger in crowd:
            spent(stranger, cost)
        assert spent(pilot, cost) == cost.each.burst
        assert spent(Budget(), cost) == cost.each.burst


def test_a_host_that_comes_back_has_the_budget_that_it_left() -> None:
    hosts = HostBudgets()
    stranger = host(hosts, 1)
    assert spent(stranger, Cost.BOARD) == Cost.BOARD.each.burst
    stranger.leave()
    assert spent(host(hosts, 1), Cost.BOARD) == 0


def test_a_seat_is_free_again_when_its_host_has_left() -> None:
    hosts = HostBudgets()
    seated = [host(hosts, number, may_sit=True) for number in range(SEATS)]
    late = host(hosts, 99, may_sit=True)
    for one in (*seated, late):
        one.stays()
    assert [late.seat] == [None]
    seated[3].leave()
    late.stays()
    assert late.seat is not None
    assert sum(one.seat is not None for one in seated) == SEATS - 1
    assert hosts.without_seat == 0


def test_made_up_hosts_lose_their_seats_to_one_that_stays() -> None:
    hosts = HostBudgets()
    made_up = [host(hosts, number, may_sit=True) for number in range(30)]
    pilot = host(hosts, 99, may_sit=True)
    pilot.stays()
    assert [one.seat is not None for one in made_up] == [True] * (SEATS - 1) + [False] * 15
    assert pilot.seat is not None
    assert hosts.without_seat == 15


def test_thousands_of_hosts_are_not_remembered() -> None:
    hosts = HostBudgets()
    pilot = host(hosts, 1)
    for number in range(5000):
        hosts.host(("made up", number)).allows(Cost.ARRIVAL, 0.0)
    assert hosts.host("10.0.0.1") is pilot
    gc.collect()
    assert sum(isinstance(each, HostBudget) for each in gc.get_objects()) < 3000


def test_limits_do_not_depend_on_when_the_clock_starts() -> None:
    stranger = host(HostBudgets(), 1)
    for now in (1e5, 1e5 + 1, 1e9, 1e9):
        assert stranger.allows(Cost.RECEIVED, now)


def test_a_flood_of_counts_is_not_logged() -> None:
    world = ready_world()
    station = GroundStation(world)
    world.faults.armed = True
    world.wait_until(lambda world: bool(world.bridge.vehicle.armed), 5)
    for number in range(2000):
        world.after(number / 500, lambda: station.send(m.MAVLink_mission_count_message(1, 1, 999)))
    world.run(5)
    limit = Cost.UPLOAD.each
    assert limit.burst / 2 < len(world.events("mission.refused")) <= limit.burst + limit.per_s * 5
    assert {ack.type for ack in station.messages("MISSION_ACK")} == {m.MAV_MISSION_DENIED}
    assert "Too many uploads: wait a few seconds" in station.texts()


def test_requests_from_strangers_are_not_passed_to_an_armed_board() -> None:
    """MISSION_CLEAR_ALL while armed once made it send eight times as much as telemetry does."""
    world = ready_world()
    stranger = GroundStation(world)
    stranger.send(m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    world.faults.armed = True
    world.wait_until(lambda world: bool(world.bridge.vehicle.armed), 5)
    asked = (
        m.MAVLink_mission_clear_all_message(1, 1),
        m.MAVLink_mission_count_message(1, 1, 9),
        m.MAVLink_mission_request_int_message(1, 1, 0),
        m.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", 300, 9),
        m.MAVLink_command_long_message(1, 1, 241, 0, 0, 1, 0, 0, 0, 0, 0),
    )

    def requests(seconds: float) -> Counter[int]:
        before = len(world.written)
        world.run(seconds)
        return Counter(frame.command for _, _, data in world.written[before:] for frame in MspParser().feed(data))

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
