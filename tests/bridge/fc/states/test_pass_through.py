# SPDX-License-Identifier: GPL-3.0-or-later
"""Pass-through for an autopilot that speaks MAVLink itself: frames reach their targets unchanged, both ways."""

import random
from collections.abc import Iterable
from hashlib import sha256

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from bridge.controllers import other
from bridge.effects import SendToBoard
from bridge.gcs.rights import LinkAccess
from bridge.gcs.station import Datagrams, Peer
from protocols.mavlink.codec import FrameWriter, Packed
from simulator.naze.board import SimulatedNaze
from tests.support.fake_controllers import QuietLine
from tests.support.world import GroundStation, World

KEY = sha256(b"a passphrase").digest()


class Autopilot(QuietLine):
    """Sends the frames a test gives it and a heartbeat a second. `received`: bytes from the wire."""

    def __init__(self, sysid: int = 1, compid: int = 1, version: int = 2) -> None:
        super().__init__()
        self.mavlink = mavlink.MAVLink(None, srcSystem=sysid, srcComponent=compid)
        self.version = version
        self.received = bytearray()
        self.sent: list[bytes] = []
        self.heartbeat = mavlink.MAVLink_heartbeat_message(2, 12, 81, 0, 3, 3)
        self._due = 0.3

    def pack(self, message: mavlink.MAVLink_message) -> bytes:
        frame = bytes(message.pack(self.mavlink, force_mavlink1=self.version == 1))
        self.mavlink.seq = (self.mavlink.seq + 1) % 256
        return frame

    def send(self, message: mavlink.MAVLink_message) -> bytes:
        frame = self.pack(message)
        self.sent.append(frame)
        self.outgoing += frame
        return frame

    def receive(self, data: bytes, now: float) -> None:
        self.received += data

    def advance(self, now: float) -> bytes:
        while self._due <= now:
            self._due += 1.0
            self.send(self.heartbeat)
        return super().advance(now)

    def next_wakeup(self, now: float) -> float:
        return min(super().next_wakeup(now), self._due)


def passing(
    autopilot: Autopilot | None = None, stations: int = 2, *, everything: bool = False
) -> tuple[World, Autopilot, list[GroundStation]]:
    """A found autopilot and known ground stations. `everything`: commands pass an open link."""
    autopilot = autopilot or Autopilot()
    world = World(peer=autopilot, passes_everything=everything)
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 3)
    gcs = [GroundStation(world, f"gcs{number}", sysid=255 - number) for number in range(stations)]
    for station in gcs:
        station.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    world.run(0.01)
    for station in gcs:
        station.take()
        station.frames.clear()
    autopilot.received.clear()
    autopilot.sent.clear()
    return world, autopilot, gcs


def telemetry(seed: int, count: int) -> Iterable[mavlink.MAVLink_message]:
    chance = random.Random(seed)
    for _ in range(count):
        angles = [chance.uniform(-3, 3) for _ in range(6)]
        yield mavlink.MAVLink_attitude_message(chance.randrange(1 << 32), *angles)
        yield mavlink.MAVLink_statustext_message(6, bytes(chance.choices(b"\xfe\xfdMAV$M<\r#R", k=40)))


@pytest.mark.parametrize(("version", "signed"), [(1, False), (2, False), (2, True)])
def test_every_station_gets_every_frame_unchanged(version: int, signed: bool) -> None:
    autopilot = Autopilot(version=version)
    if signed:
        autopilot.mavlink.signing.secret_key = KEY
        autopilot.mavlink.signing.sign_outgoing = True
    world, autopilot, stations = passing(autopilot)
    for message in telemetry(1, 200):
        autopilot.send(message)
        world.run(0.004)
    world.run(2)
    for station in stations:
        assert station.frames == autopilot.sent


def test_a_heartbeat_whose_last_fields_are_0_is_passed_on() -> None:
    """MAVLink 2 omits them, the autopilot's kind included."""
    autopilot = Autopilot()
    autopilot.heartbeat = mavlink.MAVLink_heartbeat_message(2, 0, 0, 0, 0, 0)
    world, autopilot, (station, _) = passing(autopilot)
    world.run(5)
    assert station.frames == autopilot.sent != []


@pytest.mark.parametrize("access", [LinkAccess(), LinkAccess(may_write=lambda _: False)], ids=["open", "listener"])
def test_a_request_to_every_system_reaches_an_autopilot_that_was_heard_once(access: LinkAccess) -> None:
    """The frame by which it was found is the only one so far, so its ids are not known as a target."""
    autopilot = Autopilot()
    world = World(peer=autopilot, links={"udp": access})
    stations = [GroundStation(world, name) for name in ("one", "other")]
    for station in stations:
        station.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 3)
    autopilot.received.clear()
    autopilot.sent.clear()
    asked = stations[0].pack(mavlink.MAVLink_param_request_list_message(0, 0))
    world.receive_from(stations[0], asked)
    assert bytes(autopilot.received) == asked
    assert autopilot.sent == []


