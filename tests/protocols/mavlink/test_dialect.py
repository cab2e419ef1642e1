# SPDX-License-Identifier: GPL-3.0-or-later
"""The formats of all messages, compared with pymavlink's dialects and with frames packed by pymavlink."""

import subprocess
import sys
from importlib import import_module

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v10 import all as mavlink_1
from pymavlink.dialects.v20 import all as mavlink_2

from protocols.mavlink.codec import FrameWriter, decode, pack
from protocols.mavlink.dialect import MESSAGE_FORMATS, Message
from protocols.mavlink.frame import MavlinkSplitter

#: Dialects of autopilots that users may have, in order of precedence for an id.
DIALECTS = ("common", "ardupilotmega", "all")


def message_of(kind: type[Message], fill: int = 0, **fields: int) -> Message:
    """A message whose other fields have the value `fill`."""
    counts = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    values: list[object] = []
    for name, type_name in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        count = counts[name]
        filled = bytes([fill]) * (count or 1) if type_name == "char" else [fill] * count if count else fill
        values.append(fields.get(name, filled))
    return kind(*values)


def packed(message: Message, version: int) -> bytes:
    """Let pymavlink pack a message."""
    sender = mavlink_2.MAVLink(None, srcSystem=7, srcComponent=8)
    return bytes(message.pack(sender, force_mavlink1=version == 1))


@pytest.mark.parametrize("dialect", DIALECTS)
def test_every_message_of_the_dialect_is_known(dialect: str) -> None:
    kinds = import_module(f"pymavlink.dialects.v20.{dialect}").mavlink_map
    assert len(kinds) > 200
    for msgid, kind in kinds.items():
        assert MESSAGE_FORMATS[msgid].crc_extra == kind.crc_extra, kind.msgname
    for msgid, kind in import_module(f"pymavlink.dialects.v10.{dialect}").mavlink_map.items():
        assert MESSAGE_FORMATS[msgid].base_size == kind.unpacker.size, kind.msgname


@pytest.mark.parametrize("version", [1, 2])
def test_frames_of_all_messages_are_found_with_their_targets(version: int) -> None:
    kinds = [kind for msgid, kind in mavlink_2.mavlink_map.items() if version == 2 or msgid < 256]
    for kind in kinds:
        for system, component in ((0, 0), (3, 0), (0, 200), (255, 190)):
            raw = packed(message_of(kind, target_system=system, target_component=component), version)
            (frame,) = MavlinkSplitter().feed(raw)
            assert (frame.raw, frame.version, frame.sysid, frame.compid, frame.msgid) == (raw, version, 7, 8, kind.id)
            named = (
                system if "target_system" in kind.fieldnames else 0,
                component if "target_component" in kind.fieldnames else 0,
            )
            assert frame.target == named, kind.msgname


def test_a_mavlink_1_frame_without_extensions_lacks_their_target() -> None:
    """COMMAND_ACK's target is an extension, which MAVLink 1 cannot carry."""
    ack = mavlink_1.MAVLink_command_ack_message(400, 0)
    raw = bytes(ack.pack(mavlink_1.MAVLink(None, srcSystem=7, srcComponent=8)))
    (frame,) = MavlinkSplitter().feed(raw)
    assert frame.target == (0, 0)


@given(st.sampled_from(sorted(mavlink_2.mavlink_map)), st.integers(0, 127))
def test_our_frames_of_all_messages_are_those_of_pymavlink(msgid: int, fill: int) -> None:
    message = message_of(mavlink_2.mavlink_map[msgid], fill)
    frame = FrameWriter(7, 8).frame(pack(message), 2)
    assert frame == packed(message, 2)
    (found,) = MavlinkSplitter().feed(frame)
    read = decode(found)
    assert read is not None
    assert read.to_dict() == mavlink_2.MAVLink(None).decode(bytearray(frame)).to_dict()
    if (older := mavlink_1.mavlink_map.get(msgid)) is not None:
        without_extensions = message_of(older, fill).pack(mavlink_1.MAVLink(None, srcSystem=7, srcComponent=8))
        assert FrameWriter(7, 8).frame(pack(message), 1) == without_extensions


def test_importing_pymavlink_has_no_side_effects() -> None:
    """mavutil would set environment variables, and load numpy and a second dialect."""
    program = "import os, sys; before = {**os.environ}; import protocols.mavlink.codec; print(*sys.modules)"
    program += "; assert before == {**os.environ}"
    printed = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    imported = {*printed.split()}
    dialects = {name for name in imported if name.startswith("pymavlink.")}
    assert dialects == {"pymavlink.dialects", "pymavlink.dialects.v20", "pymavlink.dialects.v20.all"}
    assert not {"lxml", "numpy"} & imported
