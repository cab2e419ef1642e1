# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's own MAVLink upload alongside the mission extension: tests for the model and the image."""

from collections.abc import Callable

from protocols.msp.mission import INFO_REQUEST, decode_info
from tests.support.mavlink_ground import UNKNOWN, MavlinkGround, item
from tests.support.naze_bench import WireBench, mission

ACCEPTED, ERROR = 0, 1
_WRITTEN_S = 3.0
_AUTOSENSE_S = 5.0


def count(bench: WireBench) -> int:
    """The number of stored records reported by the extension once the board accepts MSP again."""
    bench.run(_WRITTEN_S + _AUTOSENSE_S)
    info = decode_info(bench.payload(INFO_REQUEST, 3.0))
    assert info is not None
    return info.stored.count


def an_upload_becomes_the_stored_list(bench: WireBench) -> None:
    bench.run(_AUTOSENSE_S)
    assert MavlinkGround(bench).upload(4) == ACCEPTED
    assert count(bench) == 4
    assert [record.height_m for record in bench.pull()] == [20, 21, 22, 23]


def an_accepted_upload_survives_a_power_cut(bench: WireBench, power_cycle: Callable[[], object]) -> None:
    bench.run(_AUTOSENSE_S)
    assert MavlinkGround(bench).upload(4) == ACCEPTED
    power_cycle()
    assert count(bench) == 4


def a_cleared_list_survives_a_power_cut(bench: WireBench, power_cycle: Callable[[], object]) -> None:
    bench.push(mission(3))
    bench.run(_AUTOSENSE_S)
    assert MavlinkGround(bench).upload(2, replace={1: UNKNOWN}) == ACCEPTED
    power_cycle()
    assert count(bench) == 0


def a_repeated_last_item_gets_the_same_ack(bench: WireBench) -> None:
    bench.run(_AUTOSENSE_S)
    ground = MavlinkGround(bench)
    assert ground.upload(4) == ACCEPTED
    for _ in range(3):
        assert ground.answer_to(item(3)) == ACCEPTED
    assert ground.answer_to(item(2)) == ERROR
    assert count(bench) == 4
    bench.run(_AUTOSENSE_S)
    # The last item of a list that was given up was never accepted.
    assert ground.upload(4, stop_after=2) is None
    bench.run(1.0)
    assert ground.answer_to(item(3)) == ERROR


def an_interrupted_upload_keeps_the_old_list(bench: WireBench) -> None:
    bench.run(_AUTOSENSE_S)
    assert MavlinkGround(bench).upload(4, stop_after=2) is None
    assert count(bench) == 0
    records = mission(3)
    bench.push(records)
    bench.run(_AUTOSENSE_S)
    assert MavlinkGround(bench).upload(5, stop_after=2) is None
    assert count(bench) == 3
    assert bench.pull() == records


def an_upload_while_armed_is_an_error(bench: WireBench, arm: Callable[[], None]) -> None:
    arm()
    bench.run(1.0)
    assert MavlinkGround(bench).upload(4) == ERROR
