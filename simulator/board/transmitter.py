# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated pilot's transmitter: the switch positions for Harakiri's boxes (mw.c, GetRCandAuxfromBuf).

MSP_BOX has one word per box, with three bits per aux channel: low (below 1300 us), middle, and high (above 1700 us).
"""

import struct
from functools import cache

_LOW, _MIDDLE, _HIGH = 1000, 1500, 2000
_POSITIONS = {_LOW: 0b001, _MIDDLE: 0b010, _HIGH: 0b100}
#: The bit offsets of aux 1..4.
_AUX1, _AUX2, _AUX3, _AUX4 = 0, 3, 6, 9
_AT_MIDDLE, _AT_HIGH = 0b010, 0b100

#: Box number -> switch positions.
_ACTIVATION = {
    0: _AT_MIDDLE << _AUX2,  # ANGLE
    1: _AT_HIGH << _AUX2,  # HORIZON
    2: (_AT_MIDDLE | _AT_HIGH) << _AUX3,  # BARO
    5: _AT_HIGH << _AUX1,  # ARM
    6: _AT_MIDDLE << _AUX4,  # GPS HOME
    7: _AT_HIGH << _AUX3,  # GPS HOLD
    8: _AT_HIGH << _AUX4,  # GPS AUTO
}


def box_activation(boxes: int) -> bytes:
    """The payload of MSP_BOX for this many boxes."""
    return struct.pack(f"<{boxes}H", *(_ACTIVATION.get(box, 0) for box in range(boxes)))


def channels_us(armed: bool, boxes: int) -> tuple[int, ...]:
    """Roll, pitch, yaw, throttle, aux 1..4 for these boxes, one bit each."""
    aux = [_HIGH if armed else _LOW]
    for middle, high in ((0, 1), (2, 7), (6, 8)):
        aux.append(_HIGH if boxes >> high & 1 else _MIDDLE if boxes >> middle & 1 else _LOW)
    return (_MIDDLE, _MIDDLE, _MIDDLE, 1450 if armed else _LOW, *aux)


@cache  # each main loop asks
def switch_positions(armed: bool, boxes: int) -> int:
    """The positions of aux 1..4, as in a word of MSP_BOX."""
    aux = channels_us(armed, boxes)[4:]
    return sum(_POSITIONS[value] << 3 * number for number, value in enumerate(aux))
