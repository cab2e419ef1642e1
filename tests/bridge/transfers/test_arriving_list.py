# SPDX-License-Identifier: GPL-3.0-or-later
"""A list arrives item by item: whole and in order, never mixed with another one."""

from dataclasses import replace
from functools import partial

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.transfers.upload_states import Delivering
from protocols.mavlink.dialect import Message
from protocols.mission_item import MissionItem
from tests.support.conversations import Upload, count_message, item_message, records_of, waypoints
from tests.support.upload_bench import A, acks, assert_written, begun, finish, holding, receiving, requested, state
from tests.support.world import GroundStation, Radio, World


def another(count: int) -> list[MissionItem]:
    """A list with the home of `waypoints(count, 1)`."""
    return [*waypoints(1, 1), *waypoints(count, 2)[1:]]


def assert_written_on_request(world: World, station: GroundStation, items: list[MissionItem]) -> None:
    """From now on the station answers each request with an item of this list, as MAVProxy and QGroundControl do."""

    def answer(message: Message) -> None:
        if message.get_type() == "MISSION_REQUEST":
            station.send(item_message(message.seq, items[message.seq]))

    station.on_message[:] = [answer]
    world.wait_until(lambda _: bool(acks(station)), 20)
    assert acks(station) == [A.ACCEPTED]
    assert world.stored == records_of(items)


def test_two_lists_are_never_mixed_if_a_burst_loses_the_first_item() -> None:
    """Mission Planner's "Write Fast" again, with another list of the same length."""
    before, after = waypoints(12, 1), waypoints(12, 2)
    world, station = begun(before, 6)
    station.send(count_message(12))
    for seq in range(1, 10):
        station.send(item_message(seq, after[seq]))
    world.run(0.5)
    assert requested(station)[-1] == 0
    finish(world, station, after)


@pytest.mark.parametrize("answered", [8, 18])
@pytest.mark.parametrize("repeat", [0.0, 1.0])
def test_two_lists_are_never_mixed_if_a_request_is_on_the_way(repeat: float, answered: int) -> None:
    """MAVProxy answers the request for an item of the old list with one of the new list, which has the same home."""
    world, station = holding()
    station.radio = Radio(repeat=repeat, delay_s=0.05)
    former = Upload(station, waypoints(20, 1))
    world.wait_until(lambda _: answered in former.requested, 10)
    former.stop()
    assert_written(station, another(20))


@pytest.mark.parametrize("count", [9, 16])
def test_two_lists_are_never_mixed_if_items_of_the_first_are_late(count: int) -> None:
    """MAVProxy had answered two requests for item 2, and both answers arrive after its next MISSION_COUNT."""
    former, items = waypoints(16, 1), another(count)
    world, station = begun(former, 2)
    late = [station.pack(item_message(2, former[2])) for _ in range(2)]
    station.radio = Radio(delay_s=0.02)
    upload = Upload(station, items)
    world.wait_until(lambda _: bool(upload.requested), 1)
    for data in late:
        world.at(world.now, partial(world.receive_from, station, data))
    assert upload.run() is A.ACCEPTED
    assert world.stored == records_of(items)


def test_two_lists_are_never_mixed_if_a_request_and_the_repeat_are_on_their_way() -> None:
    """MAVProxy answers both with its new list's last item."""
    former, items = waypoints(5, 1), another(5)
    world, station = begun(former, 4)
    world.wait_until(lambda _: 4 in requested(station), 2)
    station.send(count_message(5))
    for _ in range(2):
        station.send(item_message(4, items[4]), wait_s=0.01)
        assert state(world) is not Delivering
    assert_written_on_request(world, station, items)


def test_two_lists_are_never_mixed_if_the_second_count_is_lost() -> None:
    """To Mission Planner the repeated request for item 1 answers its new MISSION_COUNT: it sends item 0."""
    world, station = begun(waypoints(5, seed=1), 1)
    items = waypoints(5, seed=2)
    for seq, item in enumerate(items):
        station.send(item_message(seq, item))
    world.run(0.001)
    assert acks(station) == []
    assert_written_on_request(world, station, items)


@pytest.mark.parametrize("changed", [range(1, 12), range(3, 4), range(9, 10)])
def test_two_lists_are_never_mixed_if_the_first_was_stuck_and_the_second_count_is_lost(changed: range) -> None:
    """Both have the same home and length; the ground station sends MISSION_COUNT once."""
    former = waypoints(12, 1)
    latter = [replace(item, alt_m=item.alt_m + 5) if item.seq in changed else item for item in former]
    world, station = begun(former, 6)
    world.run(3.0)
    station.pack(count_message(12))
    assert_written_on_request(world, station, latter)


def test_a_list_is_requested_twice_if_a_frame_was_lost(world: World, station: GroundStation) -> None:
    items = waypoints(6)

    def lose(message: Message) -> None:
        if message.get_type() == "MISSION_REQUEST" and message.seq == 3:
            station.pack(count_message(6))

    station.on_message.append(lose)
    assert Upload(station, items).run() is A.ACCEPTED
    assert requested(station) == [0, 1, 2, 3, 4, 0, 1, 2, 3, 4, 5]
    assert world.stored == records_of(items)


