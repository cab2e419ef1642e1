# SPDX-License-Identifier: GPL-3.0-or-later
"""Several vehicles at one ground station: frames reach the vehicle that they address, and no two share a system id."""

from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.dialect import Message
from tests.bridge.test_relay import PLAN, Bench, item_int


def connected(**systems: int) -> Bench:
    bench = Bench(**systems)
    bench.send(m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    assert {frame.sysid for frame, _ in bench.frames} == set(systems.values())
    return bench


def test_a_frame_reaches_the_vehicle_that_it_addresses_and_a_heartbeat_all() -> None:
    bench = connected(kite=1, owl=2)
    bench.send(m.MAVLink_param_request_list_message(2, 1))
    bench.send(m.MAVLink_param_request_list_message(3, 1))
    assert bench.to_vehicle == {"kite": ["HEARTBEAT"], "owl": ["HEARTBEAT", "PARAM_REQUEST_LIST"]}


def test_missions_for_two_vehicles_at_once_do_not_mix() -> None:
    bench = connected(kite=1, owl=2)
    counts = {1: 5, 2: 9}
    for system, count in counts.items():
        bench.send(m.MAVLink_mission_count_message(system, 1, count))
    while requests := {frame.sysid: each.seq for frame, each in bench.frames if each.get_type() == "MISSION_REQUEST"}:
        bench.frames.clear()
        for system, seq in requests.items():
            bench.send(_item(system, seq))
    assert {name: len(items) for name, items in bench.written.items()} == {"kite": 5, "owl": 9}


def test_a_mission_for_all_vehicles_is_for_none() -> None:
    bench = connected(kite=1, owl=2)
    assert bench.send(m.MAVLink_mission_clear_all_message(0, 0)) == []
    assert bench.written == {}
    alone = connected(kite=1)
    alone.send(m.MAVLink_mission_clear_all_message(0, 0))
    alone.run(0.1)
    assert alone.written == {"kite": ()}


def test_a_vehicle_whose_id_is_in_use_is_left_out_until_the_other_has_left() -> None:
    bench = connected(kite=1)
    before = len(bench.frames)
    bench.join("owl", 1)
    assert len(bench.frames) == before
    assert bench.clashes == [("owl", "kite", 1)]
    bench.send(m.MAVLink_param_request_list_message(1, 1))
    assert (bench.to_vehicle["kite"][-1], bench.to_vehicle["owl"]) == ("PARAM_REQUEST_LIST", [])
    bench.relays.remove("kite")
    bench.join("owl", 1)
    assert bench.relays.heard == {"owl"}


def _item(system: int, seq: int) -> Message:
    message = item_int(PLAN[seq])
    message.target_system = system
    return message
