# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts about a flight controller that is missing, lost, or back: each once, in time, and none for a switch."""

from math import inf

from bridge.controllers import other
from bridge.fc.profile import FlightController
from bridge.vehicle.link_announcer import LinkAnnouncer
from bridge.voice.happening import Happening
from bridge.voice.sentences import IN_COMMAND_LINE

BOARD = FlightController(other.OTHER_MSP, "BTFL")


class Said:
    """An announcer at time 0, and its texts."""

    def __init__(self, trouble: Happening | None = None, *, was_found: bool = False) -> None:
        self.texts: list[str] = []
        self.announcer = LinkAnnouncer(self._say, lambda: trouble, 0.0, was_found=was_found)

    def _say(self, happening: Happening) -> None:
        self.texts.append(happening.text)

    def until(self, end: float) -> list[str]:
        """The texts of all ticks up to a time."""
        self.texts.clear()
        while self.announcer.due <= end:
            self.announcer.tick(self.announcer.due)
        return self.texts


def test_without_a_flight_controller_the_reason_is_repeated() -> None:
    said = Said()
    assert said.until(9.0) == []
    assert said.until(60.0) == ["No flight controller found: check power, wiring"] * 2
    assert Said(IN_COMMAND_LINE()).until(10.0) == ["Board in its CLI: type exit, or unplug it"]


def test_behind_a_wifi_adapter_there_is_no_wiring_to_check() -> None:
    texts: list[str] = []
    announcer = LinkAnnouncer(lambda said: texts.append(said.text), lambda: None, 0.0, is_wired=False)
    announcer.tick(announcer.due)
    assert (texts, announcer.why_unknown) == (
        ["No flight controller found: check power, Wi-Fi"],
        "no flight controller: check power, Wi-Fi",
    )


def test_a_loss_is_reported_with_its_age_and_its_end() -> None:
    said = Said()
    said.announcer.found(BOARD, 1.0)
    assert said.announcer.due == inf
    said.announcer.lost(20.0)
    assert said.announcer.why_unknown == ""
    assert said.until(32.0) == [f"Flight controller lost: silent for {age} s" for age in (3, 12)]
    assert said.announcer.why_unknown == "flight controller lost"
    said.announcer.found(BOARD, 34.0)
    assert said.texts[-1] == "Flight controller back after 14 s"
    assert said.announcer.why_unknown == ""


def test_a_short_silence_and_one_that_was_asked_for_are_no_loss() -> None:
    said = Said()
    said.announcer.found(BOARD, 1.0)
    said.announcer.lost(20.0)
    said.announcer.found(BOARD, 22.0)
    said.announcer.expect_silence(40.0)
    said.announcer.lost(30.0)
    assert said.until(39.0) == []
    assert said.until(40.0) == ["Flight controller lost: silent for 10 s"]


def test_after_a_restart_in_flight_a_missing_board_is_a_lost_one() -> None:
    assert Said(was_found=True).until(3.0) == ["Flight controller lost: silent for 3 s"]
