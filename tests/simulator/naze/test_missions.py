# SPDX-License-Identifier: GPL-3.0-or-later
"""The patched firmware's own MAVLink upload, in the model; tests/real_board checks the image."""

from itertools import count

import pytest

from protocols.msp.mission import INFO_REQUEST, decode_info
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.board.simulated_board import Power
from tests.support.mavlink_ground import UNKNOWN, MavlinkGround, item
from tests.support.naze_bench import BOOT_SECONDS, Bench, mission

ACCEPTED, ERROR = 0, 1
_WRITTEN_S = 3.0
_AUTOSENSE_S = 5.0


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def ground(bench: Bench) -> MavlinkGround:
    bench.run(_AUTOSENSE_S)
    return MavlinkGround(bench)


def stored(bench: Bench) -> int:
    """The number of stored records reported by the extension once the board accepts MSP again."""
    bench.run(_WRITTEN_S + _AUTOSENSE_S)
    info = decode_info(bench.payload(INFO_REQUEST, 3.0))
    assert info is not None
    return info.stored.count


def power_cycle(bench: Bench) -> None:
    bench.naze.power_off(bench.now)
    bench.naze.power_on(bench.now)
    bench.run(BOOT_SECONDS + 0.1)


@pytest.mark.parametrize("cut", [False, True])
def test_an_accepted_upload_is_stored_and_survives_a_power_cut(bench: Bench, ground: MavlinkGround, cut: bool) -> None:
    assert ground.upload(4) == ACCEPTED
    if cut:
        power_cycle(bench)
    assert stored(bench) == 4
    assert [record.height_m for record in bench.pull()] == [20, 21, 22, 23]


def test_a_cleared_list_survives_a_power_cut(bench: Bench) -> None:
    bench.push(mission(3))
    bench.run(_AUTOSENSE_S)
    assert MavlinkGround(bench).upload(2, replace={1: UNKNOWN}) == ACCEPTED
    power_cycle(bench)
    assert stored(bench) == 0


def test_a_repeated_last_item_gets_the_same_ack(bench: Bench, ground: MavlinkGround) -> None:
    assert ground.upload(4) == ACCEPTED
    for _ in range(3):
        assert ground.answer_to(item(3)) == ACCEPTED
    assert ground.answer_to(item(2)) == ERROR
    assert stored(bench) == 4
    bench.run(_AUTOSENSE_S)
    # The last item of a list that was given up was never accepted.
    assert ground.upload(4, stop_after=2) is None
    bench.run(1.0)
    assert ground.answer_to(item(3)) == ERROR


@pytest.mark.parametrize("old", [0, 3])
def test_an_interrupted_upload_keeps_the_old_list(bench: Bench, old: int) -> None:
    if old:
        bench.push(mission(old))
    bench.run(_AUTOSENSE_S)
    assert MavlinkGround(bench).upload(5, stop_after=2) is None
    assert stored(bench) == old
    assert bench.pull() == mission(old)


def test_an_upload_while_armed_is_an_error() -> None:
    bench = Bench(SimOptions(tele_prot=TelemetryProtocol.MAVLINK), Faults(armed=True))
    bench.run(1.0)
    assert MavlinkGround(bench).upload(4) == ERROR


def test_without_the_extension_a_power_cut_during_the_write_loses_the_list() -> None:
    """Harakiri keeps it in its configuration, of which there is one copy (writeParams)."""
    for operation in count(1):
        bench = Bench(faults=Faults(extension=False, msp=False))
        ground = MavlinkGround(bench)
        bench.run(1)
        assert ground.upload(3) == ACCEPTED
        bench.run(3)
        assert len(bench.naze.stored_records) == 3
        bench.naze.faults.power_cut_at_flash_operation = operation
        assert ground.upload(4) == ACCEPTED
        bench.run(3)
        if bench.naze.power is not Power.OFF:
            break
        bench.naze.power_on(bench.now)
        bench.run(BOOT_SECONDS + 0.1)
        assert bench.naze.stored_records == []
    assert operation > 1
    assert len(bench.naze.stored_records) == 4
