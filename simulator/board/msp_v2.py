# SPDX-License-Identifier: GPL-3.0-or-later
"""MSP v2 as in INAV and Betaflight, alongside v1 on the same port (src/main/msp/msp_serial.c)."""

import struct

from fastcrc.crc8 import dvb_s2

from simulator.board.msp_port import MspReceiver

_HEADER_SIZE = 8
_DOLLAR, _V2 = ord("$"), ord("X")


class MspReceiverV2(MspReceiver):
    """Finds requests of either version. It trusts a header's size and never rescans."""

    def __init__(self, buffer_size: int) -> None:
        super().__init__(buffer_size)
        self._largest = buffer_size
        self._after_dollar = False
        self._frame = bytearray()

    @property
    def in_frame(self) -> bool:
        return bool(self._frame) or super().in_frame

    def push(self, byte: int) -> tuple[int, bytes] | None:
        """Take a byte. Returns command and payload if it completes a request with a valid checksum."""
        if self._frame:
            self._frame.append(byte)
            return self._look()
        begins = self._after_dollar and byte == _V2
        self._after_dollar = byte == _DOLLAR and not super().in_frame
        if begins:
            self.forget()
            self._frame += b"$X"
            return None
        return super().push(byte)

    def _look(self) -> tuple[int, bytes] | None:
        frame = self._frame
        if len(frame) == 3 and frame[2] != ord("<"):
            frame.clear()
        if len(frame) < _HEADER_SIZE:
            return None
        command, size = struct.unpack_from("<HH", frame, 4)
        if size > self._largest:
            frame.clear()
        if len(frame) <= _HEADER_SIZE + size:
            return None
        body, checksum = bytes(frame[3:-1]), frame[-1]
        frame.clear()
        return (command, body[5:]) if dvb_s2(body) == checksum else None
