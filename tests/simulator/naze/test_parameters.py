# SPDX-License-Identifier: GPL-3.0-or-later
"""The model's own parameters over MAVLink; tests/real_board has the same tests for the image."""

from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.msp.frame import request
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.naze.setting_table import SETTINGS
from tests.support import mavlink_parameters as page
from tests.support.mavlink_ground import MavlinkGround
from tests.support.naze_bench import Bench

NAMES = [held.setting.name for held in SETTINGS]
IDENT = request(100)


def test_the_list_has_every_setting_cut_to_16_characters() -> None:
    for faults in (Faults(), Faults(extension=False)):
        assert 20 < page.the_list_has_every_setting_cut_to_16_characters(Bench(faults=faults), NAMES) < 25


def test_a_set_also_changes_the_setting_whose_name_it_begins_with() -> None:
    page.a_set_also_changes_the_setting_whose_name_it_begins_with(Bench())


def test_a_set_survives_a_power_cut_half_a_second_later() -> None:
    bench = Bench()
    assert page.set_one(bench, "p_roll", 44) == [f"p_roll {NAMES.index('p_roll')}"]
    bench.run(1)
    bench.naze.power_off(bench.now)
    bench.naze.power_on(bench.now)
    bench.run(10)
    assert dict(page.listed(bench).values())["p_roll"] == 44


def test_msp_is_not_answered_during_a_listing() -> None:
    bench = Bench()
    MavlinkGround(bench).send(m.MAVLink_param_request_list_message(1, 200))
    bench.run(15)
    assert bench.ask(IDENT) is None
    bench.run(15)
    assert bench.ask(IDENT) is not None


def test_a_mission_transfer_ends_the_list() -> None:
    bench = Bench()
    ground = MavlinkGround(bench)
    ground.send(m.MAVLink_param_request_list_message(1, 200))
    bench.run(2)
    assert ground.upload(3) == m.MAV_MISSION_ACCEPTED
    ground.wait(-1, seconds=1)
    assert ground.wait(m.MAVLINK_MSG_ID_PARAM_VALUE, seconds=2) is None


def test_another_alignment_crashes_it() -> None:
    bench = Bench()
    page.set_one(bench, "align_gyro_x", 2)
    assert bench.run(3) == b""


def test_armed_the_patch_ignores_a_set() -> None:
    bench = Bench(SimOptions(tele_prot=TelemetryProtocol.MAVLINK), Faults(armed=True))
    bench.run(1)
    page.armed_a_set_is_ignored(bench)
