# SPDX-License-Identifier: GPL-3.0-or-later
"""The track of this flight or the last one, which the page draws."""

from payloads.mission_data import Json
from service.daemon.daemon import Daemon

#: About 1 m: degrees.
_STEP = 1e-5
#: Then every second place is left out: 1000 of them draw any flight.
_MOST = 2000


class FlownTrack:
    """`sample` notes the craft's place every second, while it is armed and moves."""

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon
        self._places: list[tuple[float, float]] = []
        self._was_armed = False
        #: Another one means that the places so far are no longer the beginning of the list.
        self._version = 0

    def sample(self) -> None:
        report = self._daemon.report()
        was_armed, self._was_armed = self._was_armed, bool(report.last_heard.armed)
        if self._was_armed and not was_armed:
            self._places, self._version = [], self._version + 1
        lat, lon = report.position.lat_deg, report.position.lon_deg
        if self._was_armed and lat is not None and lon is not None:
            self._append(lat, lon)

    def _append(self, lat: float, lon: float) -> None:
        if self._places and max(abs(lat - self._places[-1][0]), abs(lon - self._places[-1][1])) < _STEP:
            return
        self._places.append((lat, lon))
        if len(self._places) > _MOST:
            self._places, self._version = self._places[::2], self._version + 1

    @property
    def state(self) -> Json:
        return {"version": self._version, "length": len(self._places)}

    def to_json(self, first: int) -> Json:
        """The places from number `first` on."""
        return {"version": self._version, "places": self._places[first:]}