def test_the_bridge_does_not_send_messages_of_its_own() -> None:
    world, autopilot, (station, _) = passing()
    world.run(20)
    assert station.frames == autopilot.sent
    assert bytes(autopilot.received) == b""


def test_frames_from_ground_stations_arrive_unchanged() -> None:
    world, autopilot, (one, other) = passing(everything=True)
    sent = b""
    for message in (
        mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
        mavlink.MAVLink_mission_count_message(1, 1, 5, 0),
        mavlink.MAVLink_mission_count_message(1, 0, 5, 0),
        mavlink.MAVLink_param_request_list_message(0, 0),
        mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
        mavlink.MAVLink_command_long_message(77, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
    ):
        frame = one.pack(message)
        world.receive_from(one, frame)
        sent += frame
    world.run(0.1)
    assert bytes(autopilot.received) == sent
    # The others get broadcasts; no sender gets its own frame.
    assert [message.get_type() for message in other.messages()] == ["PARAM_REQUEST_LIST", "HEARTBEAT"]
    assert one.messages() == []


def test_only_a_frame_with_a_target_asks_for_a_reply() -> None:
    """Heartbeats must not end the gathering of reads every second."""
    world, _, (station, *_) = passing()
    asks = []
    for message in (
        mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3),
        mavlink.MAVLink_param_request_list_message(1, 1),
    ):
        frame = bytes(message.pack(mavlink.MAVLink(None, srcSystem=station.sysid, srcComponent=station.compid)))
        world.bridge.gcs_received(station.peer, frame, world.now, datagram=True)
        (output,) = (effect for effect in world.bridge.take() if isinstance(effect, SendToBoard))
        assert output.data == [frame]
        asks.append(output.asks)
    assert asks == [False, True]


def test_an_addressed_frame_goes_only_to_the_target() -> None:
    world, autopilot, (one, other) = passing()
    autopilot.send(mavlink.MAVLink_mission_ack_message(255, 190, 0, 0))
    autopilot.send(mavlink.MAVLink_mission_ack_message(254, 0, 0, 0))
    autopilot.send(mavlink.MAVLink_mission_ack_message(254, 1, 0, 0))
    autopilot.send(mavlink.MAVLink_mission_ack_message(9, 0, 0, 0))
    world.run(0.1)
    assert [message.target_component for message in one.messages("MISSION_ACK")] == [190]
    assert [message.target_component for message in other.messages("MISSION_ACK")] == [0]


def test_ground_stations_reach_each_other() -> None:
    _world, autopilot, (one, other) = passing()
    one.send(mavlink.MAVLink_param_set_message(254, 190, b"STATION", 1, 9), wait_s=0.1)
    assert [message.get_type() for message in other.messages("PARAM_SET")] == ["PARAM_SET"]
    assert bytes(autopilot.received) == b""


def test_signing_keys_are_never_forwarded() -> None:
    world, autopilot, (one, other) = passing()
    one.send(mavlink.MAVLink_setup_signing_message(1, 1, list(KEY), 5))
    one.send(mavlink.MAVLink_setup_signing_message(0, 0, list(KEY), 5))
    autopilot.send(mavlink.MAVLink_setup_signing_message(0, 0, list(KEY), 5))
    world.run(0.1)
    assert bytes(autopilot.received) == b""
    assert one.messages("SETUP_SIGNING") == other.messages("SETUP_SIGNING") == []


def test_after_an_autopilot_is_unplugged_the_bridge_represents_its_own_vehicle() -> None:
    world, autopilot, (station, _) = passing()
    world.unplug()
    world.run(5)
    assert any("Flight controller lost" in text for text in station.texts())
    assert len(station.messages("HEARTBEAT")) >= 4
    station.ask(mavlink.MAVLink_param_request_list_message(1, 1))
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 3), wait_s=0.5)
    assert station.messages("PARAM_VALUE")
    assert [ack.type for ack in station.messages("MISSION_ACK")] == [mavlink.MAV_MISSION_DENIED]
    world.plug()
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 3)
    autopilot.sent.clear()
    station.frames.clear()
    world.run(20)
    assert station.frames == autopilot.sent != []


def test_a_board_in_the_command_line_in_place_of_an_autopilot_is_reported() -> None:
    world, _autopilot, (station, _) = passing()
    world.unplug()
    world.naze = SimulatedNaze()
    world.naze.power_on_booted(world.now)
    world.naze.receive(b"\r\r\r", world.now)
    world.plug()
    world.wait_until(lambda w: any("type exit" in text for text in station.texts()), 20)


