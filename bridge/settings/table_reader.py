# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a board's settings in the background: one request at a time, which leaves room for others on the line."""

from collections.abc import Callable
from dataclasses import dataclass

from bridge.fc.fc_settings import FcSettings, TableReading
from bridge.line.conversation import Conversation, LinkLost, Pause
from bridge.line.runner import Runner
from bridge.model.board_setting import SettingTable

#: After a failure; doubled after each further one.
_RETRY_S, _MOST_RETRY_S = 0.3, 60.0


@dataclass(eq=False)
class TableReader:
    """_pace: see TableReading. _on_pause: called between requests; _on_end: with the table, None after a failure."""

    _runner: Runner
    _pace: Callable[[int], float]
    _on_pause: Callable[[float], None]
    _on_end: Callable[[SettingTable | None, float], None]
    _reading: Conversation[SettingTable | None] | None = None
    _retry_s: float = _RETRY_S
    _retry_at: float = 0.0
    #: True while one of its requests is on the line.
    is_asking: bool = False
    #: When the line has carried the last request.
    line_free_at: float = 0.0

    @property
    def next_at(self) -> float:
        """The earliest time for the next request."""
        return max(self.line_free_at, self._retry_at)

    def read_on(self, fc_settings: FcSettings, previous: SettingTable | None, is_doubtful: bool, now: float) -> None:
        """Begin to read the table, or continue until the next pause. previous, is_doubtful: see FcSettings.read."""
        if self._reading is None:
            self._reading = fc_settings.read(previous, TableReading(self._pace, is_doubtful))
        reading, self.is_asking = self._reading, True

        def done(result: SettingTable | Pause | LinkLost | None, at: float) -> None:
            self.is_asking = False
            if self._reading is not reading:
                return
            if isinstance(result, Pause):
                self.line_free_at = at + result.seconds
                self._on_pause(at)
                return
            self.stop()
            if isinstance(result, SettingTable):
                self._retry_s = _RETRY_S
                self._on_end(result, at)
            else:
                self._retry_s = min(2 * self._retry_s, _MOST_RETRY_S)
                self._retry_at = at + self._retry_s
                self._on_end(None, at)

        self._runner.start(_up_to_pause(reading), done, now, in_background=True)

    def stop(self) -> None:
        """Forget the values read so far: they may be out of date."""
        if self._reading is not None and not self.is_asking:
            self._reading.close()
        self._reading = None

    def forget_failures(self) -> None:
        """Another board, or the same again."""
        self._retry_s, self._retry_at = _RETRY_S, 0.0


def _up_to_pause(conversation: Conversation[SettingTable | None]) -> Conversation[SettingTable | Pause | None]:
    """Go on with a conversation up to its next pause, or its end."""
    answer = None
    try:
        while not isinstance(effect := conversation.send(answer), Pause):
            answer = yield effect
    except StopIteration as end:
        table: SettingTable | None = end.value
        return table
    return effect
