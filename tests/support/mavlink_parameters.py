# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's own parameters over MAVLink: tests for the model and the image."""

from pymavlink.dialects.v20 import ardupilotmega as m

from tests.support.mavlink_ground import MavlinkGround
from tests.support.naze_bench import WireBench

_AUTOSENSE_S = 5.0
_REAL32 = 9


def listed(bench: WireBench) -> dict[int, tuple[str, float]]:
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


def set_one(bench: WireBench, name: str, value: float) -> list[str]:
    """Set a parameter; return the names and indexes that the board reports."""
    ground = MavlinkGround(bench)
    ground.send(m.MAVLink_param_set_message(1, 200, name.encode(), value, _REAL32))
    answers = []
    while (answer := ground.wait(m.MAVLINK_MSG_ID_PARAM_VALUE, seconds=0.5)) is not None:
        answers.append(f"{answer.param_id} {answer.param_index}")
    return answers


def the_list_has_every_setting_cut_to_16_characters(bench: WireBench, names: list[str]) -> float:
    """Return the seconds that the list took."""
    began = bench.now + _AUTOSENSE_S
    found = listed(bench)
    assert [found[index][0] for index in range(len(names))] == [name[:16] for name in names]
    return bench.now - began


def a_set_also_changes_the_setting_whose_name_it_begins_with(bench: WireBench) -> None:
    before = dict(listed(bench).values())
    assert before["rc_db"] != 10
    assert set_one(bench, "rc_dbyw", 10) == ["rc_dbyw 0", "rc_dbyw 1"]
    after = dict(listed(bench).values())
    assert (after["rc_db"], after["rc_dbyw"]) == (10, 10)
    assert {name for name, value in after.items() if before[name] != value} == {"rc_db", "rc_dbyw"}


def armed_a_set_is_ignored(bench: WireBench) -> None:
    """The board is armed and speaks MAVLink."""
    assert set_one(bench, "p_roll", 44) == []
