# SPDX-License-Identifier: GPL-3.0-or-later
"""A ground station directly on a board's UART, for Harakiri's own MAVLink upload and parameters."""

from collections.abc import Mapping

from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.codec import FrameWriter, decode
from protocols.mavlink.dialect import Message
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.mission_item import Command
from tests.support.naze_bench import WireBench
from tests.support.packing import pack

#: A command that the firmware does not store.
UNKNOWN = Command.DO_JUMP
_BOARD = (1, 200)


def item(seq: int, command: int = m.MAV_CMD_NAV_WAYPOINT) -> Message:
    place = (45.3838 + seq / 1e4, 8.4733, 20.0 + seq)
    frame = m.MAV_FRAME_GLOBAL_RELATIVE_ALT
    return m.MAVLink_mission_item_message(*_BOARD, seq, frame, command, 0, 1, 0.0, 3.0, 0.0, 0.0, *place)


class MavlinkGround:
    """A MAVLink 1 ground station on a bench."""

    def __init__(self, bench: WireBench) -> None:
        self._bench = bench
        self._writer = FrameWriter(255, 190)
        self._splitter = MavlinkSplitter()
        self._frames: list[MavlinkFrame] = []

    def send(self, message: Message) -> None:
        self._bench.send(self._writer.frame(pack(message), 1))

    def wait(self, *wanted: int, seconds: float = 2.0) -> Message | None:
        """The next message of one of these kinds."""
        end = self._bench.now + seconds
        while True:
            while self._frames:
                frame = self._frames.pop(0)
                if frame.msgid in wanted:
                    return decode(frame)
            if self._bench.now >= end:
                return None
            self._frames += self._splitter.feed(self._bench.run(0.02))

    def set_parameter(self, name: str, value: float) -> list[str]:
        """Set a parameter; return the names and indexes that the board reports."""
        self.send(m.MAVLink_param_set_message(*_BOARD, name.encode(), value, m.MAV_PARAM_TYPE_REAL32))
        answers = []
        while (answer := self.wait(m.MAVLINK_MSG_ID_PARAM_VALUE, seconds=0.5)) is not None:
            answers.append(f"{answer.param_id} {answer.param_index}")
        return answers

    def answer_to(self, message: Message) -> int | None:
        """The result of the ACK to a message."""
        self.send(message)
        ack = self.wait(m.MAVLINK_MSG_ID_MISSION_ACK)
        return None if ack is None else int(ack.type)

    def upload(self, count: int, stop_after: int | None = None, replace: Mapping[int, int] | None = None) -> int | None:
        """Upload waypoints, some replaced by other commands; return the ACK's result, None if it was stopped."""
        self.send(m.MAVLink_mission_count_message(*_BOARD, count))
        for _ in range(count + 1):
            reply = self.wait(m.MAVLINK_MSG_ID_MISSION_REQUEST, m.MAVLINK_MSG_ID_MISSION_ACK)
            assert reply is not None, "no reply"
            if reply.get_msgId() == m.MAVLINK_MSG_ID_MISSION_ACK:
                return int(reply.type)
            if reply.seq == stop_after:
                return None
            self.send(item(reply.seq, (replace or {}).get(reply.seq, m.MAV_CMD_NAV_WAYPOINT)))
        raise AssertionError("no end")
