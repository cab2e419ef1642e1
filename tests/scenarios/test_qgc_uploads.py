# SPDX-License-Identifier: GPL-3.0-or-later
"""QGroundControl's uploads over lossy links, each compared with the same upload to an ideal vehicle."""

import random

import pytest

from protocols.mission_item import MissionResult
from tests.support.conversations import records_of, waypoints
from tests.support.qgc_upload import FatedLink, QgcStation, QgcUpload, upload_to_ideal_vehicle
from tests.support.world import World, flash_holding

OLD_RECORDS = records_of(waypoints(15, seed=777))
OLD_FLASH = flash_holding(OLD_RECORDS)
A = MissionResult


def qgroundcontrol(
    seed: int, loss: float, repeat: float = 0.03, jitter_s: float = 0.08
) -> tuple[World, QgcStation, FatedLink]:
    world = World(speeds=(115200,), seed=seed, flash=OLD_FLASH)
    world.wait_ready()
    link = FatedLink(world, seed, loss, repeat, jitter_s=jitter_s)
    return world, QgcStation(world, link, "qgc"), link


@pytest.mark.parametrize("first_seed", range(0, 200, 20))
@pytest.mark.parametrize("loss", [0.05, 0.1, 0.15])
def test_no_upload_fails_that_an_ideal_vehicle_would_save(loss: float, first_seed: int) -> None:
    failed = []
    for seed in range(first_seed, first_seed + 20):
        items = waypoints(15, seed)
        world, station, _ = qgroundcontrol(seed, loss)
        upload = station.upload = QgcUpload(world, station.send, items)
        world.run_until(lambda _, upload=upload: upload.is_over, 120)  # type: ignore[misc]
        if upload.result is A.ACCEPTED and not upload.gave_up:
            assert world.stored == records_of(items)
        else:
            failed.append(seed)
            assert world.stored in (records_of(items), OLD_RECORDS)
    assert [seed for seed in failed if upload_to_ideal_vehicle(waypoints(15, seed), seed, loss)] == []


@pytest.mark.parametrize("first_seed", [20, 140, 280])
def test_an_abandoned_list_is_never_mixed_with_the_next_one(first_seed: int) -> None:
    """Both have the same home and length, on a link that delays and doubles many messages.

    Its user begins the second one after the failure of the first, on a dead link.
    """
    accepted = 0
    for seed in range(first_seed, first_seed + 20):
        first, second = waypoints(15, seed), [*waypoints(1, seed), *waypoints(15, seed + 1000)[1:]]
        world, station, link = qgroundcontrol(seed, 0.1, repeat=0.3, jitter_s=0.3)
        station.upload = QgcUpload(world, station.send, first)
        world.run(random.Random(seed).uniform(0.1, 4.0))
        link.loss = 1.0
        world.run(2.6)
        link.loss = 0.1
        upload = station.upload = QgcUpload(world, station.send, second)
        world.run_until(lambda _, upload=upload: upload.is_over, 120)  # type: ignore[misc]
        is_accepted = upload.result is A.ACCEPTED and not upload.gave_up
        lists = [records_of(second)] if is_accepted else [OLD_RECORDS, records_of(first), records_of(second)]
        assert world.stored in lists
        accepted += is_accepted
    assert accepted >= 18
