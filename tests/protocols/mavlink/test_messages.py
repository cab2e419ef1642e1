# SPDX-License-Identifier: GPL-3.0-or-later
"""Our part of the dialect, compared with the whole: pymavlink packs and reads the same bytes."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v10 import ardupilotmega as mavlink_1
from pymavlink.dialects.v20 import ardupilotmega as mavlink_2

from generators.messages import module
from protocols.mavlink import messages
from protocols.mavlink.codec import FrameWriter, Packed, decode, pack
from protocols.mavlink.frame import MavlinkSplitter
from protocols.mavlink.message_base import MavlinkMessage

KINDS = pytest.mark.parametrize("kind", messages.KINDS.values(), ids=lambda kind: kind.msgname)
SIZES = {"8_t": 8, "16_t": 16, "32_t": 32, "64_t": 64}


def field_values(type_name: str, count: int) -> st.SearchStrategy[Any]:
    if type_name == "char":
        return st.binary(max_size=count)
    if type_name in ("float", "double"):
        one: st.SearchStrategy[Any] = st.floats(width=32 if type_name == "float" else 64)
    else:
        bits = next(bits for end, bits in SIZES.items() if type_name.removesuffix("_mavlink_version").endswith(end))
        low = 0 if type_name.startswith("u") else -(1 << bits - 1)
        one = st.integers(low, low + (1 << bits) - 1)
    return st.lists(one, min_size=count, max_size=count) if count else one


def arguments(kind: Any) -> st.SearchStrategy[tuple[Any, ...]]:
    """Values for the constructor of one of pymavlink's classes."""
    counts = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    types = zip(kind.fieldnames, kind.fieldtypes, strict=True)
    return st.tuples(*(field_values(type_name, counts[name]) for name, type_name in types))


def fields(kind: Any, message: Any) -> dict[str, str]:
    """By name; as text, because NaN does not equal NaN."""
    values = {name: getattr(message, name) for name in kind.fieldnames}
    return {name: repr(list(value) if isinstance(value, tuple) else value) for name, value in values.items()}


def test_the_module_is_up_to_date() -> None:
    """After a use of another name, and after an update of pymavlink, run `make messages`."""
    assert Path(messages.__file__).read_text() == module()


@KINDS
@settings(max_examples=20)
@given(data=st.data())
def test_our_frames_are_those_of_pymavlink(kind: type[MavlinkMessage], data: st.DataObject) -> None:
    theirs = mavlink_2.mavlink_map[kind.msgid]
    values = data.draw(arguments(theirs))
    packed = pack(kind(*values))
    frame = bytes(theirs(*values).pack(mavlink_2.MAVLink(None, srcSystem=1, srcComponent=1)))
    assert FrameWriter(1, 1).frame(packed, 2) == frame
    (found,) = MavlinkSplitter().feed(frame)
    read, expected = decode(found.msgid, found.payload), mavlink_2.MAVLink(None).decode(bytearray(frame))
    assert read is not None
    assert (read.get_type(), fields(theirs, read)) == (expected.get_type(), fields(theirs, expected))
    if (older := mavlink_1.mavlink_map.get(kind.msgid)) is not None:
        sender = mavlink_1.MAVLink(None, srcSystem=1, srcComponent=1)
        assert FrameWriter(1, 1).frame(packed, 1) == bytes(older(*values[: len(older.fieldnames)]).pack(sender))


@KINDS
@settings(max_examples=20)
@given(payload=st.binary(min_size=1, max_size=255))
def test_any_payload_is_read_as_by_pymavlink(kind: type[MavlinkMessage], payload: bytes) -> None:
    """Shorter, because MAVLink 2 omits trailing zeros, or longer, with the fields of a newer dialect."""
    theirs = mavlink_2.mavlink_map[kind.msgid]
    (frame,) = MavlinkSplitter().feed(FrameWriter(1, 1).frame(Packed(kind.msgid, payload, payload), 2))
    read, expected = decode(frame.msgid, frame.payload), mavlink_2.MAVLink(None).decode(bytearray(frame.raw))
    assert fields(theirs, read) == fields(theirs, expected)


@KINDS
def test_omitted_extension_fields_have_the_same_values(kind: type[MavlinkMessage]) -> None:
    theirs = mavlink_2.mavlink_map[kind.msgid]
    assert kind.__init__.__defaults__ == theirs.__init__.__defaults__


def test_the_constants_are_those_of_pymavlink() -> None:
    constants = {name: value for name, value in vars(messages).items() if isinstance(value, int)}
    assert len(constants) > 100
    assert constants == {name: getattr(mavlink_2, name) for name in constants}
