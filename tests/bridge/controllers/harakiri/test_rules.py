# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of every list, checked by a second implementation of the rules (rule_oracle.py)."""

import math
from dataclasses import replace

from hypothesis import event, given
from hypothesis import strategies as st

from bridge.controllers.harakiri.check import HarakiriRules
from bridge.controllers.harakiri.rules import items_from_records
from bridge.missions.list_check import check_list
from protocols.mission_item import MissionItem
from protocols.msp.mission import WpRecord, unpack_records
from reports.finding import DROPPED, REJECTED, Finding
from reports.verdict import Result, Verdict
from tests.support.rule_oracle import expected

KNOWN = [16, 17, 18, 19, 20, 21, 22, 80, 195, 197, 201]
ENDS = [(22, 17), (22, 20), (22, 21), (16, 21), (16, 16), (201, 16), (178, 178)]
FIELDS = ("command", "p1", "p2", "p3", "p4", "lat_e7", "lon_e7", "alt_m")

numbers = st.one_of(
    st.sampled_from([0.0, -0.0, 1.0, 0.5, -0.5, 2.0, 15.0, 16.0, 127.0, 128.0, 255.0, 256.0, 32767.5, -32769.0]),
    st.sampled_from([math.nan, math.inf, -math.inf, 1e30, -1e30]),
    st.integers(-300, 300).map(float),
    st.floats(),
)
tame_numbers = st.sampled_from(
    [-200.0, -1.5, -0.1, 0.0, 0.9, 1.0, 1.5, 2.0, 3.0, 14.2, 15.0, 90.0, 255.0, 300.0, math.nan]
)
degrees = st.one_of(
    st.sampled_from([0, 1, -1, 453838000, None, 900_000_000, 900_000_001, -1_800_000_000, 1_800_000_001]),
    st.integers(-(2**31), 2**31 - 1),
)
wild_items = st.builds(
    MissionItem,
    seq=st.integers(0, 65535),
    command=st.one_of(st.sampled_from(KNOWN), st.integers(0, 65535)),
    frame=st.one_of(st.sampled_from([0, 2, 3, 5, 6, 10, 11]), st.integers(0, 255)),
    **dict.fromkeys(("p1", "p2", "p3", "p4"), numbers),
    lat_e7=degrees,
    lon_e7=degrees,
    alt_m=numbers,
)
tame_items = st.builds(
    MissionItem,
    seq=st.just(0),
    command=st.sampled_from([16, 16, 16, 18, 19, 20, 80, 195, 197, 201, 178]),
    frame=st.sampled_from([0, 3, 3, 3, 6, 10]),
    p1=tame_numbers,
    p2=tame_numbers,
    p3=st.sampled_from([0.0, math.nan, 3.0]),
    p4=st.sampled_from([0.0, 1.0, 90.0, math.nan]),
    lat_e7=st.sampled_from([453838000, 453840141, -1, 0]),
    lon_e7=st.sampled_from([84733000, 84741389, -1, None]),
    alt_m=tame_numbers,
)


@st.composite
def plausible_lists(draw: st.DrawFn) -> list[MissionItem]:
    """Lists of home, a first item, simple items and a last item, most of which are accepted."""
    home = replace(draw(tame_items), command=16, lat_e7=1, lon_e7=2, alt_m=draw(st.sampled_from([0.0, 131.0, 584.3])))
    middle = draw(st.lists(tame_items, max_size=8))
    ends = [replace(draw(tame_items), command=command) for command in draw(st.sampled_from(ENDS))]
    return [home, *ends[:1], *middle, *ends[1:]]


lists = st.one_of(plausible_lists(), plausible_lists(), st.lists(wild_items, max_size=5))
profiles = st.builds(
    HarakiriRules,
    capacity=st.sampled_from([146, 146, 5]),
    wp_radius_cm=st.sampled_from([0, 1, 100, 150, 200, 2000, 65535]),
    takeoff_max_m=st.sampled_from([2, 15, 80]),
)
homes = st.sampled_from([None, (123, -456)])


