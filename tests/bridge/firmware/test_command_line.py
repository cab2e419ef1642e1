# SPDX-License-Identifier: GPL-3.0-or-later
"""The way into the boot loader through Harakiri's command line."""

import pytest

from bridge.firmware.command_line import CommandLineError, read_dump, settings_in, start_boot_loader
from simulator.board.options import SimOptions
from simulator.board.simulated_board import Power
from simulator.naze.board import SimulatedNaze
from tests.support.boot_loader_bench import DialogueBench
from tests.support.naze_bench import BOOT_SECONDS


def booted() -> DialogueBench:
    board = SimulatedNaze(SimOptions(wp_radius_cm=345))
    board.power_on(0.0)
    bench = DialogueBench(board)
    bench.wait(BOOT_SECONDS + 0.1)
    return bench


def test_the_settings_are_printed_before_the_boot_loader_starts() -> None:
    bench = booted()
    assert bench.run(read_dump()).splitlines()[-1] == "gps_wp_radius = 345"
    bench.run(start_boot_loader())
    assert isinstance(bench.board, SimulatedNaze)
    assert bench.board.power is Power.BOOTLOADER


def test_an_armed_board_opens_no_command_line() -> None:
    bench = booted()
    assert isinstance(bench.board, SimulatedNaze)
    bench.board.faults.armed = True
    bench.wait(0.5)
    with pytest.raises(CommandLineError, match="does not open"):
        bench.run(read_dump())
    assert bench.board.power is Power.RUNNING
    assert bench.board.armed


def test_the_settings_in_a_dump_are_its_numbers() -> None:
    dump = "Config:\nFW: x = 3 y\n00|ANGLE   : ---\nrc_db = 20\nrc_trm_rll =  -0.500\nEnabled features: PPM\n"
    assert settings_in(dump) == {"rc_db": 20.0, "rc_trm_rll": -0.5}
