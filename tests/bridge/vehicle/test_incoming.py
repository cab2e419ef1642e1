# SPDX-License-Identifier: GPL-3.0-or-later
"""Write access per link: by key, by list of addresses, and in pass-through."""

from collections.abc import Sequence
from functools import partial

import pytest
from pymavlink.dialects.v20 import all as every_message
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from bridge.controllers import other
from bridge.gcs.rights import LinkAccess
from bridge.voice import sentences
from protocols.mavlink.codec import FrameWriter, Packed
from protocols.mavlink.dialect import CRC_EXTRA, Message
from protocols.mavlink.signing import Check, Signing, Timestamps, key_from_passphrase, ticks
from protocols.mission_item import MissionResult
from protocols.tlog import tlog_records
from tests.bridge.fc.states.test_pass_through import Autopilot
from tests.support.conversations import (
    Download,
    Upload,
    clear_message,
    count_message,
    item_message,
    request_message,
    waypoints,
)
from tests.support.seeds import seeds
from tests.support.world import GroundStation, Radio, World, ready_world

KEY = key_from_passphrase("a passphrase")
OTHER_KEY = key_from_passphrase("another passphrase")
#: Start time of the worlds here, in seconds since the Unix epoch.
NOON = 1_795_262_400.0
LINK_ID = 3
COMMAND_ARM = mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1, 0, 0, 0, 0, 0, 0)

#: Messages that change something, one of each family, and the reply to a refusal.
WRITES: Sequence[tuple[Message, str | None]] = (
    (count_message(3), "MISSION_ACK"),
    (item_message(0, waypoints(2)[0]), "MISSION_ACK"),
    (item_message(0, waypoints(2)[0], as_int=False), "MISSION_ACK"),
    (clear_message(), "MISSION_ACK"),
    (clear_message(mission_type=1), "MISSION_ACK"),
    (mavlink.MAVLink_mission_write_partial_list_message(1, 1, 0, 1), "MISSION_ACK"),
    (COMMAND_ARM, "COMMAND_ACK"),
    (mavlink.MAVLink_command_int_message(1, 1, 0, 176, 0, 0, 0, 0, 0, 0, 0, 0, 0), "COMMAND_ACK"),
    (mavlink.MAVLink_mission_set_current_message(1, 1, 2), None),
    (mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_OPERATION_CANCELLED), None),
    (mavlink.MAVLink_param_set_message(1, 1, b"SYSID_THISMAV", 3, 9), "PARAM_VALUE"),
    (mavlink.MAVLink_set_mode_message(1, 1, 3), None),
    (mavlink.MAVLink_rc_channels_override_message(1, 1, *[1500] * 8), None),
    (mavlink.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0), None),
    (mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0, *[0] * 11), None),
    (mavlink.MAVLink_serial_control_message(10, 0, 0, 0, 1, [13] * 70), None),
    (mavlink.MAVLink_gps_inject_data_message(1, 1, 1, [0] * 110), None),
    (mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, [0, 0, 0, 6, *[0] * 247]), "FILE_TRANSFER_PROTOCOL"),
)
READS: tuple[Message, ...] = (
    mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
    mavlink.MAVLink_statustext_message(6, b"Mission Planner 1.3"),
    mavlink.MAVLink_ping_message(1, 1, 0, 0),
    mavlink.MAVLink_timesync_message(0, 1),
    mavlink.MAVLink_autopilot_version_request_message(1, 1),
    mavlink.MAVLink_param_request_list_message(1, 1),
    mavlink.MAVLink_param_request_read_message(1, 1, b"WPNAV_RADIUS", -1),
    mavlink.MAVLink_mission_request_list_message(1, 1),
    mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_ACCEPTED),
    mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, [0, 0, 0, 3, *[0] * 247]),
    mavlink.MAVLink_log_request_list_message(1, 1, 0, 0),
    mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_REQUEST_MESSAGE, 0, 148, 0, 0, 0, 0, 0, 0),
    mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_DO_SEND_BANNER, 0, 0, 0, 0, 0, 0, 0, 0),
)


def named(value: object) -> str:
    return value.get_type() if isinstance(value, mavlink.MAVLink_message) else str(value)


def signing() -> Signing:
    return Signing(KEY, Timestamps(lambda: NOON))


