# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink that arrives over zenoh."""

import asyncio
from typing import Any, cast

import zenoh
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from protocols.mavlink.frame import MavlinkSplitter
from service.daemon.daemon import GcsConnections
from service.zenoh_link.mavlink_link import MavlinkLink
from service.zenoh_link.publisher import Publisher
from tests.support.benches import Starter
from tests.support.programs import until
from tests.support.zenoh_bench import I_KNOW, Reader, endpoint, key, session, zenoh_bench

HEARTBEAT = bytes.fromhex("fe09000101000000000002030000030346f1")


class Events:
    def __init__(self) -> None:
        self.received: list[bytes] = []

    def gcs_data(self, _peer: Any, data: bytes, *, datagram: bool) -> None:
        self.received.append(data)


class Sample:
    payload = zenoh.ZBytes(HEARTBEAT)


async def test_frames_are_dropped_while_another_bridge_has_the_same_name() -> None:
    """It gets them, too: a mission would be written to both aircraft."""
    events, others = Events(), {"0123"}
    link = MavlinkLink(cast("Publisher", None), cast("GcsConnections", events), others)
    link._arrived(cast("zenoh.Sample", Sample()))
    await asyncio.sleep(0)
    assert events.received == []
    others.clear()
    link._arrived(cast("zenoh.Sample", Sample()))
    await asyncio.sleep(0)
    assert events.received == [HEARTBEAT]


def test_mavlink_is_published_while_subscribed_and_received(start: Starter) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'listen = ["{where}"]\nmavlink_in = true\ncommands_without_authentication = "I know"')
    with session(connect=where) as opened:
        reader = Reader(opened, key("@mavlink/v1/out"))
        until(lambda: len(reader.samples) > 30, "frames")
        frames = [frame for each in reader.samples for frame in MavlinkSplitter().feed(each.payload.to_bytes())]
        numbers = [frame.seq for frame in frames]
        assert numbers == [(numbers[0] + place) % 256 for place in range(len(numbers))]
        assert all(mavlink.MAVLink(None).decode(bytearray(frame.raw)) for frame in frames)
        speaker = mavlink.MAVLink(None, srcSystem=254, srcComponent=190)
        opened.put(key("@mavlink/v1/in"), b"\xfd\xff no MAVLink" * 9)
        opened.put(key("@mavlink/v1/in"), bytes(mavlink.MAVLink_mission_request_list_message(1, 1, 0).pack(speaker)))

        def answered() -> bool:
            return any(
                frame.msgid == mavlink.MAVLINK_MSG_ID_MISSION_COUNT
                for each in reader.samples[:]
                for frame in MavlinkSplitter().feed(each.payload.to_bytes())
            )

        until(answered, "the answer")
        status = bench.daemon.status()
        assert status is not None
        assert status["ground_stations"] == ["zenoh @mavlink/v1/out"]


def test_incoming_mavlink_is_off_by_default(start: Starter) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'listen = ["{where}"]\n{I_KNOW}')
    with session(connect=where) as opened:
        reader = Reader(opened, key("@mavlink/v1/out"))
        until(lambda: reader.samples, "a frame")
        speaker = mavlink.MAVLink(None, srcSystem=254, srcComponent=190)
        opened.put(key("@mavlink/v1/in"), bytes(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(speaker)))
        seen = len(reader.samples)
        until(lambda: len(reader.samples) > seen + 20, "more frames")
        status = bench.daemon.status()
        assert status is not None
        assert status["ground_stations"] == []
