# SPDX-License-Identifier: GPL-3.0-or-later
"""The model's own parameters over MAVLink; tests/real_board has the same tests for the image."""

from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.msp.frame import request
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.naze.setting_table import SETTINGS
from tests.support.mavlink_ground import MavlinkGround
from tests.support.naze_bench import Bench

NAMES = [held.setting.name for held in SETTINGS]
IDENT = request(100)
_AUTOSENSE_S = 5.0


def listed(bench: Bench) -> dict[int, tuple[str, float]]:
    """Name and value by index, of one list."""
    bench.run(_AUTOSENSE_S)
    ground = MavlinkGround(bench)
    ground.send(m.MAVLink_param_request_list_message(1, 200))
    found: dict[int, tuple[str, float]] = {}
    while (value := ground.wait(m.MAVLINK_MSG_ID_PARAM_VALUE)) is not None:
        found[value.param_index] = value.param_id, value.param_value
        if len(found) == value.param_count:
            break
    return found


def test_the_list_has_every_setting_cut_to_16_characters() -> None:
    for faults in (Faults(), Faults(extension=False)):
        bench = Bench(faults=faults)
        found = listed(bench)
        assert [found[index][0] for index in range(len(NAMES))] == [name[:16] for name in NAMES]
        assert 20 < bench.now - _AUTOSENSE_S < 25


def test_a_set_also_changes_the_setting_whose_name_it_begins_with() -> None:
    bench = Bench()
    before = dict(listed(bench).values())
    assert before["rc_db"] != 10
    assert MavlinkGround(bench).set_parameter("rc_dbyw", 10) == ["rc_dbyw 0", "rc_dbyw 1"]
    after = dict(listed(bench).values())
    assert (after["rc_db"], after["rc_dbyw"]) == (10, 10)
    assert {name for name, value in after.items() if before[name] != value} == {"rc_db", "rc_dbyw"}


def test_a_set_survives_a_power_cut_half_a_second_later() -> None:
    bench = Bench()
    assert MavlinkGround(bench).set_parameter("p_roll", 44) == [f"p_roll {NAMES.index('p_roll')}"]
    bench.run(1)
    bench.naze.power_off(bench.now)
    bench.naze.power_on(bench.now)
    bench.run(10)
    assert dict(listed(bench).values())["p_roll"] == 44


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
    MavlinkGround(bench).set_parameter("align_gyro_x", 2)
    assert bench.run(3) == b""


def test_armed_the_patch_ignores_a_set() -> None:
    bench = Bench(SimOptions(tele_prot=TelemetryProtocol.MAVLINK), Faults(armed=True))
    bench.run(1)
    assert MavlinkGround(bench).set_parameter("p_roll", 44) == []
