# SPDX-License-Identifier: GPL-3.0-or-later
"""A list as Harakiri's flight core flies it, and what it refuses in the air (firmware/naze_flight.c, check_record)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from bridge.missions.flown_legs import Departure, FlownPath, Judgement, Leg, first_of, in_metres
from bridge.model.ground_track import Place, distance_m
from protocols.msp.mission import WpCommand, WpRecord
from reports.finding import News

#: NF_MAX_LEG_M, and NF_TAKEOFF_LEAST_M, also of legs, and NF_TAKEOFF_MOST_M.
MAX_LEG_M, LEAST_M, TAKEOFF_MOST_M = 2000, 2, 15
PLACED = (WpCommand.WAYPOINT, WpCommand.LOITER_UNLIM, WpCommand.LOITER_TURNS, WpCommand.LOITER_TIME)
_WITHOUT_HEIGHT = (WpCommand.LAND, WpCommand.SETROI)


@dataclass(frozen=True, slots=True)
class FlightLimits:
    """The settings of a Harakiri with mission flight that decide about a list, and their defaults: metres."""

    mission_first: int = 200
    mission_height: int = 100
    #: 0: any distance from home.
    mission_radius: int = 0

    def judge(self, records: Sequence[WpRecord], path: FlownPath, departure: Departure) -> Iterable[Judgement]:
        """The core compares whole metres, rounded down."""
        long, high, limited, outside = [], [], [], []
        home = departure.place or departure.home
        for leg in path.legs:
            off_m = 0.0 if home is None else distance_m(home, leg.end)
            if 0 < self.mission_radius < int(off_m):
                why = f"not flown: {in_metres(off_m)} off, mission_radius {self.mission_radius} m"
                outside.append((leg.target, why))
            elif leg.is_first and int(leg.length_m) > self.mission_first:
                why = f"not flown: {in_metres(leg.length_m)} off, mission_first {self.mission_first} m"
                if departure.home is not None and int(distance_m(departure.home, leg.end)) <= self.mission_first:
                    why = f"starts only at the list's home, {in_metres(leg.length_m)} off"
                yield Judgement(leg.target, "lat_e7", why)
            elif int(leg.length_m) > MAX_LEG_M:
                long.append((leg.target, f"not flown: {in_metres(leg.length_m)} leg, at most 2 km"))
        for place, record in enumerate(records):
            if not place or record.command in _WITHOUT_HEIGHT:
                continue
            if (flown_m := _flown_m(record)) > self.mission_height:
                high.append((place, f"not flown: {flown_m} m, mission_height {self.mission_height}"))
            elif flown_m != record.height_m:
                limited.append((place, f"{record.height_m} m is flown at {flown_m} m"))
        yield from first_of(limited, "alt_m", News.WARNING)
        yield from first_of(long, "lat_e7")
        yield from first_of(outside, "lat_e7")
        yield from first_of(high, "alt_m")


USUAL_FLIGHT = FlightLimits()


def _flown_m(record: WpRecord) -> int:
    height_m = max(record.height_m, LEAST_M)
    return min(height_m, TAKEOFF_MOST_M) if record.command == WpCommand.TAKEOFF else height_m


def fly(records: Sequence[WpRecord], departure: Departure) -> FlownPath:
    """The way of the records. The first is the list's home. RETURN_TO_LAUNCH leads to the place of arming."""
    legs: list[Leg] = []
    here: Place | None = departure.place
    here_cm = None
    for place, record in enumerate(records[1:], 1):
        end = record if record.command in PLACED else departure.place
        if end is None or not (record.command in PLACED or record.command == WpCommand.RETURN_TO_LAUNCH):
            continue
        end_cm = 100 * max(record.height_m, LEAST_M)
        is_return = record.command == WpCommand.RETURN_TO_LAUNCH
        start_cm = end_cm if here_cm is None else here_cm
        start = here or end
        length_m = 0.0 if start is end else distance_m(start, end)
        legs.append(Leg(place, place, start, end, length_m, start_cm, end_cm, not legs, is_return))
        here, here_cm = end, end_cm
    return FlownPath(legs, lands=records[-1].command == WpCommand.LAND)


def low_returns(path: FlownPath) -> Iterable[Judgement]:
    """Returns below the highest leg."""
    for leg in path.legs:
        if leg.is_return and leg.end_cm is not None and leg.end_cm < path.highest_cm:
            why = f"RTL flies home at {leg.end_cm / 100:g} m, below the {path.highest_cm / 100:g} m"
            yield Judgement(leg.target, "alt_m", why)
