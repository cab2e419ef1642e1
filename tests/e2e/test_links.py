# SPDX-License-Identifier: GPL-3.0-or-later
"""Links that appear, disappear, move and stall while the daemon runs, on real terminals and sockets."""

import os
import socket
from functools import partial
from pathlib import Path

from protocols.mission_item import MissionResult
from tests.support.benches import Bench, Starter
from tests.support.mission_planner import MissionPlanner
from tests.support.plain_station import PlainStation, tcp_station, udp_station
from tests.support.plan import judge, plain_plan, records_of
from tests.support.programs import TIMEOUT_S, Daemon, free_port, until

PLAN = plain_plan(40)


def has_lost_port(daemon: Daemon, times: int) -> bool:
    return len([entry for entry in daemon.events() if entry["event"] == "fc.port_lost"]) == times


def take_terminals(name: Path) -> list[int]:
    """Open terminals until the name is taken, by this or another program."""
    taken: list[int] = []
    while len(taken) < 40 and not (taken and os.ttyname(taken[-1]) == str(name)):
        taken += os.openpty()
    return taken


# -- the flight controller's side ----------------------------------------------------------------------------


def test_a_port_returns_under_another_name_behind_the_same_link(start: Starter, tmp_path: Path) -> None:
    """As with USB adapters: ttyUSB0 becomes ttyUSB1, and /dev/serial/by-id/... points there."""
    board = start.board()
    by_id = tmp_path / "usb-FTDI_FT232R-if00-port0"
    by_id.symlink_to(board.link)
    daemon = start.daemon(str(by_id))
    daemon.wait()
    with udp_station(daemon.address) as station:
        station.send_heartbeat()
        for number in range(2):
            name = by_id.resolve()
            board.set("unplug")
            until(partial(has_lost_port, daemon, number + 1), "the loss of the port")
            # Another program has the old name now.
            taken = take_terminals(name)
            board.set("plug")
            assert by_id.resolve() != name
            daemon.wait()
            plan = plain_plan(12, start=number)
            assert station.upload(plan) is MissionResult.ACCEPTED
            assert board.records() == records_of(judge(plan))
            for end in taken:
                os.close(end)
    board.assert_unharmed()


def test_a_ground_station_keeps_the_vehicle_through_a_reset(bench: Bench) -> None:
    planner = bench.mission_planner()
    planner.wait_for_vehicle()
    planner.write(PLAN)
    for _ in range(2):
        planner.received.clear()
        bench.board.set("power off")
        bench.board.set("power on")
        planner.wait_until(lambda: len(planner.messages("HEARTBEAT")) >= 2, "the vehicle")
        planner.wait_until(lambda: len(planner.messages("ATTITUDE")) >= 10, "its telemetry")
        assert {(beat.get_srcSystem(), beat.get_srcComponent()) for beat in planner.messages("HEARTBEAT")} == {(1, 1)}
    bench.daemon.wait()
    planner.write(plain_plan(41))
    assert bench.board.records() == records_of(judge(plain_plan(41)))


# -- other kinds of links ------------------------------------------------------------------------------------


def test_links_on_ipv6_and_on_a_host_name_work(start: Starter) -> None:
    udp, tcp, named = free_port(), free_port(socket.SOCK_STREAM), free_port()
    bench = start.bench(gcs=[f"udpin:[::1]:{udp}", f"tcpin:[::1]:{tcp}", f"udpout:localhost:{named}"])
    by_udp = socket.socket(socket.AF_INET6, socket.SOCK_DGRAM)
    by_udp.connect(("::1", udp))
    for number, connection in enumerate((by_udp, socket.create_connection(("::1", tcp), TIMEOUT_S))):
        with PlainStation(connection) as station:
            plan = plain_plan(12 + number)
            assert station.upload(plan) is MissionResult.ACCEPTED
            assert bench.board.records() == records_of(judge(plan))
    with MissionPlanner(("127.0.0.1", named), listen=True) as called:
        called.connect()
        called.write(PLAN)
    assert bench.board.records() == records_of(judge(PLAN))


def test_a_client_that_does_not_read_does_not_delay_others(start: Starter) -> None:
    port, udp = free_port(socket.SOCK_STREAM), free_port()
    bench = start.bench(gcs=[f"tcpin:127.0.0.1:{port}", f"udpin:127.0.0.1:{udp}"])
    with tcp_station(port) as deaf, tcp_station(port) as station, udp_station(("127.0.0.1", udp)) as by_udp:
        deaf.send_heartbeat()
        for number, writer in enumerate((station, by_udp)):
            plan = plain_plan(50 + number)
            assert writer.upload(plan) is MissionResult.ACCEPTED
            assert bench.board.records() == records_of(judge(plan))
        # When it reads again, it is served like any other.
        assert deaf.upload(PLAN) is MissionResult.ACCEPTED
    assert bench.board.records() == records_of(judge(PLAN))
