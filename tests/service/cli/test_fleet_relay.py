# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet mavlink --all`: several vehicles in one ground station."""

from contextlib import ExitStack
from pathlib import Path

from tests.service.cli.test_vehicle_relay import relay
from tests.support.fleet_bench import Fleet
from tests.support.mission_planner import MissionPlanner
from tests.support.plan import judge, plain_plan, records_of
from tests.support.programs import free_port, until
from tests.support.zenoh_bench import I_KNOW

_COMMANDS = I_KNOW + "mavlink_in = true\n"


def test_all_vehicles_are_at_one_station(tmp_path: Path) -> None:
    """Each has its own mission; one that joins with an id that is in use is left out."""
    with ExitStack() as stack:
        fleet = Fleet(tmp_path, stack)
        for sysid, name in enumerate(("kite", "crow"), 1):
            fleet.start(name, fc=fleet.board(name).fc, commands=_COMMANDS, sysid=sysid)
        fleet.wait("kite", "crow")
        _use(fleet, tmp_path)


def _use(fleet: Fleet, tmp_path: Path) -> None:
    port = free_port()
    with (
        relay(tmp_path, fleet, "--all", f"udpout:127.0.0.1:{port}") as program,
        MissionPlanner(("127.0.0.1", port), listen=True) as planner,
    ):
        assert "2 vehicles are at" in program.printed
        planner.skip_connecting()
        planner.wait_until(
            lambda: {message.get_srcSystem() for message in planner.messages("HEARTBEAT")} == {1, 2}, "both vehicles"
        )
        plans = {"kite": (1, plain_plan(20, start=3)), "crow": (2, plain_plan(30, start=60))}
        for name, (sysid, plan) in plans.items():
            planner.vehicle = sysid, 1
            planner.write(plan)
            assert fleet.daemons[name].pull()["records"] == records_of(judge(plan))
        for sysid, plan in plans.values():
            planner.vehicle = sysid, 1
            assert len(planner.read()) == len(plan)
        fleet.start("owl", commands=_COMMANDS, sysid=2)
        until(lambda: "owl and crow both have system id 2" in program.printed, "the clash")
        assert "owl is left out" in program.printed
        planner.vehicle = 2, 1
        assert len(planner.read()) == 30
        fleet.wait("owl")
    refused = fleet.ask("mavlink", "--all", "--gcs", f"udpout:127.0.0.1:{port}")
    assert (refused.returncode, refused.stdout) == (1, "")
    assert "both have system id 2: give each its own sysid" in refused.stderr
