# SPDX-License-Identifier: GPL-3.0-or-later
"""A ground station next to the relay: its mission crosses the link as a whole, and the ack waits for the vehicle."""

from collections.abc import Sequence
from dataclasses import replace

from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.gcs.station import Datagrams, Peer
from bridge.relay import Relays, SameSystem, SendToVehicle, WriteList, WriteResult
from protocols.mavlink.codec import FrameWriter, decode
from protocols.mavlink.dialect import Message
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.mission_item import ListIdentity, MissionItem, MissionResult
from reports.finding import Finding, News
from tests.support.packing import pack

VEHICLE = (7, 1)
PEER = Peer("udp", "planner")
PLAN = tuple(
    MissionItem(seq, 16, 3 if seq else 0, 0.0, 2.0, 0.0, 0.0, 453838000 + 900 * seq, 84733000, 20.0 * bool(seq))
    for seq in range(146)
)
NONE = ListIdentity(0, 0)


class Bench:
    """Relays of vehicles with these system ids, and a ground station right next to them.

    `to_vehicle` has the message types that each vehicle was sent, `frames` what the station got.
    """

    def __init__(self, **systems: int) -> None:
        self.to_vehicle: dict[str, list[str]] = {}
        self.written: dict[str, Sequence[MissionItem]] = {}
        self.clashes: list[tuple[str, str, int]] = []
        self.frames: list[tuple[MavlinkFrame, Message]] = []
        self.relays = Relays()
        self.relays.add_default_peer(PEER)
        self.now = 100.0
        self._writer = FrameWriter(255, 190)
        for name, system in systems.items():
            self.join(name, system)

    def join(self, name: str, system: int, *, stores: bool = True) -> None:
        self.to_vehicle[name] = []
        self.relays.add(name)
        self.heartbeat(name, system)
        if stores:
            self.relays.holds(name, (), NONE)

    def heartbeat(self, name: str, system: int, *, armed: bool = False) -> None:
        """Of a vehicle."""
        message = m.MAVLink_heartbeat_message(2, 3, 81 | (128 * armed), 0, 3, 3)
        self.relays.vehicle_received(name, FrameWriter(system, 1).frame(pack(message), 2), self.now)
        self._take()

    def send(self, message: Message) -> list[Message]:
        """Send a message of the ground station; the answers."""
        before = len(self.frames)
        self.relays.gcs_received(PEER, self._writer.frame(pack(message), 2), self.now, datagram=True)
        self.run(0.01)
        return [answer for _, answer in self.frames[before:]]

    def run(self, seconds: float) -> None:
        end = self.now + seconds
        while (due := max(self.relays.due, self.now)) <= end:
            self.now = due + 1e-4
            self.relays.tick(self.now)
        self.now = end
        self._take()

    def upload(self, plan: Sequence[MissionItem]) -> None:
        """Answer every request; afterwards the relay waits for the vehicle."""
        wanted = self.send(m.MAVLink_mission_count_message(*VEHICLE, len(plan)))
        while requests := [each.seq for each in wanted if each.get_type() == "MISSION_REQUEST"]:
            wanted = self.send(item_int(plan[requests[-1]]))

    def acks(self) -> list[int]:
        return [message.type for _, message in self.frames if message.get_type() == "MISSION_ACK"]

    def _take(self) -> None:
        for name, effect in self.relays.take():
            match effect:
                case SendToVehicle(sent):
                    self.to_vehicle[name] += [message.get_type() for _, message in decoded(sent)]
                case WriteList(items):
                    self.written[name] = items
                case SameSystem(other, system):
                    self.clashes.append((name, other, system))
                case Datagrams():
                    self.frames += decoded(b"".join(data for _, data in effect))


def decoded(data: bytes) -> list[tuple[MavlinkFrame, Message]]:
    found = ((frame, decode(frame)) for frame in MavlinkSplitter().feed(data))
    return [(frame, message) for frame, message in found if message is not None]


def item_int(item: MissionItem) -> Message:
    place = (item.lat_e7 or 0, item.lon_e7 or 0, item.alt_m)
    params = (item.p1, item.p2, item.p3, item.p4)
    return m.MAVLink_mission_item_int_message(*VEHICLE, item.seq, item.frame, item.command, 0, 1, *params, *place)


