# SPDX-License-Identifier: GPL-3.0-or-later
"""One object holds all that is known about a ground station: nothing else remembers one that has left."""

import gc
from collections.abc import Callable

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.gcs.ground_station import GroundStation as GcsStation
from bridge.gcs.ground_station import Outbox, Sender
from bridge.gcs.rights import LinkAccess
from bridge.gcs.station import Peer
from protocols.mavlink.frame import MAGIC_V2, MavlinkFrame
from tests.support.conversations import count_message
from tests.support.world import GroundStation, World, ready_world

REQUESTS = (
    m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
    m.MAVLink_request_data_stream_message(1, 1, 0, 4, 1),
    m.MAVLink_command_long_message(1, 1, 511, 0, 30, 20_000, 0, 0, 0, 0, 0),
    m.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
    m.MAVLink_mission_request_list_message(1, 1),
    m.MAVLink_mission_set_current_message(1, 1, 2),
    m.MAVLink_param_request_read_message(1, 1, b"SYSID_THISMAV", -1),
    count_message(3),
)


def fall_silent(_world: World, _peer: Peer) -> None:
    """It leaves when it has been silent for a minute."""


def disconnect(world: World, peer: Peer) -> None:
    world.bridge.gcs_gone(peer, world.now)


@pytest.mark.parametrize("leave", [fall_silent, disconnect])
def test_stations_that_have_left_are_forgotten(leave: Callable[[World, Peer], None]) -> None:
    world = ready_world()
    gc.collect()
    before = [each for each in gc.get_objects() if type(each) in (GcsStation, Peer)]
    speaker = GroundStation(world)
    del world.stations[speaker.peer]
    data = b"".join(map(speaker.pack, REQUESTS))
    for number in range(40):
        peer = Peer("udp", (f"10.0.0.{number}", 14550))
        world.bridge.gcs_received(peer, data, world.now, datagram=True)
        world.bridge.gcs_received(peer, data, world.now, datagram=True)
        world.run(0.1)
        leave(world, peer)
    assert len(world.events("gcs.found")) == 40
    # An upload ends after 5 s without an item, and a download after 20 s.
    world.run(85)
    world.log_event.clear()
    gc.collect()
    left = [each for each in gc.get_objects() if type(each) in (GcsStation, Peer)]
    left = [each for each in left if not any(each is other for other in before)]
    assert [each for each in left if isinstance(each, GcsStation)] == []
    # Those of this test's own variables.
    assert len(left) <= 3


@pytest.mark.parametrize(
    ("numbers", "lost"),
    [
        ([1, 2, 3], False),
        ([255, 0, 1], False),
        ([1, 3], True),
        ([1, 3, 2], False),
        ([1, 4, 2], True),
        ([1, 2, 3, 1], False),
        ([1, 1], True),
        ([1, 200], True),
    ],
)
def test_a_gap_in_the_frame_numbers_is_a_lost_frame(numbers: list[int], *, lost: bool) -> None:
    """Unless the missing frame arrives late. A sender that numbers all frames alike seems to lose many."""
    sender = Sender(GcsStation(Peer("udp", "gcs"), LinkAccess(), 1, 1, Outbox(print)), 255, 190)
    frames = [
        MavlinkFrame(bytes((MAGIC_V2, 0, 0, 0, number, 255, 190, 0, 0, 0, at))) for at, number in enumerate(numbers)
    ]
    sender.heard(frames[0], 0.0)
    first = sender.frames
    for frame in frames[1:]:
        sender.heard(frame, 0.1)
    assert (sender.last_lost > first) is lost


@pytest.mark.parametrize(("silence_s", "is_late"), [(0.9, True), (1.1, False)])
def test_an_older_number_after_a_silence_is_that_of_a_restarted_sender(silence_s: float, *, is_late: bool) -> None:
    sender = Sender(GcsStation(Peer("udp", "gcs"), LinkAccess(), 1, 1, Outbox(print)), 255, 190)
    for at, number in ((0.0, 9), (silence_s, 0)):
        sender.heard(MavlinkFrame(bytes((MAGIC_V2, 0, 0, 0, number, 255, 190, 0, 0, 0))), at)
    assert sender.is_late is is_late
