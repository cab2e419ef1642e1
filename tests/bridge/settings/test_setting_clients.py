# SPDX-License-Identifier: GPL-3.0-or-later

from bridge.fc.fc_settings import NO_ANSWER, SettingRefusal
from bridge.model.board_setting import SettingTable, table_of
from bridge.settings.setting_clients import Change, Changes, TableClients


def change(value: float, client: str) -> Change:
    return Change("p_roll", value, client, lambda _result, _at: None)


def test_changes_are_bounded_for_each_client_and_for_all() -> None:
    changes = Changes()
    taken = dict.fromkeys("abcdefghij", 0)
    for client in taken:
        for value in range(20):
            if changes.has_room_for(change(value, client)):
                changes.append(change(value, client))
                taken[client] += 1
    assert list(taken.values()) == [8] * 8 + [0, 0]


def test_a_client_that_repeats_itself_is_recognised() -> None:
    changes = Changes((change(1, "a"),))
    assert [each in changes for each in (change(1, "a"), change(2, "a"), change(1, "b"))] == [True, False, False]


def test_the_late_are_answered_first_and_the_others_with_the_table() -> None:
    clients, answers = TableClients(), list[tuple[str, SettingTable | SettingRefusal]]()
    clients.add(5.0, lambda answer, _at: answers.append(("early", answer)))
    clients.add(9.0, lambda answer, _at: answers.append(("late", answer)))
    clients.answer(NO_ANSWER, 6.0, if_late=True)
    table = table_of()
    clients.answer(table, 7.0)
    clients.answer(table, 8.0)
    assert answers == [("early", NO_ANSWER), ("late", table)]
