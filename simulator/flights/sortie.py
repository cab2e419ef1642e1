# SPDX-License-Identifier: GPL-3.0-or-later
"""A mission flown once by a firmware image, from power on to the verdict: what `naze-bridge fly` prints."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from protocols.firmware_image import Image
from protocols.msp.mission import WpRecord
from simulator.emulated_naze.console import ConsoleError
from simulator.emulated_naze.flying_naze import FlyingNaze
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
    """A flight, and its verdict."""

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
