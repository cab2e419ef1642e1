# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m generators.message_table`: print a new message_table.py from pymavlink's dialect `all`.

Checking a frame needs its message's CRC_EXTRA, so the table has every message that any flight controller may send.
Importing pymavlink's module of that dialect would cost the daemon 6 MB.

Where a smaller dialect (matrixpilot, paparazzi) reuses an id, `all` has the message of ardupilotmega, which includes
common. The smaller dialect's frames then look damaged and are dropped.
"""

import os
import struct
import sys

# pymavlink reads this at import time.
os.environ.setdefault("MAVLINK20", "1")

from pymavlink.dialects.v10 import all as mavlink_1
from pymavlink.dialects.v20 import all as mavlink_2

from protocols.mavlink.dialect import Message
from protocols.mavlink.message_format import MessageFormat

#: COMPONENT_METADATA is in common.xml, but not in pymavlink's `all`.
_MISSING = {397: ("COMPONENT_METADATA", MessageFormat(182, None, 108, None, None))}
_HEAD = '''# SPDX-License-Identifier: GPL-3.0-or-later
"""The format of every message that is known to MAVLink. Made by `make message-table`, not by hand."""

from protocols.mavlink.message_format import MessageFormat

#: By message id.
MESSAGE_FORMATS = {
'''


def table() -> str:
    known = {msgid: (message.msgname, _format(msgid, message)) for msgid, message in mavlink_2.mavlink_map.items()}
    rows = [_row(msgid, *entry) for msgid, entry in sorted({**_MISSING, **known}.items())]
    return f"{_HEAD}{''.join(rows)}}}\n"


def _row(msgid: int, name: str, form: MessageFormat) -> str:
    values = ", ".join(map(str, form))
    return f"    {msgid}: MessageFormat({values}),  # {name}\n"


def _format(msgid: int, message: Message) -> MessageFormat:
    base = mavlink_1.mavlink_map.get(msgid)
    places = _places(message)
    return MessageFormat(
        message.crc_extra,
        None if base is None else base.unpacker.size,
        message.unpacker.size,
        places.get("target_system"),
        places.get("target_component"),
    )


def _places(message: Message) -> dict[str, int]:
    """The offset of each field in the payload."""
    places: dict[str, int] = {}
    at = 0
    for name, kind, count in zip(
        message.ordered_fieldnames, message.native_format[1:], message.array_lengths, strict=True
    ):
        places[name] = at
        at += struct.calcsize(f"<{chr(kind)}") * max(1, count)
    assert at == message.unpacker.size, message.msgname
    return places


if __name__ == "__main__":
    sys.stdout.write(table())
