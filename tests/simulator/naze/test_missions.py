# SPDX-License-Identifier: GPL-3.0-or-later
"""The patched firmware's own MAVLink upload, in the model; tests/real_board checks the image."""

from itertools import count

from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.board.simulated_board import Power
from tests.support import mavlink_missions as page
from tests.support.mavlink_ground import MavlinkGround
from tests.support.naze_bench import BOOT_SECONDS, Bench


def test_an_upload_becomes_the_stored_list() -> None:
    page.an_upload_becomes_the_stored_list(Bench())


def test_an_accepted_upload_survives_a_power_cut() -> None:
    bench = Bench()
    page.an_accepted_upload_survives_a_power_cut(bench, lambda: power_cycle(bench))


def test_a_cleared_list_survives_a_power_cut() -> None:
    bench = Bench()
    page.a_cleared_list_survives_a_power_cut(bench, lambda: power_cycle(bench))


def power_cycle(bench: Bench) -> None:
    bench.naze.power_off(bench.now)
    bench.naze.power_on(bench.now)
    bench.run(BOOT_SECONDS + 0.1)


def test_a_repeated_last_item_gets_the_same_ack() -> None:
    page.a_repeated_last_item_gets_the_same_ack(Bench())


def test_an_interrupted_upload_keeps_the_old_list() -> None:
    page.an_interrupted_upload_keeps_the_old_list(Bench())


def test_an_upload_while_armed_is_an_error() -> None:
    bench = Bench(SimOptions(tele_prot=TelemetryProtocol.MAVLINK), Faults())
    page.an_upload_while_armed_is_an_error(bench, lambda: setattr(bench.naze.faults, "armed", True))


def test_without_the_extension_a_power_cut_during_the_write_loses_the_list() -> None:
    """Harakiri keeps it in its configuration, of which there is one copy (writeParams)."""
    for operation in count(1):
        bench = Bench(faults=Faults(extension=False, msp=False))
        ground = MavlinkGround(bench)
        bench.run(1)
        assert ground.upload(3) == page.ACCEPTED
        bench.run(3)
        assert len(bench.naze.stored_records) == 3
        bench.naze.faults.power_cut_at_flash_operation = operation
        assert ground.upload(4) == page.ACCEPTED
        bench.run(3)
        if bench.naze.power is not Power.OFF:
            break
        bench.naze.power_on(bench.now)
        bench.run(BOOT_SECONDS + 0.1)
        assert bench.naze.stored_records == []
    assert operation > 1
    assert len(bench.naze.stored_records) == 4