@pytest.fixture
def world() -> World:
    """A world whose only link requires a key."""
    return ready_world(links={"udp": LinkAccess(signing(), LINK_ID)})


def signing_station(world: World, name: str = "gcs", *, at: int = ticks(NOON), sysid: int = 255) -> GroundStation:
    station = GroundStation(world, name, sysid=sysid)
    station.sign(KEY, at)
    return station


def passing(links: dict[str, LinkAccess], sysid: int = 1, *, everything: bool = False) -> tuple[World, Autopilot]:
    autopilot = Autopilot(sysid=sysid)
    world = World(peer=autopilot, links=links, passes_everything=everything)
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 3, then_s=1.5)
    autopilot.received.clear()
    return world, autopilot


#: Telemetry may come in between.
ANSWERS = ("MISSION_ACK", "COMMAND_ACK", "PARAM_VALUE", "FILE_TRANSFER_PROTOCOL")


def refusals(world: World) -> dict[str, int]:
    return {why: count for (_, why), count in world.inside.incoming.refused.items()}


# With a key.


@pytest.mark.parametrize(("message", "answer"), WRITES, ids=named)
@pytest.mark.parametrize("version", [1, 2])
def test_a_change_must_be_signed(world: World, message: Message, answer: str | None, version: int) -> None:
    station = GroundStation(world, version=version)
    station.send(message, wait_s=0.01)
    assert refusals(world) == {"not signed": 1}
    received = station.messages(*ANSWERS)
    assert [each.get_type() for each in received] == ([] if answer is None else [answer])
    match answer:
        case "MISSION_ACK":
            (ack,) = received
            assert (ack.type, ack.mission_type) == (MissionResult.DENIED, getattr(message, "mission_type", 0))
            assert station.is_target_of(ack)
        case "COMMAND_ACK":
            (ack,) = received
            assert (ack.result, ack.command) == (mavlink.MAV_RESULT_DENIED, message.command)
        case "PARAM_VALUE":
            (value,) = received
            assert (value.param_id, value.param_value) == ("SYSID_THISMAV", 1.0)
    assert station.texts() == ["Refused: not signed"]


@pytest.mark.parametrize("message", READS, ids=named)
@pytest.mark.parametrize("version", [1, 2])
def test_reading_does_not_need_a_signature(world: World, message: Message, version: int) -> None:
    GroundStation(world, version=version).send(message)
    world.run(0.5)
    assert refusals(world) == {}


def test_every_message_not_known_to_be_harmless_must_be_signed(world: World) -> None:
    station = GroundStation(world)
    free = {message.get_msgId() for message in READS} - {mavlink.MAVLINK_MSG_ID_COMMAND_LONG} | {
        mavlink.MAVLINK_MSG_ID_MISSION_REQUEST,
        mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
        mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_PARTIAL_LIST,
        mavlink.MAVLINK_MSG_ID_PARAM_EXT_REQUEST_READ,
        mavlink.MAVLINK_MSG_ID_PARAM_EXT_REQUEST_LIST,
        mavlink.MAVLINK_MSG_ID_FENCE_FETCH_POINT,
        mavlink.MAVLINK_MSG_ID_RALLY_FETCH_POINT,
        mavlink.MAVLINK_MSG_ID_LOG_REQUEST_DATA,
        mavlink.MAVLINK_MSG_ID_LOG_REQUEST_END,
    }
    for msgid in CRC_EXTRA:
        world.receive_from(station, FrameWriter(255, 190).frame(Packed(msgid, b"", b"\0"), 2))
    assert len(CRC_EXTRA) > 250
    assert free < CRC_EXTRA.keys()
    assert sum(refusals(world).values()) == len(CRC_EXTRA) - len(free)


def test_a_signed_upload_is_accepted_and_every_reply_is_signed(world: World) -> None:
    station = signing_station(world)
    items = waypoints(8)
    assert Upload(station, items).run() is MissionResult.ACCEPTED
    assert len(Download(station).run()) == 8
    world.run(3)
    assert len(world.stored) == 8
    assert refusals(world) == {}
    receiver = every_message.MAVLink(None)
    receiver.robust_parsing = False
    receiver.signing.secret_key, receiver.signing.timestamp = KEY, ticks(NOON)
    assert len(station.frames) > 50
    for frame in station.frames:
        (message,) = receiver.parse_buffer(frame)
        assert message.get_signed()
        assert message.get_link_id() == LINK_ID


