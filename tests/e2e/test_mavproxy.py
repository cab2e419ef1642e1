# SPDX-License-Identifier: GPL-3.0-or-later
"""The real MAVProxy as a ground station."""

from pathlib import Path

import pytest

from protocols.mission_item import Command
from tests.support.benches import Bench
from tests.support.mavproxy import MavProxy
from tests.support.plan import HOME, PlanRow, expected_fields, judge, mixed_plan, plain_plan, records_of, waypoint
from tests.support.programs import happens


@pytest.mark.parametrize("version", ["--mav10", "--mav20"])
def test_load_list_save_and_clear_work(shared: Bench, tmp_path: Path, version: str) -> None:
    plan = mixed_plan(20)
    with MavProxy(tmp_path, shared.daemon.port, version) as mavproxy:
        mavproxy.load(plan)
        mavproxy.wait_for("TYPE_MISSION: ACCEPTED")
        assert shared.board.records() == records_of(judge(plan))
        assert mavproxy.list(len(judge(plan).items)) == expected_fields(plan)
        mavproxy.type(f"wp save {tmp_path / 'back.waypoints'}")
        mavproxy.wait_for("Saved 18 waypoints")
        assert len((tmp_path / "back.waypoints").read_text().splitlines()) == 1 + 18
        mavproxy.type("wp clear")
        mavproxy.wait_for("cleared")
        assert shared.board.records() == []
        mavproxy.type("wp list")
        # Only home is left.
        mavproxy.wait_for("Requesting 1 waypoints")


def test_float_items_parameters_and_refusals_work(shared: Bench, tmp_path: Path) -> None:
    plan = mixed_plan(20)
    with MavProxy(tmp_path, shared.daemon.port) as mavproxy:
        mavproxy.wait_for("Received 237 parameters")
        mavproxy.type("set wp_use_mission_int False")
        mavproxy.load(plan)
        mavproxy.wait_for("TYPE_MISSION: ACCEPTED")
        assert shared.board.records() == records_of(judge(plan, use_int=False))
        mavproxy.type("param show WPNAV_RADIUS")
        mavproxy.wait_for("200.0")
        mavproxy.type("param set LED_ARMED 2")
        mavproxy.wait_for(": 0..1")
        # It finds only names in capitals, but takes them in any case.
        mavproxy.type("param set p_roll 44")
        mavproxy.type("wp list")
        mavproxy.wait_for("Requesting")
        mavproxy.type("long MAV_CMD_PREFLIGHT_STORAGE 1")
        mavproxy.wait_for("Settings saved")
        mavproxy.type("param set p_roll 35")
        mavproxy.type("arm throttle")
        mavproxy.wait_for("disarm with the transmitter")


def test_refusals_have_a_reason_and_keep_the_list(bench: Bench, tmp_path: Path) -> None:
    plan = plain_plan(12)
    with MavProxy(tmp_path, bench.daemon.port) as mavproxy:
        mavproxy.load(plan)
        mavproxy.wait_for("TYPE_MISSION: ACCEPTED")
        mavproxy.load([HOME, PlanRow(Command.NAV_LAND), waypoint(1)])
        assert "LAND must be last" in mavproxy.wait_for("TYPE_MISSION: INVALID")
        mavproxy.load(plain_plan(147))
        assert "147 items, but only 146 fit" in mavproxy.wait_for("TYPE_MISSION: NO_SPACE")
        bench.board.set("armed 1")
        mavproxy.wait_for("ARMED")
        mavproxy.load(plain_plan(12, start=30))
        assert "disarm to change the mission" in mavproxy.wait_for("TYPE_MISSION: DENIED")
        mavproxy.type("wp clear")
        mavproxy.wait_for("TYPE_MISSION: DENIED")
        assert bench.board.records() == records_of(judge(plan))


def test_load_and_list_work_over_a_bad_link(shared: Bench, tmp_path: Path) -> None:
    """MAVProxy sends MISSION_COUNT and the last item only once; after a loss the user repeats `wp load`."""
    link = shared.lossy_link(loss=0.1, repeats=0.05, delay_s=0.02, jitter_s=0.05, seed=3)
    plan = plain_plan(8, start=40)
    expected = records_of(judge(plan))
    with MavProxy(tmp_path, link.address[1]) as mavproxy:
        for _ in range(10):
            mavproxy.load(plan)
            if happens(lambda: shared.board.records() == expected, seconds=4.0):
                break
        assert shared.board.records() == expected
        assert mavproxy.list(len(plan)) == expected_fields(plan)
    assert link.lost
