# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes wrong in a flight, by the names of `fly --lie`."""

from types import SimpleNamespace
from typing import cast

import pytest

from protocols.msp.mission_flight import FlightProgress
from simulator.flights.pilot import Pilot
from simulator.flights.wrongs import Wrongs


def test_a_jump_and_an_outage_come_after_20_s_and_the_rest_at_once() -> None:
    wrongs = Wrongs(["compass=-30", "gps-jump=15", "gps-outage=6"])
    pilot = SimpleNamespace(now=100.0, naze=SimpleNamespace(faults=SimpleNamespace(gps_fix=True)))
    found = []
    for now in (100.0, 119.0, 121.0, 127.0):
        pilot.now = now
        wrongs.happen(cast("Pilot", pilot), FlightProgress())
        found.append((wrongs.lies.gps_jump, pilot.naze.faults.gps_fix))
    assert wrongs.lies.compass == -30
    assert found == [(0, True), (0, True), (15, False), (15, True)]


@pytest.mark.parametrize("told", ["wind=3", "compass", "compass=nan", "compass=east"])
def test_an_invalid_lie_is_reported_in_one_sentence(told: str) -> None:
    with pytest.raises(ValueError, match=f"--lie {told}"):
        Wrongs([told])
