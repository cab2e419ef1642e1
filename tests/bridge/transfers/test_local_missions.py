# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line and ground stations write one after the other."""

from bridge.transfers.upload_states import Delivering
from tests.support.conversations import count_message, item_message, records_of, waypoints
from tests.support.upload_bench import A, acks, hanging_push, holding, requested, state


def test_an_upload_waits_for_a_push_from_the_command_line() -> None:
    world, station = holding()
    hanging_push(world)
    for _ in range(4):
        station.send(count_message(5))
        world.run(0.7)
    assert station.messages("MISSION_ACK", "MISSION_REQUEST", "STATUSTEXT") == []
    world.run(1)
    assert set(requested(station)) == {0}


def test_a_push_from_the_command_line_waits_for_an_upload() -> None:
    world, station = holding()
    outcome = world.push(waypoints(146))
    station.send(count_message(5))
    world.run(0.05)
    assert requested(station) == []
    world.wait_until(lambda _: bool(outcome), 2)
    world.run(0.1)
    assert requested(station) == [0]
    for seq, item in enumerate(waypoints(5)):
        station.send(item_message(seq, item))
    world.run(0.02)
    assert state(world) is Delivering
    world.push(waypoints(3))
    world.wait_until(lambda _: bool(acks(station)), 2)
    assert acks(station) == [A.ACCEPTED]
    assert world.stored == records_of(waypoints(5))
    world.run(1)
    assert world.stored == records_of(waypoints(3))
