# SPDX-License-Identifier: GPL-3.0-or-later

from collections.abc import Callable

from bridge.fc.fc_settings import NO_ANSWER, FcSettings, SettingRefusal, TableReading
from bridge.line.conversation import Conversation, Pause
from bridge.line.runner import Runner
from bridge.model.board_setting import BoardSetting, SettingTable, Value, table_of
from bridge.settings.table_reader import TableReader

TABLE = table_of()


class PausingSettings(FcSettings):
    """Three pauses of a second, then the result."""

    def __init__(self, result: SettingTable | None) -> None:
        self.result = result
        self.count = 0

    def read(self, previous: SettingTable | None, reading: TableReading) -> Conversation[SettingTable | None]:
        for count in (10, 20, 30):
            self.count = count
            yield Pause(1.0)
        return self.result

    def change(
        self, table: SettingTable, setting: BoardSetting, value: Value
    ) -> Conversation[SettingTable | SettingRefusal]:
        yield from ()
        return NO_ANSWER

    def save(self) -> Conversation[SettingRefusal | None]:
        yield from ()
        return NO_ANSWER


def reader(on_end: Callable[[SettingTable | None, float], None]) -> TableReader:
    return TableReader(Runner(lambda _effect: None), lambda _size: 0.0, lambda _now: None, on_end)


def test_the_line_is_free_between_two_requests() -> None:
    ends: list[SettingTable | None] = []
    reading, settings = reader(lambda table, _at: ends.append(table)), PausingSettings(TABLE)
    for number in range(1, 4):
        reading.read_on(settings, None, True, float(number))
        assert (reading.is_asking, settings.count, reading.next_at) == (False, 10 * number, number + 1)
    assert ends == []
    reading.read_on(settings, None, True, 4.0)
    assert ends == [TABLE]


def test_after_a_failure_it_waits_ever_longer_up_to_a_minute_until_another_board_is_found() -> None:
    now, waits = 0.0, []
    reading, settings = reader(lambda _table, _at: None), PausingSettings(None)
    for _ in range(10):
        for _ in range(4):
            reading.read_on(settings, None, True, now)
        waits.append(round(reading.next_at - now, 1))
        now = reading.next_at
    assert waits == [1.0, 1.2, 2.4, 4.8, 9.6, 19.2, 38.4, 60.0, 60.0, 60.0]
    reading.forget_failures()
    assert reading.next_at < now


def test_a_stopped_reading_begins_again() -> None:
    ends: list[SettingTable | None] = []
    reading, settings = reader(lambda table, _at: ends.append(table)), PausingSettings(TABLE)
    for now in (1.0, 2.0):
        reading.read_on(settings, None, True, now)
    reading.stop()
    reading.read_on(settings, None, True, 3.0)
    assert settings.count == 10