def test_mavlink_1_and_unheard_peers_get_only_signed_frames(world: World) -> None:
    unheard = GroundStation(world, "unheard")
    world.bridge.add_default_peer(unheard.peer, until_answered=False)
    old = GroundStation(world, "old", version=1)
    old.send(READS[0], wait_s=3)
    for station in (unheard, old):
        assert station.messages("HEARTBEAT")
        assert all(frame[0] == 0xFD and frame[2] & 1 for frame in station.frames)


def test_without_the_key_an_upload_is_refused(world: World) -> None:
    station = GroundStation(world)
    station.sign(OTHER_KEY, ticks(NOON))
    assert Upload(station, waypoints(5)).run() is MissionResult.DENIED
    assert world.stored == ()
    assert set(refusals(world)) == {Check.WRONG.value}


def test_a_refusal_is_logged_once_for_each_peer_and_counted_each_time(world: World) -> None:
    stations = [GroundStation(world, name) for name in ("one", "two")]
    for _ in range(5):
        for station in stations:
            station.send(COMMAND_ARM)
    world.run(1)
    events = world.events("gcs.refused")
    assert [(event.level, event.facts["message"], event.facts["why"]) for event in events] == [
        ("warning", "COMMAND_LONG", "not signed")
    ] * 2
    assert refusals(world) == {"not signed": 10}
    for station in stations:
        assert len(station.messages("COMMAND_ACK")) == 5
        assert station.texts() == ["Refused: not signed"]


@pytest.mark.parametrize("was_right", [False, True])
def test_a_station_gets_a_text_about_a_wrong_clock(world: World, *, was_right: bool) -> None:
    station, right = signing_station(world), signing_station(world, "right clock", sysid=254)
    if was_right:
        station.send(clear_message(), wait_s=1)
        assert [ack.type for ack in station.take("MISSION_ACK")] == [MissionResult.ACCEPTED]
    station.sign(KEY, ticks(NOON) + 2 * 86400 * 100_000)
    for _ in range(3):
        station.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), wait_s=1)
    assert station.texts() == []
    station.send(clear_message(), wait_s=0.1)
    assert [ack.type for ack in station.messages("MISSION_ACK")] == [MissionResult.DENIED]
    assert station.texts() == ["Refused: signed over a day ahead: set the clocks"]
    right.send(clear_message(), wait_s=1)
    assert [ack.type for ack in right.messages("MISSION_ACK")] == [MissionResult.ACCEPTED]


def test_a_refusal_of_rates_is_silent(world: World) -> None:
    """Every ground station sends some when it connects, and every radio its status."""
    station = GroundStation(world)
    station.send(mavlink.MAVLink_radio_status_message(0, 0, 0, 0, 0, 0, 0))
    station.send(mavlink.MAVLink_request_data_stream_message(1, 1, 0, 4, 1))
    station.send(mavlink.MAVLink_command_long_message(1, 1, 511, 0, 30, 100_000, 0, 0, 0, 0, 0), wait_s=0.1)
    assert refusals(world) == {"not signed": 3}
    assert station.texts() == []
    assert world.events("gcs.refused") == []


@pytest.mark.parametrize("access", [LinkAccess(signing(), LINK_ID), LinkAccess(may_write=lambda peer: "pilot" in peer)])
def test_texts_for_others_do_not_reach_a_listener(access: LinkAccess) -> None:
    world = ready_world(links={"udp": access})
    pilot = signing_station(world, "pilot")
    listener = GroundStation(world, "listener", sysid=250)
    for station in (pilot, listener):
        station.send(READS[0])
    world.run(0.1)
    world.inside.ground.say(sentences.FOUND("INAV"))
    world.run(0.1)
    assert (pilot.texts(), listener.texts()) == (["Found INAV"], [])


def test_listeners_do_not_displace_a_station_with_the_key(world: World) -> None:
    pilot = signing_station(world, "pilot")
    for number in range(40):
        if number == 20:
            pilot.send(READS[0])
        listener = GroundStation(world, f"listener {number}", sysid=250)
        for _ in range(2):
            listener.send(READS[0])
        world.run(0.1)
    peers = world.inside.ground.peers()
    assert pilot.peer in peers
    assert len(peers) <= 32


