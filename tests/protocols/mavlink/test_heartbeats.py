# SPDX-License-Identifier: GPL-3.0-or-later
"""A heartbeat is evidence of a flight controller only if every field is plausible."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.dialect import MESSAGE_FORMATS
from protocols.mavlink.frame import MavlinkFrame, is_autopilot_heartbeat, is_disarmed_heartbeat, is_plausible_heartbeat

#: Custom mode, type, autopilot, base mode, state, version.
GOOD = bytes((0, 0, 0, 0, 2, 3, 81, 3, 3))


def frame(payload: bytes, msgid: int = 0, sysid: int = 1, *, version: int = 2) -> MavlinkFrame:
    """A frame whose CRC nobody checks."""
    if version == 1:
        return MavlinkFrame(bytes((0xFE, len(payload), 0, sysid, 1, msgid)) + payload + b"\0\0")
    header = bytes((0xFD, len(payload), 0, 0, 0, sysid, 1)) + msgid.to_bytes(3, "little")
    return MavlinkFrame(header + payload + b"\0\0")


def with_byte(at: int, value: int) -> bytes:
    return GOOD[:at] + bytes((value,)) + GOOD[at + 1 :]


@pytest.mark.parametrize("version", [1, 2])
def test_a_heartbeat_is_recognised(version: int) -> None:
    assert is_plausible_heartbeat(frame(GOOD, version=version))


def test_the_same_bytes_in_another_message_are_not_recognised() -> None:
    recognised = [msgid for msgid in MESSAGE_FORMATS if is_plausible_heartbeat(frame(GOOD, msgid))]
    old = [msgid for msgid in range(256) if is_plausible_heartbeat(frame(GOOD, msgid, version=1))]
    assert recognised == old == [0]


@pytest.mark.parametrize("payload", [b"", GOOD[:8], GOOD + b"\0", GOOD[:4]], ids=len)
def test_the_length_must_be_right(payload: bytes) -> None:
    assert not is_plausible_heartbeat(frame(payload))


@pytest.mark.parametrize(("at", "highest"), [(4, 45), (5, 20), (7, 8)], ids=["type", "autopilot", "state"])
def test_the_fields_must_be_known(at: int, highest: int) -> None:
    assert is_plausible_heartbeat(frame(with_byte(at, highest)))
    assert not is_plausible_heartbeat(frame(with_byte(at, highest + 1)))


def test_the_version_is_3_and_the_system_is_not_0() -> None:
    assert not is_plausible_heartbeat(frame(with_byte(8, 2)))
    assert not is_plausible_heartbeat(frame(with_byte(8, 4)))
    assert not is_plausible_heartbeat(frame(GOOD, sysid=0))


def test_a_camera_is_not_an_autopilot() -> None:
    assert is_autopilot_heartbeat(frame(GOOD))
    assert not is_autopilot_heartbeat(frame(with_byte(5, m.MAV_AUTOPILOT_INVALID)))
    assert not is_autopilot_heartbeat(frame(GOOD, m.MAVLINK_MSG_ID_SYS_STATUS))


def test_armed_and_disarmed() -> None:
    assert is_disarmed_heartbeat(frame(GOOD))
    assert not is_disarmed_heartbeat(frame(with_byte(6, 81 | m.MAV_MODE_FLAG_SAFETY_ARMED)))
    assert not is_disarmed_heartbeat(frame(GOOD, m.MAVLINK_MSG_ID_SYS_STATUS))
