# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line and ground stations exclude each other."""

from bridge.transfers.upload_states import Delivering
from tests.support.conversations import ack_message, count_message, item_message, records_of, waypoints
from tests.support.upload_bench import OLD, A, acks, hanging_push, requested, state
from tests.support.world import GroundStation, World


def test_an_upload_during_a_push_from_the_command_line_is_denied(world: World, station: GroundStation) -> None:
    hanging_push(world)
    for message in (count_message(5), count_message(5), item_message(0, OLD[1]), ack_message(A.ACCEPTED)):
        station.send(message)
    world.run(2.4)
    assert station.messages("MISSION_ACK", "MISSION_REQUEST", "STATUSTEXT") == []
    world.run(0.2)
    assert acks(station) == [A.DENIED]
    assert station.texts() == ["Another mission transfer is running: try again"]


def test_the_command_line_and_a_ground_station_exclude_each_other(world: World, station: GroundStation) -> None:
    outcome = world.push(waypoints(146))
    station.send(count_message(5), wait_s=0.05)
    assert requested(station) == []
    world.wait_until(lambda _: bool(outcome), 2, then_s=0.1)
    assert requested(station) == [0]
    assert any(text.startswith("test: ") for text in station.texts())
    for seq, item in enumerate(waypoints(5)):
        station.send(item_message(seq, item))
    world.run(0.02)
    assert state(world) is Delivering
    denied = world.push(waypoints(3))
    assert denied[0][0].text == "Another mission transfer is running: try again"
    world.run(1)
    assert acks(station) == [A.ACCEPTED]
    assert world.stored == records_of(waypoints(5))
