# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV Configurator's own MSP code, run by Node, alongside Mission Planner."""

import json
import subprocess
from pathlib import Path

from tests.e2e.test_inav_clients import nav_plan, records_of
from tests.e2e.test_mavsdk import fields
from tests.real_clients.conftest import SharedInav, sources

_PROGRAM = Path(__file__).with_name("configurator.mjs")
_RECORDS = 60


def test_configurator_reads_and_writes_the_mission_and_a_setting(shared_inav: SharedInav) -> None:
    configurator = sources("INAV_CONFIGURATOR")
    planner, share = shared_inav
    plan = nav_plan(_RECORDS)
    planner.write(plan)
    # Home comes from the board, if it has one.
    before = [fields(item) for item in planner.read()][1:]
    command = ["node", str(_PROGRAM), str(configurator), share, "nav_wp_radius", "321"]
    done = subprocess.run(command, capture_output=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr.decode()
    found = json.loads(done.stdout)
    assert found["identifier"] == "INAV"
    # Behind each record's number.
    assert [bytes(record[1:]) for record in found["read"]] == records_of(plan)
    assert found["again"] == found["read"]
    assert (found["before"] != 321, found["after"]) == (True, 321)
    planner.wait_until(lambda: planner.parameters.get("nav_wp_radius") == 321, "the changed setting")
    assert [fields(item) for item in planner.read()][1:] == before
