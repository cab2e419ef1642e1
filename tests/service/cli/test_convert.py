# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge convert`, run as a command."""

import math
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from protocols.mission_file import read_mission_file
from service.cli.convert import convert

WPL = "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t51.477\t0.001\t46\t1\n1\t0\t3\t{}\t0\t0\t0\t0\t51.4771\t0.0012\t15\t1\n"
KML = "<kml><LineString><coordinates>0.0012,51.4771 0.0015,51.4772</coordinates></LineString></kml>"


def run(folder: Path, source: str, content: str, *args: str) -> Result:
    (folder / source).write_text(content)
    return CliRunner().invoke(convert, [str(folder / source), *args])


@pytest.mark.parametrize("ending", ["waypoints", "txt", "plan", "mission", "xml"])
def test_a_mission_keeps_home_and_waypoints_in_every_format(tmp_path: Path, ending: str) -> None:
    target = tmp_path / f"out.{ending}"
    done = run(tmp_path, "in.waypoints", WPL.format(16), str(target))
    assert done.exit_code == 0, done.output
    home, point = read_mission_file(target.read_bytes(), target.name)
    assert (home.lat_e7, home.lon_e7) == (514770000, 10000)
    assert (point.command, point.lat_e7, point.lon_e7, point.alt_m) == (16, 514771000, 12000, 15)


def test_a_path_gets_the_altitude_and_home_that_are_given(tmp_path: Path) -> None:
    target = tmp_path / "out.waypoints"
    assert run(tmp_path, "in.kml", KML, str(target)).exit_code == 2
    assert not target.exists()
    done = run(tmp_path, "in.kml", KML, str(target), "--alt", "30", "--home", "51.477,0.001")
    assert done.exit_code == 0, done.output
    assert "the file has no home" not in done.output
    home, first, _ = read_mission_file(target.read_bytes(), target.name)
    assert (home.lat_e7, home.lon_e7, first.alt_m) == (514770000, 10000, 30)


@pytest.mark.parametrize("ending", ["waypoints", "plan", "mission"])
def test_whole_numbers_of_inavs_xml_are_written(tmp_path: Path, ending: str) -> None:
    waiting = '<missionitem no="1" action="POSHOLD_TIME" lat="51.4771" lon="0.0012" alt="15" parameter1="30"/>'
    target = tmp_path / f"out.{ending}"
    assert run(tmp_path, "in.mission", f"<mission>{waiting}</mission>", str(target)).exit_code == 0
    assert read_mission_file(target.read_bytes(), target.name)[1].p1 == 30


def test_a_list_without_home_needs_the_option(tmp_path: Path) -> None:
    text, target = WPL.replace("\t0\t16\t", "\t3\t22\t").format(16), tmp_path / "out.plan"
    done = run(tmp_path, "in.waypoints", text, str(target))
    assert done.exit_code == 2
    assert "the list has no home; --home LAT,LON adds it" in " ".join(done.output.split())
    assert run(tmp_path, "in.waypoints", text, str(target), "--home", "51.47,0.001").exit_code == 0
    assert [item.command for item in read_mission_file(target.read_bytes(), "x")] == [16, 22, 16]


@pytest.mark.parametrize(
    ("target", "args", "words"),
    [
        ("out.kml", [], "name it .waypoints, .plan or .mission"),
        ("out.waypoints", ["--alt", "30"], "omit --alt, which is for a KML, GPX or CSV"),
        ("out.waypoints", ["--home", "91,0"], "is not a position"),
    ],
)
def test_refuses_unsupported_conversions(tmp_path: Path, target: str, args: list[str], words: str) -> None:
    done = run(tmp_path, "in.waypoints", WPL.format(16), str(tmp_path / target), *args)
    assert done.exit_code == 2
    assert words in " ".join(done.output.split())


def test_a_list_that_inav_refuses_is_not_written(tmp_path: Path) -> None:
    target = tmp_path / "out.mission"
    done = run(tmp_path, "in.waypoints", WPL.format(84), str(target))  # its one command is dropped
    assert done.exit_code == 1
    assert not target.exists()


def test_an_infinite_altitude_of_a_file_is_unknown_in_a_plan(tmp_path: Path) -> None:
    target = tmp_path / "out.plan"
    assert run(tmp_path, "in.waypoints", WPL.format(16).replace("\t15\t", "\tinf\t"), str(target)).exit_code == 0
    assert math.isnan(read_mission_file(target.read_bytes(), "x")[1].alt_m)
