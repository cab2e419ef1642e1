# SPDX-License-Identifier: GPL-3.0-or-later
"""The zenoh end of one vehicle of `fleet mavlink`: its MAVLink, the mission, and missions for it as commands."""

import asyncio
from collections.abc import Callable, Container, Sequence

import zenoh

from bridge.relay import Relays, WriteResult
from fleet.payload import decode, part, text, whole
from fleet.session import send_query
from fleet.vehicle import BridgeId, replier
from payloads.keys import CLEAR, MAVLINK_IN, MAVLINK_OUT, MAX_MAVLINK_BYTES, MISSION_CURRENT, STATUS, UPLOAD, full
from payloads.mission_data import Json, mission_findings, mission_items
from protocols.mission_file import write_qgc_wpl
from protocols.mission_item import ListIdentity, MissionItem, MissionResult
from service.machine.threads import post

#: The router reports a vehicle's subscription within this time.
_FIRST_MATCH_S = 2.0
_ASK_TIMEOUT_S, _WRITE_TIMEOUT_S = 10.0, 120.0
_NO_RESULT = "No result from the vehicle: read the mission to see what it holds"
#: Samples beyond this are dropped when they arrive faster than the event loop takes them.
_MAX_WAITING = 64


class VehicleRelay:
    """Must be made on a running event loop. If the vehicle takes commands, `relays` receive the missions as a whole.

    `bridges`: those that are alive. `sent`: called with the vehicle's name and frames, or none after a result.
    `on_input`: called with its name and False if it does not accept frames, or is gone; with True when it does again.
    """

    def __init__(
        self,
        session: zenoh.Session,
        prefix: str,
        name: str,
        bridges: Container[BridgeId | None],
        relays: Relays,
        sent: Callable[[str, bytes], None],
        on_input: Callable[[str, bool], None],
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._session, self._prefix, self._name, self._bridges = session, prefix, name, bridges
        self._sent, self._on_input = sent, on_input
        self._relays = relays
        self._input = session.declare_publisher(
            self._key(MAVLINK_IN.suffix),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.DATA_HIGH,
        )
        self._accepts_input: bool | None = None
        self._matching = self._input.declare_matching_listener(
            lambda status: post(self._loop, self._input_is, status.matching)
        )
        # A vehicle that never accepted frames does not cause an event.
        self._first_match = self._loop.call_later(_FIRST_MATCH_S, lambda: self._input_is(self._accepts_input is True))
        self._waiting = 0
        self._subscribers = [session.declare_subscriber(self._key(MAVLINK_OUT.suffix), self._heard)]
        # Only a vehicle that takes commands can be sent a whole mission.
        send_query(session, self._key(STATUS.suffix), self._takes_commands, _ASK_TIMEOUT_S)

    def close(self) -> None:
        self._first_match.cancel()
        self._matching.undeclare()  # type: ignore[no-untyped-call]
        self._input.undeclare()  # type: ignore[no-untyped-call]
        for subscriber in self._subscribers:
            subscriber.undeclare()  # type: ignore[no-untyped-call]

    def _input_is(self, accepted: bool) -> None:
        was_refused, self._accepts_input = self._accepts_input is False, accepted
        if was_refused is accepted:
            self._on_input(self._name, accepted)

    def _heard(self, sample: zenoh.Sample) -> None:
        if self._waiting < _MAX_WAITING and len(sample.payload) <= MAX_MAVLINK_BYTES:
            self._waiting += 1
            post(self._loop, self._take, sample.payload.to_bytes())

    def _take(self, data: bytes) -> None:
        self._waiting -= 1
        self._sent(self._name, data)

    # The vehicle's mission, and commands. Called on zenoh's threads, except for `send` and `write`.

    def _key(self, suffix: str) -> str:
        return full(self._prefix, self._name, suffix)

    def _takes_commands(self, reply: zenoh.Reply | None) -> None:
        if reply is not None and reply.ok is not None:
            post(self._loop, self._follow_mission)

    def _follow_mission(self) -> None:
        key = self._key(MISSION_CURRENT.suffix)
        self._subscribers.append(self._session.declare_subscriber(key, self._mission))
        send_query(self._session, key, self._mission_replied, _ASK_TIMEOUT_S)

    def _mission_replied(self, reply: zenoh.Reply | None) -> None:
        # A storage may know an older one.
        if reply is not None and reply.ok is not None and replier(reply) in self._bridges:
            self._mission(reply.ok)

    def _mission(self, sample: zenoh.Sample) -> None:
        data = decode(sample) or {}
        count, checksum, items = whole(data, "count"), text(data, "checksum"), _items(part(data, "items"))
        try:
            identity = None if count is None or checksum is None else ListIdentity(count, int(checksum, 16))
        except ValueError:
            identity = None
        post(self._loop, self._relays.holds, self._name, items, identity)

    def send(self, frame: bytes) -> None:
        """Send a frame to the vehicle."""
        self._input.put(frame)

    def write(self, items: Sequence[MissionItem]) -> None:
        """Have the vehicle write a list, () to clear."""
        replied: list[WriteResult] = []

        def reply(answer: zenoh.Reply | None) -> None:
            if answer is None:
                result = replied[-1] if replied else WriteResult(MissionResult.ERROR, _NO_RESULT)
                post(self._loop, self._wrote, result)
                return
            data = decode(answer.ok or answer.err) or {}  # type: ignore[arg-type]
            if isinstance(part(data, "result"), dict) or text(data, "error") is not None:
                replied.append(_result(data))

        payload = write_qgc_wpl(items).encode() if items else None
        command = UPLOAD if items else CLEAR
        send_query(self._session, self._key(command.suffix), reply, _WRITE_TIMEOUT_S, payload)

    def _wrote(self, result: WriteResult) -> None:
        self._relays.wrote(self._name, result)
        self._sent(self._name, b"")


def _items(data: object) -> tuple[MissionItem, ...] | None:
    try:
        return tuple(mission_items(data))
    except ValueError:
        return None


def _result(data: Json) -> WriteResult:
    """The reply to a command: a result, or the reason for a refusal."""
    found = part(data, "result")
    result = found if isinstance(found, dict) else {}
    ack = MissionResult.__members__.get((text(result, "ack") or "").removeprefix("MAV_MISSION_"), MissionResult.DENIED)
    try:
        findings = mission_findings(part(result, "findings") or [])
    except (TypeError, ValueError):
        findings = []
    items = _items(part(result, "stored")) if ack is MissionResult.ACCEPTED else None
    return WriteResult(ack, text(result, "text") or text(data, "error") or _NO_RESULT, findings, items)
