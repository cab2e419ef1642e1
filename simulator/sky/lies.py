# SPDX-License-Identifier: GPL-3.0-or-later
"""What a craft's sensors and motors do wrong. All of it may be changed in flight."""

from dataclasses import dataclass, fields


@dataclass(slots=True, kw_only=True)
class Lies:
    """By default everything is right."""

    #: The compass points this much too far clockwise, degrees.
    compass: float = 0.0
    #: The field of the motors' current in a hover, gauss, to the craft's left. The earth's is 0.21 horizontally.
    motor_field: float = 0.0
    #: The GPS module reports a place this far north of the true one, m, ...
    gps_jump: float = 0.0
    #: ... which grows, m/s. The reported speed has the drift, too.
    gps_drift: float = 0.0
    #: The age of a position when it is sent, s.
    gps_lag: float = 0.2
    #: The barometer's height rises by this, m/s.
    baro_drift: float = 0.0
    #: The barometer's height on the ground is this much too low in a hover, m: the propellers press the air.
    prop_wash: float = 0.0
    #: A factor of the propellers' vibration.
    vibration: float = 1.0
    #: A factor of the front right motor's thrust.
    weak_motor: float = 1.0


#: Seconds without a fix, beside the fields' names.
OUTAGE = "gps-outage"
NAMES = (*(field.name.replace("_", "-") for field in fields(Lies)), OUTAGE)
