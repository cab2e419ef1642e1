# SPDX-License-Identifier: GPL-3.0-or-later
"""The craft's true track: samples of a flight, and figures of them."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import hypot, sqrt

from simulator.emulated_naze.flying_naze import FlyingNaze
from simulator.sky.vectors import Vector, heading_of, tilt_of

_EVERY_S = 0.1


@dataclass(frozen=True, slots=True)
class Sample:
    """Times in seconds since power on; metres and m/s in the sky's axes; degrees."""

    at_s: float
    position: Vector
    velocity: Vector
    heading: float
    tilt: float
    armed: bool

    @property
    def height(self) -> float:
        return self.position[2]

    @property
    def speed(self) -> float:
        return hypot(self.velocity[0], self.velocity[1])

    def distance_to(self, place: tuple[float, float]) -> float:
        """Horizontal, to a place north and west of the launch."""
        return hypot(self.position[0] - place[0], self.position[1] - place[1])

    def distance_to_leg(self, begin: tuple[float, float], end: tuple[float, float]) -> float:
        """Horizontal, to the nearest point of the line between two places."""
        north, west = end[0] - begin[0], end[1] - begin[1]
        along = (self.position[0] - begin[0]) * north + (self.position[1] - begin[1]) * west
        part = min(max(along / (north**2 + west**2 or 1.0), 0.0), 1.0)
        return self.distance_to((begin[0] + part * north, begin[1] + part * west))


@dataclass(slots=True)
class Track:
    """Samples ten times a second."""

    samples: list[Sample] = field(default_factory=list)

    def note(self, now: float, naze: FlyingNaze) -> None:
        """Add a sample, if it is time."""
        if self.samples and now < self.samples[-1].at_s + _EVERY_S - 1e-6:
            return
        body = naze.sky.body
        self.samples.append(
            Sample(now, body.position, body.velocity, heading_of(body.attitude), tilt_of(body.attitude), naze.armed)
        )

    def since(self, at_s: float) -> "Track":
        return Track([sample for sample in self.samples if sample.at_s >= at_s])

    def between(self, begin_s: float, end_s: float) -> "Track":
        return Track([sample for sample in self.samples if begin_s <= sample.at_s <= end_s])

    def __iter__(self) -> Iterator[Sample]:
        return iter(self.samples)

    @property
    def last(self) -> Sample:
        return self.samples[-1]

    def height_rms(self, around: float | None = None) -> float:
        """The root mean square of the height's deviation from its mean, or from `around`."""
        heights = [sample.height for sample in self.samples]
        middle = sum(heights) / len(heights) if around is None else around
        return sqrt(sum((height - middle) ** 2 for height in heights) / len(heights))

    def distances(self, place: tuple[float, float]) -> tuple[float, float]:
        """The root mean square and the maximum of the distance to a place."""
        found = [sample.distance_to(place) for sample in self.samples]
        return sqrt(sum(distance * distance for distance in found) / len(found)), max(found)

    @property
    def middle(self) -> tuple[float, float]:
        count = len(self.samples)
        return sum(s.position[0] for s in self.samples) / count, sum(s.position[1] for s in self.samples) / count