def test_mission_planner_is_not_asked_for_its_items_again_after_a_lost_frame() -> None:
    """A request for another item than the next costs one of its ten tries."""
    world, station = holding()
    items = waypoints(6)
    station.send(messages.MAVLink_request_data_stream_message(1, 1, messages.MAV_DATA_STREAM_ALL, 4, 1))
    receiving(world, station, items, 4)
    for _ in range(3):
        station.pack(item_message(4, items[4]))
        world.run(0.3)
    station.send(item_message(4, items[4]), wait_s=0.001)
    assert requested(station) == [4, 4, 4, 5]
    finish(world, station, items, 5)


def test_a_list_whose_last_item_follows_a_lost_frame_is_requested_again() -> None:
    """MAVProxy does not answer after its last item: its list is not accepted."""
    first, second = waypoints(6, 1), another(6)
    world, station = begun(first, 5)
    station.pack(count_message(6))
    station.send(item_message(5, second[5]))
    world.wait_until(lambda _: bool(acks(station)), 10)
    assert set(requested(station)) == {0}
    assert acks(station) == [A.OPERATION_CANCELLED]
    assert world.stored == records_of(waypoints(20, seed=77))


def test_a_delayed_message_count_does_not_begin_the_list_again(world: World, station: GroundStation) -> None:
    items = waypoints(6)
    late = station.pack(count_message(6))
    receiving(world, station, items, 3)
    world.receive_from(station, late)
    finish(world, station, items, 3)


def test_two_lists_are_never_mixed_if_the_only_count_is_lost() -> None:
    """MAVProxy sends it once, and answers the previous list's repeated request with its present list's item."""
    former, items = waypoints(9, 1), another(9)
    world, station = begun(former, 4)
    station.radio = Radio(loss=1.0)
    upload = Upload(station, items, tries=0)
    station.radio = Radio()
    upload.gave_up = False
    station.send(item_message(3, items[3]))
    assert upload.run() is A.ACCEPTED
    assert world.stored == records_of(items)


def test_a_list_may_mix_float_and_int_items() -> None:
    items = waypoints(10)
    world, station = begun(items, 0)
    for seq, item in enumerate(items):
        station.send(item_message(seq, item, as_int=bool(seq % 2)))
    world.run(1)
    assert acks(station) == [A.ACCEPTED]


def test_a_burst_of_items_is_acknowledged_item_by_item() -> None:
    """Mission Planner's "Write Fast" sends ten at once, then waits for the request for the eleventh."""
    items = waypoints(40)
    world, station = begun(items, 0)
    for first in range(0, 40, 10):
        station.take()
        for seq in range(first, first + 10):
            station.send(item_message(seq, items[seq]))
        world.run(0.001)
        assert requested(station) == list(range(first + 1, min(first + 11, 40)))
    world.run(1)
    assert acks(station) == [A.ACCEPTED]
    assert world.stored == records_of(items)


def test_items_out_of_order_are_kept_and_missing_items_requested() -> None:
    items = waypoints(8)
    world, station = begun(items, 0)
    for seq, wanted in [(0, 1), (2, 1), (3, 1), (7, 1), (1, 4), (5, 4), (6, 4)]:
        station.ask(item_message(seq, items[seq]), wait_s=0.001)
        assert requested(station) == [wanted]
    station.send(item_message(4, items[4]), wait_s=1)
    assert acks(station) == [A.ACCEPTED]
    assert world.stored == records_of(items)


def test_a_repeated_item_gets_one_request_and_is_ignored() -> None:
    items = waypoints(8)
    world, station = begun(items, 5)
    for seq in (1, 4, 4, 2):
        world.run(0.12)
        station.ask(item_message(seq, items[seq]), wait_s=0.001)
        assert requested(station) == [5]
    finish(world, station, items, 5)


def test_duplicates_from_the_network_do_not_multiply_requests(world: World, station: GroundStation) -> None:
    items = waypoints(40)
    station.radio = Radio(repeat=0.1, delay_s=0.03, spread_s=0.02)
    upload = Upload(station, items, repeat_s=20)
    assert upload.run() is A.ACCEPTED
    world.run(10)
    assert world.stored == records_of(items)
    # Frames that overtake one another may look lost, then the list is read twice. If each duplicate caused another
    # request, there would be 45 times as many.
    assert len(requested(station)) <= 4 * len(items)


def test_an_item_beyond_the_list_is_an_invalid_sequence_and_the_transfer_continues() -> None:
    items = waypoints(8)
    world, station = begun(items, 3)
    for seq in (8, 9, 65535):
        station.ask(item_message(seq, items[0]), wait_s=0.001)
        assert acks(station) == [A.INVALID_SEQUENCE]
    finish(world, station, items, 3)
