# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m generators.message_table`: print a new message_table.py from pymavlink's dialect `all`.

Checking a frame needs its message's CRC_EXTRA, so every message must be known that any flight controller may send. The
table has what the dialect that the daemon imports lacks: importing `all`, too, would cost the daemon 6 MB.

Where a smaller dialect (matrixpilot, paparazzi) reuses an id, `all` has the message of ardupilotmega, which includes
common. The smaller dialect's frames then look damaged and are dropped.
"""

import os
import sys

# pymavlink reads this at import time.
os.environ.setdefault("MAVLINK20", "1")

from pymavlink.dialects.v10 import all as mavlink_1
from pymavlink.dialects.v20 import all as mavlink_2

from protocols.mavlink.dialect import message_format, messages
from protocols.mavlink.message_format import MessageFormat

#: COMPONENT_METADATA is in common.xml, but not in pymavlink's `all`.
_MISSING = {397: ("COMPONENT_METADATA", MessageFormat(182, None, 108, None, None))}
_HEAD = '''# SPDX-License-Identifier: GPL-3.0-or-later
"""Facts about messages that pymavlink's ardupilotmega dialect lacks. Made by `make message-table`, not by hand."""

from protocols.mavlink.message_format import MessageFormat

'''


def table() -> str:
    names = {msgid: str(kind.msgname) for msgid, kind in mavlink_2.mavlink_map.items()}
    bases = {msgid: int(kind.unpacker.size) for msgid, kind in mavlink_1.mavlink_map.items()}
    kinds = mavlink_2.mavlink_map.items()
    known = {msgid: message_format(kind, bases.get(msgid)) for msgid, kind in kinds}
    others = {msgid: (names[msgid], form) for msgid, form in known.items() if msgid not in messages.mavlink_map}
    rows = [
        "#: The size in MAVLink 1, by message id, of the dialect's messages that have extension fields in MAVLink 2.\n",
        "BASE_SIZES = {\n",
        *(
            f"    {msgid}: {form.base_size},  # {names[msgid]}\n"
            for msgid, form in sorted(known.items())
            if msgid in messages.mavlink_map and form.base_size not in (None, form.full_size)
        ),
        "}\n#: Messages of other dialects, by message id.\nOTHER_FORMATS = {\n",
        *(
            f"    {msgid}: MessageFormat({', '.join(map(str, form))}),  # {name}\n"
            for msgid, (name, form) in sorted({**_MISSING, **others}.items())
        ),
        "}\n",
    ]
    return _HEAD + "".join(rows)


if __name__ == "__main__":
    sys.stdout.write(table())
