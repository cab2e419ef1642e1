# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission Planner through zenoh: `fleet mavlink`, with the daemon behind a router."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.support.fleet_bench import I_KNOW, Fleet
from tests.support.mission_planner import MissionPlanner
from tests.support.plan import judge, plain_plan, records_of
from tests.support.programs import Program, free_port, until


class Relay(Program):
    """The command as a process."""

    def __init__(self, folder: Path, fleet: Fleet, vehicle: str, gcs: str) -> None:
        where = ("--connect", fleet.router.endpoint)
        super().__init__(folder / "relay.log", "fleet", "mavlink", "--vehicle", vehicle, "--gcs", gcs, *where)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    with ExitStack() as stack:
        fleet = Fleet(tmp_path_factory.mktemp("fleet"), stack)
        fleet.start("kite", commands=I_KNOW + "mavlink_in = true\n")
        fleet.wait("kite")
        yield fleet


@pytest.mark.parametrize("kind", ["udpout", "udpin"])
def test_mission_planner_writes_and_reads_a_mission(fleet: Fleet, tmp_path: Path, kind: str) -> None:
    address = ("127.0.0.1", free_port())
    relay = Relay(tmp_path, fleet, "kite", f"{kind}:127.0.0.1:{address[1]}")
    try:
        until(lambda: "kite is at" in relay.printed or not relay.is_alive, "the relay")
        with MissionPlanner(address, listen=kind == "udpout") as planner:
            planner.be_connected()
            plan = plain_plan(20, start=3)
            planner.write(plan)
            assert fleet.daemons["kite"].held()["records"] == records_of(judge(plan))
            assert len(planner.read()) == 20
    finally:
        code = relay.end()
    assert "Traceback" not in relay.printed
    assert code in (0, 130, -15)


def test_an_unknown_vehicle(fleet: Fleet) -> None:
    ended = fleet.ask("mavlink", "--vehicle", "owl")
    assert (ended.returncode, ended.stderr) == (1, "naze-bridge: no vehicle 'owl' is alive; there is kite\n")
    assert fleet.ask("mavlink", "--vehicle", "kite", "--gcs", "smoke:1").returncode == 2
