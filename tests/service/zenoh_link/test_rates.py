# SPDX-License-Identifier: GPL-3.0-or-later
"""Publishing rates: limits, urgent changes, and requests that expire."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.model import vehicle_groups
from bridge.model.vehicle_groups import Attitude, Battery, Group, Position, Rc, Status
from payloads.names import ZenohSettingsError
from service.settings.zenoh import ZenohProfile, check_rates
from service.zenoh_link.rates import SampleRates

GAPS_S = st.lists(st.floats(0.01, 3.0), min_size=2, max_size=300)


def sent_at(rates: SampleRates, times: list[float]) -> list[float]:
    """The times at which the attitude of a rolling craft is published."""
    return [now for now in times if rates.admits(Group.ATTITUDE, Attitude(now * 10), now, gathered=True)]


def times_of(gaps_s: list[float]) -> list[float]:
    times = [100.0]
    for gap_s in gaps_s:
        times.append(times[-1] + gap_s)
    return times


@given(GAPS_S, st.sampled_from([0.2, 1.0, 4.0, 10.0]))
def test_the_limit_is_not_exceeded(gaps_s: list[float], limit_hz: float) -> None:
    times = times_of(gaps_s)
    sent = sent_at(SampleRates(ZenohProfile.FULL, {"attitude": limit_hz}), times)
    assert sent[0] == times[0]
    assert len(sent) <= 2 + (times[-1] - times[0]) * limit_hz


def test_a_limit_is_reached_from_a_rate_that_is_no_multiple_of_it() -> None:
    sent = sent_at(SampleRates(ZenohProfile.FULL, {"attitude": 4.0}), [number / 10 for number in range(1000)])
    assert 395 <= len(sent) <= 401


@given(GAPS_S)
def test_the_full_profile_limits_nothing(gaps_s: list[float]) -> None:
    times = times_of(gaps_s)
    assert sent_at(SampleRates(ZenohProfile.FULL, {}), times) == times


def test_a_rate_of_0_sends_nothing() -> None:
    assert sent_at(SampleRates(ZenohProfile.METERED, {"attitude": 0.0}), [1.0, 20.0, 400.0]) == []


def test_arming_does_not_wait_on_a_metered_link() -> None:
    rates = SampleRates(ZenohProfile.METERED, {})
    assert rates.admits(Group.STATUS, Status(armed=False, mode="ACRO", cycle_time_us=3000), 0.0)
    assert not rates.admits(Group.STATUS, Status(armed=False, mode="ACRO", cycle_time_us=3050), 1.0)
    assert rates.held_back == {Group.STATUS}
    assert rates.admits(Group.STATUS, Status(armed=True, mode="ACRO", cycle_time_us=3050), 1.1)
    assert rates.held_back == set()
    assert rates.admits_state(("armed", None), 1.1)
    assert not rates.admits_state(("armed", None), 2.1)
    assert rates.admits_state(("disarmed", None), 2.2)


def test_infrequent_groups_are_sent_together() -> None:
    rates = SampleRates(ZenohProfile.METERED, {})
    flying = {Group.ATTITUDE: Attitude(1.0), Group.POSITION: Position(height_m=1.0)}
    later = {Group.ATTITUDE: Attitude(9.0), Group.POSITION: Position(height_m=9.0)}
    assert all(rates.admits(group, sample, 3.0) for group, sample in flying.items())
    assert not any(rates.admits(group, sample, 7.0) for group, sample in later.items())
    assert rates.held_back == set(later)
    assert all(rates.admits(group, sample, 7.1, gathered=True) for group, sample in later.items())


@pytest.mark.parametrize(
    ("group", "first", "nearly_the_same", "different"),
    [
        (Group.ATTITUDE, Attitude(1.0, 0.0, None), Attitude(1.5, -0.5, None, age_s=3.0), Attitude(4.0, 0.0, None)),
        (Group.ATTITUDE, Attitude(1.0, 0.0, 9.0), Attitude(1.0, 0.0, 10.0), Attitude(1.0, 0.0, None)),
        (Group.POSITION, Position(45.0, 8.0), Position(45.00001, 8.0), Position(45.00004, 8.0)),
        (Group.RC, Rc((1500, 1000)), Rc((1510, 1000)), Rc((1500, 1800))),
        (Group.RC, Rc((1500, 1000)), Rc((1510, 1000)), Rc((1500,))),
        (Group.STATUS, Status(sensors=("gps",)), Status(sensors=("gps",), cycle_time_us=9), Status(sensors=())),
        (Group.BATTERY, Battery(11.1), Battery(11.2), Battery(10.8)),
    ],
)
def test_a_metered_link_sends_changes(group: Group, first: object, nearly_the_same: object, different: object) -> None:
    rates = SampleRates(ZenohProfile.METERED, {})
    assert rates.admits(group, first, 30.0)
    same = [now for now in range(31, 80) if rates.admits(group, nearly_the_same, now, gathered=True)]
    assert same == [60]
    assert [now for now in range(80, 90) if rates.admits(group, different, now, gathered=True)] == [80]


def test_every_field_of_an_urgent_change_exists() -> None:
    """A renamed field would silently lose its effect."""
    for group in Group:
        sample = getattr(vehicle_groups, group.value.capitalize())(**({"state": "MSP"} if group is Group.LINK else {}))
        rates = SampleRates(ZenohProfile.METERED, {})
        assert rates.admits(group, sample, 0.0)
        assert not rates.admits(group, sample, 5.0, gathered=True)


def test_a_request_raises_a_rate_for_a_while() -> None:
    rates = SampleRates(ZenohProfile.METERED, {})
    seconds = [float(number) for number in range(61)]
    assert len(sent_at(rates, seconds)) == 13
    rates.request("attitude", 1.0, until=130.0)
    assert rates.describe(100.0)["attitude"] == 1.0
    assert len(sent_at(rates, [100 + each for each in seconds])) == 30 + 7

    rates = SampleRates(ZenohProfile.METERED, {})
    rates.request("attitude", 1.0, until=130.0)
    assert rates.describe(131.0)["attitude"] == 0.2
    rates.request("attitude", 0.01, until=300.0)
    assert rates.describe(140.0)["attitude"] == 0.2


@pytest.mark.parametrize("rates", [{"altitude": 1}, {"rc": -1}, {"rc": True}, {"rc": "fast"}, {"rc": 1e9}])
def test_an_invalid_rate_is_one_sentence(rates: dict[str, object]) -> None:
    with pytest.raises(ZenohSettingsError, match=r"zenoh\.rates"):
        check_rates(rates)
