# SPDX-License-Identifier: GPL-3.0-or-later
"""A refusal is said once for each attempt."""

from bridge.gcs.recent_texts import RecentTexts
from bridge.gcs.station import Peer

ONE, OTHER = Peer("udp", "one"), Peer("udp", "other")


def test_a_repeated_text_is_new_only_once() -> None:
    texts = RecentTexts()
    assert texts.new_to([ONE, OTHER], "armed", 0.0) == [ONE, OTHER]
    # Each repetition begins the second again, as Mission Planner's seven do.
    for number in range(1, 8):
        assert texts.new_to([ONE], "armed", 0.7 * number) == []


def test_after_a_second_of_silence_it_is_a_new_attempt() -> None:
    texts = RecentTexts()
    texts.new_to([ONE], "armed", 0.0)
    texts.new_to([ONE], "armed", 0.9)
    assert texts.new_to([ONE], "armed", 1.8) == []
    assert texts.new_to([ONE], "armed", 2.9) == [ONE]


def test_texts_and_peers_do_not_hide_each_other() -> None:
    texts = RecentTexts()
    assert texts.new_to([ONE], "armed", 0.0) == [ONE]
    assert texts.new_to([ONE], "no link", 0.1) == [ONE]
    assert texts.new_to([OTHER], "armed", 0.2) == [OTHER]
    assert texts.new_to([ONE, OTHER], "armed", 0.3) == []


def test_a_text_that_is_repeated_does_not_keep_others() -> None:
    texts = RecentTexts()
    texts.new_to([ONE], "armed", 0.0)
    texts.new_to([ONE], "no link", 0.5)
    for number in range(1, 4):
        texts.new_to([ONE], "armed", 0.6 * number)
    assert texts.new_to([ONE], "no link", 1.9) == [ONE]


def test_a_flood_of_texts_is_forgotten_oldest_first() -> None:
    texts = RecentTexts()
    for number in range(1000):
        texts.new_to([ONE], str(number), 0.0)
    assert texts.new_to([ONE], "999", 0.0) == []
    assert texts.new_to([ONE], "0", 0.0) == [ONE]
    assert len(texts._sent) <= 258
