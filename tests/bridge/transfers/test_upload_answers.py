# SPDX-License-Identifier: GPL-3.0-or-later
"""The final ack: once, repeated if it is lost, and none to a station that went on."""

import pytest

from bridge.transfers.upload_states import Delivering
from protocols.mavlink.dialect import Message, messages
from simulator.board.options import SimOptions
from tests.support.conversations import ack_message, count_message, item_message, list_message, waypoints
from tests.support.qgc_upload import QGC_HEARTBEAT
from tests.support.upload_bench import (
    A,
    acks,
    begun,
    holding,
    partial_list_message,
    receiving,
    refused,
    requested,
    state,
)
from tests.support.world import GroundStation, World


def test_a_refusal_is_remembered_for_ten_seconds(world: World, station: GroundStation) -> None:
    refused(world, station, 147, A.NO_SPACE, "only 146 fit")
    world.run(10.5)
    station.ask(partial_list_message(), wait_s=1)
    assert acks(station) == [A.UNSUPPORTED]
    assert "A mission can only be written as a whole" in station.texts()


def test_a_repeated_last_item_is_answered_by_the_final_ack() -> None:
    items = waypoints(146)
    world, station = begun(items, 146, SimOptions(flash_erase_ms=1200))
    for _ in range(3):
        station.send(item_message(145, items[145]), wait_s=0.3)
        assert state(world) is Delivering
        assert acks(station) == []
        assert requested(station) == []
    world.wait_until(lambda _: bool(acks(station)), 3, then_s=1)
    for _ in range(4):
        station.ask(item_message(145, items[145]), wait_s=0.45)
        assert acks(station) == [A.ACCEPTED]
        assert state(world) is None
    # Only the last item.
    station.ask(item_message(20, items[20]), wait_s=0.45)
    assert acks(station) == []
    assert world.naze.counters.flash_writes == 2


def test_a_lost_final_ack_is_sent_again() -> None:
    items = waypoints(20)
    world, station = begun(items, 19)
    station.radio.loss = 1.0
    world.receive_from(station, station.pack(item_message(19, items[19])))
    world.run(1.5)
    station.radio.loss = 0.0
    assert acks(station) == []
    station.send(item_message(19, items[19]), wait_s=0.1)
    assert acks(station) == [A.ACCEPTED]


def test_the_final_ack_is_repeated_before_the_station_can_go_on(world: World, station: GroundStation) -> None:
    """QGroundControl never asks for it again, and takes one that comes during its next transfer for that one's end."""
    station.send(QGC_HEARTBEAT)
    receiving(world, station, waypoints(8), 8)
    world.run(5)
    first, *again = [at for at, message in station.received if message.get_type() == "MISSION_ACK"]
    assert len(again) == 3
    assert again[-1] < first + 0.1


@pytest.mark.parametrize("lost", [0, 1])
def test_mavsdk_gets_the_final_ack_again_only_if_the_link_loses_frames(
    world: World, station: GroundStation, lost: int
) -> None:
    """A script begins its next upload at once, and a repeated ack would end that."""
    station.send(messages.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0))
    items = waypoints(8)
    receiving(world, station, items, 7)
    world.run(lost)
    station.send(item_message(7, items[7]), wait_s=5)
    assert len(acks(station)) == 1 + 3 * lost


def test_a_final_ack_that_a_busy_machine_delays_is_not_repeated() -> None:
    """It could reach the station during its next transfer."""
    world, station = holding()
    station.send(QGC_HEARTBEAT)
    receiving(world, station, waypoints(8), 8)
    world.wait_until(lambda _: bool(acks(station)), 3)
    world.now += 0.2
    world.run(1)
    assert len([message for _, message in station.received if message.get_type() == "MISSION_ACK"]) == 1


@pytest.mark.parametrize("next_message", [list_message(), count_message(5), ack_message(A.ACCEPTED)])
def test_a_station_that_continues_gets_a_single_final_ack(next_message: Message) -> None:
    world, station = holding()
    station.send(QGC_HEARTBEAT)
    receiving(world, station, waypoints(8), 8)
    world.wait_until(lambda _: bool(acks(station)), 3)
    station.send(next_message, wait_s=1)
    assert len([at for at, message in station.received if message.get_type() == "MISSION_ACK"]) == 1


def test_an_item_that_crosses_the_final_ack_is_ignored() -> None:
    """The bridge has requested it again while it wrote the list, or the network has doubled it."""
    items = waypoints(8)
    world, station = begun(items, 8)
    world.wait_until(lambda _: bool(acks(station)), 3)
    station.send(item_message(7, items[7]), wait_s=0.2)
    assert len(station.messages("MISSION_ACK")) == 1


def test_the_final_ack_comes_within_two_seconds_of_the_last_item() -> None:
    """With a flash that stalls for 300 ms and a slow store."""
    world, station = holding(SimOptions(flash_erase_ms=300))
    world.store.delay_s = 0.3
    items = waypoints(146)
    receiving(world, station, items, 145)
    station.send(item_message(145, items[145]))
    assert world.wait_until(lambda _: bool(acks(station)), 5) <= 2.0
    assert acks(station) == [A.ACCEPTED]