def test_an_address_must_show_the_key_again_after_the_station_has_left(world: World) -> None:
    station, another = signing_station(world), GroundStation(world, sysid=250)
    assert another.peer == station.peer
    for times in (1, 2):
        another.send(clear_message(), wait_s=0.1)
        assert [ack.type for ack in another.messages("MISSION_ACK")] == [MissionResult.DENIED] * times
        assert another.texts() == ["Refused: not signed"] * times
        station.send(READS[0], wait_s=0.1)
        world.bridge.gcs_gone(station.peer, world.now)


def test_a_replayed_frame_is_refused(world: World) -> None:
    station = signing_station(world)
    frame = station.pack(clear_message())
    world.receive_from(station, frame)
    world.run(2)
    (ack,) = station.messages("MISSION_ACK")
    assert ack.type == MissionResult.ACCEPTED
    thief = GroundStation(world, "thief")
    for speaker in (thief, station):
        world.receive_from(speaker, frame)
    world.run(2)
    assert refusals(world) == {Check.REPLAYED.value: 2}
    # The copy is refused silently, because the network may have duplicated the frame.
    assert [ack.type for ack in thief.messages("MISSION_ACK")] == [MissionResult.DENIED]
    assert len(station.messages("MISSION_ACK")) == 1


def test_an_unsigned_frame_cannot_end_the_pilots_upload(world: World) -> None:
    """The attacker can forge the address and ids, but not the signature."""
    station = signing_station(world)
    forger = GroundStation(world, "gcs")
    world.stations[station.peer] = station
    frames = [
        forger.pack(message)
        for message in (
            mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_OPERATION_CANCELLED),
            count_message(0),
            count_message(2),
            item_message(1, waypoints(2)[1]),
            clear_message(),
        )
    ]

    def forge(message: Message) -> None:
        if message.get_type() == "MISSION_REQUEST":
            for frame in frames:
                world.after(0.0, partial(world.receive_from, station, frame))

    station.on_message.append(forge)
    assert Upload(station, waypoints(20)).run() is MissionResult.ACCEPTED
    assert len(world.stored) == 20
    assert refusals(world)["not signed"] >= 5 * 19
    assert station.texts().count("Refused: not signed") == 0


@pytest.mark.parametrize("seed", seeds(2))
def test_a_signed_upload_over_a_network_that_loses_and_duplicates(seed: int) -> None:
    world = ready_world(seed=seed, links={"udp": LinkAccess(signing(), LINK_ID)})
    station = GroundStation(world, radio=Radio(loss=0.05, repeat=0.3, delay_s=0.02))
    station.sign(KEY, ticks(NOON))
    assert Upload(station, waypoints(30)).run() is MissionResult.ACCEPTED
    assert len(world.stored) == 30
    assert set(refusals(world)) == {Check.REPLAYED.value}
    assert MissionResult.DENIED not in [ack.type for ack in station.messages("MISSION_ACK")]


# With a list of addresses.


def test_an_unlisted_address_may_only_read() -> None:
    world = ready_world(links={"udp": LinkAccess(may_write=lambda peer: peer.key == "pilot")})
    pilot, guest = GroundStation(world, "pilot"), GroundStation(world, "guest", sysid=250)
    assert Upload(pilot, waypoints(6)).run() is MissionResult.ACCEPTED
    assert Upload(guest, waypoints(3)).run() is MissionResult.DENIED
    assert len(world.stored) == 6
    assert len(Download(guest).run()) == 6
    assert guest.texts()[0] == "Refused: this address may only read"
    assert all(frame[0] == 0xFE or not frame[2] & 1 for frame in guest.frames)


def test_with_a_key_and_a_list_both_are_required() -> None:
    world = ready_world(links={"udp": LinkAccess(signing(), LINK_ID, lambda peer: peer.key == "pilot")})
    assert Upload(signing_station(world, "guest", sysid=250), waypoints(3)).run() is MissionResult.DENIED
    assert Upload(GroundStation(world, "pilot"), waypoints(3)).run() is MissionResult.DENIED
    assert Upload(signing_station(world, "pilot"), waypoints(3)).run() is MissionResult.ACCEPTED


