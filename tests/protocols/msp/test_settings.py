# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings in which two replies differ, by name."""

from hypothesis import given
from hypothesis import strategies as st

from protocols.msp.settings import SETTINGS, Part, SettingNames, SettingsRequest, changed_names
from protocols.rights.msp import Firmware

REQUESTS = [request for requests in SETTINGS.values() for request in requests]


def of(firmware: Firmware, part: Part) -> SettingsRequest:
    return next(request for request in SETTINGS[firmware] if request.part is part)


@given(request=st.sampled_from([request for request in REQUESTS if request.layout]), data=st.data())
def test_a_changed_field_is_named_alone_and_a_counter_is_no_change(
    request: SettingsRequest, data: st.DataObject
) -> None:
    size = sum(bytes_ for _, bytes_ in request.layout)
    before = data.draw(st.binary(min_size=size, max_size=size))
    at = data.draw(st.integers(0, size - 1))
    after = bytes(byte ^ (place == at) for place, byte in enumerate(before))
    fields = [name for name, bytes_ in request.layout for _ in range(bytes_)]
    names = changed_names(request, request.settings(before), request.settings(after), SettingNames())
    assert names == ((fields[at],) if fields[at] else ())


@given(request=st.sampled_from(REQUESTS), before=st.binary(max_size=60), after=st.binary(max_size=60))
def test_any_two_replies_are_compared(request: SettingsRequest, before: bytes, after: bytes) -> None:
    names = SettingNames(("ROLL", "PITCH"), ("ARM", "ANGLE"), {0: "ARM"})
    found = changed_names(request, before, after, names)
    assert len(found) == len(set(found))
    assert changed_names(request, before, before, names) == ()


def test_a_pid_is_named() -> None:
    names = SettingNames(("ROLL", "PITCH", "YAW"))
    assert changed_names(of(Firmware.HARAKIRI, Part.PIDS), bytes(9), bytes(3) + b"\1" + bytes(5), names) == ("PITCH",)


def test_a_range_that_only_moved_within_the_reply_is_no_change() -> None:
    request, names = of(Firmware.INAV, Part.MODES), SettingNames(boxes_by_id={0: "ARM", 1: "ANGLE"})
    arm, angle, unused = b"\0\1\x10\x20", b"\1\2\x08\x18", bytes(4)
    assert changed_names(request, arm + angle + unused, unused + angle + arm, names) == ()
    assert changed_names(request, arm + angle + unused, arm + unused + unused, names) == ("ANGLE",)
