# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission uploads, row by row of docs/mission-rules.md: "Before the first item" and "While items arrive"."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.model.missions import Outcome
from bridge.transfers.upload_states import Asking, Delivering
from protocols.mavlink.dialect import Message
from protocols.mission_item import Command, Frame, MissionItem, MissionResult
from protocols.msp.mission import WpRecord
from simulator.board.options import SimOptions
from tests.support.conversations import (
    MISSION,
    Upload,
    ack_message,
    clear_message,
    count_message,
    item_message,
    records_of,
    rounded,
    waypoints,
)
from tests.support.screens import Screens
from tests.support.seeds import seeds
from tests.support.upload_bench import (
    OLD,
    OLD_FLASH,
    OLD_RECORDS,
    A,
    acks,
    assert_refusal_is_repeated,
    assert_written,
    begun,
    finish,
    hanging_push,
    holding,
    partial_list_message,
    receiving,
    refused,
    requested,
    state,
)
from tests.support.world import GroundStation, Radio, World, flash_holding, ready_world

# Before the first item.


@pytest.mark.parametrize("mission_type", [1, 2, 7, 255])
def test_another_mission_type_is_unsupported(world: World, station: GroundStation, mission_type: int) -> None:
    for message in (
        count_message(5, mission_type),
        item_message(0, OLD[0], mission_type=mission_type),
        item_message(0, OLD[0], mission_type=mission_type, as_int=False),
        partial_list_message(mission_type),
        *([clear_message(mission_type)] if mission_type != 255 else []),
    ):
        station.ask(message, wait_s=0.3)
        answers = [(ack.type, ack.mission_type) for ack in station.messages("MISSION_ACK")]
        assert answers == [(A.UNSUPPORTED, mission_type)]
        assert requested(station) == []
    assert world.stored == OLD_RECORDS


def test_another_mission_type_does_not_disturb_a_transfer(world: World, station: GroundStation) -> None:
    station.radio = Radio(delay_s=0.002)
    upload = Upload(station, waypoints(30))
    for number in range(10):
        world.after(number * 0.003, lambda: station.send(count_message(3, 1)))
        world.after(number * 0.003, lambda: station.send(ack_message(A.ERROR, 1)))
    assert upload.run() is A.ACCEPTED
    assert world.stored == records_of(waypoints(30))


def test_an_upload_while_armed_is_denied(world: World, station: GroundStation) -> None:
    world.arm(then_s=1)
    refused(world, station, 5, A.DENIED, "disarm")
    world.faults.armed = False
    world.run(1)
    assert Upload(station, waypoints(5)).run() is A.ACCEPTED


def test_arming_while_items_arrive_denies_the_upload() -> None:
    world, station = begun(waypoints(50), 10)
    world.faults.armed = True
    world.run(0.5)
    assert acks(station) == [A.DENIED]
    assert "Armed: disarm to change the mission" in station.texts()
    assert world.stored == OLD_RECORDS
    world.run(1)
    assert_refusal_is_repeated(world, station, A.DENIED)
    assert world.store.outcomes()[-1] is Outcome.REJECTED


def listen_for_acks(world: World, station: GroundStation) -> list[tuple[WpRecord, ...]]:
    """What the board holds at each ack from now on."""
    stored: list[tuple[WpRecord, ...]] = []
    station.on_message.append(
        lambda message: stored.append(world.stored) if message.get_type() == "MISSION_ACK" else None
    )
    return stored


@pytest.mark.parametrize("message", [count_message(0), clear_message(), clear_message(255)])
def test_clear_all_clears_the_list_and_verifies_it(world: World, station: GroundStation, message: Message) -> None:
    stored_at_ack = listen_for_acks(world, station)
    station.send(message)
    world.wait_until(lambda _: bool(acks(station)), 2)
    assert stored_at_ack == [()]
    # The second time nothing is written.
    station.send(message, wait_s=1)
    assert acks(station) == [A.ACCEPTED, A.ACCEPTED]
    assert {ack.mission_type for ack in station.messages("MISSION_ACK")} == {getattr(message, "mission_type", MISSION)}
    assert world.naze.counters.flash_writes == 2


