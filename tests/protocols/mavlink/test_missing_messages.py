# SPDX-License-Identifier: GPL-3.0-or-later
"""CURRENT_MODE and AVAILABLE_MODES, read with a pymavlink dialect that has them."""

import pytest
from pymavlink.dialects.v20 import development

from protocols.mavlink.codec import FrameWriter, Packed
from protocols.mavlink.missing_messages import available_mode, current_mode


@pytest.mark.parametrize(
    ("packed", "fields"),
    [
        (current_mode(5, 1), {"custom_mode": 5, "standard_mode": 1, "intended_custom_mode": 0}),
        (current_mode(0, 0), {"custom_mode": 0, "standard_mode": 0, "intended_custom_mode": 0}),
        (
            available_mode(3, 6, 2, 4, "Alt Hold"),
            {"mode_index": 3, "number_modes": 6, "custom_mode": 2, "standard_mode": 4, "mode_name": "Alt Hold",
             "properties": development.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE},
        ),
    ],
)  # fmt: skip
@pytest.mark.parametrize("version", [1, 2])
def test_a_published_dialect_reads_both(packed: Packed, fields: dict[str, int | str], version: int) -> None:
    frame = FrameWriter(1, 1).frame(packed, version)
    assert frame[1] >= 1  # MAVLink 2 never omits the first byte
    message = development.MAVLink(None).decode(bytearray(frame))
    assert {name: getattr(message, name) for name in message.fieldnames} == fields
