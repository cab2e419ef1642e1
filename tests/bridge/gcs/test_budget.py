# SPDX-License-Identifier: GPL-3.0-or-later
"""Long-term limits on a ground station's requests, in simulated time."""

from collections import Counter

from bridge.gcs.budget import Budgets
from bridge.gcs.cost import LIMITS, Cost
from bridge.gcs.station import Peer
from protocols.mavlink.dialect import messages as m
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


def test_new_peers_share_a_limit_per_host_and_a_total() -> None:
    pilot = Peer("udp", ("10.0.0.1", 14550))
    budgets = Budgets(lambda peer: peer == pilot)
    for cost in (Cost.ARRIVAL, Cost.BOARD, Cost.STORED, Cost.TEXT):
        limit = LIMITS[cost]
        spent = 0
        for host in range(2, 22):
            ports = (Peer("udp", (f"10.0.0.{host}", port)) for port in range(int(limit.each.burst) + 5))
            of_host = sum(budgets.allows(cost, peer, 0.0) for peer in ports)
            assert of_host <= limit.each.burst
            spent += of_host
        assert spent == int(limit.total.burst)
        assert sum(budgets.allows(cost, pilot, 0.0) for _ in range(1000)) == limit.each.burst


def test_limits_do_not_depend_on_when_the_clock_starts() -> None:
    peer = Peer("udp", ("10.0.0.1", 14550))
    budgets = Budgets(lambda _peer: False)
    for now in (1e5, 1e5 + 1, 1e9, 1e9):
        assert budgets.allows(Cost.RECEIVED, peer, now)


def test_a_newcomer_gets_the_same_share_as_each_busy_host() -> None:
    budgets = Budgets(lambda _peer: False)
    hosts = [Peer("udp", (f"10.0.0.{host}", 14550)) for host in range(2, 12)]
    for peer in hosts * 1000:
        budgets.allows(Cost.TRANSFER, peer, 0.0)
    newcomer = Peer("udp", ("10.0.0.1", 14550))
    used = sum(budgets.allows(Cost.TRANSFER, newcomer, 0.0) for _ in range(1000))
    assert used >= LIMITS[Cost.TRANSFER].total.burst / 11 / 2


def test_a_flood_of_counts_is_not_logged() -> None:
    world = ready_world()
    station = GroundStation(world)
    world.faults.armed = True
    world.wait_until(lambda world: bool(world.bridge.vehicle.armed), 5)
    for number in range(2000):
        world.after(number / 500, lambda: station.send(m.MAVLink_mission_count_message(1, 1, 999)))
    world.run(5)
    limit = LIMITS[Cost.UPLOAD].each
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
