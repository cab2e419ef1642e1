# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's own MAVLink upload on the patched image."""

from tests.support import mavlink_missions as page
from tests.support.real_bench import Figure, RealBench


def test_an_upload_becomes_the_stored_list(bench: RealBench, figure: Figure) -> None:
    page.an_upload_becomes_the_stored_list(bench)
    figure("MAVLink upload", "becomes the stored list")


def test_an_accepted_upload_survives_a_power_cut(bench: RealBench, figure: Figure) -> None:
    page.an_accepted_upload_survives_a_power_cut(bench, bench.power_cycle)
    figure("power cut right after a MAVLink upload's ack", "the list is stored")


def test_a_cleared_list_survives_a_power_cut(bench: RealBench) -> None:
    page.a_cleared_list_survives_a_power_cut(bench, bench.power_cycle)


def test_a_repeated_last_item_gets_the_same_ack(bench: RealBench) -> None:
    page.a_repeated_last_item_gets_the_same_ack(bench)


def test_an_interrupted_upload_keeps_the_old_list(bench: RealBench, figure: Figure) -> None:
    page.an_interrupted_upload_keeps_the_old_list(bench)
    figure("interrupted MAVLink upload", "keeps the old list, or none on a fresh board")


def test_an_upload_while_armed_is_an_error(bench: RealBench, figure: Figure) -> None:
    bench.configure(tele_prot=2)
    page.an_upload_while_armed_is_an_error(bench, bench.arm)
    figure("MAVLink upload while armed", "MISSION_ACK 1")