def connected(*, stores: bool = True) -> Bench:
    bench = Bench()
    bench.join("owl", VEHICLE[0], stores=stores)
    bench.send(m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    bench.to_vehicle["owl"].clear()
    return bench


def test_a_list_crosses_the_link_as_a_whole_and_is_acknowledged_when_the_vehicle_has_verified_it() -> None:
    bench = connected()
    bench.upload(PLAN)
    assert tuple(bench.written["owl"]) == PLAN
    assert bench.to_vehicle == {"owl": []}
    bench.run(2.0)
    assert bench.acks() == []
    stored = (PLAN[0], *(replace(item, p1=1.0) for item in PLAN[1:]))
    finding = Finding(1, "p1", 0.0, 1, "0 not allowed", 16, News.NOTICE)
    bench.relays.wrote("owl", WriteResult(MissionResult.ACCEPTED, "Mission verified: 146 records", [finding], stored))
    bench.run(0.5)
    assert bench.acks()[-1] == MissionResult.ACCEPTED
    texts = [message.text for _, message in bench.frames if message.get_type() == "STATUSTEXT"]
    assert any("0 not allowed" in text for text in texts)
    assert not any("on the Pi" in text for text in texts)
    (count,) = bench.send(m.MAVLink_mission_request_list_message(*VEHICLE))
    assert count.count == 146
    (item,) = bench.send(m.MAVLink_mission_request_int_message(*VEHICLE, 145))
    assert (item.seq, item.param1, item.x) == (145, 1.0, PLAN[145].lat_e7)
    assert bench.to_vehicle == {"owl": []}


def test_the_vehicles_refusal_is_the_final_ack() -> None:
    bench = connected()
    bench.upload(PLAN[:5])
    bench.relays.wrote("owl", WriteResult(MissionResult.DENIED, "Rejected, WP 3: too far"))
    bench.run(0.5)
    assert bench.acks()[-1] == MissionResult.DENIED
    assert any(each.text.startswith("Rejected, WP 3") for _, each in bench.frames if each.get_type() == "STATUSTEXT")


def test_does_not_send_to_an_armed_vehicle() -> None:
    bench = connected()
    bench.heartbeat("owl", VEHICLE[0], armed=True)
    bench.upload(PLAN[:5])
    assert bench.written == {}
    assert bench.acks()[-1] == MissionResult.DENIED


def test_an_empty_list_clears_the_vehicles() -> None:
    bench = connected()
    bench.send(m.MAVLink_mission_clear_all_message(*VEHICLE))
    bench.run(0.1)
    assert bench.written == {"owl": ()}


def test_a_vehicle_that_does_not_store_missions_gets_every_frame_itself() -> None:
    bench = connected(stores=False)
    assert bench.send(m.MAVLink_mission_count_message(*VEHICLE, 5)) == []
    assert bench.send(m.MAVLink_param_request_list_message(*VEHICLE)) == []
    assert bench.to_vehicle == {"owl": ["MISSION_COUNT", "PARAM_REQUEST_LIST"]}


def test_all_other_frames_and_those_of_other_targets_are_passed_on() -> None:
    bench = connected()
    for message in (
        m.MAVLink_param_request_list_message(*VEHICLE),
        m.MAVLink_mission_count_message(9, 1, 5),
        m.MAVLink_mission_count_message(*VEHICLE, 5, m.MAV_MISSION_TYPE_FENCE),
    ):
        bench.to_vehicle["owl"].clear()
        assert bench.send(message) == []
        assert bench.to_vehicle == {"owl": [message.get_type()]}


def test_the_sequence_numbers_are_gapless() -> None:
    bench = connected()
    for _ in range(3):
        bench.heartbeat("owl", VEHICLE[0])
        bench.send(m.MAVLink_mission_request_list_message(*VEHICLE))
    numbers = [frame.raw[4] for frame, _ in bench.frames]
    assert numbers == [*range(numbers[0], numbers[0] + len(numbers))]
