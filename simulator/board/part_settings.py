# SPDX-License-Identifier: GPL-3.0-or-later
"""PIDs, modes, rates and MISC of boards that lack a command to list their settings, from one boot to the next."""

from collections.abc import Mapping

from simulator.board.msp_sensors import MspCommand

_MODE_RANGES, _SET_MODE_RANGE, _RANGE_SIZE = 34, 35, 4
_SETTERS: dict[int, int] = {
    MspCommand.SET_PID: MspCommand.PID,
    MspCommand.SET_BOX: MspCommand.BOX,
    MspCommand.SET_RC_TUNING: MspCommand.RC_TUNING,
    MspCommand.SET_MISC: MspCommand.MISC,
}


class PartSettings:
    """`blank`: the replies of a board that was never saved. `eeprom`: outlives the board."""

    def __init__(self, blank: Mapping[int, bytes], eeprom: memoryview) -> None:
        self._eeprom = eeprom
        self._replies = dict(blank)
        at = 1
        for command, reply in blank.items() if eeprom[0] else ():
            self._replies[command] = bytes(eeprom[at : at + len(reply)])
            at += len(reply)

    def read(self, command: int) -> bytes | None:
        """The payload of a reply, or None for other commands."""
        return self._replies.get(command)

    def write(self, command: int, payload: bytes) -> bool:
        """Carry out a setter, even while armed. Returns False if it is another command, or the payload is too short."""
        if command == _SET_MODE_RANGE and _MODE_RANGES in self._replies:
            ranges = bytearray(self._replies[_MODE_RANGES])
            at = payload[0] * _RANGE_SIZE if len(payload) > _RANGE_SIZE else len(ranges)
            if at >= len(ranges):
                return False
            ranges[at : at + _RANGE_SIZE] = payload[1 : 1 + _RANGE_SIZE]
            self._replies[_MODE_RANGES] = bytes(ranges)
            return True
        held = self._replies.get(_SETTERS.get(command, -1))
        if held is None or len(payload) < len(held):
            return False
        self._replies[_SETTERS[command]] = payload[: len(held)]
        return True

    def save(self) -> None:
        """EEPROM_WRITE."""
        stored = b"\1" + b"".join(self._replies.values())
        self._eeprom[: len(stored)] = stored
