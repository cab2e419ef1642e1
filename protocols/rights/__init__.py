# SPDX-License-Identifier: GPL-3.0-or-later
"""The effect of each request that can reach a flight controller. A request that is not listed here is refused."""

from enum import StrEnum


class Effect(StrEnum):
    """An effect. The first four apply to MSP and MAVLink, the others to MAVLink only.

    A mission's upload is a CHANGE. The start is a MOVE.
    """

    #: The flight controller replies and is otherwise as before.
    READ = "read"
    #: Changes the settings, mission, calibration or memory.
    CHANGE = "change"
    #: Arms or moves the craft, restarts it, or replaces its transmitter, sensors, receiver or port.
    MOVE = "move"
    #: No firmware's handler is known for it.
    UNKNOWN = "unknown"

    #: Part of a ground station's own dialogue. An autopilot knows the station only by the ids: with those of the pilot,
    #: a heartbeat hides the loss of the pilot's station, and a mission request ends the pilot's upload.
    DIALOGUE = "dialogue"
    #: Asks for message rates, which an autopilot applies to all ground stations.
    RATE = "rate"
    #: Ends or slows telemetry for all ground stations.
    SILENCE = "silence"
    #: Sets the signing key, which the message carries in the clear.
    KEY = "key"
    #: Not listed, and without a target: another vehicle's or a companion's telemetry.
    REPORT = "report"
