# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission Planner writes, reads, cancels and is refused, on good and bad links."""

from collections.abc import Sequence
from dataclasses import replace

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.voice.mission_report import finding_lines, summary
from protocols.mavlink.dialect import Message
from protocols.mission_item import Frame, MissionResult
from tests.support.benches import Bench
from tests.support.mission_planner import MissionPlanner
from tests.support.plan import (
    PlanRow,
    expected_fields,
    judge,
    mixed_plan,
    plain_plan,
    records_of,
)
from tests.support.programs import until

#: A link over a long-range radio.
BAD_RADIO = {"loss": 0.1, "repeats": 0.05, "delay_s": 0.2}


def as_read(message: Message) -> tuple[float, ...]:
    names = ("seq", "command", "frame", "param1", "param2", "param3", "param4", "x", "y", "z")
    return tuple(getattr(message, name) for name in names)


def assert_reads(planner: MissionPlanner, plan: Sequence[PlanRow], *, use_int: bool = True) -> None:
    """Assert that a Read shows `plan` with the rules applied."""
    read = planner.read()
    assert all((message.autocontinue, message.current) == (1, 0) for message in read)
    assert [as_read(message) for message in read] == expected_fields(plan, use_int=use_int)


# -- connecting ----------------------------------------------------------------------------------------------


def test_every_request_while_connecting_is_answered(shared: Bench) -> None:
    planner = shared.mission_planner()
    planner.wait_for_vehicle()
    shared.daemon.ask({"do": "settings"})  # until they are read the list is shorter
    planner.connect()
    assert planner.vehicle == (1, 1)
    assert planner.unacked_commands == []
    assert planner.capabilities & messages.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    assert len(planner.parameters) == 237
    assert planner.parameters["WPNAV_RADIUS"] == 200
    assert not {"FENCE_TOTAL", "RALLY_TOTAL"} & planner.parameters.keys()
    heartbeat = planner.messages("HEARTBEAT")[-1]
    assert (heartbeat.autopilot, heartbeat.type) == (messages.MAV_AUTOPILOT_ARDUPILOTMEGA, 2)
    assert planner.texts
    # Nothing is wrong, so nothing is on the HUD, and nothing is said.
    planner.listen(1.5)
    assert planner.read_hud() == ""
    assert planner.screen.heard() == []
    assert planner.messages("HOME_POSITION")


def test_it_speaks_mavlink_1_until_it_has_seen_mavlink_2(shared: Bench) -> None:
    with MissionPlanner(shared.daemon.address) as planner:
        planner.wait_for_vehicle()
        assert planner.messages_of_version(1)
        assert planner.messages_of_version(2)
        planner.connect()
        planner.received.clear()
        planner.wait_until(lambda: len(planner.messages_of_version(2)) >= 20, "telemetry")
        assert not planner.messages_of_version(1)


# -- writing and reading -------------------------------------------------------------------------------------


@pytest.mark.parametrize("use_int", [True, False], ids=["int", "float"])
@pytest.mark.parametrize("count", [12, 146])
def test_a_write_is_stored_with_the_rules_applied(shared: Bench, count: int, use_int: bool) -> None:
    planner = shared.mission_planner()
    planner.connect()
    plan = mixed_plan(count)
    planner.write(plan, use_int=use_int)
    planner.after_write(radius_m=2.0)
    verdict = judge(plan, use_int=use_int)
    assert shared.board.records() == records_of(verdict)
    assert shared.daemon.missions()[0]["outcome"] == "VERIFIED"
    assert_reads(planner, plan, use_int=use_int)
    # Every important change and drop was reported.
    lines = finding_lines(verdict.findings)
    assert lines
    assert all(line.text in planner.joined_texts() for line in lines)
    # The summary stays on the HUD, even after the radius and a Read.
    assert planner.read_hud() == summary(count, verdict)
    # The voice says the first danger: the return is lower than the way out.
    assert planner.screen.heard()[0] == lines[0].line


def test_a_write_and_a_read_survive_a_bad_radio(shared: Bench) -> None:
    link = shared.lossy_link(**BAD_RADIO, seed=1)
    plan = mixed_plan(12)
    shared.mission_planner(link.address).write(plan)
    assert shared.board.records() == records_of(judge(plan))
    reader = shared.mission_planner(link.address)
    reader.request_version()
    assert_reads(reader, plan)
    assert link.lost


