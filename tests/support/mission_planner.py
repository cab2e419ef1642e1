# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission Planner as a scripted client: its messages, waits and timeouts (docs/ground-stations.md).

Only its behaviour on the link, quirks included: any ack to MISSION_COUNT means "continue" to it, and it understands
only MISSION_REQUEST (40) while sending MISSION_ITEM_INT.
"""

import socket
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from types import TracebackType
from typing import Any, Self

from pymavlink.dialects.v10 import ardupilotmega as mavlink_1
from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.mavlink.dialect import Message
from protocols.mission_item import Frame, MissionResult
from tests.support.mission_planner_screen import MissionPlannerScreen
from tests.support.plan import PlanRow
from tests.support.programs import TIMEOUT_S

SYSID, COMPID = 255, 190
_DATAGRAM_SIZE = 2048
_INT_CAPABILITY = messages.MAV_PROTOCOL_CAPABILITY_MISSION_INT
_FENCE_CAPABILITY = messages.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
_TABS = ("MISSION", "FENCE", "RALLY")
#: Its requests at the first heartbeat: stream and rate.
_STREAMS = ((2, 2), (6, 2), (10, 4), (11, 4), (12, 2), (1, 2), (3, 2))


class UploadFailed(Exception):
    """The error dialogue its user sees. `result` is the result code that caused it, None for a timeout."""

    def __init__(self, text: str, result: MissionResult | None = None) -> None:
        super().__init__(text)
        self.result = result


class TimedOut(UploadFailed):
    """The client gave up."""


class MissionPlanner:
    """A ground station with a UDP client link to `address`; with `listen` it waits for the vehicle there instead."""

    def __init__(self, address: tuple[str, int], *, listen: bool = False) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        if listen:
            self._socket.bind(address)
        self._peer = None if listen else address
        self._sees_mavlink_2 = False
        self._codec = messages.MAVLink(None, srcSystem=SYSID, srcComponent=COMPID)
        self._codec.robust_parsing = True
        self._router: deque[Message] = deque()
        self._heartbeat_due = time.monotonic()
        self.vehicle: tuple[int, int] | None = None
        self.capabilities = 0
        #: MAV_MISSION_TYPE of the tab that is open: its buttons write and read that list.
        self.tab = 0
        #: The parameters as a file; None: it requested them one by one.
        self.parameters: dict[str, float] = {}
        self._parameter_count = 0
        self.texts: list[str] = []
        self.armed = False
        #: Every received message, whether a loop was waiting for it or not.
        self.received: list[Message] = []
        self.unacked_commands: list[int] = []
        #: What its user reads and hears; times are those of time.monotonic().
        self.screen = MissionPlannerScreen()
        # Read by "Write Fast"; no loop can take it away.
        self._requested, self._answer = 0, MissionResult.ACCEPTED

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._socket.close()

    # -- the link --------------------------------------------------------------------------------------------

    def send(self, message: Message) -> None:
        """Send in MAVLink 1 until the vehicle has shown MAVLink 2."""
        self._send_bytes(bytes(message.pack(self._codec, force_mavlink1=not self._sees_mavlink_2)))

    def _send_bytes(self, frame: bytes) -> None:
        self._codec.seq = (self._codec.seq + 1) % 256
        if self._peer is not None:
            self._socket.sendto(frame, self._peer)

    def _send_signed(self, message: Message) -> None:
        """Sign with the all-zero key it has before a passphrase is set."""
        signing = self._codec.signing
        signing.secret_key, signing.link_id, signing.sign_outgoing = bytes(32), 1, True
        self._send_bytes(bytes(message.pack(self._codec)))
        signing.secret_key, signing.sign_outgoing = None, False

    def _packets(self, seconds: float) -> Iterator[Message]:
        """Yield the packets that reach the waiting loop within this time."""
        deadline = time.monotonic() + seconds
        while True:
            while self._router:
                yield self._router.popleft()
            if not self._receive(deadline):
                return

    def _receive(self, deadline: float) -> bool:
        """Receive one datagram; False at the deadline."""
        now = time.monotonic()
        if now >= self._heartbeat_due:
            self._heartbeat_due = now + 1.0
            self.send(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
        if now >= deadline:
            return False
        self._socket.settimeout(max(min(deadline, self._heartbeat_due) - now, 0.001))
        try:
            data, sender = self._socket.recvfrom(_DATAGRAM_SIZE)
        except TimeoutError:
            return True
        self._peer = sender
        for message in self._codec.parse_buffer(data) or []:
            if message.get_type() != "BAD_DATA" and _has_the_right_size(message):
                self._note(message)
        return True

    def _discard(self) -> None:
        """Lose the packets that arrived while no loop was waiting: its reader passes on no others."""
        deadline = time.monotonic() + 0.05
        while self._receive(deadline):
            pass
        self._router.clear()

    def _note(self, message: Message) -> None:
        """Process a packet before any loop gets it."""
        self.received.append(message)
        self.screen.take(time.monotonic(), message)
        self._sees_mavlink_2 |= message.get_msgbuf()[0] == 0xFD
        match message.get_type():
            case "HEARTBEAT":
                self.armed = bool(message.base_mode & messages.MAV_MODE_FLAG_SAFETY_ARMED)
            case "STATUSTEXT":
                self.texts.append(message.text.rstrip())
            case "AUTOPILOT_VERSION":
                self.capabilities = message.capabilities
            case "PARAM_VALUE":
                self.parameters[message.param_id] = message.param_value
                self._parameter_count = message.param_count
            case "MISSION_REQUEST" if self._is_for_me(message):
                self._requested = message.seq
            case "MISSION_ACK" if self._is_for_me(message):
                self._answer = MissionResult(message.type)
        self._router.append(message)

    def _is_for_me(self, message: Message) -> bool:
        sender = (message.get_srcSystem(), message.get_srcComponent())
        return sender == self.vehicle and (message.target_system, message.target_component) == (SYSID, COMPID)

    @property
    def _target(self) -> tuple[int, int]:
        assert self.vehicle is not None, "no vehicle has been found"
        return self.vehicle

    def listen(self, seconds: float) -> None:
        """Only listen, for a time in seconds."""
        for _ in self._packets(seconds):
            pass

    def joined_texts(self) -> str:
        """All texts of the vehicle joined, because long ones arrive in pieces."""
        return " ".join(self.texts)

    def wait_for_text(self, part: str) -> None:
        """Wait until `part` occurs in the vehicle's texts."""
        self.wait_until(lambda: part in self.joined_texts(), f"the text {part!r}")

    def wait_for_ack(self, result: MissionResult) -> None:
        self.wait_until(lambda: result in self.acks(), result.name)

    def wait_for_armed(self, armed: bool) -> None:
        """Wait for heartbeats with this armed state."""
        self.wait_until(lambda: self.armed is armed, f"armed {armed}")

    def wait_until(self, condition: Callable[[], bool], what: str) -> None:
        deadline = time.monotonic() + TIMEOUT_S
        while not condition():
            assert self._receive(deadline), f"timed out waiting for {what}; received {self.texts}, {self.acks()}"

    # -- connecting ------------------------------------------------------------------------------------------

    def wait_for_vehicle(self) -> None:
        """Wait for two heartbeats of an autopilot's component 1; until then nothing is sent to a vehicle."""
        seen = 0
        for message in self._packets(TIMEOUT_S):
            if message.get_type() == "HEARTBEAT" and message.get_srcComponent() == 1 and message.type != 6:
                seen += 1
                self.vehicle = message.get_srcSystem(), message.get_srcComponent()
                if seen == 2:
                    return
        raise TimedOut("No Heartbeat Packets Received")

    def skip_connecting(self) -> None:
        """Continue as if the daemon's vehicle had been found earlier."""
        self.vehicle = (1, 1)
        self._sees_mavlink_2 = True

    def connect(self) -> None:
        """All of its requests in the first seconds."""
        m = messages
        self.wait_for_vehicle()
        for _ in range(2):
            self.send(m.MAVLink_statustext_message(6, b"Mission Planner"))
        self._send_signed(m.MAVLink_statustext_message(6, b"Mission Planner"))
        for _ in range(2):
            self.request_streams()
        self.command(m.MAV_CMD_REQUEST_MESSAGE, 148)
        self.command(m.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, 1)
        self.request_version()
        self.command(42428)
        # With this capability it would ask for a file of parameters first, and wait 15 s for an answer.
        assert not self.capabilities & m.MAV_PROTOCOL_CAPABILITY_FTP
        self._request_parameters()
        self.command(m.MAV_CMD_REQUEST_MESSAGE, 259, tries=4)
        self.command(521, 1)
        self.command(m.MAV_CMD_REQUEST_MESSAGE, 269)
        self.command(m.MAV_CMD_REQUEST_MESSAGE, 280)
        self.command(m.MAV_CMD_SET_MESSAGE_INTERVAL, 271)

    def request_streams(self) -> None:
        """At the first heartbeat, and about every 38 s."""
        for stream, rate in _STREAMS:
            self.send(messages.MAVLink_request_data_stream_message(*self._target, stream, rate, 1))

    def command(self, command: int, param1: float = 0.0, tries: int = 1) -> int | None:
        """COMMAND_LONG, 2 s a try; return the MAV_RESULT, None without an ack."""
        for confirmation in range(tries):
            self.send(
                messages.MAVLink_command_long_message(*self._target, command, confirmation, param1, 0, 0, 0, 0, 0, 0)
            )
            for message in self._packets(2.0):
                if message.get_type() == "COMMAND_ACK" and message.command == command:
                    result: int = message.result
                    return result
        self.unacked_commands.append(command)
        return None

    def read_hud(self) -> str:
        """The line on its HUD now."""
        return self.screen.hud(time.monotonic())

    def request_version(self) -> None:
        """AUTOPILOT_VERSION_REQUEST, 500 ms x 3; without a reply it assumes no capabilities."""
        for _ in range(3):
            self.send(messages.MAVLink_autopilot_version_request_message(*self._target))
            for message in self._packets(0.5):
                if message.get_type() == "AUTOPILOT_VERSION":
                    return

    def _request_parameters(self) -> None:
        """Request the list every 4 s until it arrives; then missing parameters by index."""
        deadline = time.monotonic() + TIMEOUT_S
        while not self._parameter_count:
            assert time.monotonic() < deadline, "it would request parameters forever"
            self.send(messages.MAVLink_param_request_list_message(*self._target))
            for _ in self._packets(4.0):
                if len(self.parameters) == self._parameter_count:
                    break
        while len(self.parameters) < self._parameter_count:
            assert time.monotonic() < deadline, "a parameter is missing"
            for index in range(self._parameter_count):
                self.send(messages.MAVLink_param_request_read_message(*self._target, b"", index))
                for message in self._packets(0.2):
                    if message.get_type() == "PARAM_VALUE":
                        break

    # -- writing ---------------------------------------------------------------------------------------------

    def write(self, rows: Sequence[PlanRow], *, use_int: bool = True) -> None:
        """Its Write button; rows[0] of a mission is home. UploadFailed is the dialogue its user would see."""
        self._check_tab()
        if self.tab == messages.MAV_MISSION_TYPE_FENCE:
            rows = [replace(row, frame=Frame.GLOBAL) for row in rows]
        self._start_upload(len(rows))
        self.write_rest(rows, 0, use_int=use_int)

    def write_rest(self, rows: Sequence[PlanRow], at: int, *, use_int: bool = True) -> None:
        """Write the rest of a list whose upload has begun."""
        while at < len(rows):
            result = self._write_item(rows, at, use_int)
            if result is MissionResult.ERROR:
                partial = messages.MAVLink_mission_write_partial_list_message(*self._target, at, len(rows), self.tab)
                self.send(partial)
                result = self._write_item(rows, at, use_int)
            if result is MissionResult.NO_SPACE:
                raise UploadFailed("Upload failed, please reduce the number of wp's", result)
            if result is MissionResult.INVALID:
                raise UploadFailed(f"mission was rejected by the Mav, item had a bad option wp# {at}", result)
            if result is MissionResult.INVALID_SEQUENCE:
                at = self._requested_seq(at) - 1
            elif result is not MissionResult.ACCEPTED:
                error = UploadFailed(f"Upload {_TABS[self.tab]} failed {result.name}", result)
                error.add_note(f"The vehicle's last texts: {self.texts[-5:]}")
                raise error
            at += 1
        self._send_ack()

    def after_write(self, radius_m: float | None = None) -> None:
        """Its requests after a successful Write: home, and the radius in its text box if the vehicle's differs."""
        self.get_home()
        if radius_m is not None:
            self.set_parameter("WPNAV_RADIUS", radius_m * 100)

    def set_current(self, seq: int) -> int:
        """Set WP: its window hangs until a MISSION_CURRENT arrives; returns the number of requests (setWPCurrent)."""
        for tries in range(1, 7):
            self.send(messages.MAVLink_mission_set_current_message(*self._target, seq))
            for message in self._packets(2.0):
                if message.get_type() == "MISSION_CURRENT":
                    return tries
        raise TimedOut("Timeout on read - setWPCurrent")

    def get_home(self) -> None:
        """Command 410, 700 ms a try; without a reply it reads item 0 instead."""
        for _ in range(4):
            self.send(
                messages.MAVLink_command_long_message(
                    *self._target, messages.MAV_CMD_GET_HOME_POSITION, 0, 0, 0, 0, 0, 0, 0, 0
                )
            )
            for message in self._packets(0.7):
                if message.get_type() == "HOME_POSITION":
                    return
        self.read_item(0)

    def set_parameter(self, name: str, value: float) -> None:
        """PARAM_SET if it differs, 700 ms a try."""
        if name not in self.parameters or self.parameters[name] == value:
            return
        for _ in range(4):
            self.send(messages.MAVLink_param_set_message(*self._target, name.encode(), value, 9))
            for message in self._packets(0.7):
                if message.get_type() == "PARAM_VALUE" and message.param_id == name:
                    return
        raise TimedOut(f"set {name} failed")

    def write_fast(self, rows: Sequence[PlanRow], *, cancel_at: int | None = None) -> None:
        """Its "Write Fast": bursts of ten. With `cancel_at` its user presses Cancel before that item is sent.

        It does not wait for a result after the last item.
        """
        self._start_upload(len(rows))
        self._requested, self._answer = 0, MissionResult.ACCEPTED
        at = 0
        while at < len(rows):
            if at % 10 == 0 and at:
                for _ in self._packets(1.1):
                    if self._requested == at or self._answer is not MissionResult.ACCEPTED:
                        break
                if self._answer is not MissionResult.ACCEPTED:
                    text = f"Upload wps failed {self._requested} {self._answer.name}"
                    raise UploadFailed(text, self._answer)
                at = self._requested
            if cancel_at is not None and at >= cancel_at:
                self.cancel()
                return
            self.send(rows[at].int_message(*self._target, at))
            at += 1
        self._send_ack()

    def cancel(self) -> None:
        """Its Cancel button: a count of 0."""
        self.send(messages.MAVLink_mission_count_message(*self._target, 0, 0))

    def write_begun(self, rows: Sequence[PlanRow], count: int) -> None:
        """Write only the first `count` items of a list, as if unplugged then."""
        self._start_upload(len(rows))
        for at in range(count):
            self._write_item(rows, at, use_int=True)

    def _start_upload(self, count: int) -> None:
        """MISSION_COUNT, 700 ms x 4. A request for item 0 or 1 means "continue", and so does ANY ack."""
        self._discard()
        for _ in range(4):
            self.send(messages.MAVLink_mission_count_message(*self._target, count, self.tab))
            for message in self._packets(0.7):
                if message.get_type() in ("MISSION_REQUEST", "MISSION_REQUEST_INT"):
                    if self._is_for_me(message) and message.seq in (0, 1):
                        return
                elif message.get_type() == "MISSION_ACK" and self._is_for_me(message):
                    return
        raise TimedOut("Timeout on read - setWPTotal")

    def _write_item(self, rows: Sequence[PlanRow], at: int, use_int: bool) -> MissionResult:
        """One item, 450 ms x 11. A request for a seq other than the next uses up a try at once."""
        row = rows[at]
        message_of = row.int_message if use_int else row.float_message
        # While sending MISSION_ITEM_INT it does not understand MISSION_REQUEST_INT.
        understood = ("MISSION_REQUEST",) if use_int else ("MISSION_REQUEST", "MISSION_REQUEST_INT")
        for _ in range(11):
            item = message_of(*self._target, at)
            item.mission_type = self.tab
            self.send(item)
            for message in self._packets(0.45):
                if message.get_type() == "MISSION_ACK" and self._is_for_me(message):
                    return MissionResult(message.type)
                if message.get_type() in understood and self._is_for_me(message):
                    if message.seq == at + 1:
                        return MissionResult.ACCEPTED
                    break
        raise TimedOut("Timeout on read - setWP")

    def _requested_seq(self, at: int) -> int:
        """After INVALID_SEQUENCE continue with the next requested item; without a request, skip silently."""
        for message in self._packets(1.5):
            if message.get_type() == "MISSION_REQUEST":
                seq: int = message.seq
                return seq
        return at + 1

    def _send_ack(self) -> None:
        self.send(messages.MAVLink_mission_ack_message(*self._target, 0, self.tab))

    def _check_tab(self) -> None:
        """Before it writes or reads (mav_mission.cs)."""
        if self.tab == messages.MAV_MISSION_TYPE_FENCE and not self.capabilities & _FENCE_CAPABILITY:
            raise UploadFailed("Fence mission items not supported, please use legacy geofence")

    # -- reading ---------------------------------------------------------------------------------------------

    def read(self) -> list[Message]:
        """Its Read button: REQUEST_LIST 700 ms x 7, then item by item. It ignores MISSION_ACK errors."""
        self._check_tab()
        items = [self.read_item(seq) for seq in range(self.read_count())]
        self._send_ack()
        return items

    def read_item(self, seq: int) -> Message:
        """One item, 2.5 s x 6, in the form given by the capabilities. On another item it repeats the request."""
        as_int = bool(self.capabilities & _INT_CAPABILITY)
        m = messages
        request = (m.MAVLink_mission_request_int_message if as_int else m.MAVLink_mission_request_message)(
            *self._target, seq, self.tab
        )
        for _ in range(6):
            self.send(request)
            for message in self._packets(2.5):
                if message.get_type() in ("MISSION_ITEM", "MISSION_ITEM_INT") and self._is_for_me(message):
                    if message.seq == seq:
                        return message
                    self.send(request)
        raise TimedOut("Timeout on read - getWP")

    def read_count(self) -> int:
        for _ in range(7):
            self.send(messages.MAVLink_mission_request_list_message(*self._target, self.tab))
            for message in self._packets(0.7):
                if message.get_type() == "MISSION_COUNT" and self._is_for_me(message):
                    count: int = message.count
                    return count
        raise TimedOut("Timeout on read - getWPCount")

    # -- inspection by tests -----------------------------------------------------------------------------

    def messages(self, kind: str) -> list[Any]:
        """All received messages of one type, whichever loop took them."""
        return [message for message in self.received if message.get_type() == kind]

    def messages_of_version(self, version: int) -> list[Any]:
        """All messages received in one version of MAVLink."""
        magic = 0xFD if version == 2 else 0xFE
        return [message for message in self.received if message.get_msgbuf()[0] == magic]

    def acks(self) -> list[MissionResult]:
        return [MissionResult(message.type) for message in self.messages("MISSION_ACK")]


def _has_the_right_size(message: Message) -> bool:
    """MAVLink 1 frames must have the table's size; MAVLink 2 frames may be truncated or extended."""
    frame = message.get_msgbuf()
    known = mavlink_1.mavlink_map.get(message.get_msgId())
    return frame[0] == 0xFD or known is None or frame[1] == known.unpacker.size
