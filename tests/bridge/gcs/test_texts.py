# SPDX-License-Identifier: GPL-3.0-or-later
"""A refusal is said once for each attempt."""

from bridge.gcs.texts import RecentTexts


def test_a_repeated_text_is_new_only_once() -> None:
    texts = RecentTexts()
    assert texts.is_new("armed", 0.0)
    # Each repetition begins the second again, as Mission Planner's seven do.
    assert not any(texts.is_new("armed", 0.7 * number) for number in range(1, 8))


def test_after_a_second_of_silence_it_is_a_new_attempt() -> None:
    texts = RecentTexts()
    assert [texts.is_new("armed", now) for now in (0.0, 0.9, 1.8, 2.9)] == [True, False, False, True]


def test_texts_do_not_hide_each_other() -> None:
    texts = RecentTexts()
    assert texts.is_new("armed", 0.0)
    assert texts.is_new("no link", 0.1)
    assert not texts.is_new("armed", 0.3)


def test_a_flood_of_texts_is_forgotten_oldest_first() -> None:
    texts = RecentTexts()
    for number in range(1000):
        texts.is_new(str(number), 0.0)
    assert not texts.is_new("999", 0.0)
    assert texts.is_new("0", 0.0)
