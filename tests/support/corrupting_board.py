# SPDX-License-Identifier: GPL-3.0-or-later
"""Boards that send wrong contents with a right checksum."""

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.codec import FrameWriter, Packed
from protocols.mavlink.dialect import MESSAGE_FORMATS
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.msp.frame import MspFrame, MspParser
from tests.support.fake_controllers import QuietLine
from tests.support.fuzz_inputs import FuzzInputs

_FRSKY_BAUD = 9600
READ_MESSAGES = (
    m.MAVLINK_MSG_ID_HEARTBEAT,
    m.MAVLINK_MSG_ID_SYS_STATUS,
    m.MAVLINK_MSG_ID_BATTERY_STATUS,
    m.MAVLINK_MSG_ID_ATTITUDE,
    m.MAVLINK_MSG_ID_GPS_RAW_INT,
    m.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    m.MAVLINK_MSG_ID_VFR_HUD,
    m.MAVLINK_MSG_ID_HOME_POSITION,
    m.MAVLINK_MSG_ID_RC_CHANNELS,
    m.MAVLINK_MSG_ID_SYSTEM_TIME,
)


class CorruptingBoard:
    """Changes a share, `rate`, of a board's frames; FrSky has no frames, so there it changes bytes."""

    def __init__(self, board: Any, inputs: FuzzInputs, rate: float) -> None:
        self._board = board
        self._inputs = inputs
        self._rate = rate
        self._msp = MspParser()
        self._mavlink = MavlinkSplitter()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._board, name)

    def advance(self, now: float) -> bytes:
        """The bytes that the board sends until `now`."""
        sent = self._board.advance(now)
        if self._board.baud == _FRSKY_BAUD:
            return bytes(self._inputs.random.randrange(256) if self._corrupts else byte for byte in sent)
        replies = [(self._reply(frame) if self._corrupts else frame).encode() for frame in self._msp.feed(sent)]
        messages = [self._message(frame) if self._corrupts else frame.raw for frame in self._mavlink.feed(sent)]
        return b"".join(replies + messages)

    @property
    def _corrupts(self) -> bool:
        return self._inputs.random.random() < self._rate

    def _reply(self, frame: MspFrame) -> MspFrame:
        return MspFrame(frame.direction, frame.command, self._inputs.contents(len(frame.payload)), is_v2=frame.is_v2)

    def _message(self, frame: MavlinkFrame) -> bytes:
        return FrameWriter(*frame.sender).frame(any_message(frame.msgid, self._inputs), frame.version)


class RandomAutopilot(QuietLine):
    """Speaks MAVLink itself. Half of its messages are those that the bridge reads."""

    def __init__(self, inputs: FuzzInputs) -> None:
        super().__init__()
        self._inputs = inputs
        self._writer = FrameWriter(1, 1)
        self._due = 0.0

    def advance(self, now: float) -> bytes:
        """Return the frames due until `now`, ten a second."""
        draw = self._inputs.random
        while self._due <= now:
            self._due += 0.1
            msgid = draw.choice(READ_MESSAGES if draw.random() < 0.5 else tuple(MESSAGE_FORMATS))
            self.outgoing += self._writer.frame(any_message(msgid, self._inputs), draw.choice((1, 2)))
        return super().advance(now)

    def next_wakeup(self, now: float) -> float:
        return self._due


def any_message(msgid: int, inputs: FuzzInputs) -> Packed:
    layout = MESSAGE_FORMATS[msgid]
    contents = inputs.contents(layout.full_size)[: layout.full_size].ljust(layout.full_size, b"\0")
    return Packed(msgid, contents[: layout.base_size], contents.rstrip(b"\0") or b"\0")