def test_a_link_without_access_rules_is_open() -> None:
    world = ready_world(links={"another": LinkAccess(may_write=lambda _: False)})
    assert Upload(GroundStation(world), waypoints(3)).run() is MissionResult.ACCEPTED


# An autopilot that speaks MAVLink itself.


def test_a_listener_with_the_pilots_ids_cannot_act_as_the_pilot() -> None:
    """ArduPilot's GCS failsafe waits for the pilot's heartbeats, and it denies an upload when a list is requested."""
    world, autopilot = passing({"udp": LinkAccess(signing(), LINK_ID)})
    listener = GroundStation(world)
    for message in READS[:1] + READS[7:9] + (request_message(0), request_message(0, as_int=False)):
        listener.send(message)
    world.run(0.01)
    assert bytes(autopilot.received) == b""
    pilot = signing_station(world, "pilot")
    frames = [listener.pack(READS[5]), pilot.pack(READS[0]), pilot.pack(READS[7])]
    world.receive_from(listener, frames[0])
    world.receive_from(pilot, frames[1])
    world.receive_from(pilot, frames[2])
    assert bytes(autopilot.received) == b"".join(frames)


def test_a_refusal_has_the_autopilots_ids() -> None:
    world, _ = passing({"udp": LinkAccess(may_write=lambda _: False)}, sysid=42)
    station = GroundStation(world)
    station.send(mavlink.MAVLink_command_long_message(42, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    station.send(mavlink.MAVLink_command_long_message(77, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0), wait_s=0.01)
    (ack,) = station.messages("COMMAND_ACK")
    assert (ack.get_srcSystem(), ack.get_srcComponent(), ack.result) == (42, 1, mavlink.MAV_RESULT_DENIED)
    assert refusals(world) == {"this address may only read": 2}


def test_a_refusal_comes_from_the_component_that_was_addressed() -> None:
    """From the autopilot if that component was never heard."""
    world, autopilot = passing({"udp": LinkAccess(may_write=lambda _: False)}, sysid=42)
    autopilot.mavlink.srcComponent = 7
    autopilot.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
    autopilot.mavlink.srcComponent = 1
    world.run(0.1)
    station = GroundStation(world)
    for component in (7, 1, 99, 0):
        station.send(mavlink.MAVLink_command_long_message(42, component, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    world.run(0.01)
    assert [ack.get_srcComponent() for ack in station.messages("COMMAND_ACK")] == [7, 1, 1, 1]


def test_signed_frames_reach_the_autopilot_unchanged() -> None:
    world, autopilot = passing({"udp": LinkAccess(signing(), LINK_ID)})
    station = signing_station(world)
    frames = [station.pack(message) for message, _ in WRITES]
    for frame in frames:
        world.receive_from(station, frame)
    for frame in frames:
        world.receive_from(station, frame)
    assert bytes(autopilot.received) == b"".join(frames)
    assert refusals(world) == {Check.REPLAYED.value: len(frames)}


# The key.


@pytest.mark.parametrize("access", [LinkAccess(), LinkAccess(signing(), LINK_ID)])
def test_setup_signing_is_never_forwarded(access: LinkAccess) -> None:
    world, autopilot = passing({"udp": access})
    world.inside.ground.outbox.recorded = []
    GroundStation(world, "other", sysid=250).send(READS[0])
    world.run(0.1)
    autopilot.received.clear()
    station = GroundStation(world)
    setup = mavlink.MAVLink_setup_signing_message(1, 1, KEY, 1)
    station.send(setup)
    station.sign(KEY, ticks(NOON))
    station.send(setup, wait_s=0.1)
    assert bytes(autopilot.received) == b""
    assert sum(refusals(world).values()) == 2
    assert "Refused: set the key in naze-bridge's settings" in station.texts()
    received = b"".join(b"".join(each.frames) for each in world.stations.values())
    for place in (
        received,
        tlog_records(world.recorded, 0),
        repr(world.log_event).encode(),
        repr(world.inside.ground._access).encode(),
    ):
        assert KEY not in place
        assert KEY.hex().encode() not in place
        assert repr(KEY).encode() not in place
