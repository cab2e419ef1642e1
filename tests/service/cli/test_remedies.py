# SPDX-License-Identifier: GPL-3.0-or-later
"""One table of faults in files and links: each sentence's remedy is applied, and then there is no fault.

tests/service/cli/doctor/test_remedy_table.py is that of the machine.
"""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from protocols.settings_file import read_settings_file
from service.cli.main import main
from service.settings.addresses import AddressError, parse_fc, parse_gcs
from tests.service.cli.test_direct_bridge import assert_one_sentence
from tests.support.programs import run_naze_bridge

HOME = "0\t1\t0\t16\t0\t0\t0\t0\t51.477\t0.001\t46\t1\n"
POINT = "1\t0\t3\t16\t0\t0\t0\t0\t51.4771\t0.0012\t15\t1\n"
TAKEOFF = "{}\t0\t3\t22\t0\t0\t0\t0\t51.4771\t0.0012\t10\t1\n"
CAMERA = "1\t0\t2\t530\t0\t2\t0\t0\t0\t0\t0\t1\n"
WPL = "QGC WPL 110\n"
ITEM = '<missionitem no="1" action="WAYPOINT" lat="51.4771" lon="0.0012" alt="15"/>'
KML = "<kml><LineString><altitudeMode>absolute</altitudeMode><coordinates>{}</coordinates></LineString></kml>"
Mend = Callable[[str], str]


def with_points(text: str) -> str:
    return text.replace(",", ".")


@pytest.mark.parametrize(
    ("name", "text", "fault", "remedy", "mend"),
    [
        ("a.waypoints", WPL + (HOME + POINT).replace(".", ","), "decimal comma", "replace the commas", with_points),
        ("a.mission", f"<mission>{ITEM.replace('.', ',')}</mission>", "decimal comma", "replace the", with_points),
        ("a.txt", HOME + POINT, "without the header", "write QGC WPL 110 into a line above", lambda text: WPL + text),
        (
            "a.waypoints",
            WPL + TAKEOFF.format(0) + POINT,
            "item 0 is TAKEOFF",
            "put home first",
            lambda _: WPL + HOME + TAKEOFF.format(1) + POINT.replace("1", "2", 1),
        ),
        (
            "a.waypoints",
            WPL + HOME + CAMERA + TAKEOFF.format(2) + POINT.replace("1", "3", 1),
            "TAKEOFF must be item 1",
            "remove WP 1 SET_CAMERA_MODE",
            lambda text: text.replace(CAMERA, ""),
        ),
        (
            "a.mission",
            f'<!DOCTYPE m SYSTEM "http://localhost/x">\n<mission>{ITEM}</mission>',
            "has a document type",
            "delete the line that begins with <!DOCTYPE",
            lambda text: text.partition("\n")[2],
        ),
        (
            "a.csv",
            "Breite;Länge;Höhe\n51.4771;0.0012;15\n",
            "without names for latitude and longitude",
            "latitude,longitude,altitude(m)",
            lambda text: "latitude,longitude,altitude(m)\n" + text.partition("\n")[2].replace(";", ","),
        ),
        (
            "a.kml",
            KML.format("0.0012, 51.4771, 15"),
            "is not LON,LAT,ALT",
            "blanks only between points",
            lambda text: text.replace(", ", ","),
        ),
        (
            "a.txt",
            "wp 0 1 51.4771 0.0012 15 0 0 0 165\n",
            "is not a waypoint",
            "write wp NUMBER ACTION LAT LON ALT P1 P2 P3 FLAG",
            lambda _: "wp 0 1 514771000 12000 1500 0 0 0 165\n",
        ),
    ],
)
def test_the_remedy_for_a_mission_file_makes_it_readable(
    tmp_path: Path, name: str, text: str, fault: str, remedy: str, mend: Mend
) -> None:
    file = tmp_path / name
    file.write_text(text)
    refused = CliRunner().invoke(main, ["check", str(file)])
    said = " ".join(refused.output.split())
    assert refused.exit_code in (1, 2)
    assert fault in said
    assert remedy in said
    file.write_text(mend(text))
    mended = CliRunner().invoke(main, ["check", str(file)])
    assert mended.exit_code == 0, mended.output


def test_the_command_for_a_path_without_altitudes_gives_it_one(tmp_path: Path) -> None:
    file, target = tmp_path / "path.kml", tmp_path / "MISSION.waypoints"
    file.write_text(KML.replace("absolute", "clampToGround").format("0.0012,51.4771,0"))
    refused = CliRunner().invoke(main, ["check", str(file)])
    (command,) = re.findall(r"`naze-bridge (convert .*)`", " ".join(refused.output.split()))
    words = command.replace("METRES", "15").replace("MISSION.waypoints", str(target)).split()
    assert CliRunner().invoke(main, words).exit_code == 0
    assert CliRunner().invoke(main, ["check", str(target)]).exit_code == 0


@pytest.mark.parametrize(
    ("text", "remedy", "mended"),
    [
        ("set nav_rth_altitude 2000\n", "write set NAME = VALUE", "set nav_rth_altitude = 2000\n"),
        ("WP_RADIUS,2,5\n", "with a decimal point", "WP_RADIUS,2.5\n"),
        ("A,1\nA,2\n", "delete one of the lines", "A,2\n"),
        ("<html></html>\n", "give a .param file or a dump", "A,2\n"),
        ("QGC WPL 110\n", "this file holds a mission; give a .param file or a dump", "A,2\n"),
    ],
)
def test_the_remedy_for_a_settings_file_makes_it_readable(text: str, remedy: str, mended: str) -> None:
    with pytest.raises(Exception, match=remedy):
        read_settings_file(text.encode(), "x")
    assert read_settings_file(mended.encode(), "x").values


@pytest.mark.parametrize(
    ("parse", "given", "suggested"),
    [
        (parse_fc, "ttyUSB0", r"did you mean (\S+)\?"),
        (parse_fc, "tcp:::1:5760", r"as in (\S+)"),
        (parse_gcs, "udp:192.168.4.20:14550", r"write (\S+) to send"),
        (parse_gcs, "udp:192.168.4.20:14550", r", (\S+) to listen"),
        (parse_gcs, "tcp:192.168.4.20:5760", r"write (\S+) to listen"),
        (parse_gcs, "14550", r"did you mean (\S+)\?"),
        (parse_gcs, "udpinn:0.0.0.0:14550", r"did you mean (\S+)\?"),
        (parse_gcs, "192.168.4.20:14550", r"did you mean (\S+)\?"),
        (parse_gcs, "/dev/ttyUSB1", r"as in (\S+)"),
    ],
)
def test_the_link_that_a_sentence_suggests_can_be_used(
    parse: Callable[[str], object], given: str, suggested: str
) -> None:
    with pytest.raises(AddressError) as caught:
        parse(given)
    (link,) = re.findall(suggested, str(caught.value))
    parse(f"tcp:{link}" if link.startswith("[") else link)


@pytest.mark.parametrize(
    ("words", "remedy"),
    [
        (["check"], "see `naze-bridge check --help`"),
        (["status", "--config", "x"], "see `naze-bridge status --help`"),
        (["pull", "a", "b"], "see `naze-bridge pull --help`"),
        (["chek", "x"], "did you mean 'check'?"),
        (["settings", "lst"], "did you mean 'list'?"),
        (["convert", "a.plan", "b.kml"], "name it .waypoints, .plan or .mission"),
    ],
)
def test_a_mistake_on_the_command_line_gets_one_sentence(words: list[str], remedy: str) -> None:
    assert_one_sentence(run_naze_bridge(*words), 2, remedy)
