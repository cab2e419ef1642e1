# SPDX-License-Identifier: GPL-3.0-or-later
"""A vehicle whose disk hangs stays in the fleet: it is listed, takes missions, and reports its disk."""

import signal
from contextlib import ExitStack
from pathlib import Path

from tests.attack.test_disk import DaemonWithoutDisk
from tests.support.fleet_bench import Fleet
from tests.support.plan import judge, plain_plan, plan_text, records_of
from tests.support.zenoh_bench import I_KNOW, ask, zenoh_config


def test_a_vehicle_whose_disk_hangs_is_listed_and_takes_missions(tmp_path: Path) -> None:
    with ExitStack() as stack:
        fleet = Fleet(tmp_path, stack)
        board = fleet.board("kite")
        table = f'connect = ["{fleet.router.endpoint}"]\n{I_KNOW}'
        kite = DaemonWithoutDisk(tmp_path / "kite", board.fc, config=zenoh_config(table, "kite"))
        stack.callback(kite.end, signal.SIGKILL)
        fleet.wait("kite")
        file = tmp_path / "plan.waypoints"
        file.write_text(plan_text(plain_plan(20)))
        pushed = fleet.pushed(file, "--all", code=0)
        assert pushed["kite"]["ok"]
        assert board.records() == records_of(judge(plain_plan(20)))
        assert fleet.listed()["kite"]["mission_count"] == 20
        (missions,) = ask(fleet.session, "mission/list", vehicle="kite")
        assert "error" in missions, missions
        assert fleet.listed()["kite"]["answers"]
        assert kite.end() == 0
    assert "store.hangs" in kite.printed
