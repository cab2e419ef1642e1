# SPDX-License-Identifier: GPL-3.0-or-later
"""MSP command numbers that the bridge uses (Harakiri's serial.c; the others: INAV's msp_protocol.h)."""

from enum import IntEnum


class Msp(IntEnum):
    """Read requests. They do not change anything, and their frames are free of hazard bytes."""

    API_VERSION = 1
    FC_VARIANT = 2
    FC_VERSION = 3
    MODE_RANGES = 34
    SONAR = 58
    IDENT = 100
    STATUS = 101
    RAW_IMU = 102
    SERVO = 103
    MOTOR = 104
    RC = 105
    RAW_GPS = 106
    COMP_GPS = 107
    ATTITUDE = 108
    ALTITUDE = 109
    ANALOG = 110
    RC_TUNING = 111
    PID = 112
    BOX = 113
    MISC = 114
    BOXNAMES = 116
    PIDNAMES = 117
    WP = 118
    BOXIDS = 119
    NAV_STATUS = 121
    STATUS_EX = 150
    SENSOR_STATUS = 151
    UID = 160
    GPSSTATISTICS = 166
    #: Of Harakiri's mission extension.
    FLIGHT = 179
    RTC = 246
    DEBUG = 254
    INAV_STATUS = 0x2000
    INAV_ANALOG = 0x2002
    INAV_MISC = 0x2003
    INAV_RATE_PROFILE = 0x2007
    INAV_AIR_SPEED = 0x2009
    INAV_DEBUG = 0x2019
    INAV_TEMPERATURES = 0x201E
    PID_V2 = 0x2030
    INAV_EZ_TUNE = 0x2070


class MspAction(IntEnum):
    """Commands for the ground only: the firmware would also execute them in flight (serial.c)."""

    ACC_CALIBRATION = 205
    MAG_CALIBRATION = 206
