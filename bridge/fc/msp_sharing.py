# SPDX-License-Identifier: GPL-3.0-or-later
"""MSP requests of other programs (INAV Configurator, MultiWiiConf, mwp) to a disarmed flight controller. Sans-IO.

Each request is a conversation, so it never mixes with a mission transfer, and telemetry polls continue in between.
MSP's error reply cannot carry a reason: that is in the log and in `status`.
"""

from collections.abc import Callable
from dataclasses import replace

from bridge.fc.session import FcSession
from bridge.line.conversation import Conversation, LinkLost, receive, send
from bridge.line.runner import Runner
from protocols.msp.command_line import is_clean
from protocols.msp.frame import Direction, MspFrame, request
from protocols.msp.nav import Nav, UnsafeRecord, decode_wp, encode_set_wp
from protocols.rights.effect import Effect
from protocols.rights.msp import Firmware, MspRight, msp_right

#: Programs wait for a reply before they ask again; more than this is a flood.
_MAX_PENDING = 16


class MspSharing:
    """Forwards requests one at a time. `request` returns the reason for a refusal, "" if there is none."""

    def __init__(self, session: FcSession, runner: Runner) -> None:
        self._session = session
        self._runner = runner
        self._pending = 0
        #: Called after a request that may have changed settings.
        self.on_change: Callable[[float], None] = lambda _now: None

    def request(self, frame: MspFrame, answer: Callable[[MspFrame], None], now: float, *, may_write: bool) -> str:
        """Forward a request; `answer` gets the reply, or is not called if the flight controller does not reply."""
        why = self._refusal(frame, may_write=may_write) or self._occupied()
        if why:
            return why
        self._pending += 1

        is_change = self._right(frame).effect is Effect.CHANGE

        def done(reply: MspFrame | LinkLost | None, at: float) -> None:
            self._pending -= 1
            if is_change:
                self.on_change(at)
            if isinstance(reply, MspFrame):
                answer(reply)

        self._runner.start(self._carry(frame, may_write=may_write), done, now)
        return ""

    def _carry(self, frame: MspFrame, *, may_write: bool) -> Conversation[MspFrame | None]:
        if self._refusal(frame, may_write=may_write):
            # While it waited for its turn, the craft was armed, or the link lost.
            return refused(frame)
        # Low commands as v1, which every flight controller speaks; the client gets its own version back.
        right = self._right(frame)
        is_change = right.effect is not Effect.READ
        yield from send(request(frame.command, frame.payload), frame.command, right.reply, exclusive=is_change)
        reply = yield from receive(frame.command)
        return None if reply is None else replace(reply, is_v2=frame.is_v2)

    def _refusal(self, frame: MspFrame, *, may_write: bool) -> str:
        state = self._session.state
        link = state.link
        if link is None or state.controller is None:
            return "no flight controller speaks MSP now"
        if self._session.vehicle.armed is not False:
            return "the craft is armed" if self._session.vehicle.armed else "not yet known to be disarmed"
        right = self._right(frame)
        if right.effect is Effect.MOVE:
            return f"{right.name} is never forwarded"
        if right.effect is Effect.UNKNOWN:
            return f"the effect of {right.name} with {len(frame.payload)} bytes is not known on this flight controller"
        if not may_write and right.effect is Effect.CHANGE:
            return f"{right.name} changes something: set write = true in its [[share]] to allow that"
        if not (link.any_byte or is_clean(request(frame.command, frame.payload))):
            return "its bytes could open this flight controller's command line, or reset it"
        if frame.command == Nav.SET_WP and (record := decode_wp(frame.payload)):
            try:
                encode_set_wp(*record)
            except UnsafeRecord as unsafe:
                return f"{unsafe}, which is never forwarded"
        return ""

    def _right(self, frame: MspFrame) -> MspRight:
        controller = self._session.state.controller
        firmware = controller.firmware if controller else Firmware.UNKNOWN
        return msp_right(firmware, frame.command, frame.payload)

    def _occupied(self) -> str:
        if self._pending >= _MAX_PENDING:
            return "too many requests at once"
        return "a mission transfer is running" if self._runner.needs_line and not self._pending else ""


def refused(frame: MspFrame) -> MspFrame:
    """The reply to a refused request."""
    return MspFrame(Direction.ERROR, frame.command, is_v2=frame.is_v2)
