# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of ground stations, known by how they behave, and what each is sent for a happening. Sans-IO.

Mission Planner shows the last text of severity WARNING or worse for 10 s, or until a SYS_STATUS with an unhealthy
sensor, and each piece of a longer text alone. QGroundControl (commit c15cc3204, Vehicle::_textMessageReceived) takes
every text that begins with PreArm for a failure, and reads NOTICE and worse aloud. An ERROR is a banner over the map
that hides the next until the pilot closes it (_errorMessageReceived), beside the dialog by which it shows each
refused command, mission transfer and parameter itself (showCommandAckError, _missionManagerError,
ParameterManager::_mavlinkParamSet).
"""

from dataclasses import dataclass
from enum import Enum
from itertools import count
from math import inf
from textwrap import wrap

from bridge.voice.happening import LINE_LENGTH, Happening, Severity
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m

#: A station's own id of the component that controls vehicles: Mission Planner's, QGroundControl's and MAVSDK's.
_GROUND_STATION = 190
#: base_mode in QGroundControl's heartbeat (MultiVehicleManager::_sendGCSHeartbeat); others send 0.
_MODE_OF_QGC = 192
#: Mission Planner's Resume Mission repeats a refused command every second, for 30 s. A pilot who tries again gets the
#: reason again.
_ATTEMPT_S = 1.5
#: Bad news is repeated this often, right after a SYS_STATUS if there is one by then.
_AGAIN_S, _AT_LAST_S = 2.0, 3.5
_MOST_TIMES = 5
#: Without an answer to wait for, or if SYS_STATUS replaces the line on the HUD.
_TIMES = 3
#: For one station.
_MOST_OPEN = 8


class Kind(Enum):
    """A kind of ground station. answers: it answers PING or TIMESYNC."""

    def __init__(self, title: str, answers: bool) -> None:
        self.title, self.answers = title, answers

    MISSION_PLANNER = "Mission Planner", True
    QGROUNDCONTROL = "QGroundControl", True
    MAVSDK = "MAVSDK", True
    MAVPROXY = "MAVProxy", False
    UNKNOWN = "", False


@dataclass(slots=True)
class Behaviour:
    """The messages by which a station shows what it is. compid: of the last sender. base_mode: in its heartbeat."""

    streams: bool = False
    commands: bool = False
    speaks_v2: bool = False
    compid: int = 0
    base_mode: int = 0

    @property
    def kind(self) -> Kind:
        if self.base_mode == _MODE_OF_QGC:
            return Kind.QGROUNDCONTROL
        if self.streams:
            return Kind.MISSION_PLANNER if self.compid == _GROUND_STATION else Kind.MAVPROXY
        # It requests messages only by commands, in MAVLink 2.
        return Kind.MAVSDK if self.commands and self.speaks_v2 else Kind.UNKNOWN


def rendered(happening: Happening, kind: Kind) -> list[tuple[Severity, str]]:
    """The texts for a kind of station, with their severities. On a HUD only the last stays."""
    sentence, severity, whole = happening.sentence, happening.severity, happening.text
    if kind is Kind.MISSION_PLANNER and sentence.planner:
        # Its HUD would show a PreArm text of a lower severity in red, like an emergency.
        return [(Severity.WARNING, sentence.planner)]
    if severity > Severity.WARNING:
        return [(severity, whole)]
    if kind is Kind.QGROUNDCONTROL and severity is Severity.ERROR:
        # It shows the refusal in a dialog.
        severity = Severity.WARNING
    # The Messages tab has what the line lacks.
    line = happening.line
    is_cut = any(isinstance(value, str) and value not in line for value in happening.values)
    return [(Severity.INFO, whole)] * is_cut + [(severity, line)]


def pieces(text: str, kind: Kind) -> list[str]:
    """A text in pieces of 50 characters. The last is shorter, which ends the text for clients that join pieces.

    MAVSDK joins them without a separator. Others show each alone: they are split at spaces, and padded.
    """
    if len(text) <= LINE_LENGTH:
        return [text]
    if kind is Kind.MAVSDK:
        return [text[at : at + LINE_LENGTH] for at in range(0, len(text) + 1, LINE_LENGTH)]
    *found, last = wrap(text, LINE_LENGTH - 1)
    return [*(piece.ljust(LINE_LENGTH) for piece in found), last]


@dataclass(slots=True)
class _Open:
    """Bad news that may not have arrived. nonce: of the question that was last sent with it."""

    happening: Happening
    said_at: float
    times: int = 0
    nonce: int = 0
    has_arrived: bool = False


class BadNews:
    """What the pilot of one station must not miss: refusals, and sentences that last.

    It is repeated until an answer to a question in the same datagram shows that it arrived, or the pilot tries again.
    """

    def __init__(self) -> None:
        self._attempts: dict[tuple[bool, str], float] = {}
        self._open: list[_Open] = []
        self._nonces = count(1)
        #: SYS_STATUS has replaced the line on Mission Planner's HUD.
        self.is_replaced = False

    @property
    def due(self) -> float:
        """The time to repeat bad news even without a SYS_STATUS."""
        return min((news.said_at + _AT_LAST_S for news in self._open), default=inf)

    def is_repeated(self, happening: Happening, now: float, *, is_routine: bool) -> bool:
        """True if the station has already got this reason for this attempt: stations repeat their requests.

        A routine request of the program is another attempt than the pilot's.
        """
        key = is_routine, happening.text
        self._attempts = {each: at for each, at in self._attempts.items() if now < at + _ATTEMPT_S}
        is_repeated = key in self._attempts
        self._attempts[key] = now
        return is_repeated

    def said(self, happening: Happening, kind: Kind, now: float) -> Message | None:
        """Note a refusal, or a sentence that lasts, which is being sent. Returns the question to send with it."""
        if not happening.sentence.lasts and not kind.answers:
            return None
        news = _Open(happening, now)
        self._open = [*(each for each in self._open if each.happening != happening), news][-_MOST_OPEN:]
        self.is_replaced = False
        return self._ask(news, kind)

    def _ask(self, news: _Open, kind: Kind) -> Message | None:
        news.times += 1
        news.nonce = next(self._nonces)
        if kind is Kind.MISSION_PLANNER:
            return m.MAVLink_timesync_message(0, news.nonce)
        return m.MAVLink_ping_message(news.nonce, 0, 0, 0) if kind.answers else None

    def answered(self, nonce: int) -> None:
        for news in self._open:
            news.has_arrived |= news.nonce == nonce

    def forget(self) -> None:
        """The pilot writes again, so knows about the last mission."""
        self._open = [news for news in self._open if not news.happening.sentence.lasts]

    def again(self, kind: Kind, now: float) -> list[tuple[Happening, Message | None]]:
        """The happenings to send again, each with its question."""
        due = [news for news in self._open if now >= news.said_at + _AGAIN_S]
        done = [news for news in due if news.times >= self._least(news, kind)]
        self._open = [news for news in self._open if news not in done]
        again = [news for news in due if news not in done]
        for news in again:
            news.said_at = now
        return [(news.happening, self._ask(news, kind)) for news in again]

    def _least(self, news: _Open, kind: Kind) -> int:
        """How often it must be sent at least."""
        if not kind.answers:
            return _TIMES
        if not news.has_arrived:
            return _MOST_TIMES
        is_hidden = self.is_replaced and kind is Kind.MISSION_PLANNER and news.happening.sentence.lasts
        return _TIMES if is_hidden else 1
