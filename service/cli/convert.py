# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge convert`: a mission file in another format, offline."""

from collections.abc import Sequence
from pathlib import Path

import click

from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.missions.list_check import check_list, with_home
from protocols.mission_file import MissionFileError, write_mission_file
from protocols.mission_file.nav_mission import write_nav_xml
from protocols.mission_item import Command, MissionItem, MissionResult
from protocols.msp.nav import NavRecord
from protocols.remedies import Fault
from reports.verdict import Result
from terminal.command_group import PATH, position
from terminal.files import load_mission, shown_path, write_file
from terminal.mission_table import mission_table
from terminal.printing import print_table
from terminal.sentences import UNREADABLE, fail, say

_TEXT, _NAV = (".waypoints", ".txt", ".plan"), (".mission", ".xml")


@click.command()
@click.argument("source", type=PATH)
@click.argument("target", type=PATH)
@click.option(
    "--alt",
    "alt_m",
    type=click.FloatRange(-32767, 32767),
    help="The altitude above home of all points of a path (KML, GPX or CSV), m.",
)
@click.option("--home", metavar="LAT,LON", callback=position, help="Home, if the file has none.")
def convert(source: Path, target: Path, alt_m: float | None, home: tuple[int, int] | None) -> None:
    """Write the mission in SOURCE to TARGET, in the format that the ending of TARGET names.

    SOURCE is any file that `naze-bridge check` reads. TARGET ends with .waypoints or .txt (QGC WPL 110), .plan
    (QGroundControl), .mission or .xml (INAV Configurator and mwp: INAV's rules apply, and every change is shown).
    """
    ending = target.suffix.lower()
    if ending not in (*_TEXT, *_NAV):
        fail(MissionFileError(shown_path(target), "", *Fault.UNKNOWN_ENDING()), UNREADABLE)
    try:
        items = load_mission(source, alt_m, has_home=home is not None)
        if alt_m is not None and any(item.alt_m != alt_m for item in items[1:]):
            raise MissionFileError(shown_path(source), "", *Fault.OWN_ALTITUDES())
        if items[0].command != Command.NAV_WAYPOINT and home is None:
            raise MissionFileError(shown_path(source), "", *Fault.HOME_MISSING())
        if not (items[0].lat_e7 and items[0].lon_e7):
            home = home or (0, 0)  # which ground stations read as unknown
        items = list(with_home(items, home))
        text = _nav_text(items) if ending in _NAV else write_mission_file(items, target.name)
        write_file(target, text, MissionFileError)
    except MissionFileError as error:
        fail(error, UNREADABLE)
    say(f"{len(items)} items, home included, written to {shown_path(target)}")


def _nav_text(items: Sequence[MissionItem]) -> str:
    """The records that an INAV would store. Ends the program with status 1 if it would refuse the list."""
    verdict = check_list(items, NavRules(NavProfile()), None)
    records = [record for record in verdict.records if isinstance(record, NavRecord)]
    if verdict.findings and verdict.ack is not MissionResult.NO_SPACE:
        print_table(mission_table(items, verdict.items, verdict.findings, verdict.sent_seqs))
    if verdict.result is not Result.ACCEPTED:
        fail(verdict.findings[-1].text())
    home = items[0]
    return write_nav_xml(records, (home.lat_e7, home.lon_e7) if home.lat_e7 and home.lon_e7 else None)
