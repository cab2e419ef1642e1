# SPDX-License-Identifier: GPL-3.0-or-later
"""Several vehicles at one ground station: frames reach the vehicle that they address, and no two share a system id."""

from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.gcs.station import Datagrams, Peer
from bridge.relay import Relays, SameSystem, SendToVehicle, WriteList
from protocols.mavlink.codec import FrameWriter, decode
from protocols.mavlink.dialect import Message
from protocols.mavlink.frame import MavlinkSplitter
from protocols.mission_item import ListIdentity
from tests.bridge.test_relay import PLAN, item_int
from tests.support.packing import pack

PEER = Peer("udp", "planner")


class Bench:
    """A ground station and vehicles; `sent` has the message types that each vehicle was sent."""

    def __init__(self, **systems: int) -> None:
        self.sent: dict[str, list[str]] = {}
        self.written: dict[str, int] = {}
        self.clashes: list[tuple[str, str, int]] = []
        self.relays = Relays()
        self.relays.add_default_peer(PEER)
        self.now = 100.0
        self._writer = FrameWriter(255, 190)
        for name, system in systems.items():
            self.join(name, system)

    def join(self, name: str, system: int) -> None:
        self.sent[name] = []
        self.relays.add(name)
        self.relays.holds(name, (), ListIdentity(0, 0))
        heartbeat = FrameWriter(system, 1).frame(pack(m.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3)), 2)
        self.relays.vehicle_received(name, heartbeat, self.now)

    def send(self, message: Message) -> list[tuple[int, Message]]:
        """Send a message of the ground station; the answers with the ids of their senders."""
        self.heard()
        self.relays.gcs_received(PEER, self._writer.frame(pack(message), 2), self.now, datagram=True)
        self.now += 0.01
        self.relays.tick(self.now)
        return self.heard()

    def heard(self) -> list[tuple[int, Message]]:
        frames = []
        for name, effect in self.relays.take():
            match effect:
                case Datagrams():
                    frames += [frame for _, data in effect for frame in MavlinkSplitter().feed(data)]
                case SendToVehicle(sent):
                    self.sent[name] += [message.get_type() for message in self._messages(sent)]
                case WriteList(items):
                    self.written[name] = len(items)
                case SameSystem(other, system):
                    self.clashes.append((name, other, system))
        return [(frame.sysid, message) for frame in frames for message in self._messages(frame.raw)]

    def _messages(self, data: bytes) -> list[Message]:
        found = [decode(frame) for frame in MavlinkSplitter().feed(data)]
        return [message for message in found if message is not None]


def connected(**systems: int) -> Bench:
    bench = Bench(**systems)
    assert {system for system, _ in bench.heard()} == set(systems.values())
    bench.send(m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    return bench


def test_a_frame_reaches_the_vehicle_that_it_addresses_and_a_heartbeat_all() -> None:
    bench = connected(kite=1, owl=2)
    bench.send(m.MAVLink_param_request_list_message(2, 1))
    bench.send(m.MAVLink_param_request_list_message(3, 1))
    assert bench.sent == {"kite": ["HEARTBEAT"], "owl": ["HEARTBEAT", "PARAM_REQUEST_LIST"]}


def test_missions_for_two_vehicles_at_once_do_not_mix() -> None:
    bench = connected(kite=1, owl=2)
    counts = {1: 5, 2: 9}
    wanted = [answer for system, count in counts.items() for answer in bench.send(_count(system, count))]
    while requests := [(system, each.seq) for system, each in wanted if each.get_type() == "MISSION_REQUEST"]:
        wanted = [answer for system, seq in dict(requests).items() for answer in bench.send(_item(system, seq))]
    assert bench.written == {"kite": 5, "owl": 9}


def test_a_mission_for_all_vehicles_is_for_none() -> None:
    bench = connected(kite=1, owl=2)
    assert bench.send(m.MAVLink_mission_clear_all_message(0, 0)) == []
    assert bench.written == {}
    alone = connected(kite=1)
    alone.send(m.MAVLink_mission_clear_all_message(0, 0))
    alone.now += 0.1
    alone.relays.tick(alone.now)
    alone.heard()
    assert alone.written == {"kite": 0}


def test_a_vehicle_whose_id_is_in_use_is_left_out_until_the_other_has_left() -> None:
    bench = connected(kite=1)
    bench.join("owl", 1)
    assert bench.heard() == []
    assert bench.clashes == [("owl", "kite", 1)]
    bench.send(m.MAVLink_param_request_list_message(1, 1))
    assert (bench.sent["kite"][-1], bench.sent["owl"]) == ("PARAM_REQUEST_LIST", [])
    bench.relays.remove("kite")
    bench.join("owl", 1)
    assert bench.relays.heard == {"owl"}


def _count(system: int, count: int) -> Message:
    return m.MAVLink_mission_count_message(system, 1, count)


def _item(system: int, seq: int) -> Message:
    message = item_int(PLAN[seq])
    message.target_system = system
    return message
