# SPDX-License-Identifier: GPL-3.0-or-later

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.msp.settings import SETTINGS, Part, SettingsRequest, fields
from protocols.rights.msp import Firmware

REQUESTS = [request for requests in SETTINGS.values() for request in requests]


@given(request=st.sampled_from(REQUESTS), payload=st.binary(max_size=60), data=st.data())
def test_every_field_is_within_the_reply_and_another_value_changes_it_alone(
    request: SettingsRequest, payload: bytes, data: st.DataObject
) -> None:
    found = fields(request, payload, ("ROLL", "PITCH"), ("ARM", "", "ANGLE"))
    assert len({field.name for field in found}) == len(found)
    if not found:
        return
    changed = data.draw(st.sampled_from(found))
    after = changed.put(payload, changed.value(payload) ^ 1)
    assert len(after) == len(payload)
    assert [field for field in found if field.value(after) != field.value(payload)] == [changed]


@pytest.mark.parametrize(
    ("firmware", "part", "size", "names"),
    [
        (Firmware.HARAKIRI, Part.PIDS, 6, ("ROLL P", "ROLL I", "ROLL D", "PITCH P", "PITCH I", "PITCH D")),
        (Firmware.HARAKIRI, Part.BOXES, 6, ("BOX ARM", "BOX ANGLE")),
        (Firmware.BETAFLIGHT, Part.RANGES, 80, ()),
    ],
)
def test_settings_are_named(firmware: Firmware, part: Part, size: int, names: tuple[str, ...]) -> None:
    request = next(request for request in SETTINGS[firmware] if request.part is part)
    found = fields(request, bytes(size), ("ROLL", "PITCH"), ("ARM", "", "ANGLE"))
    assert tuple(field.name for field in found) == names


def test_the_counters_of_a_multiwii_are_not_settings() -> None:
    misc = next(request for request in SETTINGS[Firmware.MULTIWII] if request.part is Part.MISC)
    counters = range(10, 16)
    assert not [field for field in fields(misc, bytes(22), (), ()) if field.at in counters]
