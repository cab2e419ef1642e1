# SPDX-License-Identifier: GPL-3.0-or-later
"""The board's declination against that of the place, before take-off."""

import pytest

from bridge.model.vehicle import GlobalPosition, Source
from bridge.vehicle.compass_check import declination_deg
from simulator.board.options import Faults
from tests.support.settings_client import BOARDS, ready
from tests.support.world import GroundStation, World


@pytest.mark.parametrize(
    ("place", "lat_deg", "lon_deg", "declination"),
    [
        # Computed by pygeomag 1.1.0: WMM 2025, mid 2027, sea level.
        ("Cape Town", -33.92, 18.42, -27.0),
        ("Sao Paulo", -23.55, -46.63, -21.9),
        ("Auckland", -36.85, 174.76, 20.4),
        ("Munich", 48.14, 11.58, 4.4),
        ("Vancouver", 49.28, -123.12, 15.3),
        ("Suva, near 180 degrees", -18.14, 178.44, 13.0),
    ],
)
def test_the_table_is_the_world_magnetic_model(place: str, lat_deg: float, lon_deg: float, declination: float) -> None:
    assert declination_deg(lat_deg, lon_deg) == pytest.approx(declination, abs=2.5), place


def test_near_the_poles_the_declination_is_unknown() -> None:
    assert declination_deg(71.0, 25.0) is declination_deg(-78.0, 166.0) is None


def compass_texts(world: World, name: str) -> list[str]:
    """What a station that connects now is told about the compass."""
    station = GroundStation(world, name).stay_connected(wait_s=5)
    return [text for text in station.texts() if "Compass" in text]


def test_a_wrong_declination_is_reported_once_until_it_is_set() -> None:
    world, client = ready(BOARDS["patched Harakiri"])
    station = GroundStation(world).stay_connected()
    client.change("mag_dec", -2548)
    world.run(40)
    expected = "Compass 29 deg off: set mag_dec to 300"
    assert [text for text in station.texts() if "Compass" in text] == [expected]
    assert compass_texts(world, "newcomer") == [expected]
    client.change("mag_dec", 300)
    world.run(5)
    assert compass_texts(world, "late") == []


@pytest.mark.parametrize("armed", [False, True])
def test_the_compass_warning_is_not_repeated_while_the_craft_moves(armed: bool) -> None:
    faults = Faults()
    world, client = ready(BOARDS["patched Harakiri"], faults)
    station = GroundStation(world).stay_connected()
    client.change("mag_dec", -2548)
    world.run(10)
    faults.armed = armed
    for step in range(50):
        place = GlobalPosition(world.now, Source.MSP, 453_838_000 + 5_000 * step, 84_733_000, 100.0)
        world.bridge.vehicle.hear(place)
        world.run(0.2)
    assert len([text for text in station.texts() if "Compass" in text]) == 1


def test_inav_does_not_need_a_declination_while_it_finds_it_itself() -> None:
    world, client = ready(BOARDS["INAV"])
    client.change("mag_declination", 3000)
    assert compass_texts(world, "automatic") == []
    client.change("inav_auto_mag_decl", 0)
    world.run(5)
    assert "set mag_declination to" in compass_texts(world, "manual")[0]
