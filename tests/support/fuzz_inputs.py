# SPDX-License-Identifier: GPL-3.0-or-later
"""Random inputs for all interfaces from one seed: valid, damaged, and noise."""

import random
from collections.abc import Sequence

from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.codec import FrameWriter, Packed
from protocols.mavlink.dialect import MESSAGE_FORMATS
from protocols.msp.frame import Direction, MspFrame

#: Messages that ground stations send; others are drawn less often.
_OURS = [
    m.MAVLINK_MSG_ID_HEARTBEAT,
    m.MAVLINK_MSG_ID_PARAM_REQUEST_READ,
    m.MAVLINK_MSG_ID_PARAM_REQUEST_LIST,
    m.MAVLINK_MSG_ID_PARAM_SET,
    *range(m.MAVLINK_MSG_ID_MISSION_REQUEST_PARTIAL_LIST, m.MAVLINK_MSG_ID_MISSION_ACK + 1),
    m.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
    m.MAVLINK_MSG_ID_MISSION_ITEM_INT,
    m.MAVLINK_MSG_ID_COMMAND_LONG,
    m.MAVLINK_MSG_ID_COMMAND_INT,
    m.MAVLINK_MSG_ID_REQUEST_DATA_STREAM,
    m.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL,
    m.MAVLINK_MSG_ID_TIMESYNC,
]
_BYTES = (b"\0", b"\1", b"\xff", b"\x80", b"\x7f")


class FuzzInputs:
    """A generator of inputs, determined by `seed`."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)

    def from_a_ground_station(self) -> bytes:
        """A MAVLink frame of any known message (ids above 255 included), or something similar."""
        msgid = self.random.choice(_OURS if self.random.random() < 0.5 else list(MESSAGE_FORMATS))
        payload = self.contents(MESSAGE_FORMATS[msgid].full_size)
        sysid, version = self.random.choice((1, 250, 255, self.random.randrange(256))), self.random.choice((1, 2, 2))
        frame = FrameWriter(sysid, 190).frame(Packed(msgid, payload, payload or b"\0"), 2 if msgid > 255 else version)
        return self.damaged(frame)

    def from_the_uart(self) -> bytes:
        """An MSP frame, a MAVLink frame, or something similar."""
        if self.random.random() < 0.2:
            return self.from_a_ground_station()
        reply = MspFrame(
            self.random.choice((Direction.REPLY, *Direction)), self.random.randrange(256), self.contents(255)
        )
        return self.damaged(reply.encode())

    def like(self, examples: Sequence[bytes]) -> bytes:
        """A file similar to one of these."""
        data = self.random.choice(examples)
        for _ in range(self.random.randrange(1, 5)):
            data = self.damaged(data)
        return data

    def damaged(self, data: bytes) -> bytes:
        """The data unchanged, truncated, altered, with a part moved, or after noise."""
        draw = self.random
        at, end = sorted((draw.randrange(len(data) + 1), draw.randrange(len(data) + 1)))
        match draw.randrange(12):
            case 0:
                return data[:end]
            case 1:
                return data[:at] + draw.randbytes(draw.randrange(1, 9)) + data[at + 1 :]
            case 2:
                return data[:at] + data[end:]
            case 3:
                return data[:end] + data[at:]
            case 4:
                return draw.randbytes(draw.randrange(300)) + data
            case 5:
                return draw.randbytes(draw.randrange(300))
        return data

    def contents(self, size: int) -> bytes:
        """Contents of any size, but often of this one."""
        size = self.random.choice((size, self.random.randrange(256), self.random.randrange(size + 1)))
        if self.random.random() < 0.5:
            return self.random.randbytes(size)
        # Small and extreme values, among them valid targets and counts.
        return b"".join(self.random.choice(_BYTES) for _ in range(size))
