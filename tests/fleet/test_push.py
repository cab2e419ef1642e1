# SPDX-License-Identifier: GPL-3.0-or-later
"""The bookkeeping of a push to many vehicles: with events in any order, each ends exactly once with its own reason."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fleet.push import FleetPush, stages

ACCEPTED = {"result": {"ack": "MAV_MISSION_ACCEPTED", "text": "Mission verified: 3 records", "findings": []}}
NAMES = ("a", "b", "c")


def push_to(*names: str) -> FleetPush:
    return FleetPush(names)


def test_a_failure_does_not_affect_the_others() -> None:
    fleet = push_to(*NAMES)
    fleet.replied("a", {"progress": 2, "of": 3})
    fleet.refused("b", {"error": "Armed: disarm to change the mission"})
    assert fleet.waiting == ["a", "c"]
    fleet.replied("a", ACCEPTED)
    fleet.replied("c", {"progress": 0, "of": 3})
    fleet.ended("c")
    assert fleet.waiting == []
    assert [each.vehicle for each in fleet.failed] == ["b", "c"]
    assert fleet.vehicles["b"].error == "Armed: disarm to change the mission"
    assert "disconnected" in str(fleet.vehicles["c"].error)
    assert fleet.vehicles["a"].result == ACCEPTED["result"]


def test_a_vehicle_that_disappears_after_the_success_has_not_failed() -> None:
    fleet = push_to("a")
    fleet.replied("a", ACCEPTED)
    fleet.ended("a")
    assert fleet.failed == []


def test_a_missing_result_has_one_of_three_reasons() -> None:
    fleet = push_to(*NAMES)
    fleet.ended("a")
    fleet.replied("b", {"progress": 0, "of": 3})
    fleet.ended("b")
    fleet.refused("c", None)
    reasons = [str(each.error) for each in fleet.failed]
    words = ("accepts no commands", "disconnected", "no result after")
    assert [word in reason for word, reason in zip(words, reasons, strict=True)] == [True] * 3


def test_a_staged_push_does_not_begin_another_push_after_a_failure() -> None:
    fleet = push_to(*NAMES)
    begun = fleet.begin(NAMES, staged=True)
    assert next(begun) == "a"
    fleet.refused("a", {"error": "no"})
    assert list(begun) == []
    assert [each.error for each in fleet.failed] == ["no"]
    assert [each.error for each in fleet.left_out] == ["a had failed"] * 2


@pytest.mark.parametrize(("count", "sizes"), [(1, [1]), (3, [1, 1, 1]), (10, [1, 1, 2, 4, 2])])
def test_stages_double_from_one_vehicle(count: int, sizes: list[int]) -> None:
    names = [f"{number}" for number in range(count)]
    assert [len(stage) for stage in stages(names)] == sizes
    assert [name for stage in stages(names) for name in stage] == names


def test_any_result_but_accepted_is_a_failure() -> None:
    fleet = push_to("a")
    fleet.replied("a", {"result": {"ack": "MAV_MISSION_NO_SPACE", "text": "Too many items"}})
    assert fleet.vehicles["a"].error == "Too many items"


_ODD: list[object] = [
    None,
    True,
    0,
    -1,
    2.5,
    "",
    "x",
    [],
    {},
    {"ack": 3},
    {"ack": "MAV_MISSION_DENIED"},
    ACCEPTED["result"],
]
_ANSWERS = st.none() | st.dictionaries(
    st.sampled_from(["progress", "of", "result", "error"]), st.sampled_from(_ODD), max_size=4
)
_EVENTS = st.tuples(st.sampled_from(["replied", "refused", "ended"]), st.sampled_from(NAMES), _ANSWERS)


@given(st.lists(_EVENTS, max_size=20))
def test_each_vehicle_ends_exactly_once_in_any_order(events: list[tuple[str, str, dict[str, object] | None]]) -> None:
    fleet = push_to(*NAMES)
    ends: dict[str, tuple[object, object]] = {}
    for kind, name, answer in events:
        match kind:
            case "replied":
                fleet.replied(name, answer)
            case "refused":
                fleet.refused(name, answer)
            case "ended":
                fleet.ended(name)
        for each in fleet.vehicles.values():
            if each.is_done:
                assert ends.setdefault(each.vehicle, (each.result, each.error)) == (each.result, each.error)
                assert (each.result is None) == (each.error is not None)
                assert each.error != ""
    for name in fleet.waiting:
        fleet.ended(name)
    assert fleet.waiting == []
