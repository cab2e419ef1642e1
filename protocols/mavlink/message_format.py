# SPDX-License-Identifier: GPL-3.0-or-later
"""What framing and routing must know of a message: nothing of its meaning."""

from typing import NamedTuple


class MessageFormat(NamedTuple):
    """How one kind of message is checked and measured; sizes and places are bytes of the payload.

    Sizes: `full_size` with extension fields; `base_size` without, which is what MAVLink 1 carries (None: it cannot,
    the id is above 255). Places: None if the message has no such field.
    """

    crc_extra: int
    base_size: int | None
    full_size: int
    target_system_at: int | None
    target_component_at: int | None
