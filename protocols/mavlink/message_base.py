# SPDX-License-Identifier: GPL-3.0-or-later
"""The base of the message classes in messages.py. A field is an attribute."""

from collections.abc import Sequence
from struct import Struct
from typing import ClassVar


class MavlinkMessage:
    """A decoded or not yet packed message.

    `unpacker`: its payload, with the fields in the order in which they are sent. `places`: where the values of each
    field are in it, in the order of the constructor's arguments.
    """

    __slots__ = ()
    msgid: ClassVar[int]
    msgname: ClassVar[str]
    unpacker: ClassVar[Struct]
    places: ClassVar[Sequence[int | slice]]

    def get_type(self) -> str:
        return self.msgname

    def to_payload(self) -> bytes:
        """The payload with all extension fields. struct.error if a value does not fit its field."""
        raise NotImplementedError


def as_text(chars: bytes) -> str:
    """The text of a field of type char, which ends at its first zero."""
    return chars.partition(b"\0")[0].decode("ascii", "replace")
