# SPDX-License-Identifier: GPL-3.0-or-later
"""The navigation of an INAV or MultiWii in the words of INAV's OSD (osd.c, from NAV_STATUS), said when they change."""

from collections.abc import Mapping
from math import inf

from bridge.voice.happening import Sentence
from bridge.voice.sentences import EMERGENCY, NAVIGATION
from protocols.msp.nav import FINISHED, NavAction, NavMode, NavState, NavStatus

#: Legs may be shorter. The words of the last are said.
_INTERVAL_S = 2.0
#: With the current and the last item's number, as the ground station counts them.
_EN_ROUTE, _HOLDING = "TO WP {}/{}", "HOLDING WP {}/{}"
_WORDS: Mapping[int, str] = {
    NavState.RTH_START: "STARTING RTH",
    NavState.RTH_ENROUTE: "EN ROUTE TO HOME",
    NavState.LAND_IN_PROGRESS: "LANDING",
    NavState.LANDED: "LANDED",
    NavState.LAND_SETTLE: "PREPARING TO LAND",
    NavState.HOVER_ABOVE_HOME: "HOVERING",
    NavState.EMERGENCY_LANDING: "EMERGENCY LANDING",
    NavState.RTH_CLIMB: "ADJUSTING RTH ALTITUDE",
}


def nav_words(status: NavStatus, *, is_plane: bool) -> str:
    """The words, with two places for item numbers while a mission is flown, or "" if INAV's OSD has none."""
    if status.mode == NavMode.MISSION:
        if status.error == FINISHED:
            return "WP END>LANDED" if status.action == NavAction.LAND else "WP END>HOLDING POSITION"
        if status.state == NavState.WP_ENROUTE:
            return _EN_ROUTE
        if status.state == NavState.HOLD_TIMED:
            return _HOLDING
    if is_plane and status.state == NavState.HOVER_ABOVE_HOME:
        return "LOITERING AROUND HOME"
    return _WORDS.get(status.state, "")


def sentence_for(words: str) -> Sentence[str]:
    """With the severity of INAV's own MAVLink: NOTICE, and CRITICAL for words that blink."""
    return EMERGENCY if words == _WORDS[NavState.EMERGENCY_LANDING] else NAVIGATION


class NavWords:
    """Feed it every report."""

    def __init__(self) -> None:
        self._said: tuple[str, int] = "", 0
        self._said_at = -inf

    def changed(self, status: NavStatus | None, now: float, *, is_plane: bool) -> str:
        """The words to say now, or "" if they were said already, or too soon. status: None unless it flies."""
        words = "" if status is None else nav_words(status, is_plane=is_plane)
        said = words, status.number if status is not None and "{}" in words else 0
        if said == self._said or (words and now < self._said_at + _INTERVAL_S):
            return ""
        self._said = said
        if words:
            self._said_at = now
        return words
