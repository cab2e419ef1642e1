# SPDX-License-Identifier: GPL-3.0-or-later
"""Attacks over links that require nothing, or a key that the stranger lacks, on an autopilot that is passed through.

Every known message is tried, in both versions, to every kind of target, with payloads that are empty, full or random.
The lists of what may arrive are written here by hand, apart from the table of rights.
"""

import random
from collections.abc import Iterator

import pytest
from pymavlink.dialects.v20 import all as every_message
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.gcs.rights import LinkAccess, Standing
from bridge.gcs.station import Peer
from protocols.mavlink.codec import FrameWriter, Packed
from protocols.mavlink.dialect import MESSAGE_FORMATS, Message
from protocols.mavlink.frame import MavlinkSplitter
from protocols.mavlink.signing import Check, ticks
from tests.bridge.vehicle.test_incoming import KEY, NOON, passing, signing
from tests.support.world import GroundStation, World

HELLO = m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
#: A vehicle that is connected like a ground station.
SECOND_VEHICLE = 42
QUESTIONS = {410, 510, 512, 519, 520, 521, 42428}
READS = {
    "PING", "TIMESYNC", "STATUSTEXT", "AUTOPILOT_VERSION_REQUEST", "PARAM_REQUEST_LIST", "PARAM_REQUEST_READ",
    "PARAM_EXT_REQUEST_LIST", "PARAM_EXT_REQUEST_READ", "FENCE_FETCH_POINT", "RALLY_FETCH_POINT", "COMMAND_LONG",
    "COMMAND_INT",
}  # fmt: skip
#: What an open link also passes: missions, parameters, and a station's own dialogue.
WRITES = READS | {
    "HEARTBEAT", "SYSTEM_TIME", "COMMAND_ACK", "REQUEST_DATA_STREAM", "FILE_TRANSFER_PROTOCOL", "PARAM_SET",
    "PARAM_EXT_SET", "MISSION_REQUEST_LIST", "MISSION_REQUEST_PARTIAL_LIST", "MISSION_WRITE_PARTIAL_LIST",
    "MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_COUNT", "MISSION_ITEM", "MISSION_ITEM_INT", "MISSION_ACK",
    "MISSION_CLEAR_ALL", "FENCE_POINT", "RALLY_POINT", "LOG_REQUEST_LIST", "LOG_REQUEST_DATA", "LOG_REQUEST_END",
}  # fmt: skip
#: Commands that also act without a target field.
MOVES = {
    "MANUAL_CONTROL", "SERIAL_CONTROL", "HIL_STATE", "HIL_SENSOR", "HIL_GPS", "HIL_RC_INPUTS_RAW", "GPS_INPUT",
    "GPS_RTCM_DATA", "MANUAL_SETPOINT", "RADIO_STATUS", "RADIO", "VISION_POSITION_ESTIMATE",
}  # fmt: skip


def on_link(station: GroundStation, link: str) -> GroundStation:
    world = station.world
    del world.stations[station.peer]
    station.peer = Peer(link, station.peer.key)
    world.stations[station.peer] = station
    return station


def decoded(data: bytes) -> list[Message]:
    codec = every_message.MAVLink(None)
    return [codec.decode(bytearray(frame.raw)) for frame in MavlinkSplitter().feed(data)]


def frames(seed: int) -> Iterator[bytes]:
    """Every message, in each version, to each kind of target, with four payloads."""
    chance = random.Random(seed)
    writers = {ids: FrameWriter(*ids) for ids in ((255, 190), (0, 0), (1, 191), (99, 1))}
    for msgid, layout in MESSAGE_FORMATS.items():
        versions = (2,) if layout.base_size is None or msgid > 255 else (1, 2)
        for fill in (b"\0", b"\1", b"\xff", None):
            for target in ((0, 0), (1, 1), (SECOND_VEHICLE, 1), (77, 0)):
                payload = bytearray(chance.randbytes(layout.full_size) if fill is None else fill * layout.full_size)
                if layout.target_system_at is not None:
                    payload[layout.target_system_at] = target[0]
                if layout.target_component_at is not None:
                    payload[layout.target_component_at] = target[1]
                if msgid in (75, 76) and fill is None:
                    command = chance.choice((*QUESTIONS, 511, 400, 176, 246, 209, 183, 300, chance.randrange(65536)))
                    payload[28:30] = command.to_bytes(2, "little")
                packed = Packed(msgid, bytes(payload[: layout.base_size or 0]), bytes(payload).rstrip(b"\0") or b"\0")
                for version in versions:
                    yield writers[chance.choice([*writers])].frame(packed, version)


