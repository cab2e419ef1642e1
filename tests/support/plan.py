# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission lists as in a ground station's plan screen, and the lists that the rules make of them."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.controllers.harakiri.check import HarakiriRules
from bridge.missions.list_check import check_list
from protocols.mavlink.dialect import Message
from protocols.mission_file.qgc_wpl import write_qgc_wpl
from protocols.mission_item import Command, Frame, MissionItem, degrees_to_e7, pack_records
from protocols.msp.mission import WpRecord
from reports.verdict import Verdict

PROFILE = HarakiriRules(capacity=146, wp_radius_cm=200)


@dataclass(frozen=True)
class PlanRow:
    """One row, in degrees and metres; the first row of a plan is home."""

    command: int
    lat: float = 0.0
    lng: float = 0.0
    alt: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    p3: float = 0.0
    p4: float = 0.0
    frame: int = Frame.GLOBAL_RELATIVE_ALT

    def int_message(self, sysid: int, compid: int, seq: int) -> Message:
        """MISSION_ITEM_INT; Mission Planner truncates the coordinates."""
        place = (int(self.lat * 1e7), int(self.lng * 1e7))
        return messages.MAVLink_mission_item_int_message(*self._head(sysid, compid, seq), *place, self.alt)

    def float_message(self, sysid: int, compid: int, seq: int) -> Message:
        return messages.MAVLink_mission_item_message(*self._head(sysid, compid, seq), self.lat, self.lng, self.alt)

    def _head(self, sysid: int, compid: int, seq: int) -> tuple[float, ...]:
        return (sysid, compid, seq, self.frame, self.command, 0, 1, self.p1, self.p2, self.p3, self.p4)

    def as_sent(self, seq: int, *, use_int: bool) -> MissionItem:
        """The item as the ground station sends it."""
        if use_int:
            lat_e7, lon_e7 = int(self.lat * 1e7), int(self.lng * 1e7)
        else:
            lat_e7, lon_e7 = degrees_to_e7(single(self.lat)) or 0, degrees_to_e7(single(self.lng)) or 0
        p1, p2, p3, p4, alt = (single(value) for value in (self.p1, self.p2, self.p3, self.p4, self.alt))
        return MissionItem(seq, self.command, self.frame, p1, p2, p3, p4, lat_e7, lon_e7, alt)


def single(value: float) -> float:
    """A number rounded to a 32-bit float."""
    number: float = struct.unpack("<f", struct.pack("<f", value))[0]
    return number


def as_items(rows: Sequence[PlanRow], *, use_int: bool = True) -> list[MissionItem]:
    """The items as the ground station sends them."""
    return [row.as_sent(seq, use_int=use_int) for seq, row in enumerate(rows)]


def plan_text(rows: Sequence[PlanRow]) -> str:
    """The list as a QGC WPL file."""
    return write_qgc_wpl(as_items(rows))


def plan_file(folder: Path, rows: Sequence[PlanRow]) -> Path:
    path = folder / "plan.waypoints"
    path.write_text(plan_text(rows))
    return path


def judge(rows: Sequence[PlanRow], *, use_int: bool = True, profile: HarakiriRules = PROFILE) -> Verdict[WpRecord]:
    """The rules' verdict on a list: the board's records and the items that read back."""
    return check_list(as_items(rows, use_int=use_int), profile)


def stored_fields(item: MissionItem) -> tuple[float, ...]:
    """A stored item as it must read back: seq, command, frame, param1..4, lat_e7, lon_e7, height."""
    assert item.lat_e7 is not None
    assert item.lon_e7 is not None
    return (
        item.seq,
        item.command,
        item.frame,
        item.p1,
        item.p2,
        item.p3,
        item.p4,
        item.lat_e7,
        item.lon_e7,
        item.alt_m,
    )


def expected_fields(plan: Sequence[PlanRow], *, use_int: bool = True) -> list[tuple[float, ...]]:
    """The items that must read back after `plan` was written."""
    return [stored_fields(item) for item in judge(plan, use_int=use_int).items]


def records_of(verdict: Verdict[WpRecord]) -> list[str]:
    """A verdict's records in hex, like those of the simulated board."""
    return [pack_records([record]).hex() for record in verdict.records]


HOME = PlanRow(Command.NAV_WAYPOINT, 45.3838, 8.4733, 131.0, frame=Frame.GLOBAL)


def waypoint(number: int, **fields: float) -> PlanRow:
    """One waypoint of a grid; position and height differ for each number."""
    lat, lng = 45.3840123 + number % 12 * 3.7e-4, 8.4735432 + number // 12 * 5.3e-4
    row = {"lat": lat, "lng": lng, "alt": 12.0 + number % 30, "p2": 3.0} | fields
    return PlanRow(Command.NAV_WAYPOINT, **row)  # type: ignore[arg-type]


def plain_plan(count: int, start: int = 0) -> list[PlanRow]:
    """Home and waypoints that are stored unchanged; each `start` gives a different list of the same length."""
    return [HOME, *(waypoint(start + number) for number in range(1, count))]


def mixed_plan(count: int) -> list[PlanRow]:
    """A list with every command that is stored, a dropped one, and changed values (at least 12 items)."""
    head = [
        HOME,
        PlanRow(Command.NAV_TAKEOFF, alt=20.0),
        PlanRow(Command.DO_SET_ROI, 45.3843398, 8.4742597),
        waypoint(1, p1=1.0, p4=1.0),
        PlanRow(Command.NAV_LOITER_TURNS, 45.3845001, 8.4745002, 18.0, p1=-3.0, p2=4.0),
        PlanRow(178, p2=5.0),  # DO_CHANGE_SPEED: unknown to the flight controller
        PlanRow(Command.NAV_LOITER_TIME, 45.3846003, 8.4746004, 19.5, p1=700.0, p2=1.0, p4=1.0),
        PlanRow(Command.DO_SET_ROI_NONE),
        waypoint(2, p4=1.0, alt=0.0),
        PlanRow(Command.NAV_ROI, 45.3847005, 8.4747006),
    ]
    tail = [PlanRow(Command.NAV_RETURN_TO_LAUNCH, alt=15.0)]
    return head + [waypoint(number) for number in range(3, 3 + count - len(head) - len(tail))] + tail
