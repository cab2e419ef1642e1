# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions of INAV and MultiWii in files: XML and the command line's wp lines."""

import pytest

from protocols.mission_file import MissionFileError, read_mission_file
from protocols.mission_file.nav_mission import write_nav_xml
from protocols.mission_item import Command, Frame, MissionItem
from protocols.msp.nav import LAST, NavAction, NavRecord

ITEM = '<missionitem no="1" action="WAYPOINT" lat="51.4771" lon="0.0012" alt="15" parameter1="0" parameter2="0"/>'


def read(text: str) -> list[MissionItem]:
    return read_mission_file(text.encode(), "field.mission")


def error(text: str) -> str:
    with pytest.raises(MissionFileError) as caught:
        read(text)
    return str(caught.value)


def test_reads_a_mission_of_inav_configurator() -> None:
    home, first, hold, jump, back = read(
        '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>\n<mission><version value="2.3-pre8"/>'
        '<mwp cx="0.0013" cy="51.4772" home-x="0.0010" home-y="51.4770" zoom="18"/>'
        '<missionitem no="1" action="WAYPOINT" lat="51.4771" lon="0.0012" alt="15" parameter1="0" flag="0"/>'
        '<missionitem no="2" action="POSHOLD_TIME" lat="51.4772" lon="0.0015" alt="20" parameter1="30" flag="0"/>'
        '<missionitem no="3" action="JUMP" lat="0" lon="0" alt="0" parameter1="1" parameter2="2" flag="0"/>'
        '<missionitem no="4" action="RTH" lat="0" lon="0" alt="0" parameter1="1" flag="165"/></mission>'
    )
    assert (home.lat_e7, home.lon_e7) == (514770000, 10000)
    assert (first.command, first.frame, first.lat_e7, first.lon_e7, first.alt_m) == (16, 3, 514771000, 12000, 15)
    assert (hold.command, hold.p1, hold.lat_e7, hold.alt_m) == (Command.NAV_LOITER_TIME, 30, 514772000, 20)
    assert (jump.command, jump.p1, jump.p2) == (Command.DO_JUMP, 1, 2)
    assert (back.command, back.p1) == (Command.NAV_RETURN_TO_LAUNCH, 1)


@pytest.mark.parametrize(
    "text",
    [
        "<MISSION><MISSIONITEM no='1' action='WAYPOINT' lat='51.4771' lon='0.0012' alt='15' /></MISSION>",
        '<mission xmlns="http://www.example.org/mission">' + ITEM + "</mission>",
        '\n <?xml version="1.0"?><mission>' + ITEM + "</mission>",
        "\n<!--MultiWiiWinGUI--><mission>" + ITEM.replace("51.4771", "51.477100000000003") + "</mission>",
        "# wp\n#wp 1 valid\nwp 0 1 514771000 12000 1500 0 0 0 165\nwp 1 0 0 0 0 0 0 0 0\n",
        "WP  0  1 514771000 12000 1500 0 165\n",
        "set a = 1\rwp reset\rwp\t0 1 514771000 12000 1500 0 0 0 165\rsave\r",
    ],
)
def test_reads_every_program_that_writes_records(text: str) -> None:
    _, point = read(text)
    assert (point.command, point.frame) == (Command.NAV_WAYPOINT, Frame.GLOBAL_RELATIVE_ALT)
    assert (point.lat_e7, point.lon_e7, point.alt_m) == (514771000, 12000, 15)


def test_a_speed_and_a_height_above_the_sea_are_kept() -> None:
    _, speed, point = read("wp 0 1 514771000 12000 12000 350 0 1 165\n")
    assert (speed.command, speed.p2) == (Command.DO_CHANGE_SPEED, 3.5)
    assert (point.frame, point.alt_m) == (Frame.GLOBAL, 120)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<mission></mission>", "the file has no items"),
        (f"<mission>{ITEM.replace('WAYPOINT', 'SPIN')}</mission>", "missionitem 1: its action is 'SPIN'; use one of"),
        (
            f"<mission>{ITEM.replace('51.4771', '51,4771')}</mission>",
            "missionitem 1: '51,4771' has a decimal comma; set",
        ),
        (f"<mission>{ITEM.replace('0.0012', 'nan')}</mission>", "lon is 'nan'"),
        (f"<mission>{ITEM.replace('15', '1e12')}</mission>", "alt is '1e12', not a number"),
        (f"<mission>{ITEM}{ITEM.replace('parameter1', 'flag')}", "this XML is damaged"),
        (f"<!DOCTYPE m [<!ENTITY a 'b'>]><mission>{ITEM}</mission>", "delete the line that begins with <!DOCTYPE"),
        ("wp 0 1 51 12 15 0 0 0 165\nwp 1 4 0 0 0 0 0 0 165\n", "contains 2 missions"),
        ("wp 0 1 51 12 15 0 0 165\n", "line 1: 'wp 0 1 51 12 15 0 0 165... is not a waypoint"),
        ("wp 0 1 51 12 15 0 0 0 0\nwp 1 1 51477", "line 2: 'wp 1 1 51477' is not a waypoint"),
        ("wp 0 1 51.4771 0.0012 15 0 0 0 165\n", "line 1: 'wp 0 1 51.4771 0.0012 1... is not a waypoint"),
        ("wp 0 99 51 12 15 0 0 0 165\n", "line 1: its action is 99; use one of WAYPOINT (1)"),
        ("<svg/>", "this XML contains <svg>"),
    ],
)
def test_refuses_with_the_place_and_a_remedy(text: str, words: str) -> None:
    assert words in error(text)


def test_written_records_are_read_again() -> None:
    records = [
        NavRecord(NavAction.WAYPOINT, 514771000, -12000, 1550),
        NavRecord(NavAction.JUMP, p1=1, p2=-1),
        NavRecord(NavAction.RTH, p1=1, flag=LAST),
    ]
    home, point, jump, back = read(write_nav_xml(records, (514770000, -10000)))
    assert (home.lat_e7, home.lon_e7) == (514770000, -10000)
    assert (point.lat_e7, point.lon_e7, point.alt_m) == (514771000, -12000, 15.5)
    assert (jump.p1, jump.p2, back.p1) == (1, -1, 1)
