# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVSDK, daemon, pty and simulated UART with the flight controller's real C code."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from mavsdk.asyncio.plugins.mavlink_direct.mavlink_direct import MavlinkDirectAsync, MavlinkMessage
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync

from tests.e2e.test_mavsdk import fields, raw_items, vehicle_at
from tests.support.benches import Bench, Starter
from tests.support.c_core import library
from tests.support.plan import expected_fields, judge, mixed_plan, records_of
from tests.support.programs import run_naze_bridge, until


def sealed_slots(flash: Path, records: list[str]) -> int:
    """Count the slots that hold these records, as firmware/naze_mission.h lays them out."""
    chip, wanted = flash.read_bytes(), bytes.fromhex("".join(records))
    slots = (chip[at : at + 3072] for at in (0, 3072))
    return sum(slot[:2] == b"NM" and slot[16:18] == b"\0\0" and slot[32:].startswith(wanted) for slot in slots)


@pytest.fixture
def core(start: Starter, tmp_path: Path) -> Iterator[tuple[Bench, Path]]:
    """A bench and the path of the board's flash."""
    bench = start.bench("--core", str(library()), "--state", str(tmp_path / "flash"))
    yield bench, tmp_path / "flash"
    bench.board.assert_unharmed()


async def test_146_items_are_written_and_read_back(core: tuple[Bench, Path]) -> None:
    (bench, flash), plan = core, mixed_plan(146)
    board, records = bench.board, records_of(judge(plan))
    async with vehicle_at(bench.daemon.port) as vehicle:
        missions = MissionRawAsync(vehicle)
        await missions.upload_mission(raw_items(plan))
        assert board.records() == records
        assert sealed_slots(flash, records) == 1
        assert [fields(item) for item in await missions.download_mission()] == expected_fields(plan)
        written = board.stats()["flash_writes"]
        await missions.upload_mission(raw_items(plan))
        assert board.stats()["flash_writes"] == written
        clear_all = '{"target_system": 1, "target_component": 1, "mission_type": 0}'
        await MavlinkDirectAsync(vehicle).send_message(MavlinkMessage("MISSION_CLEAR_ALL", 245, 190, 1, 1, clear_all))
        until(lambda: board.records() == [], "an empty board")
        assert len(await missions.download_mission()) <= 1  # home
        assert board.stats()["flash_writes"] == written + 1


def test_a_library_that_is_not_the_core_is_refused(tmp_path: Path) -> None:
    wrong = tmp_path / "core.so"
    wrong.write_text("not a library")
    for options, reason in [
        (("--core", str(wrong)), "the core cannot be loaded"),
        (("--core", str(tmp_path / "none.so")), "does not exist"),
        (("--core", str(library()), "--capacity", "20"), "holds 146 records: omit --capacity"),
    ]:
        result = run_naze_bridge("sim", "--link", str(tmp_path / "naze"), *options)
        assert result.returncode != 0
        assert reason in result.stderr
        assert "Traceback" not in result.stderr
