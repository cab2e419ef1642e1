# SPDX-License-Identifier: GPL-3.0-or-later
"""A vehicle in 80 bytes, for programs that watch thousands: whole numbers only, always in CBOR."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import cbor2

from payloads.mission_data import Json
from reports.vehicle_groups import Progress

_GREATEST = 0xFFFFFFFF
_FIXES = {"none": 0, "2D": 2, "3D": 3}
_PROGRESS = {progress.text: progress.value for progress in Progress}


@dataclass(frozen=True, slots=True)
class Overview:
    """Made from the state. None if not known, or stale."""

    link: Annotated[str, "as in link's state"]
    armed: bool | None
    mode: str | None
    battery_cv: Annotated[int | None, "V * 100"]
    lat_e7: Annotated[int | None, "degrees * 1e7"]
    lon_e7: Annotated[int | None, "degrees * 1e7"]
    height_m: Annotated[int | None, "above the launch point"]
    mission_count: Annotated[int | None, "records, home included"]
    mission_checksum: Annotated[int | None, "CRC-32 over the records"]
    heading_deg: Annotated[int | None, "0 up to 360, clockwise from north"]
    speed_dm_s: Annotated[int | None, "over ground, m/s * 10"]
    fix: Annotated[int | None, "of the GPS: 0 none, 2 or 3 dimensions"]
    mission_state: Annotated[int | None, "MAVLink's MISSION_STATE: 2 not started, 3 active, 4 paused, 5 complete"]

    @property
    def marks(self) -> object:
        """The values whose change is sent at once."""
        return self.link, self.armed, self.mode, self.mission_count, self.mission_checksum, self.mission_state


#: The schema's `cborKey`. A field keeps its number as long as the keys keep their version: new fields come last.
CBOR_NUMBERS = {name: number for number, name in enumerate(("v", "seq", "time_s", *Overview.__annotations__))}


def overview_of(state: Json) -> Overview:
    status, battery, position = (state[group] for group in ("status", "battery", "position"))
    mission = state["mission"] or {}
    checksum, progress, heading_deg = mission.get("checksum"), mission.get("state"), state["attitude"]["heading_deg"]
    return Overview(
        link=state["link"]["state"],
        armed=status.get("armed"),
        mode=status.get("mode"),
        battery_cv=_whole(battery.get("voltage_v"), 100),
        lat_e7=_whole(position.get("lat_deg"), 1e7),
        lon_e7=_whole(position.get("lon_deg"), 1e7),
        height_m=_whole(position.get("height_m"), 1),
        mission_count=mission.get("count"),
        mission_checksum=None if checksum is None else int(checksum, 16),
        heading_deg=None if heading_deg is None else round(heading_deg) % 360,
        speed_dm_s=_whole(state["gps"]["ground_speed_m_s"], 10),
        fix=_FIXES.get(state["gps"]["fix"]),
        mission_state=None if progress is None else _PROGRESS[progress],
    )


def state_of(overview: Json) -> Json:
    """The parts of a state that an overview has, or None where it has none. It may be foreign."""

    def scaled(name: str, scale: float) -> float | None:
        value = overview.get(name)
        return value / scale if isinstance(value, int) and abs(value) <= _GREATEST else None

    def named(name: str, names: Mapping[str, int]) -> str | None:
        return next((each for each, number in names.items() if number == overview.get(name)), None)

    checksum = overview.get("mission_checksum")
    return {
        "time_s": overview.get("time_s"),
        "link": {"state": overview.get("link")},
        "status": {name: overview.get(name) for name in ("armed", "mode")},
        "battery": {"voltage_v": scaled("battery_cv", 100)},
        "position": {
            "lat_deg": scaled("lat_e7", 1e7),
            "lon_deg": scaled("lon_e7", 1e7),
            "height_m": scaled("height_m", 1),
        },
        "attitude": {"heading_deg": scaled("heading_deg", 1)},
        "gps": {"ground_speed_m_s": scaled("speed_dm_s", 10), "fix": named("fix", _FIXES)},
        "mission": {
            "count": overview.get("mission_count"),
            "checksum": f"{checksum:08x}" if isinstance(checksum, int) and 0 <= checksum <= _GREATEST else None,
            "state": named("mission_state", _PROGRESS),
        },
    }


def packed(body: Json) -> bytes:
    """Encode an overview with its envelope, in CBOR with a number per field instead of its name."""
    return cbor2.dumps({CBOR_NUMBERS[name]: value for name, value in body.items()})


def unpacked(data: bytes) -> Json:
    """Decode an overview. ValueError or cbor2.CBORError if that is impossible. Unknown numbers are ignored."""
    values = cbor2.loads(data)
    if not isinstance(values, Mapping):
        raise ValueError("an overview is a map")
    return {name: values[number] for name, number in CBOR_NUMBERS.items() if number in values}


def _whole(value: float | None, scale: float) -> int | None:
    return None if value is None else round(value * scale)
