"""MSP command numbers that the bridge uses (Harakiri's serial.c; the others: inav.md)."""

from enum import IntEnum


class Msp(IntEnum):
    """Requests. All of them only read, and their frames hold no hazard byte."""

    API_VERSION = 1
    FC_VARIANT = 2
    IDENT = 100
    STATUS = 101
    RC = 105
    RAW_GPS = 106
    ATTITUDE = 108
    ALTITUDE = 109
    ANALOG = 110
    BOXNAMES = 116
    WP = 118
