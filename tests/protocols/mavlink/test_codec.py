# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink 1 for receivers that support only it (fixed payload sizes, no extension fields), and packing by struct."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v10 import ardupilotmega as mavlink_1
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.codec import FrameWriter, decode, file_refusal, pack, pack_attitude
from protocols.mavlink.dialect import Message, messages
from protocols.mavlink.frame import MavlinkSplitter

_NAN4 = [0.0] * 4
SENT = [
    messages.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3),
    messages.MAVLink_sys_status_message(0, 0, 0, 0, 11100, -1, -1, 0, 0, 0, 0, 0, 0),
    messages.MAVLink_attitude_message(1, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0),
    messages.MAVLink_gps_raw_int_message(1000, 3, 453838000, 84733000, 131000, 65535, 65535, 120, 9000, 9),
    messages.MAVLink_global_position_int_message(1, 453838000, 84733000, 131000, 5000, 0, 0, 0, 9000),
    messages.MAVLink_param_value_message(b"WPNAV_RADIUS", 200.0, 9, 2, 1),
    messages.MAVLink_mission_item_message(255, 190, 3, 3, 16, 0, 1, 0, 2, 0, 0, 45.4, 8.5, 12.0, 0),
    messages.MAVLink_mission_item_int_message(255, 190, 3, 3, 16, 0, 1, 0, 2, 0, 0, 453838000, 84733000, 12.0, 0),
    messages.MAVLink_mission_request_message(255, 190, 3, 0),
    messages.MAVLink_mission_count_message(255, 190, 12, 0),
    messages.MAVLink_mission_current_message(3, 12, 2, 0),
    messages.MAVLink_mission_ack_message(255, 190, 14, 0),
    messages.MAVLink_command_ack_message(400, 2, 0, 0, 255, 190),
    messages.MAVLink_autopilot_version_message(4, 65536, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0),
    messages.MAVLink_battery_status_message(0, 0, 3, 32767, [11100] + [65535] * 9, -1, -1, -1, -1),
    messages.MAVLink_home_position_message(453838000, 84733000, 0, 0.0, 0.0, 0.0, _NAN4, 0.0, 0.0, 0.0),
    messages.MAVLink_statustext_message(6, b"Mission verified: 146 records and so on, to the end"[:50]),
    messages.MAVLink_file_transfer_protocol_message(0, 255, 190, [0] * 251),
    messages.MAVLink_ping_message(1000, 2, 255, 190),
    messages.MAVLink_timesync_message(1000, 2000),
]


@pytest.mark.parametrize("message", SENT, ids=lambda message: str(message.get_type()))
def test_our_frames_are_valid_mavlink_1(message: Message) -> None:
    frame = FrameWriter(1, 1).frame(pack(message), 1)
    assert frame[1] == mavlink_1.mavlink_map[message.get_msgId()].unpacker.size
    received = mavlink_1.MAVLink(None).decode(bytearray(frame))
    for name in received.get_fieldnames():
        assert getattr(received, name) == pytest.approx(getattr(message, name)), name


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("message", SENT, ids=lambda message: str(message.get_type()))
def test_our_frames_are_read(message: Message, version: int) -> None:
    (frame,) = MavlinkSplitter().feed(FrameWriter(1, 1).frame(pack(message), version))
    received = decode(frame)
    assert received is not None
    assert received.get_type() == message.get_type()


@pytest.mark.parametrize("version", [1, 2])
@given(boot_ms=st.integers(0, 2**32 - 1), values=st.lists(st.floats(width=32), min_size=6, max_size=6))
def test_attitude_is_packed_like_pymavlinks(version: int, boot_ms: int, values: list[float]) -> None:
    frame = FrameWriter(1, 1).frame(pack_attitude(boot_ms, *values), version)
    theirs = m.MAVLink_attitude_message(boot_ms, *values)
    assert frame == theirs.pack(m.MAVLink(None, srcSystem=1, srcComponent=1), force_mavlink1=version == 1)


@pytest.mark.parametrize(("opcode", "kind", "error"), [(2, 128, 0), (4, 129, 10), (15, 129, 10), (6, 129, 2)])
def test_a_file_is_not_found_and_none_is_written(opcode: int, kind: int, error: int) -> None:
    """RESET_SESSIONS, OPEN_FILE_RO, BURST_READ_FILE and CREATE_FILE (https://mavlink.io/en/services/ftp.html)."""
    reply = file_refusal([7, 0, 3, opcode, *[0] * 247])
    assert reply is not None
    assert (reply[:3], reply[3], reply[5], reply[12]) == ([8, 0, 3], kind, opcode, error)
    assert file_refusal(reply) is None
