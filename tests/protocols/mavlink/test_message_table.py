# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of message formats, compared with pymavlink's dialects and with frames packed by pymavlink."""

from importlib import import_module
from pathlib import Path

import pytest
from pymavlink.dialects.v10 import all as mavlink_1
from pymavlink.dialects.v20 import all as mavlink_2

from generators.message_table import table
from protocols.mavlink import message_table
from protocols.mavlink.dialect import MESSAGE_FORMATS, Message
from protocols.mavlink.frame import MavlinkSplitter

#: Dialects of autopilots that users may have, in order of precedence for an id.
DIALECTS = ("common", "ardupilotmega", "all")


def packed(kind: type[Message], version: int, **fields: int) -> bytes:
    """Let pymavlink pack a message whose other fields are zero."""
    counts = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    values: list[object] = []
    for name, type_name in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        count = counts[name]
        empty = bytes(count or 1) if type_name == "char" else [0] * count if count else 0
        values.append(fields.get(name, empty))
    sender = mavlink_2.MAVLink(None, srcSystem=7, srcComponent=8)
    return bytes(kind(*values).pack(sender, force_mavlink1=version == 1))


def test_the_table_is_up_to_date() -> None:
    """After an update of pymavlink, run `make messages`."""
    assert Path(message_table.__file__).read_text() == table()


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
            raw = packed(kind, version, target_system=system, target_component=component)
            (frame,) = MavlinkSplitter().feed(raw)
            assert (frame.raw, frame.version, frame.sysid, frame.compid, frame.msgid) == (raw, version, 7, 8, kind.id)
            named = (
                system if "target_system" in kind.fieldnames else 0,
                component if "target_component" in kind.fieldnames else 0,
            )
            assert frame.target == named, kind.msgname


def test_a_mavlink_1_frame_without_extensions_has_no_target_in_them() -> None:
    """COMMAND_ACK's target is an extension, which MAVLink 1 cannot carry."""
    ack = mavlink_1.MAVLink_command_ack_message(400, 0)
    raw = bytes(ack.pack(mavlink_1.MAVLink(None, srcSystem=7, srcComponent=8)))
    (frame,) = MavlinkSplitter().feed(raw)
    assert frame.target == (0, 0)
