# SPDX-License-Identifier: GPL-3.0-or-later
"""The metered profile: changes, urgent changes, and nothing that is nearly the same."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from reports import vehicle_groups
from reports.vehicle_groups import Attitude, Battery, Group, Position, Rc, Status
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


@given(GAPS_S)
def test_a_metered_group_is_sent_every_5_s_at_most(gaps_s: list[float]) -> None:
    times = times_of(gaps_s)
    sent = sent_at(SampleRates(is_metered=True), times)
    assert sent[0] == times[0]
    assert len(sent) <= 2 + (times[-1] - times[0]) / 5


@given(GAPS_S)
def test_the_full_profile_does_not_limit_anything(gaps_s: list[float]) -> None:
    times = times_of(gaps_s)
    assert sent_at(SampleRates(is_metered=False), times) == times


def test_arming_does_not_wait_on_a_metered_link() -> None:
    rates = SampleRates(is_metered=True)
    assert rates.admits(Group.STATUS, Status(armed=False, mode="ACRO", cycle_time_us=3000), 0.0)
    assert not rates.admits(Group.STATUS, Status(armed=False, mode="ACRO", cycle_time_us=3050), 1.0)
    assert rates.held_back == {Group.STATUS}
    assert rates.admits(Group.STATUS, Status(armed=True, mode="ACRO", cycle_time_us=3050), 1.1)
    assert rates.held_back == set()
    assert rates.admits_state(("armed", None), 1.1)
    assert not rates.admits_state(("armed", None), 2.1)
    assert rates.admits_state(("disarmed", None), 2.2)


def test_infrequent_groups_are_sent_together() -> None:
    rates = SampleRates(is_metered=True)
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
    rates = SampleRates(is_metered=True)
    assert rates.admits(group, first, 30.0)
    same = [now for now in range(31, 80) if rates.admits(group, nearly_the_same, now, gathered=True)]
    assert same == [60]
    assert [now for now in range(80, 90) if rates.admits(group, different, now, gathered=True)] == [80]


def test_every_field_of_an_urgent_change_exists() -> None:
    """A renamed field would silently lose its effect."""
    for group in Group:
        sample = getattr(vehicle_groups, group.value.capitalize())(**({"state": "MSP"} if group is Group.LINK else {}))
        rates = SampleRates(is_metered=True)
        assert rates.admits(group, sample, 0.0)
        assert not rates.admits(group, sample, 5.0, gathered=True)
