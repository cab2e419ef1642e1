# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

from bridge.fc.fc_settings import Cause
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction
from tests.support.fake_controllers import HARAKIRI_CAPABILITY, MspFake, ident
from tests.support.settings_client import BOARDS, SettingsClient, cause_of, ready, value_of
from tests.support.share_program import ShareProgram
from tests.support.world import World

SET_PID = 202


def test_a_part_whose_bytes_are_hazards_is_not_written_to_an_unpatched_harakiri() -> None:
    _, client = ready(BOARDS["Harakiri"])
    for value in (13, 35, 82):
        assert cause_of(client.change("YAW_P", value)) is Cause.FIXED
    assert value_of(client.change("YAW_P", 36)) == 36


def test_a_change_by_another_program_is_read_again() -> None:
    world, client = ready(BOARDS["Betaflight"])
    pids = bytes((99, 80, 30, 47, 84, 34, 45, 80, 0, 50, 75, 75, 40, 0, 0))
    reply = ShareProgram(world, may_write=True).outcome(SET_PID, pids)
    assert reply is not None
    assert reply.direction is Direction.REPLY
    world.run(10)
    assert client.value("ROLL_P") == 99


def test_settings_of_an_unknown_firmware_are_shown_and_never_written() -> None:
    board = MspFake(
        {
            Msp.IDENT: ident(230, HARAKIRI_CAPABILITY),
            Msp.BOXNAMES: b"ARM;ANGLE;",
            Msp.STATUS: bytes(11),
            Msp.PIDNAMES: b"ROLL;PITCH;",
            Msp.PID: bytes((40, 30, 23, 41, 31, 24)),
        }
    )
    client = SettingsClient(World(peer=board))
    assert client.wait_read().settings["PITCH_P"].value == 41
    assert cause_of(client.change("PITCH_P", 45)) is Cause.FIXED
    assert SET_PID not in board.asked


@pytest.mark.parametrize("name", ["INAV", "Betaflight"])
def test_a_mode_gets_whole_ranges_and_the_others_keep_theirs(name: str) -> None:
    world, client = ready(BOARDS[name])
    before = {each.name: each.value for each in client.wait_read() if each.name.startswith("MODE_")}
    for ranges in ("AUX1 1300-1700; AUX3 900-1200", "AUX4 1000-1500", ""):
        assert value_of(client.change("MODE_HORIZON", ranges)) == ranges
        after = {each.name: each.value for each in client.wait_read() if each.name.startswith("MODE_")}
        assert after == before | {"MODE_HORIZON": ranges}
    result = client.change("MODE_HORIZON", "AUX1 1310-1700")
    assert cause_of(result) is Cause.OUT_OF_RANGE
    assert cause_of(client.change("MODE_ARM", "AUX1 900-2100")) is Cause.FIXED
    world.run(75)
    assert world.events("settings.changed_on_board") == []
