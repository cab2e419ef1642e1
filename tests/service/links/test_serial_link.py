# SPDX-License-Identifier: GPL-3.0-or-later
"""A ground station behind a telemetry radio, on a pseudo-terminal."""

import asyncio
import os
import pty
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.gcs.station import Peer
from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from service.links import serial_link
from tests.support.links import Links
from tests.support.packing import pack
from tests.support.programs import TIMEOUT_S, until_async

HEARTBEAT = m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3)


class Radio:
    """The other end of the port at `path`."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.plug()

    def plug(self) -> None:
        self.descriptor, terminal = pty.openpty()
        os.set_blocking(self.descriptor, False)
        self._path.unlink(missing_ok=True)
        self._path.symlink_to(os.ttyname(terminal))
        os.close(terminal)

    def unplug(self) -> None:
        self._path.unlink()
        os.close(self.descriptor)

    async def frames(self, last: int) -> list[MavlinkFrame]:
        """Everything up to a frame with this message id."""
        splitter, data = MavlinkSplitter(), b""
        frames: list[MavlinkFrame] = []
        async with asyncio.timeout(TIMEOUT_S):
            while not any(frame.msgid == last for frame in frames):
                try:
                    piece = os.read(self.descriptor, 4096)
                except BlockingIOError:
                    await asyncio.sleep(0.001)
                    continue
                data += piece
                frames += splitter.feed(piece)
        assert b"".join(frame.raw for frame in frames) == data
        return frames


@pytest.fixture
def radio(tmp_path: Path) -> Iterator[Radio]:
    radio = Radio(tmp_path / "ttyUSB1")
    yield radio
    os.close(radio.descriptor)


async def test_a_station_is_heard_without_the_radios_own_reports(links: Links, radio: Radio, tmp_path: Path) -> None:
    link = links.open(f"{tmp_path}/ttyUSB1,57600")
    await until_async(lambda: links.events.default_peers, "the open port")
    (peer,) = links.events.default_peers
    writer, station = FrameWriter(51, 68), FrameWriter(255, 190)
    report = writer.frame(pack(m.MAVLink_radio_status_message(100, 100, 90, 0, 0, 0, 0)), 1)
    frame = station.frame(pack(HEARTBEAT), 2)
    os.write(radio.descriptor, frame[:5])
    os.write(radio.descriptor, frame[5:] + report + frame)
    await until_async(lambda: b"".join(data for _, data in links.events.received) == frame * 2, "the frames")
    link.send(peer, frame)
    assert [each.raw for each in await radio.frames(m.MAVLINK_MSG_ID_HEARTBEAT)] == [frame]


async def test_more_telemetry_than_the_line_carries_is_dropped(links: Links, radio: Radio, tmp_path: Path) -> None:
    link = links.open(f"{tmp_path}/ttyUSB1,57600")
    await until_async(lambda: links.events.default_peers, "the open port")
    (peer,) = links.events.default_peers
    writer, sent = FrameWriter(1, 1), 0
    for number in range(300):
        attitude = writer.frame(pack(m.MAVLink_attitude_message(number, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)), 2)
        sent += len(attitude)
        link.send(peer, attitude)
        if number % 100 == 0:
            link.send(peer, writer.frame(pack(m.MAVLink_mission_request_message(255, 190, number, 0)), 2))
    link.send(peer, writer.frame(pack(m.MAVLink_mission_ack_message(255, 190, 0, 0)), 2))
    frames = await radio.frames(m.MAVLINK_MSG_ID_MISSION_ACK)
    requests = [frame for frame in frames if frame.msgid == m.MAVLINK_MSG_ID_MISSION_REQUEST]
    assert [int.from_bytes(frame.payload[:2], "little") for frame in requests] == [0, 100, 200]
    # All were made at once, and 57600 baud carry 5.8 kB a second.
    assert sum(len(frame.raw) for frame in frames) < 2500 < sent


async def test_a_full_radio_gets_less(links: Links, radio: Radio, tmp_path: Path) -> None:
    link = links.open(f"{tmp_path}/ttyUSB1,57600")
    await until_async(lambda: links.events.default_peers, "the open port")
    (peer,) = links.events.default_peers
    writer = FrameWriter(1, 1)

    async def admitted() -> int:
        for number in range(300):
            link.send(peer, writer.frame(pack(m.MAVLink_attitude_message(number, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)), 2))
        link.send(peer, writer.frame(pack(m.MAVLink_mission_ack_message(255, 190, 0, 0)), 2))
        return len(await radio.frames(m.MAVLINK_MSG_ID_MISSION_ACK))

    before = await admitted()
    for _ in range(3):
        full = FrameWriter(51, 68).frame(pack(m.MAVLink_radio_status_message(100, 100, 5, 0, 0, 0, 0)), 1)
        os.write(radio.descriptor, full)
        station = FrameWriter(255, 190).frame(pack(HEARTBEAT), 2)
        links.events.received.clear()
        os.write(radio.descriptor, station)
        await until_async(lambda: links.events.received, "the heartbeat after the report")
    assert await admitted() < before / 2


async def test_an_unplugged_radio_comes_back(
    links: Links, radio: Radio, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(serial_link, "_REOPEN_S", 0.01)
    link = links.open(f"{tmp_path}/ttyUSB1,57600")
    await until_async(lambda: links.events.default_peers, "the open port")
    (peer,) = links.events.default_peers
    radio.unplug()
    await until_async(lambda: links.events.gone == [peer], "the end")
    link.send(peer, b"lost")
    radio.plug()
    await until_async(lambda: links.events.default_peers, "its return")
    os.write(radio.descriptor, frame := FrameWriter(255, 190).frame(pack(HEARTBEAT), 2))
    await until_async(lambda: links.events.received == [(Peer(link.name, f"{tmp_path}/ttyUSB1"), frame)], "a frame")