@given(items=lists, profile=profiles, home=homes)
def test_the_verdict_matches_the_document(
    items: list[MissionItem], profile: HarakiriRules, home: tuple[int, int] | None
) -> None:
    verdict = check_list(items, profile, home)
    wanted = expected(items, profile.capacity, profile.wp_radius_cm, profile.takeoff_max_m, home)
    event(verdict.result.name)
    assert all(finding.text().isprintable() for finding in verdict.findings)
    if isinstance(wanted, set):
        assert verdict.result is Result.REJECTED
        assert verdict.ack in wanted
        assert verdict.findings[-1].becomes == REJECTED
    else:
        assert verdict.ack == 0
        assert verdict.result is (Result.ACCEPTED if wanted else Result.CLEARED)
        assert [record.pack() for record in verdict.records] == wanted


@given(items=plausible_lists(), profile=profiles, home=homes)
def test_a_list_that_reads_back_can_be_sent_again_unchanged(
    items: list[MissionItem], profile: HarakiriRules, home: tuple[int, int] | None
) -> None:
    verdict = check_list(items, profile, home)
    if verdict.result is Result.ACCEPTED:
        again = check_list(verdict.items, profile)
        assert (again.result, changes(again)) == (Result.ACCEPTED, [])
        assert (again.records, again.items) == (verdict.records, verdict.items)
        assert again.sent_as == verdict.sent_as
        assert tuple(items_from_records(verdict.records, verdict.sent_as)) == verdict.items


@given(items=plausible_lists(), profile=profiles, home=homes)
def test_every_difference_is_a_finding_and_every_finding_a_difference(
    items: list[MissionItem], profile: HarakiriRules, home: tuple[int, int] | None
) -> None:
    verdict = check_list(items, profile, home)
    if verdict.result is not Result.ACCEPTED:
        return
    dropped = {finding.seq for finding in verdict.findings if finding.becomes == DROPPED}
    sent = [replace(item, seq=n) for n, item in enumerate(items) if n not in dropped]
    assert len(sent) == len(verdict.items)
    differences = {
        (before.seq, field, getattr(after, field))
        for before, after in zip(sent, verdict.items, strict=True)
        for field in FIELDS
        if given_value(before, field) != getattr(after, field)
    }
    found = [finding for finding in changes(verdict) if finding.becomes != DROPPED and finding.field != "frame"]
    assert {(finding.seq, finding.field, finding.becomes) for finding in found} == differences
    assert len(found) == len(differences)


def changes(verdict: Verdict[WpRecord]) -> list[Finding]:
    """Without the findings about the flight, which change nothing."""
    return [finding for finding in verdict.findings if finding.was != finding.becomes]


def given_value(item: MissionItem, field: str) -> float:
    value: float | None = getattr(item, field)
    return 0 if value is None or math.isnan(value) else value


@given(
    data=st.lists(st.binary(min_size=16, max_size=16), max_size=5),
    rois=st.dictionaries(st.integers(0, 5), st.just(201)),
)
def test_any_stored_records_can_be_read_back(data: list[bytes], rois: dict[int, int]) -> None:
    records = unpack_records(b"".join(data))
    items = items_from_records(records, rois)
    assert [item.seq for item in items] == list(range(len(records)))
    for seq, (item, record) in enumerate(zip(items, records, strict=True)):
        assert (item.lat_e7, item.lon_e7, item.alt_m) == (record.lat_e7, record.lon_e7, record.height_m)
        if record.command > 7:
            assert (item.command, item.p1) == (0, record.command)
        elif record.command == 7:
            assert item.command == rois.get(seq, 80)
        else:
            assert item.command == [16, 17, 18, 19, 20, 21, 22][record.command]


def test_without_remembered_commands_a_roi_reads_back_as_80() -> None:
    record = WpRecord(1, 2, 0, 0, 0, 0, 0, 7)
    assert [item.command for item in items_from_records([record, record], {1: 195})] == [80, 195]