def test_home_alone_is_invalid(world: World, station: GroundStation) -> None:
    """Mission Planner's empty Write; a count of 1 is first answered with a request for the item."""
    assert Upload(station, waypoints(1)).run() is A.INVALID
    assert "Mission rejected: only home, without a command" in station.texts()
    assert_refusal_is_repeated(world, station, A.INVALID)
    assert world.stored == OLD_RECORDS


def test_one_item_of_zeros_clears(world: World, station: GroundStation) -> None:
    """MAVSDK's clear_mission on an ARDUPILOTMEGA vehicle."""
    blank = MissionItem(0, Command.NAV_WAYPOINT, Frame.GLOBAL_RELATIVE_ALT, 0.0, 0.0, 0.0, 0.0, 0, 0, 0.0)
    assert Upload(station, [blank]).run() is A.ACCEPTED
    assert world.stored == ()


@pytest.mark.parametrize("capacity", [146, 30])
def test_more_than_the_flight_controller_holds_is_refused_with_no_space(capacity: int) -> None:
    options = SimOptions(capacity=capacity)
    world = World(options, flash=flash_holding(OLD_RECORDS, options))
    world.wait_ready()
    station = GroundStation(world)
    for count in (capacity + 1, 65535):
        refused(world, station, count, A.NO_SPACE, f"only {capacity} fit")
        station.take()
    assert Upload(station, waypoints(capacity)).run() is A.ACCEPTED


def test_two_simultaneous_uploads_both_succeed(world: World, station: GroundStation) -> None:
    """They are received in parallel, and the list completed last is written last."""
    second = GroundStation(world, "second", sysid=254, radio=Radio(delay_s=0.002))
    station.radio = Radio(delay_s=0.002)
    uploads = [Upload(station, waypoints(100)), Upload(second, waypoints(30, 1), repeat_s=0.7, tries=4)]
    assert [upload.run() for upload in uploads] == [A.ACCEPTED, A.ACCEPTED]
    assert world.stored == records_of(waypoints(100))
    assert [upload.requested for upload in uploads] == [list(range(100)), list(range(30))]


def test_a_slow_upload_does_not_delay_others() -> None:
    world, slow = begun(waypoints(4, 1), 0)
    for seq in range(4):
        world.after(4.9 * (seq + 1), lambda seq=seq: slow.send(item_message(seq, waypoints(4, 1)[seq])))  # type: ignore[misc]
    world.run(2)
    for number in range(3):
        assert_written(GroundStation(world, f"{number}", sysid=number + 1), waypoints(30, number))
    world.run(20)
    assert acks(slow) == [A.ACCEPTED]
    assert world.stored == records_of(waypoints(4, 1))


