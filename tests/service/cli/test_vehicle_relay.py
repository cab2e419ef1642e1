# SPDX-License-Identifier: GPL-3.0-or-later
"""Ground stations through zenoh: `fleet mavlink`, with the daemon behind a router."""

import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync, MissionRawResult
from mavsdk.asyncio.plugins.telemetry.telemetry import TelemetryAsync

from tests.e2e.test_mavsdk import fields, raw_items, refusal_of, vehicle_at
from tests.support.fleet_bench import Fleet
from tests.support.mission_planner import MissionPlanner
from tests.support.plan import expected_fields, judge, mixed_plan, plain_plan, records_of
from tests.support.programs import Program, free_port, until
from tests.support.zenoh_bench import I_KNOW


@contextmanager
def relay(folder: Path, fleet: Fleet, vehicle: str, gcs: str) -> Iterator[Program]:
    """The command as a process. `vehicle`: a name, or --all."""
    vehicles = (vehicle,) if vehicle == "--all" else ("--vehicle", vehicle)
    program = Program(
        folder / "relay.log", "fleet", "mavlink", *vehicles, "--gcs", gcs, "--connect", fleet.router.endpoint
    )
    try:
        until(lambda: " at udp" in program.printed or not program.is_alive, "the relay")
        yield program
    finally:
        code = program.end()
    assert "Traceback" not in program.printed
    assert code in (0, 130, -15)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    with ExitStack() as stack:
        fleet = Fleet(tmp_path_factory.mktemp("fleet"), stack)
        fleet.start("kite", fc=fleet.board("kite").fc, commands=I_KNOW + "mavlink_in = true\n")
        fleet.wait("kite")
        yield fleet


@pytest.mark.parametrize("kind", ["udpout", "udpin"])
def test_mission_planner_writes_and_reads_a_mission(fleet: Fleet, tmp_path: Path, kind: str) -> None:
    address = ("127.0.0.1", free_port())
    with (
        relay(tmp_path, fleet, "kite", f"{kind}:127.0.0.1:{address[1]}"),
        MissionPlanner(address, listen=kind == "udpout") as planner,
    ):
        planner.skip_connecting()
        planner.wait_until(lambda: bool(planner.messages("HEARTBEAT")), "the vehicle")
        plan = plain_plan(20, start=3)
        planner.write(plan)
        assert fleet.daemons["kite"].pull()["records"] == records_of(judge(plan))
        assert len(planner.read()) == 20


async def test_mavsdk_works_through_zenoh(fleet: Fleet, tmp_path: Path) -> None:
    port, board = free_port(), fleet.boards["kite"]
    with relay(tmp_path, fleet, "kite", f"udpout:127.0.0.1:{port}"):
        async with vehicle_at(port, listen=True) as vehicle:
            missions = MissionRawAsync(vehicle)
            plan = mixed_plan(146)
            await missions.upload_mission(raw_items(plan))
            assert board.records() == records_of(judge(plan))
            assert [fields(item) for item in await missions.download_mission()] == expected_fields(plan)
            await missions.clear_mission()
            until(lambda: board.records() == [], "an empty board")
            plan = plain_plan(12, start=20)
            await missions.upload_mission(raw_items(plan))
            board.set("armed 1")
            async for armed in TelemetryAsync(vehicle).subscribe_armed():
                if armed:
                    break
            assert await refusal_of(missions, plain_plan(7)) == MissionRawResult.DENIED
            assert board.records() == records_of(judge(plan))
            board.set("armed 0")


def test_a_vehicle_that_does_not_accept_mavlink_is_reported(fleet: Fleet, tmp_path: Path) -> None:
    owl = fleet.start("owl", commands="")
    fleet.wait("owl")
    with relay(tmp_path, fleet, "owl", f"udpout:127.0.0.1:{free_port()}") as program:
        until(lambda: "owl accepts no MAVLink" in program.printed, "the reason")
        owl.end()
        until(lambda: "owl has left" in program.printed, "its end")
    with relay(tmp_path, fleet, "kite", f"udpout:127.0.0.1:{free_port()}") as program:
        until(lambda: "kite is at" in program.printed, "the relay")
        fleet.router.process.send_signal(signal.SIGKILL)
        until(lambda: "kite has left" in program.printed, "the loss")
        fleet.router.process.wait()
        fleet.router.start_again()
        until(lambda: "kite is back" in program.printed, "its return")


def test_an_unknown_vehicle_is_reported_in_one_sentence(fleet: Fleet) -> None:
    ended = fleet.ask("mavlink", "--vehicle", "owl")
    assert (ended.returncode, ended.stderr) == (1, "naze-bridge: no vehicle 'owl' is alive; there is kite\n")
    assert fleet.ask("mavlink", "--vehicle", "kite", "--gcs", "smoke:1").returncode == 2
