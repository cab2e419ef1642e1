# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's own parameters over MAVLink: the CLI's settings (baseflight_mavlink_send_paramlist, _set_param).

PARAM_REQUEST_LIST alone is answered, one value in a slot of the stream. PARAM_SET changes every setting whose name the
given one begins with, and schedules a write of the configuration. The patch ignores it while armed. There is no
PARAM_REQUEST_READ.
"""

from collections.abc import Callable

from protocols.mavlink.codec import Packed, decode, pack
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from simulator.naze.missions import Board
from simulator.naze.settings_commands import CRASHING, SettingsCommands

_LONGEST_NAME = 16
_REAL32 = 9
_WRITE_DELAY_S = 0.5


class Parameters:
    """One boot's list. `send` packs and sends a message. `is_listing`: until the list ends, MSP is not answered."""

    def __init__(
        self,
        board: Board,
        settings: SettingsCommands,
        can_set: Callable[[], bool],
        send: Callable[[Packed], None],
    ) -> None:
        self._board = board
        self._settings = settings
        self._can_set = can_set
        self._send = send
        self._next = 0
        self.is_listing = False

    def reset(self) -> None:
        """Abort the list, as each end of a mission transfer does (reset_mavlink)."""
        self._next, self.is_listing = 0, False

    def take(self, frame: MavlinkFrame, now: float) -> None:
        match frame.msgid:
            case m.MAVLINK_MSG_ID_PARAM_REQUEST_LIST:
                self.is_listing = True
            case m.MAVLINK_MSG_ID_PARAM_SET if message := decode(frame):
                if self._can_set() and self._set(message.param_id, message.param_value):
                    self._board.config_write_due = now + _WRITE_DELAY_S

    def send_next(self) -> None:
        """Send the next value of the list."""
        self._send_value(self._next)
        self._next += 1
        if self._next == len(self._settings.table):
            self.reset()

    def _send_value(self, index: int, name: str | None = None) -> None:
        setting, value = self._settings.table[index]
        name = name or setting.name[:_LONGEST_NAME]
        count = len(self._settings.table)
        self._send(pack(m.MAVLink_param_value_message(name.encode(), value, _REAL32, count, index)))

    def _set(self, name: str, value: float) -> bool:
        """True if a setting has changed. An out-of-range value ends the search."""
        has_changed = False
        for index, (setting, held) in enumerate(self._settings.table):
            if name.startswith(setting.name[:_LONGEST_NAME]):
                if not setting.minimum <= value <= setting.maximum:
                    return False
                self._board.faults.hang |= setting.name in CRASHING and value != held
                self._settings.change(index, setting.unpack(setting.pack(value)))
                self._send_value(index, name)
                has_changed = True
        return has_changed
