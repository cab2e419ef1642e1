# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole table of sentences, for each kind of ground station, with the longest values."""

from collections import Counter
from string import Formatter

import pytest

from bridge.voice.happening import Happening, Severity
from bridge.voice.sentences import prearm_lines, settings_changed, table
from bridge.voice.stations import Kind, pieces, rendered

TABLE = table()
#: Sentences of the mission rules, whose whole text goes to the Messages tab first.
FREE = {"REJECTED", "DANGER"}


def longest(name: str) -> Happening:
    return Happening(TABLE[name], TABLE[name].longest)


@pytest.mark.parametrize("kind", Kind)
def test_every_sentence_fits_a_hud_and_is_shown_completely(kind: Kind) -> None:
    for name, sentence in TABLE.items():
        texts = rendered(longest(name), kind)
        for severity, text in texts:
            assert text.isascii(), text
            assert len(text) <= 50 or (severity > 4 and not text.startswith("PreArm")), text
            # Values are not cut, except a name in its middle.
            assert name in FREE or not text.endswith(".."), text
        # The HUD keeps the last text, and the Messages tab has each once. QGroundControl has dialogs of its own.
        severity = longest(name).severity
        is_banner = kind is Kind.QGROUNDCONTROL and severity is Severity.ERROR
        is_warning = is_banner or texts[-1][1] == sentence.planner
        assert texts[-1][0] is (Severity.WARNING if is_warning else severity), name
        assert len(set(texts)) == len(texts), name
        # Another text has the values that a HUD's line lacks. The short list of names stands for the long one.
        said = " ".join(text for _, text in texts)
        missing = [value for value in sentence.longest if isinstance(value, str) and value not in said]
        assert missing in ([], [TABLE["SETTINGS_CHANGED"].longest[1]]), name


def test_only_a_failure_begins_with_prearm_on_other_stations_than_mission_planner() -> None:
    """QGroundControl shows each as a failed check for 35 s."""
    for kind in Kind:
        failures = {name for name in TABLE if rendered(longest(name), kind)[-1][1].startswith("PreArm")}
        assert failures == {"NOT_READY"} | ({"READY"} if kind is Kind.MISSION_PLANNER else set())


def test_an_unsupported_command_is_not_a_failed_check() -> None:
    """QGroundControl takes a text that begins with "preflight" as one."""
    happening = Happening(TABLE["NO_EFFECT"], ("PREFLIGHT_CALIBRATION",))
    for kind in Kind:
        assert [text for _, text in rendered(happening, kind)] == ["Not supported: PREFLIGHT_CALIBRATION"]


def test_texts_in_the_table_are_unique() -> None:
    texts = Counter((sentence.severity, sentence.text) for sentence in TABLE.values() if sentence.text != "{}")
    assert [text for text, count in texts.items() if count > 1] == []


def test_the_longest_values_are_those_of_the_text() -> None:
    for name, sentence in TABLE.items():
        for text in (sentence.text, sentence.short):
            fields = [field for _, field, _, _ in Formatter().parse(text) if field is not None]
            assert all(not field or int(field) < len(sentence.longest) for field in fields), name
            assert "" not in fields or len(fields) == len(sentence.longest), name


@pytest.mark.parametrize("kind", Kind)
def test_a_long_text_is_whole_again_when_the_pieces_are_joined(kind: Kind) -> None:
    text = "19 items: Delay changed from 3 to 1 (0 = fly through, 1 = brake; to hold use LOITER_TIME) and so on"
    for each in (text, "short", "x" * 50, "x" * 51, "word " * 40, "a" * 120 + " b", "y" * 50 + " z", ""):
        *begun, last = pieces(each, kind)
        joined = "".join([*begun, last])
        assert "".join(joined.split()) == "".join(each.split())
        assert kind is not Kind.MAVSDK or joined == each
        # A receiver that joins pieces expects another one after a piece of 50 characters.
        assert {len(piece) for piece in begun} <= {50}
        assert len(last) <= (49 if begun else 50)
    assert "".join(pieces(text, kind)).split() == text.split()


def test_bad_news_is_worse_than_a_notice() -> None:
    assert {sentence.severity for sentence in TABLE.values() if sentence.lasts} <= {Severity.ERROR, Severity.WARNING}


def test_reasons_not_to_arm_share_lines() -> None:
    reasons = "not level", "no RC link", "accelerometer not calibrated", "compass not calibrated", "system overloaded"
    lines = [line.line for line in prearm_lines(reasons)]
    assert lines == [
        "PreArm: not level, no RC link",
        "PreArm: accelerometer not calibrated",
        "PreArm: compass not calibrated, system overloaded",
    ]
    assert prearm_lines(()) == []


def test_a_setting_name_is_shortened_in_the_middle() -> None:
    line = TABLE["REFUSED_BY_BOARD"]("osd_mah_remaining_precision_and_more", "-1.234567e+30").line
    assert line == "osd_mah_rem..n_and_more stays -1.234567e+30: refused"[: len(line)] or len(line) <= 50
    assert settings_changed(("p_roll",)).line == "Settings changed elsewhere: p_roll"
