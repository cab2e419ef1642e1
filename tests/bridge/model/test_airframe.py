# SPDX-License-Identifier: GPL-3.0-or-later
"""The kind of aircraft by its mixer, as Harakiri's mw.h numbers them."""

import pytest

from bridge.model.airframe import airframe

#: MULTITYPE_TRI is 1.
_MIXERS = (
    *("TRI", "QUADP", "QUADX", "BI", "GIMBAL", "Y6", "HEX6", "FLYING_WING", "Y4"),
    *("HEX6X", "OCTOX8", "OCTOFLATP", "OCTOFLATX", "AIRPLANE", "HELI_120_CCPM", "HELI_90_DEG", "VTAIL4", "HEX6H"),
)
_SHOWN = {
    "TRI": "TRICOPTER",
    "Y6": "HEXAROTOR",
    "HEX": "HEXAROTOR",
    "OCTO": "OCTOROTOR",
    "FLYING_WING": "FIXED_WING",
    "AIRPLANE": "FIXED_WING",
    "HELI": "HELICOPTER",
}


@pytest.mark.parametrize(("number", "mixer"), list(enumerate(_MIXERS, 1)))
def test_a_mixer_is_shown_as_its_kind_of_aircraft_or_as_a_quadrocopter(number: int, mixer: str) -> None:
    expected = next((shown for begin, shown in _SHOWN.items() if mixer.startswith(begin)), "QUADROTOR")
    assert airframe(number).name == expected
