# SPDX-License-Identifier: GPL-3.0-or-later
"""A mission flown once by a firmware image, from power on to the verdict: what `naze-bridge fly` prints."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

from protocols.firmware_image import FLASH_SIZE
from protocols.msp.mission import WpRecord
from simulator.emulated_naze.console import ConsoleError
from simulator.emulated_naze.flying_naze import FlyingNaze
from simulator.emulated_naze.image import Image
from simulator.emulated_naze.prepared_flash import prepared_flash
from simulator.flights.judgement import Extremes, ItemResult, extremes, is_flown, judge
from simulator.flights.mission_run import MissionRun, fly_mission
from simulator.flights.mission_upload import UnfitImageError, require_mission_flight, upload
from simulator.flights.pilot import Pilot, PilotError
from simulator.flights.track_picture import track_svg
from simulator.flights.wrongs import Wrongs
from simulator.sky.body import Airframe
from simulator.sky.earth import Place
from simulator.sky.sky import Weather


class SortieError(Exception):
    """The image, or what is wrong with the craft, cannot be flown; one sentence."""


@dataclass(frozen=True, slots=True)
class Sortie:
    """A flight, and the verdict."""

    run: MissionRun
    place: Place
    items: list[ItemResult]
    extremes: Extremes

    @property
    def is_flown(self) -> bool:
        """As in the list, and within all bounds."""
        return is_flown(self.items) and not self.extremes.problem

    @property
    def seconds(self) -> float:
        return round(self.run.track.last.at_s - self.run.begun_s, 1)

    def to_json(self) -> dict[str, Any]:
        return {
            "flown": self.is_flown,
            "reason": self.run.reason.name.lower(),
            "seconds": self.seconds,
            **asdict(self.extremes),
            "problem": self.extremes.problem,
            "items": [asdict(item) for item in self.items],
        }

    titles: ClassVar = ("WP", "command", "reached s", "near m", "high m", "held s", "turned", "problems")

    def rows(self) -> list[list[str]]:
        """A table of the commands, for people."""
        rows = []
        for item in self.items:
            planned = "" if item.planned_height_m is None else f" of {item.planned_height_m:.0f}"
            rows.append(
                [
                    str(item.number),
                    item.command,
                    _number(item.reached_s, 0),
                    _number(item.distance_m, 1),
                    "" if item.height_m is None else f"{item.height_m:.1f}{planned}",
                    _number(item.held_s, 1),
                    _number(item.turned_deg, 0),
                    "; ".join(item.problems) or "-",
                ]
            )
        return rows

    def summary(self) -> str:
        """Two sentences, a line each."""
        found = self.extremes
        ending = "Flown" if self.is_flown else f"Not flown: {found.problem}" if found.problem else "Not flown"
        return (
            f"At most {found.farthest_m:.0f} m from home and {found.off_legs_m:.0f} m from the mission's legs, "
            f"{found.fastest:.1f} m/s, leaning {found.steepest_deg:.0f} degrees{self.run.compass}.\n"
            f"{ending}, in {self.seconds:.0f} s."
        )

    def svg(self, title: str) -> str:
        return track_svg(self.run.track, self.run.records, self.place, title)


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def fly_sortie(
    image: Image,
    name: str,
    records: Sequence[WpRecord],
    weather: Weather,
    kilograms: float,
    lies: Sequence[str],
    flash: bytes | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> Sortie:
    """Fly the list with a prepared board, or with this flash. lies: NAME=VALUE, as Wrongs reads them. SortieError."""
    place = Place(lat=records[0].lat_e7 / 1e7, lon=records[0].lon_e7 / 1e7)
    if flash is not None and len(flash) != FLASH_SIZE:
        raise SortieError(f"a flash has {FLASH_SIZE} bytes, not {len(flash)} bytes: make it with sim --image --flash")
    try:
        wrongs = Wrongs(lies)
        contents = flash or prepared_flash(image, say, ("set mission_fly=1",))
        frame = Airframe().scaled(kilograms)
        memory = memoryview(bytearray(contents))
        pilot = Pilot(FlyingNaze(image, memory, weather=weather, frame=frame, place=place, lies=wrongs.lies))
        say(f"{name} boots.")
        pilot.power_on()
        require_mission_flight(pilot.console, name)
        upload(pilot.console, records)
        say(f"{len(records) - 1} commands are on the board. It flies, in wind of {weather.wind:g} m/s.")
        run = fly_mission(pilot, records, wrongs.happen)
    except (ValueError, ConsoleError, UnfitImageError, PilotError) as error:
        raise SortieError(str(error)) from error
    return Sortie(run, place, judge(run, place), extremes(run, place))
