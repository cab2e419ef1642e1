# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions are stored unchanged, and lookups do not slow down as the store fills."""

import math
import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from storage.database import CONTENTS, row_crc32
from storage.mission_store import MissionStore, ReceivedMission, open_store
from storage.store_error import StoreError
from tests.support.sample_missions import mission

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=8,
)
ITEMS = st.lists(st.dictionaries(st.text(), JSON, max_size=5), max_size=5)
TEXT = st.text(st.characters(exclude_categories=["Cs"]))
TIME = st.floats(min_value=0, max_value=1e11)
UINT32 = st.integers(0, 0xFFFFFFFF)
RECEIVED = st.builds(
    ReceivedMission,
    received_at=TIME,
    source=TEXT,
    items=ITEMS,
    verdict=TEXT,
    ack=TEXT,
    findings=ITEMS,
    stored_items=ITEMS,
    records=st.binary(max_size=200),
    record_count=UINT32,
    checksum=UINT32,
    roi_commands=st.dictionaries(st.integers(), st.integers(), max_size=5),
    sent_seqs=st.lists(st.none() | st.integers(), max_size=5),
)


@pytest.fixture
def store(tmp_path: Path) -> Any:
    with open_store(tmp_path / "missions.db", now=0.0).store as opened:
        yield opened


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(received=RECEIVED, outcome=TEXT, detail=TEXT, at=TIME)
def test_any_mission_is_stored_unchanged(
    store: MissionStore, received: ReceivedMission, outcome: str, detail: str, at: float
) -> None:
    number = store.add(received)
    pending = store.get(number)
    assert pending is not None
    assert (pending.number, pending.received) == (number, received)
    assert (pending.outcome, pending.detail, pending.concluded_at) == ("PENDING", "", None)

    store.conclude(number, outcome, detail, at)
    concluded = store.get(number)
    assert concluded is not None
    assert concluded.received == received
    assert (concluded.outcome, concluded.detail, concluded.concluded_at) == (outcome, detail, at)


def test_unset_parameters_stay_unset(store: MissionStore) -> None:
    number = store.add(replace(mission(1), items=[{"p4": math.nan, "alt_m": -math.inf}]))
    stored = store.get(number)
    assert stored is not None
    (item,) = stored.received.items
    assert math.isnan(item["p4"])
    assert item["alt_m"] == -math.inf


def test_a_file_name_that_is_not_utf8_is_stored(store: MissionStore) -> None:
    number = store.add(replace(mission(1), source="file caf\udce9.plan"))
    stored = store.get(number)
    assert stored is not None
    assert stored.received.source == r"file caf\udce9.plan"


@pytest.mark.parametrize("items", ["[" * 100_000, "no JSON"])
def test_contents_that_are_not_a_mission_are_damage(store: MissionStore, tmp_path: Path, items: str) -> None:
    """The checksum is right: a service that was taken over can make it, and root reads the store."""
    number = store.add(mission(1))
    with closing(sqlite3.connect(tmp_path / "missions.db")) as database:
        database.row_factory = sqlite3.Row
        database.execute("UPDATE mission_contents SET items = ?", (items,))
        row = database.execute("SELECT * FROM mission_contents").fetchone()
        database.execute(
            "UPDATE mission_contents SET crc32 = ?", (row_crc32(number, *(row[name] for name in CONTENTS)),)
        )
        database.commit()
    with pytest.raises(StoreError, match="was damaged"):
        store.get(number)


def test_the_list_shows_the_newest_first(store: MissionStore) -> None:
    numbers = [store.add(mission(tag, items=tag)) for tag in (1, 2, 3)]
    store.conclude(numbers[1], "REFUSED", "armed", 1_700_000_009.5)
    youngest, second = store.list(2)
    assert (youngest.number, second.number) == (numbers[2], numbers[1])
    assert (youngest.outcome, youngest.concluded_at) == ("PENDING", None)
    assert (second.outcome, second.detail, second.concluded_at) == ("REFUSED", "armed", 1_700_000_009.5)
    sent = mission(2, items=2)
    assert (second.received_at, second.source, second.verdict, second.ack) == (
        sent.received_at,
        sent.source,
        sent.verdict,
        sent.ack,
    )
    assert (second.item_count, second.finding_count) == (2, 1)
    assert (second.record_count, second.checksum) == (2, sent.checksum)
    assert [summary.number for summary in store.list(99)] == numbers[::-1]