def test_a_false_header_in_a_slow_stream_does_not_delay_a_frame() -> None:
    """The false frame has room for twelve heartbeats."""
    world, autopilot, (station, _) = passing()
    autopilot.outgoing += b"\xfd\xff\x00\x00\x00\x01\x01\x1e\x00\x00"
    world.run(6)
    assert world.events("fc.lost") == []
    assert station.frames == autopilot.sent
    assert len(autopilot.sent) >= 5


@pytest.mark.parametrize("sysid", [1, 42], ids=["our own ids", "others"])
def test_a_companion_with_the_autopilots_system_id_is_heard_but_echoes_are_not(sysid: int) -> None:
    world, autopilot, (one, two) = passing(Autopilot(sysid))
    world.run(1)
    companion = GroundStation(world, "companion", sysid=sysid, compid=191)
    companion.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), wait_s=0.1)
    assert bytes(autopilot.received)
    assert one.messages("HEARTBEAT")[-1].get_srcComponent() == 191
    autopilot.received.clear()
    world.run(2)
    two.frames.clear()
    world.receive_from(one, autopilot.sent[-1])
    world.run(0.1)
    assert bytes(autopilot.received) == b""
    assert two.frames == []


def test_addresses_heard_once_do_not_multiply_frames() -> None:
    world, autopilot, (pilot, _) = passing()
    ground = world.inside.ground
    hello = pilot.pack(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    for number in range(200):
        world.bridge.gcs_received(Peer("udp", (f"10.0.0.{number}", 14550)), hello, world.now, datagram=True)
    world.run(1)
    ground.outbox.take()
    copies: list[tuple[Peer, bytes]] = []
    for _ in range(400):
        world.bridge.fc_received(autopilot.pack(mavlink.MAVLink_attitude_message(0, *[0.0] * 6)), world.now)
        copies += ground.outbox.take()
    assert [peer for peer, _ in copies].count(pilot.peer) == 400
    assert {peer for peer, _ in copies} == set(ground.peers())
    assert len(ground.peers()) == 2


def test_a_reused_address_does_not_get_frames_for_earlier_ids() -> None:
    world, autopilot, (one, _) = passing()
    world.bridge.gcs_gone(one.peer, world.now)
    successor = GroundStation(world, "gcs0", sysid=7)
    assert successor.peer == one.peer
    successor.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), wait_s=0.1)
    autopilot.send(mavlink.MAVLink_mission_ack_message(255, 190, 0, 0))
    autopilot.send(mavlink.MAVLink_mission_ack_message(7, 190, 0, 0))
    world.run(0.1)
    assert [ack.target_system for ack in successor.messages("MISSION_ACK")] == [7]


def test_a_sender_with_all_ids_does_not_displace_others() -> None:
    """One address with 60,000 forged ids gets no more than its share."""
    world, autopilot, (one, _) = passing()
    liar = GroundStation(world, "liar", sysid=99)
    for sysid in range(2, 200):
        for compid in (1, 2, 3):
            frame = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
            liar._mavlink.srcSystem, liar._mavlink.srcComponent = sysid, compid
            world.receive_from(liar, liar.pack(frame))
    liar.frames.clear()
    for sysid in range(2, 200):
        autopilot.send(mavlink.MAVLink_mission_ack_message(sysid, 0, 0, 0))
    autopilot.send(mavlink.MAVLink_mission_ack_message(255, 190, 0, 0))
    world.run(0.5)
    assert 0 < len(liar.messages("MISSION_ACK")) <= 64
    assert len(one.messages("MISSION_ACK")) == 1


def test_an_autopilot_with_all_ids_does_not_fill_the_memory() -> None:
    """A router on its side that carries a swarm; all frames are passed on anyway."""
    world, autopilot, (station, _) = passing()
    for sysid in range(1, 250):
        for kind in (30, 33, 74, 1, 24):
            autopilot.sent.append(FrameWriter(sysid, 1).frame(Packed(kind, b"", b"\1"), 2))
            world.receive_from_fc(autopilot.sent[-1])
    world.run(0.1)
    assert station.frames == autopilot.sent
    routes = world.inside.incoming.routes
    assert routes is not None
    assert len(routes._for_all) <= 1024


def test_frames_that_arrive_together_share_a_datagram() -> None:
    world, autopilot, stations = passing()
    together = autopilot.pack(mavlink.MAVLink_attitude_message(1, 0, 0, 0, 0, 0, 0)) + autopilot.pack(
        mavlink.MAVLink_vfr_hud_message(1, 1, 1, 1, 1, 1)
    )
    world.bridge.fc_received(together, world.now)
    assert world.bridge.take() == [Datagrams((station.peer, together) for station in stations)]
