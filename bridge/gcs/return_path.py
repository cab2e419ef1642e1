# SPDX-License-Identifier: GPL-3.0-or-later
"""Proof that a UDP station receives what is sent to its address. Sans-IO.

The source address of a datagram may be forged: a stranger who sends one in another machine's name would let the bridge
send telemetry there. On the Pi's own networks a second datagram is taken as proof, because a host there could disturb
the others in any case. A station behind a router must send a key, or answer a question that only its address got: PING
(QGroundControl and MAVSDK answer it) or TIMESYNC (Mission Planner). Until then at most three times the bytes that it
sent go back, as in QUIC (RFC 9000, section 8.1).
"""

from secrets import randbelow

from bridge.voice.sentences import BEHIND_A_ROUTER
from protocols.mavlink.codec import decode
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame

_FACTOR = 3
#: Small enough for both messages' fields, and for two trailing zeros that MAVLink 2 omits.
_NONCES = 1 << 47
_ROUND = 4
#: A client may send a dozen requests before the answer arrives.
_ENOUGH_QUESTIONS = 16


class ReturnPath:
    """A station's address until it is proven. `is_near`: it is on one of the Pi's own networks."""

    def __init__(self, *, is_near: bool) -> None:
        self.is_near = is_near
        self._datagrams = 0
        #: Bytes that may still be sent.
        self._allowance = 0
        self._nonce = 0
        self._asked = 0

    def received(self, size: int) -> None:
        """Count a datagram from this address."""
        self._datagrams += 1
        self._allowance += _FACTOR * size

    def allows(self, frame: bytes) -> bool:
        """Count a frame to this address. Returns False if it must not be sent."""
        is_allowed = len(frame) <= self._allowance
        self._allowance -= is_allowed * len(frame)
        return is_allowed

    def is_proven_by(self, frame: MavlinkFrame) -> bool:
        if self.is_near:
            return self._datagrams > 1
        if not self._nonce or frame.msgid not in (m.MAVLINK_MSG_ID_PING, m.MAVLINK_MSG_ID_TIMESYNC):
            return False
        answer = decode(frame)
        if frame.msgid == m.MAVLINK_MSG_ID_PING:
            return answer is not None and answer.target_system != 0 and answer.time_usec == self._nonce
        return answer is not None and answer.tc1 != 0 and answer.ts1 == self._nonce

    def question(self) -> Message | None:
        """The next message to go with a heartbeat: together they stay within three times a heartbeat's size."""
        if self.is_near:
            return None
        self._nonce = self._nonce or 1 + randbelow(_NONCES)
        self._asked += 1
        match self._asked % _ROUND:
            case 1:
                return m.MAVLink_ping_message(self._nonce, 0, 0, 0)
            case 2:
                return m.MAVLink_timesync_message(0, self._nonce)
            case 0 if self._asked >= _ENOUGH_QUESTIONS:
                return m.MAVLink_statustext_message(BEHIND_A_ROUTER.severity, BEHIND_A_ROUTER.text.encode())
        return None
