# SPDX-License-Identifier: GPL-3.0-or-later
"""The patched firmware's own MAVLink upload, in the model; tests/real_board checks the image."""

from simulator.options import Faults, SimOptions, TelemetryProtocol
from tests.support import mavlink_missions as page
from tests.support.naze_bench import Bench


def test_an_upload_becomes_the_stored_list() -> None:
    page.an_upload_becomes_the_stored_list(Bench())


def test_an_interrupted_upload_keeps_the_old_list() -> None:
    page.an_interrupted_upload_keeps_the_old_list(Bench())


def test_an_upload_while_armed_is_an_error() -> None:
    bench = Bench(SimOptions(tele_prot=TelemetryProtocol.MAVLINK), Faults())
    page.an_upload_while_armed_is_an_error(bench, lambda: setattr(bench.naze.faults, "armed", True))
