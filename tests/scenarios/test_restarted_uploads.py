# SPDX-License-Identifier: GPL-3.0-or-later
"""Ground stations begin another list of the same length while the first one arrives: the two are never mixed."""

import random
from dataclasses import replace

import pytest

from protocols.mission_item import MissionItem, MissionResult
from tests.support.conversations import records_of, waypoints
from tests.support.qgc_upload import QgcUpload
from tests.support.restarting_senders import (
    MavproxyUpload,
    MavsdkUpload,
    PlannerUpload,
    Restarter,
    SentList,
    StubbornUpload,
)
from tests.support.world import Radio, World, flash_holding

A = MissionResult
_COUNT = 6
OLD_RECORDS = records_of(waypoints(15, seed=777))
OLD_FLASH = flash_holding(OLD_RECORDS)
#: MAVProxy repeats nothing; MAVSDK does not repeat its MISSION_COUNT after a request for an item of the previous list.
_REPEATING = [PlannerUpload, QgcUpload, StubbornUpload]
_KINDS = [*_REPEATING, MavsdkUpload, MavproxyUpload]


def _changed(items: list[MissionItem], chance: random.Random) -> list[MissionItem]:
    """The list as edited by its user: several items differ, now and then home."""
    changed = set(chance.sample(range(0 if chance.random() < 0.3 else 1, len(items)), chance.randint(2, 4)))
    return [replace(item, alt_m=item.alt_m + 5) if item.seq in changed else item for item in items]


def restarted(kind: type[SentList | QgcUpload], seed: int, radio: Radio) -> bool:
    """True if the second list was accepted. No mixed list may be on board, whatever the station believes."""
    chance = random.Random(seed)
    first = waypoints(_COUNT, seed)
    second = _changed(first, chance)
    world = World(speeds=(115200,), seed=seed, flash=OLD_FLASH)
    world.wait_ready()
    at, delay_s = seed % (_COUNT + 1) - 1, chance.choice([0.0, 0.01, 0.05, 0.3]) * chance.random()
    station = Restarter(world, kind, [first, second], at, delay_s, radio)
    world.run_until(lambda _: station.is_over, 40)
    world.run(6)
    assert world.stored in (OLD_RECORDS, records_of(first), records_of(second))
    return station.upload.result is A.ACCEPTED and not station.upload.gave_up


@pytest.mark.parametrize("kind", _KINDS)
def test_two_lists_are_never_mixed(kind: type[SentList | QgcUpload]) -> None:
    """The second list begins after the MISSION_COUNT and after each item of the first."""
    accepted = sum(restarted(kind, seed, Radio(delay_s=0.01)) for seed in range(_COUNT + 1))
    if kind in _REPEATING:
        assert accepted >= _COUNT - 2


@pytest.mark.parametrize("kind", _KINDS)
def test_two_lists_are_never_mixed_on_a_network_that_delays_and_doubles(kind: type[SentList | QgcUpload]) -> None:
    for seed in range(_COUNT + 1):
        restarted(kind, seed, Radio(loss=0.2, repeat=0.2, delay_s=0.01, spread_s=0.15))
