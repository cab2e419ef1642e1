# SPDX-License-Identifier: GPL-3.0-or-later
"""Ground stations on every kind of link, old versions, and several at once."""

import socket
from concurrent.futures import ThreadPoolExecutor

from pymavlink.dialects.v10 import ardupilotmega as mavlink_1

from protocols.mission_item import MissionResult
from tests.support.benches import Bench, Starter
from tests.support.mission_planner import MissionPlanner
from tests.support.plain_station import tcp_station, udp_station
from tests.support.plan import expected_fields, judge, mixed_plan, plain_plan, records_of
from tests.support.programs import free_port, until

# -- kinds of links ------------------------------------------------------------------------------------------


def test_every_kind_of_link_works_at_once(start: Starter) -> None:
    udp_in, udp_out, broadcast, tcp_in = free_port(), free_port(), free_port(), free_port(socket.SOCK_STREAM)
    links = (
        f"udpin:127.0.0.1:{udp_in}",
        f"udpout:127.0.0.1:{udp_out}",
        f"udpbcast:127.255.255.255:{broadcast}",
        f"tcpin:127.0.0.1:{tcp_in}",
    )
    bench = start.bench(gcs=links)
    with (
        MissionPlanner(("127.0.0.1", udp_out), listen=True) as called,
        MissionPlanner(("", broadcast), listen=True) as called_all,
        tcp_station(tcp_in) as by_tcp,
        udp_station(("127.0.0.1", udp_in)) as by_udp,
    ):
        by_tcp.wait_for("HEARTBEAT")
        for number, planner in enumerate((called, called_all)):
            planner.connect()
            plan = plain_plan(12, start=20 * number)
            planner.write(plan)
            assert bench.board.records() == records_of(judge(plan))
        by_udp.send_heartbeat()
        for number, station in enumerate((by_tcp, by_udp)):
            plan = mixed_plan(13 + number)
            assert station.upload(plan) is MissionResult.ACCEPTED
            assert station.download() == expected_fields(plan)
            assert bench.board.records() == records_of(judge(plan))
        until(lambda: len(bench.daemon.ground_stations()) == 4, "four ground stations")
        # Once a station has answered, only it gets messages, and no longer the whole network.
        assert not [peer for peer in bench.daemon.ground_stations() if "127.255.255.255'" in peer]
    until(lambda: len(bench.daemon.ground_stations()) == 3, "the end of the TCP connection")


def test_a_tcp_client_that_disconnects_during_an_upload_does_not_block_others(start: Starter) -> None:
    port = free_port(socket.SOCK_STREAM)
    bench = start.bench(gcs=[f"tcpin:127.0.0.1:{port}"])
    plan = plain_plan(30)
    with tcp_station(port) as gone:
        gone.send_count(len(plan))
        gone.wait_for("MISSION_REQUEST")
        gone.send_item(plan, 0)
    with tcp_station(port) as station:
        until(lambda: station.upload(plan) is MissionResult.ACCEPTED, "an upload that is not denied")
    assert bench.board.records() == records_of(judge(plan))


def test_a_station_that_supports_only_mavlink_1_writes_and_reads(shared: Bench) -> None:
    plan = mixed_plan(14)
    with udp_station(shared.daemon.address, mavlink_1) as station:
        station.send_heartbeat()
        assert station.wait_for("HEARTBEAT").autopilot == mavlink_1.MAV_AUTOPILOT_ARDUPILOTMEGA
        assert station.upload(plan) is MissionResult.ACCEPTED
        assert station.download() == expected_fields(plan)
        assert station.clear() is MissionResult.ACCEPTED
        assert len(station.download()) == 1  # home
    assert shared.board.records() == []


# -- several at once -----------------------------------------------------------------------------------------


def test_two_simultaneous_writes_of_mission_planner_both_succeed(shared: Bench) -> None:
    plans = [plain_plan(146, start=60), plain_plan(146, start=300)]
    planners = [shared.mission_planner() for _ in plans]
    for planner in planners:
        planner.wait_for_vehicle()
    with ThreadPoolExecutor() as both:
        for done in [both.submit(planner.write, plan) for planner, plan in zip(planners, plans, strict=True)]:
            done.result()
    assert all(MissionResult.ACCEPTED in planner.acks() for planner in planners)
    assert shared.board.records() in [records_of(judge(plan)) for plan in plans]
    assert [mission["outcome"] for mission in shared.daemon.missions()[:2]] == ["VERIFIED"] * 2