def attack(world: World, stranger: GroundStation, seed: int) -> None:
    for number, frame in enumerate(frames(seed)):
        world.receive_from(stranger, frame)
        if number % 16 == 0:
            world.run(1)


def is_harmless(message: Message, *, may_write: bool) -> bool:
    match message.get_type():
        case "COMMAND_LONG" | "COMMAND_INT" if message.command == m.MAV_CMD_SET_MESSAGE_INTERVAL:
            return may_write and 0 <= message.param2 <= 1e6
        case "COMMAND_LONG" | "COMMAND_INT":
            return message.command in QUESTIONS
        case "MISSION_ITEM" | "MISSION_ITEM_INT":
            return may_write and message.current < 2
        case "REQUEST_DATA_STREAM":
            return may_write and bool(message.req_message_rate and message.start_stop)
        case "FILE_TRANSFER_PROTOCOL":
            return may_write and message.payload[3] in {0, 1, 2, 3, 4, 5, 14, 15, 128, 129}
        case "TIMESYNC" | "MISSION_ACK":
            return may_write or (message.get_type() == "TIMESYNC" and message.tc1 == 0)
        case kind:
            return kind in (WRITES if may_write else READS)


@pytest.mark.parametrize("seed", range(2))
def test_a_stranger_on_an_open_link_cannot_move_or_silence_the_craft(seed: int) -> None:
    world, autopilot = passing({})
    second, stranger = GroundStation(world, "second", sysid=SECOND_VEHICLE), GroundStation(world, "stranger")
    second.stay_connected()
    attack(world, stranger, seed)
    arrived = decoded(bytes(autopilot.received))
    assert {message.get_type() for message in arrived} == WRITES
    assert [message for message in arrived if not is_harmless(message, may_write=True)] == []
    copied = [message for message in second.messages() if message.get_srcSystem() not in (1, SECOND_VEHICLE)]
    # Telemetry without a target may come from another vehicle.
    assert {"ATTITUDE", "GLOBAL_POSITION_INT", "ODOMETRY"} <= {message.get_type() for message in copied}
    commands = [message for message in copied if hasattr(message, "target_system") or message.get_type() in MOVES]
    assert [message for message in commands if not is_harmless(message, may_write=True)] == []
    assert len({message.get_type() for message in commands}) > 10


@pytest.mark.parametrize("access", [LinkAccess(signing()), LinkAccess(may_write=lambda _: False)], ids=["key", "list"])
def test_a_listener_only_asks(access: LinkAccess) -> None:
    world, autopilot = passing({"udp": access})
    pilot = on_link(GroundStation(world, "pilot"), "open")
    stranger = GroundStation(world, "stranger")
    pilot.send(HELLO, wait_s=0.1)
    autopilot.received.clear()
    pilot.take()
    attack(world, stranger, 0)
    arrived = decoded(bytes(autopilot.received))
    assert {message.get_type() for message in arrived} == READS
    assert [message for message in arrived if not is_harmless(message, may_write=False)] == []
    # Nothing reaches other stations: all that the pilot got is from the autopilot.
    assert {(message.get_srcSystem(), message.get_type()) for message in pilot.messages()} == {(1, "HEARTBEAT")}


@pytest.mark.parametrize("kind", ["COMMAND_LONG", "SET_MODE", "RC_CHANNELS_OVERRIDE", "MANUAL_CONTROL", "PARAM_SET"])
def test_a_command_for_another_vehicle_needs_a_proven_station(kind: str) -> None:
    """A second vehicle is connected like a ground station; frames for it pass the bridge."""
    command = {
        "COMMAND_LONG": m.MAVLink_command_long_message(SECOND_VEHICLE, 1, 400, 0, 1, 21196, 0, 0, 0, 0, 0),
        "SET_MODE": m.MAVLink_set_mode_message(SECOND_VEHICLE, 1, 3),
        "RC_CHANNELS_OVERRIDE": m.MAVLink_rc_channels_override_message(SECOND_VEHICLE, 1, *[1900] * 8),
        "MANUAL_CONTROL": m.MAVLink_manual_control_message(SECOND_VEHICLE, 0, 0, 0, 0, 0),
        "PARAM_SET": m.MAVLink_param_set_message(SECOND_VEHICLE, 1, b"WPNAV_SPEED", 300, 9),
    }[kind]
    world, _ = passing({"keyed": LinkAccess(signing())})
    second = GroundStation(world, "second", sysid=SECOND_VEHICLE, compid=1)
    stranger, pilot = GroundStation(world, "stranger", sysid=99), on_link(GroundStation(world, "pilot"), "keyed")
    pilot.sign(KEY, ticks(NOON))
    second.send(HELLO, wait_s=0.1)
    stranger.send(command, wait_s=0.1)
    passes_open = kind == "PARAM_SET"
    assert len(second.messages(kind)) == passes_open
    assert bool(world.inside.incoming.refused) is not passes_open
    pilot.send(command, wait_s=0.1)
    assert len(second.messages(kind)) == passes_open + 1


