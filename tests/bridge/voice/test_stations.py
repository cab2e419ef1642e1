# SPDX-License-Identifier: GPL-3.0-or-later
"""Kinds of ground stations by their behaviour, and bad news, which is repeated until it has arrived."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.voice import sentences
from bridge.voice.happening import Happening
from bridge.voice.stations import BadNews, Behaviour, Kind
from protocols.mavlink.dialect import Message
from tests.support.world import GroundStation, World

MISSING = sentences.ITEMS_MISSING(3, 35)
ARMED = sentences.ARMED()


@pytest.mark.parametrize(
    ("behaviour", "kind"),
    [
        (Behaviour(), Kind.UNKNOWN),
        (Behaviour(streams=True, compid=190), Kind.MISSION_PLANNER),
        (Behaviour(streams=True, commands=True, speaks_v2=True, compid=190), Kind.MISSION_PLANNER),
        (Behaviour(streams=True, base_mode=192, compid=190), Kind.QGROUNDCONTROL),
        (Behaviour(streams=True, compid=230), Kind.MAVPROXY),
        (Behaviour(commands=True, speaks_v2=True, compid=190), Kind.MAVSDK),
        (Behaviour(commands=True, compid=0), Kind.UNKNOWN),
    ],
)
def test_a_kind_is_known_by_the_behaviour(behaviour: Behaviour, kind: Kind) -> None:
    assert behaviour.kind is kind


def heard(kind: Kind, happening: Happening, *, answers: bool = False, is_replaced: bool = False) -> int:
    """How often a station gets a happening within two minutes."""
    news = BadNews()
    question = news.said(happening, kind, 0.0)
    news.is_replaced = is_replaced
    times = 1
    for second in range(1, 120):
        if answers and question is not None:
            news.answered(nonce_of(question))
        for _, again in news.again(kind, second):
            question = again
            times += 1
    return times


def nonce_of(question: Message) -> int:
    is_timesync = question.get_type() == "TIMESYNC"
    assert not is_timesync or question.tc1 == 0, "another number is an answer"
    number = question.ts1 if is_timesync else question.time_usec
    assert isinstance(number, int)
    return number


@pytest.mark.parametrize("kind", [Kind.MISSION_PLANNER, Kind.QGROUNDCONTROL, Kind.MAVSDK])
def test_bad_news_is_repeated_until_an_answer_shows_that_it_arrived(kind: Kind) -> None:
    for happening in (MISSING, ARMED):
        assert heard(kind, happening) == 5
        assert heard(kind, happening, answers=True) == 1


def test_texts_that_sys_status_replaces_are_repeated() -> None:
    assert heard(Kind.MISSION_PLANNER, MISSING, answers=True, is_replaced=True) == 3
    assert heard(Kind.QGROUNDCONTROL, MISSING, answers=True, is_replaced=True) == 1


@pytest.mark.parametrize("kind", [Kind.MAVPROXY, Kind.UNKNOWN])
def test_a_station_that_does_not_answer_a_question_gets_bad_news_three_times(kind: Kind) -> None:
    assert heard(kind, MISSING) == 3
    assert heard(kind, ARMED) == 1


def test_the_next_write_ends_the_repetition() -> None:
    news = BadNews()
    news.said(MISSING, Kind.MISSION_PLANNER, 0.0)
    news.forget()
    assert news.again(Kind.MISSION_PLANNER, 10.0) == []


def test_a_refusal_is_reported_once_for_each_attempt() -> None:
    """Mission Planner repeats a request seven times, 0.7 s apart, and Resume Mission its commands each second."""
    news = BadNews()
    for interval_s in (0.7, 1.1):
        times = [100 * interval_s + interval_s * number for number in range(7)]
        assert [news.is_repeated(ARMED, at, is_routine=False) for at in times] == [False] + [True] * 6
        assert not news.is_repeated(ARMED, times[-1] + 2, is_routine=False)


def test_a_refusal_of_a_routine_request_does_not_silence_the_pilots() -> None:
    news = BadNews()
    assert not news.is_repeated(ARMED, 0.0, is_routine=True)
    assert not news.is_repeated(ARMED, 0.1, is_routine=False)
    assert news.is_repeated(ARMED, 0.2, is_routine=True)


def test_a_lost_text_reaches_mission_planner_later(world: World) -> None:
    """Write Fast, and both its closing ack and the first text are lost: it has shown a success."""
    station = GroundStation(world).stay_connected()
    station.send(m.MAVLink_request_data_stream_message(1, 1, m.MAV_DATA_STREAM_ALL, 2, 1), wait_s=2)
    station.send(m.MAVLink_mission_count_message(1, 1, 5))
    station.send(m.MAVLink_mission_item_int_message(1, 1, 0, 0, 16, 0, 1, 0, 0, 0, 0, 453838000, 84733000, 20))
    world.run(4)
    station.radio.loss = 1.0
    world.run(3)
    station.radio.loss = 0.0
    station.take()
    world.run(6)
    assert "Upload stalled for 5 s, old mission kept" in station.texts()
    heard = len(station.texts())
    world.run(10)
    assert len(station.texts()) <= heard + 1
