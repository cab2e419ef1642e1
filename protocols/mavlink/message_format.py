# SPDX-License-Identifier: GPL-3.0-or-later
"""The properties of a message that framing and routing need."""

from typing import NamedTuple


class MessageFormat(NamedTuple):
    """The name, checksum seed and layout of one kind of message; sizes and places are in bytes of the payload.

    Sizes: `full_size` with extension fields; `base_size` without, as in MAVLink 1 (None: the id is above 255, so not in
    MAVLink 1). Places: None if the message has no such field.
    """

    name: str
    crc_extra: int
    base_size: int | None
    full_size: int
    target_system_at: int | None
    target_component_at: int | None
