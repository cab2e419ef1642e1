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
from protocols.msp.frame import MAX_REPLY, Direction, MspFrame, request
from protocols.msp.nav import Nav, UnsafeRecord, decode_wp, encode_set_wp

#: Never forwarded: commands that move the craft or stand in for its transmitter and sensors, that cut off its receiver,
#: or that disconnect everyone. V2_FRAME is a v2 frame inside a v1 frame, which would hide one of them.
_NEVER = {
    68: "REBOOT",
    200: "SET_RAW_RC",
    201: "SET_RAW_GPS",
    214: "SET_MOTOR",
    245: "SET_PASSTHROUGH",
    255: "V2_FRAME",
    **dict.fromkeys(range(0x1F01, 0x1F10), "a sensor's value"),
    0x201F: "SIMULATOR",
    **dict.fromkeys(range(0x2033, 0x2038), "a firmware update"),
    0x2230: "SET_AUX_RC",
    0x3000: "BIND",
    0x3001: "BIND",
}
#: Without a payload a request only reads, except for these: DATAFLASH_ERASE, calibrations, RESET_CONF, RESET_CURR_PID,
#: BIND (MultiWii), EEPROM_WRITE, OPFLOW_CALIBRATION.
_ACTIONS = frozenset((72, 205, 206, 208, 219, 241, 250, 0x2032))
_DATAFLASH_READ = 71
#: With a payload it is a change, except for these, which say what to read: OSD_CHAR_READ, WP, VTXTABLE_BAND,
#: VTXTABLE_POWERLEVEL, SETTING, SETTING_INFO, PG_LIST, TIMER_OUTPUT_MODE, OSD_LAYOUTS, SAFEHOME,
#: LOGIC_CONDITIONS_SINGLE, FW_APPROACH, CUSTOM_OSD_ELEMENT, GEOZONE, GEOZONE_VERTEX.
_QUESTIONS_WITH_PAYLOAD = frozenset(
    {_DATAFLASH_READ, 86, 118, 137, 138, 0x1003, 0x1007, 0x1008}
    | {0x200E, 0x2012, 0x2038, 0x203B, 0x204A, 0x2101, 0x2210, 0x2212}
)
#: The size of the reply is unknown: it gets the line, and the whole ring of a Harakiri, to itself.
_REPLY_PAYLOAD = 1024
#: Programs wait for a reply before they ask again; more than this is a flood.
_MAX_PENDING = 16


class MspSharing:
    """Forwards requests one at a time. `request` returns the reason for a refusal, "" if there is none."""

    def __init__(self, session: FcSession, runner: Runner) -> None:
        self._session = session
        self._runner = runner
        self._pending = 0

    def request(self, frame: MspFrame, answer: Callable[[MspFrame], None], now: float, *, may_write: bool) -> str:
        """Forward a request; `answer` gets the reply, or is not called if the flight controller does not reply."""
        why = self._refusal(frame, may_write=may_write) or self._occupied()
        if why:
            return why
        self._pending += 1

        def done(reply: MspFrame | LinkLost | None, _at: float) -> None:
            self._pending -= 1
            if isinstance(reply, MspFrame):
                answer(reply)

        self._runner.start(self._carry(frame, may_write=may_write), done, now)
        return ""

    def _carry(self, frame: MspFrame, *, may_write: bool) -> Conversation[MspFrame | None]:
        if self._refusal(frame, may_write=may_write):
            # While it waited for its turn, the craft was armed, or the link lost.
            return refused(frame)
        # Low commands as v1, which every flight controller speaks; the client gets its own version back.
        size = MAX_REPLY if frame.command == _DATAFLASH_READ else _REPLY_PAYLOAD
        yield from send(request(frame.command, frame.payload), frame.command, size, exclusive=is_change(frame))
        reply = yield from receive(frame.command)
        return None if reply is None else replace(reply, is_v2=frame.is_v2)

    def _refusal(self, frame: MspFrame, *, may_write: bool) -> str:
        state = self._session.state
        link = state.link
        if link is None or state.controller is None:
            return "no flight controller speaks MSP now"
        if self._session.vehicle.armed is not False:
            return "the craft is armed" if self._session.vehicle.armed else "not yet known to be disarmed"
        if frame.command in _NEVER:
            return f"{_NEVER[frame.command]} is never forwarded"
        if not may_write and is_change(frame):
            return "it changes something: set write = true in its [[share]] to allow that"
        if not (link.any_byte or is_clean(request(frame.command, frame.payload))):
            return "its bytes could open this flight controller's command line, or reset it"
        if frame.command == Nav.SET_WP and (record := decode_wp(frame.payload)):
            try:
                encode_set_wp(*record)
            except UnsafeRecord as unsafe:
                return f"{unsafe}, which is never forwarded"
        return ""

    def _occupied(self) -> str:
        if self._pending >= _MAX_PENDING:
            return "too many requests at once"
        return "a mission transfer is running" if self._runner.needs_line and not self._pending else ""


def is_change(frame: MspFrame) -> bool:
    """True if a request may change something on the flight controller."""
    if frame.payload:
        return frame.command not in _QUESTIONS_WITH_PAYLOAD
    return frame.command in _ACTIONS


def refused(frame: MspFrame) -> MspFrame:
    """The reply to a refused request."""
    return MspFrame(Direction.ERROR, frame.command, is_v2=frame.is_v2)