def test_unfinished_uploads_do_not_delay_others(world: World, station: GroundStation) -> None:
    """The ones with the slowest progress end."""
    station.radio = Radio(delay_s=0.03)
    station.send(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    for number in range(90):
        stranger = GroundStation(world, f"crowd {number}", sysid=1 + number)
        for again in range(20):
            world.after(0.01 * number + 0.5 * again, lambda stranger=stranger: stranger.send(count_message(9)))  # type: ignore[misc]
    world.run(1)
    for number in range(3):
        assert Upload(station, waypoints(20, number)).run() is A.ACCEPTED
    assert world.stored == records_of(waypoints(20, 2))
    world.run(16)
    assert state(world) is None


def test_only_some_cancelled_lists_are_stored(world: World, station: GroundStation) -> None:
    for _ in range(60):
        station.ask(count_message(3))
        world.wait_until(lambda _: bool(requested(station)), 2)
        station.send(item_message(0, OLD[0]))
        station.send(ack_message(A.ERROR), wait_s=0.3)
    assert 10 < len(world.store.missions) <= 25


@pytest.mark.parametrize(("sent", "stored"), [(20, OLD_RECORDS), (60, records_of(waypoints(60)))])
def test_the_upload_of_a_station_that_disconnects_ends_before_the_write(
    sent: int, stored: tuple[WpRecord, ...]
) -> None:
    world, station = begun(waypoints(60), sent)
    world.bridge.gcs_gone(station.peer, world.now)
    assert state(world) is (Delivering if sent == 60 else None)
    world.run(3)
    assert acks(station) == [A.OPERATION_CANCELLED] * (sent < 60)
    assert world.stored == stored
    assert world.inside.ground.station(station.peer) is None


def test_a_list_announced_again_before_the_write_is_received_again() -> None:
    """The new one may differ: the ack of the previous list would seem to be its own."""
    world, station = begun(waypoints(8), 7)
    world.store.delay_s = 1.0
    world.push(waypoints(3))
    station.send(item_message(7, waypoints(8)[7]), wait_s=0.1)
    station.send(count_message(8), wait_s=8)
    assert A.ACCEPTED not in acks(station)
    assert world.stored != records_of(waypoints(8))


def test_a_complete_list_that_waits_too_long_is_denied() -> None:
    world, station = begun(waypoints(8), 7)
    hanging_push(world)
    station.send(item_message(7, waypoints(8)[7]), wait_s=2.4)
    assert acks(station) == []
    world.run(0.2)
    assert acks(station) == [A.DENIED]
    assert "Another mission transfer is running: try again" in station.texts()
    world.run(5)
    assert world.stored == records_of(waypoints(3))


@pytest.mark.parametrize("message", [count_message(0), ack_message(A.OPERATION_CANCELLED)])
def test_a_waiting_upload_can_be_cancelled(world: World, station: GroundStation, message: Message) -> None:
    second = GroundStation(world, "second", sysid=254)
    receiving(world, station, waypoints(8), 3)
    second.send(count_message(5))
    second.send(message, wait_s=0.1)
    assert acks(second) == [A.OPERATION_CANCELLED]
    finish(world, station, waypoints(8), 3)


@pytest.mark.parametrize(("sent", "count"), [(0, 30), (1, 7), (10, 60), (29, 30)])
def test_the_same_station_restarts_while_items_arrive(sent: int, count: int) -> None:
    world, station = begun(waypoints(30, 1), sent)
    again = waypoints(count, 2)
    assert_written(station, again)
    ends = world.events("mission.refused") + world.events("mission.upload_ended")
    assert len(ends) == len(world.events("mission.upload_started"))


class PlannerWrite:
    """Mission Planner sends one item at a time, 450 ms x 11; a request for another one uses up a try at once."""

    def __init__(self, world: World, station: GroundStation, items: list[MissionItem]) -> None:
        self._world, self._station, self._items = world, station, items
        self.seq, self.tries = -1, 0
        station.on_message.append(self._receive)
        station.send(messages.MAVLink_request_data_stream_message(1, 1, messages.MAV_DATA_STREAM_EXTRA1, 4, 1))
        station.send(count_message(len(items)))

    def _receive(self, message: Message) -> None:
        if message.get_type() != "MISSION_REQUEST":
            return
        if message.seq == self.seq + 1:
            self.seq, self.tries = message.seq, 11
        self._send(self.seq, self.tries)

    def _send(self, seq: int, tries: int) -> None:
        if (seq, tries) == (self.seq, self.tries) and tries:
            self.tries -= 1
            self._station.send(item_message(seq, self._items[seq]))
            self._world.after(0.45, lambda: self._send(seq, tries - 1))


@pytest.mark.parametrize("gap_s", [0.3, 2.4, 2.6, 4.0])
@pytest.mark.parametrize(("at_s", "delay_s"), [(0.3, 0.03), (0.51, 0.002)])
def test_mission_planner_goes_on_after_a_gap_in_the_wifi(gap_s: float, at_s: float, delay_s: float) -> None:
    world, station = holding()
    items = waypoints(146)
    station.radio = Radio(delay_s=delay_s)
    write = PlannerWrite(world, station, items)
    world.run(at_s)
    assert 0 < write.seq < 145
    station.radio.loss = 1.0
    world.run(gap_s)
    station.radio.loss = 0.0
    world.wait_until(lambda _: bool(acks(station)), 60)
    assert acks(station) == [A.ACCEPTED]
    assert world.stored == records_of(items)


@pytest.mark.parametrize("after_s", [0.001, 0.02, 0.1, 0.2])
def test_the_same_station_restarts_while_the_list_is_written(after_s: float) -> None:
    first, again = waypoints(146, 1), waypoints(12, 2)
    world, station = begun(first, 146)
    world.run(after_s)
    assert state(world) is Delivering
    assert_written(station, again)
    assert world.store.outcomes() == [Outcome.VERIFIED, Outcome.VERIFIED]
    assert state(world) is None


def test_a_list_takes_the_place_of_a_waiting_clear(world: World, station: GroundStation) -> None:
    """DroneKit sends both at once. The final ack is of the list's mission type."""
    other = GroundStation(world, "other", sysid=254)
    receiving(world, other, waypoints(30, 1), 30)
    station.send(clear_message(255))
    assert_written(station, waypoints(5))


@pytest.mark.parametrize("announce", [count_message(0), clear_message(), count_message(12)])
def test_a_new_count_suppresses_the_ack_of_the_previous_list(announce: Message) -> None:
    world, station = begun(waypoints(146, 1), 146)
    world.run(0.05)
    assert state(world) is Delivering
    station.send(announce, wait_s=1)
    # A count of 0 is Mission Planner's Cancel and comes too late; a clear gets the only ack.
    assert acks(station) == ([] if announce.get_type() == "MISSION_COUNT" and announce.count else [A.ACCEPTED])


def test_an_upload_waits_for_a_flash_write(world: World, station: GroundStation) -> None:
    world.faults.busy = True
    world.after(0.7, lambda: setattr(world.faults, "busy", False))
    assert Upload(station, waypoints(5)).run() is A.ACCEPTED


def test_an_upload_during_a_long_flash_write_is_denied(world: World, station: GroundStation) -> None:
    world.faults.busy = True
    began = world.now
    station.send(count_message(5))
    world.wait_until(lambda _: bool(acks(station)), 3)
    assert 0.9 < world.now - began < 1.5
    assert any("busy" in text for text in station.texts())
    assert_refusal_is_repeated(world, station, A.DENIED)
    assert world.stored == OLD_RECORDS


def test_an_upload_without_a_link_is_denied(world: World, station: GroundStation) -> None:
    world.unplug()
    refused(world, station, 5, A.DENIED, "No link")
    for message in (count_message(0), clear_message()):
        station.ask(message, wait_s=0.1)
        assert acks(station) == [A.DENIED]


def test_a_write_fast_with_lost_items_is_reported_repeatedly(world: World, station: GroundStation) -> None:
    """Mission Planner reports success regardless and ends with its own MISSION_ACK."""
    other = GroundStation(world, "other", sysid=254)
    items = waypoints(35)
    station.stay_connected()
    receiving(world, station, items, 0)
    for seq in set(range(35)) - {7, 20, 34}:
        station.send(item_message(seq, items[seq]))
    station.send(ack_message(A.ACCEPTED), wait_s=0.4)
    text = "Mission NOT written: 3 of 35 missing, use Write"
    assert station.texts() == [text]
    assert acks(station) == [A.OPERATION_CANCELLED]
    assert world.stored == OLD_RECORDS
    world.run(10)
    assert station.texts() == [text] * 3
    assert {message.severity for message in station.messages("STATUSTEXT")} == {3}
    assert other.texts() == []


def test_a_new_upload_ends_the_reminders() -> None:
    world, station = begun(waypoints(35), 12)
    station.send(ack_message(A.ACCEPTED), wait_s=0.5)
    assert Upload(station, waypoints(35)).run() is A.ACCEPTED
    station.take()
    world.run(10)
    assert station.texts() == []


PLAN = waypoints(8)
WRITTEN = records_of(PLAN)
REFUSALS = [ack_message(result) for result in (A.ERROR, A.DENIED, A.OPERATION_CANCELLED, A.INVALID)]


@pytest.mark.parametrize(
    ("sent", "message", "answer", "stored"),
    [
        *((sent, refusal, A.OPERATION_CANCELLED, OLD_RECORDS) for sent in (0, 4) for refusal in REFUSALS),
        (8, ack_message(A.ERROR), A.ACCEPTED, WRITTEN),
        *((sent, clear_message(), A.ACCEPTED, ()) for sent in (0, 4, 8)),
    ],
)
def test_a_station_cancels_or_clears_in_the_middle(
    sent: int, message: Message, answer: MissionResult, stored: tuple[WpRecord, ...]
) -> None:
    world, station = begun(PLAN, sent)
    station.send(message, wait_s=3)
    assert acks(station)[-1] is answer
    assert stored == () or len(acks(station)) == 1
    assert (state(world), world.stored) == (None, stored)


@pytest.mark.parametrize("sent", [0, 7])
def test_a_late_ack_of_a_download_does_not_end_the_upload(sent: int) -> None:
    """Mission Planner ends a Read with MISSION_ACK, which the network may delay, and *Write Fast* with another."""
    world, station = begun(PLAN, sent)
    station.send(ack_message(A.ACCEPTED), wait_s=0.2 if sent else 1)
    finish(world, station, PLAN, sent)


@pytest.mark.parametrize(
    ("sent", "answer", "stored"),
    [(0, A.OPERATION_CANCELLED, OLD_RECORDS), (4, A.OPERATION_CANCELLED, OLD_RECORDS), (8, A.ACCEPTED, WRITTEN)],
)
def test_a_count_of_0_cancels_but_does_not_clear(
    sent: int, answer: MissionResult, stored: tuple[WpRecord, ...]
) -> None:
    """It is Mission Planner's Cancel button, repeated if the answer is lost; the list on board must not be erased."""
    world, station = begun(PLAN, sent)
    for _ in range(4):
        station.send(count_message(0), wait_s=0.7)
        assert set(acks(station)) == {answer}
        assert world.stored == stored
    world.run(1)
    station.send(count_message(0), wait_s=1)
    assert acks(station)[-1] is A.ACCEPTED
    assert world.stored == ()


def test_a_new_count_clears_the_previous_refusal(world: World, station: GroundStation) -> None:
    refused(world, station, 147, A.NO_SPACE, "only 146 fit")
    assert Upload(station, waypoints(5)).run() is A.ACCEPTED
    station.ask(item_message(1, OLD[1]), wait_s=0.1)
    assert acks(station) == []


# While items arrive.


@pytest.mark.parametrize("as_int", [True, False])
def test_each_item_is_requested_once_with_mission_request(world: World, station: GroundStation, as_int: bool) -> None:
    items = waypoints(146)
    stored_at_ack = listen_for_acks(world, station)
    assert Upload(station, items, as_int=as_int).run() is A.ACCEPTED
    assert requested(station) == list(range(146))
    assert stored_at_ack == [records_of(items if as_int else rounded(items))]
    assert {(m.target_system, m.target_component) for m in station.messages("MISSION_REQUEST")} == {(255, 190)}
    world.assert_line_was_clean()


@pytest.mark.parametrize("sent", [0, 3])
def test_an_unanswered_request_is_repeated_for_five_seconds(sent: int) -> None:
    world, station = begun(waypoints(8), sent)
    began = world.now
    world.wait_until(lambda _: bool(acks(station)), 10)
    assert world.now - began == pytest.approx(5.0, abs=0.05)
    assert acks(station) == [A.OPERATION_CANCELLED]
    assert any("stalled for 5 s" in text for text in station.texts())
    times = [at - began for at, message in station.received if message.get_type() == "MISSION_REQUEST"]
    assert set(requested(station)) == {sent}
    assert times[0] == pytest.approx(0.25, abs=0.05)
    # Often at first, because QGroundControl gives up after 1.5 s; Mission Planner gives up after ten.
    assert len([at for at in times if at < 1.5]) >= (2 if sent == 0 else 5)
    assert len(times) <= 10
    # At growing intervals.
    gaps = [round(later - earlier, 3) for earlier, later in pairwise(times)]
    assert gaps == sorted(gaps)
    assert world.stored == OLD_RECORDS
    assert_refusal_is_repeated(world, station, A.OPERATION_CANCELLED)
    assert world.store.outcomes() == ([Outcome.CANCELLED] if sent else [])


@pytest.mark.parametrize(("round_trip_s", "copies"), [(0.2, 1), (0.6, 2), (1.0, 3), (2.0, 4)])
def test_the_timeout_adapts_to_the_round_trip(round_trip_s: float, copies: int) -> None:
    """A repeated request costs Mission Planner one of its ten tries.

    The first request is repeated until it is answered. Each copy is answered by an item; only the first leads to the
    next request.
    """
    _, station = holding()
    station.radio = Radio(delay_s=round_trip_s / 2)
    upload = Upload(station, waypoints(30), repeat_s=10)
    assert upload.run(120) is A.ACCEPTED
    counts = [requested(station).count(seq) for seq in range(30)]
    # Again while item 1 takes longer than expected.
    assert counts[0] >= copies
    # The round trip is known after some items.
    assert max(counts[4:]) == {1.0: 2, 2.0: 3}.get(round_trip_s, 1)


def test_four_copies_of_a_lost_request_arrive_before_mavsdk_gives_up(world: World, station: GroundStation) -> None:
    """It waits 2.5 s for the next request."""
    station.radio = Radio(delay_s=0.2)
    items = waypoints(8)
    asked: dict[int, list[float]] = {seq: [] for seq in range(8)}

    def answer(message: Message) -> None:
        if message.get_type() == "MISSION_REQUEST":
            asked[message.seq].append(world.now)
            if len(asked[message.seq]) == (4 if message.seq == 4 else 1):
                station.send(item_message(message.seq, items[message.seq]))

    station.on_message.append(answer)
    station.send(count_message(8))
    world.wait_until(lambda _: bool(acks(station)), 60)
    assert acks(station) == [A.ACCEPTED]
    assert asked[4][3] - asked[4][0] < 2.5


@pytest.mark.parametrize("late_s", [0.1, 2.0])
def test_a_cancel_that_crosses_a_refusal_keeps_the_mission(world: World, station: GroundStation, late_s: float) -> None:
    items = waypoints(8)
    items[5] = replace(items[5], command=21)  # LAND must be last
    receiving(world, station, items, 6)
    world.run(0.1)
    station.take()
    world.run(late_s)
    station.ask(count_message(0), wait_s=1)
    assert acks(station) == [A.INVALID]
    assert world.stored == OLD_RECORDS


def test_a_repeated_count_of_0_does_not_cancel_the_clear(world: World, station: GroundStation) -> None:
    hanging_push(world)
    world.run(1)
    for _ in range(3):
        station.send(count_message(0), wait_s=0.3)
    assert acks(station) == []
    world.run(4)
    assert acks(station) == [A.ACCEPTED]
    assert world.stored == ()


def test_a_list_that_breaks_a_rule_is_refused_at_once(world: World, station: GroundStation) -> None:
    items = waypoints(30)
    items[12] = replace(items[12], command=21)  # LAND must be last
    upload = Upload(station, items)
    assert upload.run() is A.INVALID
    assert upload.requested == list(range(13))
    assert any("LAND must be last" in text for text in station.texts())
    assert_refusal_is_repeated(world, station, A.INVALID)
    assert world.stored == OLD_RECORDS
    assert world.store.outcomes() == [Outcome.REJECTED]


def test_the_summary_comes_last_and_goes_only_to_the_writer(world: World, station: GroundStation) -> None:
    other = GroundStation(world, "other", sysid=254)
    other.send(ack_message(A.ACCEPTED))
    items = waypoints(40)
    for seq in range(5, 25):
        items[seq] = replace(items[seq], command=178)
    items[30] = replace(items[30], frame=Frame.GLOBAL)
    assert Upload(station, items).run() is A.ACCEPTED
    world.run(0.1)
    texts = [(text.severity, text.text) for text in station.messages("STATUSTEXT") if "naze" not in text.text]
    assert texts == [
        (5, "20 items: DO_CHANGE_SPEED dropped, not supported"),
        (5, "WP 30: Alt flown above home, not above sea level"),
        (4, "20 of 40 stored: 20 dropped, 1 Alt now relative"),
    ]
    assert [text.text for text in other.messages("STATUSTEXT")] == ["New mission, 20 items, by gcs"]


def test_changes_that_cannot_matter_are_not_spoken(world: World, station: GroundStation) -> None:
    """QGroundControl speaks NOTICE; its take-off has coordinates, and home a height of 0 without terrain data."""
    home, first, *rest = waypoints(6)
    items = [replace(home, alt_m=0.0), replace(first, command=Command.NAV_TAKEOFF, p2=0.0, alt_m=10.0), *rest]
    screen = Screens(station).qgc
    assert Upload(station, items).run() is A.ACCEPTED
    world.run(0.1)
    assert not any(text.startswith(("Home", "WP 1")) for text in station.texts())
    assert (screen.heard(), screen.dialogs) == ([], [])


@pytest.mark.parametrize("lose", [World.unplug, World.power_off])
@pytest.mark.parametrize("sent", [0, 4, 30])
def test_the_flight_controller_is_lost_during_the_write(lose: Callable[[World], None], sent: int) -> None:
    world, station = begun(waypoints(30), sent)
    world.run(0.05 if sent == 30 else 0.001)
    station.take()
    lose(world)
    world.run(4)
    assert acks(station) == [A.DENIED]
    assert state(world) is None
    assert world.stored == OLD_RECORDS
    world.plug() if lose is World.unplug else world.power_on()
    world.run(world.naze.options.boot_ms / 1000 + 3)
    assert Upload(station, waypoints(30)).run() is A.ACCEPTED


def test_the_flight_controller_is_lost_while_it_is_asked(world: World, station: GroundStation) -> None:
    station.send(count_message(5), wait_s=0.0005)
    assert state(world) is Asking
    world.unplug()
    world.run(0.1)
    assert acks(station) == [A.DENIED]


@pytest.mark.parametrize("failing", [True, False])
def test_a_failing_or_slow_store_does_not_prevent_an_upload(failing: bool) -> None:
    world, station = holding()
    world.store.failing = failing
    world.store.delay_s = 0.7
    assert_written(station, waypoints(20))
    world.run(0.1)
    assert ("The mission could not be stored on the Pi" in station.texts()) is failing


def test_uploads_over_a_bad_radio_link_are_exact_or_refused() -> None:
    accepted = 0
    for seed in seeds(3):
        world = ready_world(seed=seed, flash=OLD_FLASH)
        station = GroundStation(world, radio=Radio(loss=0.1, repeat=0.1, delay_s=0.1 * (seed % 3), spread_s=0.05))
        items = waypoints(25, seed)
        result = Upload(station, items).run(120)
        world.run(6)
        assert world.stored == (records_of(items) if result is A.ACCEPTED else world.stored)
        assert world.stored in (records_of(items), OLD_RECORDS)
        accepted += result is A.ACCEPTED
        world.assert_line_was_clean()
    assert accepted >= 2


@pytest.mark.parametrize("late_s", [0.02, 0.2])
def test_late_wake_ups_do_not_lose_items(late_s: float) -> None:
    for seed in seeds(2):
        world = ready_world(seed=seed, flash=OLD_FLASH, late_s=late_s)
        station = GroundStation(world, radio=Radio(loss=0.05, repeat=0.05, delay_s=0.02, spread_s=0.02))
        items = waypoints(40, seed)
        assert Upload(station, items).run(60) is A.ACCEPTED
        assert world.stored == records_of(items)
        world.run(10)
        assert world.events("fc.lost") == []
        world.assert_line_was_clean()


def test_a_flood_of_requests_does_not_fill_queues(world: World, station: GroundStation) -> None:
    """The world checks the queue of conversations; the other queues are checked here."""
    for number in range(3000):
        station.send(count_message(5 + number % 90))
        station.send(item_message(0, OLD[0]))
        if number % 7 == 0:
            world.run(0.0001)
    world.run(10)
    assert len(world.store.missions) < 20
    assert Upload(station, waypoints(5)).run() is A.ACCEPTED