def test_numbers_increase_across_restarts(tmp_path: Path) -> None:
    path = tmp_path / "missions.db"
    numbers = []
    for tag in range(3):
        with open_store(path, now=0.0).store as store:
            numbers.append(store.add(mission(tag)))
    assert numbers == [1, 2, 3]


def test_only_verified_missions_are_found_by_checksum(store: MissionStore) -> None:
    sent = mission(7)
    first, second, refused, pending = (store.add(sent) for _ in range(4))
    other = store.add(mission(8))
    assert store.latest_verified(sent.record_count, sent.checksum) is None
    for number in (first, second, other):
        store.conclude(number, "VERIFIED", "", 1.0)
    store.conclude(refused, "REFUSED", "busy", 1.0)
    found = store.latest_verified(sent.record_count, sent.checksum)
    assert found is not None
    assert found.number == second < refused < pending
    assert found.received.roi_commands == {7: 201}
    assert store.latest_verified(sent.record_count + 1, sent.checksum) is None
    assert store.latest_verified(sent.record_count, sent.checksum ^ 1) is None


def test_a_missing_number_is_reported(store: MissionStore) -> None:
    assert store.get(5) is None
    with pytest.raises(StoreError, match=r"there is no mission 5 in .*missions\.db"):
        store.conclude(5, "VERIFIED", "", 1.0)
    assert store.add(mission(1)) == 1, "the failed transaction is rolled back"


def test_a_closed_store_reports_it(tmp_path: Path) -> None:
    store = open_store(tmp_path / "missions.db", now=0.0).store
    store.close()
    with pytest.raises(StoreError, match=r"cannot list .*closed"):
        store.list(1)


def test_lookups_take_no_more_steps_in_a_larger_store(store: MissionStore) -> None:
    wanted = mission(999)
    store.conclude(store.add(wanted), "VERIFIED", "", 1.0)

    def gather(tags: range) -> None:
        for tag in tags:
            store.conclude(store.add(mission(tag, items=1)), "VERIFIED", "", 1.0)

    def steps(search: Callable[[], object]) -> int:
        """The number of SQLite VM instructions: like a timing, without the noise."""
        count = 0

        def tick() -> int:
            nonlocal count
            count += 1
            return 0

        store._connection.set_progress_handler(tick, 1)
        assert search()
        store._connection.set_progress_handler(None, 1)
        return count

    searches: list[Callable[[], object]] = [
        lambda: store.list(20),
        lambda: store.get(1),
        lambda: store.latest_verified(wanted.record_count, wanted.checksum),
    ]
    gather(range(30))
    few = [steps(search) for search in searches]
    gather(range(30, 330))
    assert all(steps(search) <= before for search, before in zip(searches, few, strict=True))


def test_each_sender_is_found_with_the_item_numbers_until_it_reads_the_list(store: MissionStore) -> None:
    received = mission(1)
    for sender, last in (("a", 2), ("b", 3), ("a", 4), ("", 5), ("c", 6)):
        number = store.add(replace(received, sent_seqs=[0, last]), sender)
        if sender != "c":
            store.conclude(number, "VERIFIED", "", 0.0)
    wanted = received.record_count, received.checksum
    assert store.item_numbers(*wanted) == {"a": [0, 4], "b": [0, 3]}
    assert store.item_numbers(received.record_count + 1, received.checksum) == {}
    store.note_reader(*wanted, "a")
    assert store.item_numbers(*wanted) == {"b": [0, 3]}
