# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge's counters, for metrics and the status."""

from collections.abc import Mapping
from dataclasses import dataclass

from bridge.line.msp_link import RoundTrips
from bridge.model.settings import SettingsState


@dataclass(frozen=True, slots=True)
class Counters:
    """Since the start; those of the flight controller since it was found, None without MSP."""

    ground_stations: int
    #: Frames of ground stations, by link and message id; damaged ones; refused ones, by link and reason.
    frames_received: Mapping[tuple[str, int], int]
    bad_frames: int
    refused: Mapping[tuple[str, str], int]
    #: Requests of programs on a share, by reason.
    refused_by_share: Mapping[str, int]
    fc_bad_checksums: int
    fc_requests_lost: int | None
    fc_round_trips: RoundTrips | None
    firmware_version: tuple[int, int, int] | None
    settings: SettingsState | None