@pytest.mark.parametrize("count", [12, 146])
def test_write_fast_is_written_and_verified(shared: Bench, count: int) -> None:
    planner = shared.mission_planner()
    plan = plain_plan(count, start=2 * count)
    plan[0] = replace(plan[0], frame=Frame.GLOBAL_RELATIVE_ALT)
    planner.write_fast(plan)
    until(lambda: shared.board.records() == records_of(judge(plan)), "the list on the board")
    planner.wait_for_text(" stored: ")
    requested = [message.seq for message in planner.messages("MISSION_REQUEST")]
    assert max(requested) < count
    assert MissionResult.INVALID_SEQUENCE not in planner.acks()
    assert planner.read_hud() == ""


def test_write_fast_over_a_bad_radio_writes_everything_or_nothing(shared: Bench, kept: list[str]) -> None:
    """It does not check that its last burst arrived; if not, the old list is kept and the user is told."""
    link = shared.lossy_link(**BAD_RADIO, seed=4)
    planner = shared.mission_planner(link.address)
    plan = plain_plan(33, start=300)
    planner.write_fast(plan)
    mission = until(lambda: _ended_with(shared, len(plan)), "the end of the upload")
    expected = {"VERIFIED": records_of(judge(plan)), "CANCELLED": kept}
    assert shared.board.records() == expected[mission]


def _ended_with(bench: Bench, most: int) -> str | None:
    """The outcome of the latest mission, if it has 20 to `most` items."""
    newest = bench.daemon.missions()[0]
    ended = newest["outcome"] != "PENDING" and 20 <= newest["item_count"] <= most
    return str(newest["outcome"]) if ended else None


def test_a_second_write_right_after_the_radius_waits_for_the_flash(bench: Bench) -> None:
    until(lambda: bench.daemon.has_logged("settings.read"), "the board's settings, which connecting reads")
    planner = bench.mission_planner()
    planner.connect()
    planner.write(plain_plan(12))
    planner.after_write(radius_m=4.0)
    assert planner.parameters["WPNAV_RADIUS"] == 400
    # The radius is written to flash a second later; this list arrives before and is checked with the new one.
    plan = plain_plan(12, start=50)
    planner.write(plan)
    planner.wait_for_text("Hit Rad changed from 3 to 4 m")
    assert [record[26:28] for record in bench.board.records()] == ["04"] * 12


def test_refused_fence_and_rally_points_keep_their_mission_type(shared: Bench, kept: list[str]) -> None:
    planner = shared.mission_planner()
    for mission_type in (1, 2):
        planner.send(messages.MAVLink_mission_count_message(1, 1, 5, mission_type))
        planner.send(messages.MAVLink_mission_request_list_message(1, 1, mission_type))
        planner.send(messages.MAVLink_mission_clear_all_message(1, 1, mission_type))
    planner.wait_until(lambda: len(planner.messages("MISSION_ACK")) >= 4, "the refusals")
    planner.listen(0.5)
    acks = [(message.type, message.mission_type) for message in planner.messages("MISSION_ACK")]
    assert acks == [(MissionResult.UNSUPPORTED, 1)] * 2 + [(MissionResult.UNSUPPORTED, 2)] * 2
    # Mission Planner waits for a count, and takes no refusal of a reading.
    counts = [(message.count, message.mission_type) for message in planner.messages("MISSION_COUNT")]
    assert counts == [(0, 1), (0, 2)]
    assert shared.board.records() == kept


def test_cancel_keeps_the_old_list(shared: Bench, kept: list[str]) -> None:
    planner = shared.mission_planner()
    planner.write_fast(plain_plan(40, start=100), cancel_at=20)
    planner.wait_for_ack(MissionResult.OPERATION_CANCELLED)
    planner.wait_for_text("old mission kept")
    assert shared.board.records() == kept
    # A list not cancelled in time is written; the next Write succeeds at once.
    plan = plain_plan(12, start=100)
    planner.write(plan)
    assert shared.board.records() == records_of(judge(plan))


def test_an_item_sent_before_the_request_is_accepted(shared: Bench) -> None:
    """For Mission Planner a stale ack of the previous upload means "continue"."""
    planner = shared.mission_planner()
    plan = plain_plan(20, start=180)
    planner.send(messages.MAVLink_mission_count_message(1, 1, len(plan), 0))
    planner.write_rest(plan, 0)
    assert shared.board.records() == records_of(judge(plan))
