# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m generators.message_table`: print a new message_table.py from pymavlink's dialect `all`.

Checking a frame needs its message's CRC_EXTRA, so every message must be known that any flight controller may send.

Where a smaller dialect (matrixpilot, paparazzi) reuses an id, `all` has the message of ardupilotmega, which includes
common. The smaller dialect's frames then look damaged and are dropped.
"""

import struct
import sys
from typing import Any

from pymavlink.dialects.v10 import all as mavlink_1
from pymavlink.dialects.v20 import all as mavlink_2

from protocols.mavlink.message_format import MessageFormat

#: COMPONENT_METADATA is in common.xml, but not in pymavlink's `all`.
_MISSING = {397: MessageFormat("COMPONENT_METADATA", 182, None, 108, None, None)}
_HEAD = '''# SPDX-License-Identifier: GPL-3.0-or-later
"""The format of every message that is known to MAVLink. Made by `make messages` from pymavlink, not by hand."""

from protocols.mavlink.message_format import MessageFormat

#: By message id.
MESSAGE_FORMATS = {
'''


def table() -> str:
    bases = {msgid: int(kind.unpacker.size) for msgid, kind in mavlink_1.mavlink_map.items()}
    known = {msgid: _format(kind, bases.get(msgid)) for msgid, kind in mavlink_2.mavlink_map.items()}
    rows = (_row(msgid, form) for msgid, form in sorted({**_MISSING, **known}.items()))
    return f"{_HEAD}{''.join(rows)}}}\n"


def _row(msgid: int, form: MessageFormat) -> str:
    values = ", ".join(map(str, form[1:]))
    return f'    {msgid}: MessageFormat("{form.name}", {values}),\n'


def _format(kind: Any, base_size: int | None) -> MessageFormat:
    """The format of one of pymavlink's classes, which do not say where the extension fields begin."""
    places: dict[str, int] = {}
    if "target_system" in kind.fieldnames:
        at = 0
        for name, letter, count in zip(
            kind.ordered_fieldnames, kind.native_format[1:], kind.array_lengths, strict=True
        ):
            places[name] = at
            at += struct.calcsize(f"<{chr(letter)}") * max(1, count)
    system_at, component_at = places.get("target_system"), places.get("target_component")
    return MessageFormat(kind.msgname, kind.crc_extra, base_size, kind.unpacker.size, system_at, component_at)


if __name__ == "__main__":
    sys.stdout.write(table())
