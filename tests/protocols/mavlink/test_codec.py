# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink 1 for receivers that support only it (fixed payload sizes, no extension fields), and packing by struct."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.codec import FrameWriter, file_refusal, pack_attitude


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
