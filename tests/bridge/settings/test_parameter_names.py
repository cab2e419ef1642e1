# SPDX-License-Identifier: GPL-3.0-or-later

import pytest

from bridge.settings.parameter_names import LONGEST, parameter_names
from simulator.inav.setting_table import SETTINGS as INAV_SETTINGS
from simulator.naze.setting_table import SETTINGS as NAZE_SETTINGS
from tests.support.settings_client import BOARDS, ready

HARAKIRI = [held.setting.name for held in NAZE_SETTINGS]
INAV = [setting.name for setting in INAV_SETTINGS]


def test_all_names_are_short_and_distinct() -> None:
    for settings in (HARAKIRI, INAV):
        names = parameter_names(settings)
        assert [*names.values()] == settings
        assert all(len(name) <= LONGEST and name == name.upper() for name in names)


@pytest.mark.parametrize("name", BOARDS)
def test_no_two_settings_of_a_board_are_one_parameter(name: str) -> None:
    world, client = ready(BOARDS[name])
    settings = [setting.name for setting in client.wait_read()]
    own = world.inside.parameters._own.values()
    parameters = parameter_names(settings, own)
    assert (len(parameters), len({setting.upper() for setting in settings})) == (len(settings), len(settings))
    assert not parameters.keys() & own.keys()
    assert all(client.wait_read().find(setting.swapcase()) for setting in settings)


def test_a_name_that_fits_is_kept() -> None:
    assert all(name.upper() in parameter_names(HARAKIRI) for name in HARAKIRI if len(name) <= LONGEST)


def test_long_names_stay_readable() -> None:
    parameter = {name: parameter for parameter, name in parameter_names([*HARAKIRI, *INAV]).items()}
    assert parameter["LED_Toggle_Delay2"] == "LED_TOG_DELAY2"
    assert parameter["pitch_direction_l"] == "PITCH_DIR_L"
    assert parameter["failsafe_procedure"] == "FAILSAFE_PRCDR"


def test_names_that_would_coincide_get_a_checksum() -> None:
    alike = ["nav_mc_vel_xy_dterm_attenuation", "nav_mc_vel_xy_dterm_attenuation_start", "failsafe_procedure"]
    names = {name: parameter for parameter, name in parameter_names([*alike, "failsafe_procedurio"]).items()}
    assert len({*names.values()}) == 4
    assert all(len(name) <= LONGEST for name in names.values())


def test_a_name_depends_on_no_other_setting_of_another_name() -> None:
    alone = {name: parameter for setting in INAV for parameter, name in parameter_names([setting]).items()}
    together = {name: parameter for parameter, name in parameter_names(INAV).items()}
    assert sum(alone[name] != together[name] for name in INAV) == 0


def test_the_bridges_own_names_are_left_alone() -> None:
    assert "SYSID_THISMAV" not in parameter_names(["SYSID_THISMAV", "p_roll"], taken={"SYSID_THISMAV"})
