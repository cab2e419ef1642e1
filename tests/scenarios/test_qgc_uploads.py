# SPDX-License-Identifier: GPL-3.0-or-later
"""QGroundControl's transfers over lossy links, each compared with the same transfer with an ideal vehicle."""

import os
import random
from collections.abc import Sequence

import pytest

from protocols.mission_item import MissionItem, MissionResult
from tests.support.conversations import records_of, waypoints
from tests.support.qgc_upload import Begin, FatedLink, QgcDownload, QgcStation, QgcUpload, with_ideal_vehicle
from tests.support.world import World, flash_holding

#: Of each kind; `make soak` has 200.
UPLOADS = int(os.environ.get("UPLOADS", "20"))
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


def uploads(items: Sequence[MissionItem]) -> Begin:
    return lambda clock, send: QgcUpload(clock, send, items)


@pytest.mark.parametrize("first_seed", range(0, UPLOADS, 20))
@pytest.mark.parametrize("loss", [0.05, 0.1, 0.15])
def test_uploads_succeed_wherever_an_ideal_vehicle_would(loss: float, first_seed: int) -> None:
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
    assert [seed for seed in failed if all(with_ideal_vehicle(seed, loss, uploads(waypoints(15, seed))))] == []


@pytest.mark.parametrize("kind", ["download", "upload"])
@pytest.mark.parametrize("first_seed", range(0, UPLOADS, 40))
def test_the_final_ack_never_meets_the_next_transfer(first_seed: int, kind: str) -> None:
    """Which begins 0.1 to 0.5 s after the end of an upload. To QGroundControl a late ack is the next transfer's end."""
    failed: list[int] = []
    foreign: list[int] = []
    for seed in range(first_seed, first_seed + 20):
        draw = random.Random(f"{seed} {kind}")
        loss, pause_s = draw.uniform(0.0, 0.15), draw.uniform(0.1, 0.5)
        first = uploads(waypoints(draw.randint(3, 15), seed))
        second: Begin = QgcDownload if kind == "download" else uploads(waypoints(draw.randint(3, 15), seed + 1000))
        world, station, _ = qgroundcontrol(seed, loss)
        begun = []
        for pause, begin in ((0.0, first), (pause_s, second)):
            world.run(pause)
            transfer = station.upload = begin(world, station.send)
            begun.append(transfer)
            world.run_until(lambda _, transfer=transfer: transfer.is_over, 120)  # type: ignore[misc]
        world.run(3.0)
        foreign += [seed for transfer in begun if transfer.took_foreign_ack]
        if any(transfer.gave_up for transfer in begun):
            failed += [seed] * all(with_ideal_vehicle(seed, loss, first, (pause_s, second)))
    assert (foreign, failed) == ([], [])


@pytest.mark.parametrize("first_seed", range(20, 20 + UPLOADS, 20))
def test_an_abandoned_list_is_never_mixed_with_the_next(first_seed: int) -> None:
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