@pytest.mark.parametrize("sysid", [1, 42], ids=["our own ids", "others"])
def test_our_own_signed_answers_are_not_a_proof(sysid: int) -> None:
    """A stranger collects what the bridge signed, also in the autopilot's name, and sends it back."""
    links = {"one": LinkAccess(signing(), 1)}
    links["two"] = LinkAccess(links["one"].signing, 2)
    world, autopilot = passing(links, sysid)
    stranger = on_link(GroundStation(world, "stranger", sysid=99), "one")
    stranger.send(HELLO)
    for component in (0, 1, 7):
        stranger.send(m.MAVLink_command_long_message(sysid, component, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    world.run(0.1)
    signed = [frame for frame in stranger.frames if frame[0] == 0xFD and frame[2] & 1]
    assert len(signed) >= 3
    autopilot.received.clear()
    for link in links:
        thief = on_link(GroundStation(world, f"thief on {link}"), link)
        for frame in signed:
            world.receive_from(thief, frame)
        assert (station := world.inside.ground.station(thief.peer)) is None or station.standing is Standing.LISTENER
    assert bytes(autopilot.received) == b""


def test_recorded_frames_of_the_pilot_act_once() -> None:
    access = LinkAccess(signing(), 1)
    world, autopilot = passing({"one": access, "two": LinkAccess(access.signing, 2)})
    pilot = on_link(GroundStation(world, "pilot"), "one")
    pilot.sign(KEY, ticks(NOON))
    orders = (
        m.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
        m.MAVLink_set_mode_message(1, 1, 3),
        m.MAVLink_mission_clear_all_message(1, 1),
        HELLO,
    )
    recorded = [pilot.pack(message) for message in orders]
    for frame in recorded:
        world.receive_from(pilot, frame)
    once = bytes(autopilot.received)
    assert once == b"".join(recorded)
    for link in ("one", "two"):
        thief = on_link(GroundStation(world, "thief"), link)
        for frame in (*recorded, *reversed(recorded)):
            world.receive_from(thief, frame)
            # Without the flag, and without the signature.
            world.receive_from(thief, frame[:2] + b"\0" + frame[3:-13])
        assert (station := world.inside.ground.station(thief.peer)) is None or station.standing is Standing.LISTENER
    # The world reads by pieces: only whole frames of the pilot count.
    assert bytes(autopilot.received) == once
    assert {why for _, why in world.inside.incoming.refused} == {Check.REPLAYED.value}


def test_made_up_addresses_cannot_flood_the_log() -> None:
    world, _ = passing({"udp": LinkAccess(signing())})
    frame = GroundStation(world).pack(m.MAVLink_mission_clear_all_message(1, 1))
    for number in range(2000):
        peer = Peer("udp", (f"10.0.{number >> 8}.{number & 255}", 14550))
        for _ in range(2):
            world.bridge.gcs_received(peer, frame, world.now + number / 1000, datagram=True)
    assert world.inside.incoming.refused["udp", "not signed"] == 4000
    assert 0 < len(world.events("gcs.refused")) <= 200 + 2 * 50


def test_pass_through_of_everything_excludes_listeners() -> None:
    """The setting is for links that require nothing."""
    world, autopilot = passing({"keyed": LinkAccess(signing())}, everything=True)
    listener, other_station = on_link(GroundStation(world, "listener"), "keyed"), GroundStation(world, "other", sysid=7)
    other_station.send(HELLO, wait_s=0.1)
    autopilot.received.clear()
    other_station.take()
    for message in (HELLO, m.MAVLink_mission_request_list_message(1, 1), m.MAVLink_param_request_list_message(0, 0)):
        listener.send(message)
    world.run(0.1)
    assert [message.get_type() for message in decoded(bytes(autopilot.received))] == ["PARAM_REQUEST_LIST"]
    assert [message for message in other_station.messages() if message.get_srcSystem() != 1] == []
    other_station.send(m.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0), wait_s=0.1)
    assert "COMMAND_LONG" in [message.get_type() for message in decoded(bytes(autopilot.received))]
