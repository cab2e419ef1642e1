# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/telemetry.md agrees with the code's table: every message, its poll, rate and fields."""

import re
from math import inf
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import all as m

from bridge.fc.profile import POLL_FOR
from bridge.vehicle.telemetry_table import NO_STREAM, TELEMETRY, Row

PAGE = (Path(__file__).parents[2] / "docs" / "telemetry.md").read_text()
SECTIONS = re.findall(r"^### ([^\n]*)\n(.*?)(?=^##|\Z)", PAGE, re.MULTILINE | re.DOTALL)
STREAMS = {number: name.removeprefix("MAV_DATA_STREAM_") for name, number in vars(m).items() if "DATA_STREAM_" in name}
#: Fields that only identify the message, and extensions left at MAVLink's "not given".
UNTOLD = {"alt_ellipsoid", "h_acc", "v_acc", "vel_acc", "hdg_acc", "yaw", "id", "temperature", "time_remaining",
              "charge_state", "voltages_ext", "mode", "fault_bitmask", "battery_function", "type", "time_boot_ms",
              "mission_mode", "time_usec", "port", "chancount", "name", "value"}  # fmt: skip


def name_of(row: Row) -> str:
    name: str = m.mavlink_map[row.msgid].msgname
    return name


@pytest.mark.parametrize("row", TELEMETRY, ids=name_of)
def test_each_message_on_the_page_matches_the_code(row: Row) -> None:
    (line,) = re.findall(rf"^- {name_of(row)}: (.*)$", PAGE, re.MULTILINE)
    after, rate, stream = line.rsplit(", ", 2)
    poll = None if row.reading is None else POLL_FOR.get(row.reading)
    if row.msgid != m.MAVLINK_MSG_ID_HOME_POSITION and poll is not None:
        assert after.startswith(f"{poll.name} {poll.value}")
    assert rate == ("on request" if row.interval_s == inf else f"{1 / row.interval_s:g} Hz")
    assert stream == ("none" if row.stream == NO_STREAM else STREAMS[row.stream])


@pytest.mark.parametrize("row", TELEMETRY, ids=name_of)
def test_each_field_is_on_the_page(row: Row) -> None:
    sections = [
        text for heading, text in SECTIONS if name_of(row) in heading.split(", ") or heading == "Always the same"
    ]
    lines = "\n".join(line for text in sections for line in text.splitlines() if line.startswith(("- ", "| ")))
    for field in m.mavlink_map[row.msgid].fieldnames:
        known = re.sub(r"^chan\d+_raw$", "chan1", field.removesuffix("_extended"))
        known = re.sub(r"^errors_count\d$", "errors_count1", known)
        known = re.sub(r"^q\d$", "q1", known) if row.msgid == m.MAVLINK_MSG_ID_ATTITUDE_QUATERNION else known
        assert known in UNTOLD or known in lines, f"{name_of(row)}.{field}"
