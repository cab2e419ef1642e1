# SPDX-License-Identifier: GPL-3.0-or-later
"""The effects of a bridge: each is taken once, and what must not wait comes first."""

from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.bridge import Bridge
from bridge.config import BridgeConfig
from bridge.effects import RecordFrames, SendToBoard
from bridge.gcs.station import Datagrams, Peer
from bridge.model.events import GcsFound


def test_an_effect_is_taken_once() -> None:
    bridge = Bridge(BridgeConfig((57600,)), 0.0)
    bridge.take()
    bridge.fc_opened(1.0)
    (opened,) = bridge.take()
    assert isinstance(opened, SendToBoard)
    assert opened.speed == 57600
    assert bridge.take() == []


def test_datagrams_and_bytes_for_the_board_come_before_records_and_events() -> None:
    bridge = Bridge(BridgeConfig((57600,), has_log=True), 0.0)
    heartbeat = m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, 8, 0, 0, 0, 3).pack(m.MAVLink(None, 255, 190))
    assert bridge.gcs_received(Peer("tcp", 1), bytes(heartbeat), 0.0, datagram=False)
    bridge.tick(0.1)
    effects = bridge.take()
    assert [type(effect) for effect in effects[:3]] == [Datagrams, SendToBoard, RecordFrames]
    assert any(isinstance(effect, GcsFound) for effect in effects[3:])
