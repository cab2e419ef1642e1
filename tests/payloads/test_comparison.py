# SPDX-License-Identifier: GPL-3.0-or-later
"""Comparison of lists: no row is missing, and every difference has a reason."""

import json
import math
from dataclasses import asdict, replace

from hypothesis import example, given
from hypothesis import strategies as st

from bridge.controllers.harakiri.check import HarakiriRules
from bridge.missions.list_check import check_list
from payloads.comparison import checked_mission, sent_and_stored, stored_mission
from payloads.mission_data import to_json, verdict_data
from protocols.mission_item import MissionItem
from reports.verdict import Result

RULES = HarakiriRules(capacity=146, wp_radius_cm=200)
numbers = st.one_of(st.sampled_from([0.0, 1.0, 0.5, 2.0, 15.0, 300.0, math.nan, math.inf]), st.floats(width=32))
places = st.sampled_from([453838000, 84733000, 0, None])
items = st.builds(
    MissionItem,
    seq=st.integers(0, 65535),
    command=st.sampled_from([16, 16, 16, 18, 19, 20, 80, 197, 178]),
    frame=st.sampled_from([0, 3, 6, 10]),
    **dict.fromkeys(("p1", "p2", "p3", "p4"), numbers),
    lat_e7=places,
    lon_e7=places,
    alt_m=st.one_of(st.sampled_from([0.0, 12.0, 18.5]), numbers),
)
FAR = MissionItem(0, 16, 0, 0.0, 0.0, 0.0, 0.0, 453838000, 453838000, 0.0)
HOME = MissionItem(0, 16, 0, 0.0, 2.0, 0.0, 0.0, 453838000, 84733000, 131.0)
lists = st.lists(items, min_size=1, max_size=20).map(lambda each: [HOME, *each])
#: Without the frame, which is a change only where the height is used.
COMPARED = ("p1", "p2", "p3", "p4", "lat_e7", "lon_e7", "alt_m")


@given(lists)
@example([HOME, FAR, FAR, FAR, FAR, replace(FAR, command=20, lat_e7=None)])
def test_every_difference_has_a_reason(sent: list[MissionItem]) -> None:
    verdict = check_list(sent, RULES)
    rows = [row.to_json() for row in sent_and_stored(sent, verdict.items, verdict.findings, verdict.sent_seqs)]
    assert [row["left"]["command"] for row in rows] == [item.command for item in sent]
    if verdict.result is not Result.ACCEPTED:
        assert all(row["right"] is None for row in rows)
        return
    stored = [row["right"] for row in rows if row["right"]]
    assert [item["seq"] for item in stored] == list(range(len(verdict.items)))
    for row in rows:
        assert (row["right"] is None) == (row["kind"] == "dropped")
        assert row["changes"] or row["kind"] == "same"
        assert all(row["changes"].values())
        for name in COMPARED if row["right"] else ():
            same = (row["left"][name] or 0) == (row["right"][name] or 0)
            assert same == (name not in row["changes"]), (name, row)


def test_filled_in_defaults_are_not_changes_but_keep_their_reasons() -> None:
    sent = [
        replace(HOME, p2=0.0),
        replace(HOME, seq=1, frame=3, p2=0.0, alt_m=20.0),
        replace(HOME, seq=2, frame=3, p1=3.0, alt_m=20.0),
    ]
    shown = checked_mission(sent, verdict_data(check_list(sent, RULES)))
    assert [row["kind"] for row in shown["rows"]] == ["same", "same", "changed"]
    assert [list(row["changes"]) for row in shown["rows"]] == [["p2"], ["p2"], ["p1"]]
    assert len(shown["findings"]) == 1


def test_a_finding_reads_as_in_the_messages_tab() -> None:
    """Also after it was stored as JSON."""
    sent = [HOME, replace(HOME, seq=1, frame=3, alt_m=0.0), replace(HOME, seq=2, frame=3, alt_m=9.0)]
    verdict = check_list(sent, RULES)
    stored = json.loads(to_json(verdict_data(verdict)))
    assert checked_mission(sent, stored)["findings"] == [finding.text() for finding in verdict.findings]
    assert checked_mission(sent, stored)["findings"] == ["WP 1: Alt raised from 0 to 2 m (0 not allowed)"]


def test_a_list_of_thousands_is_truncated_with_a_note() -> None:
    """`push` accepts a megabyte of items; the refused list is stored."""
    long = [asdict(replace(HOME, seq=seq)) for seq in range(5000)]
    received = {
        "received_at": 0.0, "source": "", "verdict": "REJECTED", "ack": "", "checksum": "",
        "items": long, "stored_items": [], "findings": [], "sent_seqs": [],
    }  # fmt: skip
    shown = stored_mission({"number": 1, "received": received, "outcome": "REJECTED", "detail": ""})
    assert (len(shown["rows"]), shown["rows_left_out"]) == (500, 4500)
