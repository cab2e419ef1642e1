# SPDX-License-Identifier: GPL-3.0-or-later
"""The serial line to the flight controller over the last minutes, for the page's plot."""

from collections import deque
from dataclasses import asdict, dataclass

from payloads.mission_data import Json
from service.daemon.daemon import Daemon

INTERVAL_S = 2.0
_SAMPLES = 150  # five minutes


@dataclass(frozen=True, slots=True)
class Sample:
    """One interval. round_trip_ms: None without MSP. lost, damaged: unanswered requests and bad checksums in it."""

    round_trip_ms: float | None
    lost: int
    damaged: int


class LinkHistory:
    """`sample` takes one every INTERVAL_S."""

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon
        self._samples: deque[Sample] = deque(maxlen=_SAMPLES)
        self._before = (0, 0)

    def sample(self) -> None:
        link = self._daemon.report().link
        lost, damaged = link.requests_lost or 0, link.bad_checksums or 0
        lost_before, damaged_before = self._before
        self._before = lost, damaged
        # Both counters restart with another flight controller.
        since = max(lost - lost_before, 0), max(damaged - damaged_before, 0)
        self._samples.append(Sample(link.round_trip_ms, *since))

    def to_json(self) -> Json:
        return {"interval_s": INTERVAL_S, "samples": [asdict(sample) for sample in self._samples]}
