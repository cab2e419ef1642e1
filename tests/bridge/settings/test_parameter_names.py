# SPDX-License-Identifier: GPL-3.0-or-later

import pytest

from bridge.settings.parameter_names import parameter_names
from simulator.inav.setting_table import SETTINGS as INAV_SETTINGS
from simulator.naze.setting_table import SETTINGS as NAZE_SETTINGS
from tests.support.settings_client import BOARDS, ready

HARAKIRI = [held.setting.name for held in NAZE_SETTINGS]
INAV = [setting.name for setting in INAV_SETTINGS]
#: Names of INAV 7.1 with 29 letters or more, which differ only at their ends.
LONG = """
failsafe_lights_flash_on_time failsafe_min_distance_procedure fw_autotune_max_rate_deflection
fw_iterm_limit_stick_position fw_yaw_iterm_freeze_bank_angle limit_burst_current_falldown_time
limit_burst_power_falldown_time nav_fw_allow_manual_thr_increase nav_fw_land_final_approach_pitch2throttle_mod
nav_fw_launch_idle_motor_delay nav_fw_launch_land_abort_deadband nav_fw_launch_manual_throttle
nav_fw_soaring_pitch_deadband nav_mc_braking_boost_disengage_speed nav_mc_braking_boost_speed_threshold
nav_mc_braking_disengage_speed nav_mc_braking_speed_threshold nav_mc_vel_xy_dterm_attenuation
nav_mc_vel_xy_dterm_attenuation_end nav_mc_vel_xy_dterm_attenuation_start nav_rth_climb_first_stage_altitude
nav_rth_climb_first_stage_mode nav_rth_linear_descent_start_distance osd_estimations_wind_compensation
osd_hud_radar_alt_difference_display_time osd_hud_radar_distance_display_time osd_inav_to_pilot_logo_spacing
osd_msp_displayport_fullframe_interval osd_pan_servo_indicator_show_degrees osd_pan_servo_offcentre_warning
osd_right_sidebar_scroll_step osd_sidebar_horizontal_offset osd_stats_page_auto_swap_time
osd_switch_indicator_one_channel osd_switch_indicator_one_name osd_switch_indicator_three_channel
osd_switch_indicator_three_name osd_switch_indicator_two_channel osd_switch_indicator_two_name
osd_switch_indicator_zero_channel osd_switch_indicator_zero_name osd_switch_indicators_align_left
rate_dynamics_center_correction rate_dynamics_center_sensitivity rate_dynamics_end_sensitivity
servo_autotrim_rotation_limit tailsitter_orientation_offset vtx_smartaudio_alternate_softserial_method
vtx_smartaudio_early_akk_workaround
"""


def test_all_names_are_short_and_distinct() -> None:
    for settings in (HARAKIRI, INAV):
        names = parameter_names(settings)
        assert [*names.values()] == settings
        assert all(len(name) <= 16 and name == name.upper() for name in names)


@pytest.mark.parametrize("name", BOARDS)
def test_parameter_names_of_a_board_are_unique(name: str) -> None:
    world, client = ready(BOARDS[name])
    settings = [setting.name for setting in client.wait_read()]
    own = world.inside.parameters._own.values()
    parameters = parameter_names(settings, own)
    assert (len(parameters), len({setting.upper() for setting in settings})) == (len(settings), len(settings))
    assert not parameters.keys() & own.keys()
    assert all(client.wait_read().find(setting.swapcase()) for setting in settings)


def test_a_name_that_fits_is_kept() -> None:
    assert all(name.upper() in parameter_names(HARAKIRI) for name in HARAKIRI if len(name) <= 16)


def test_long_names_stay_readable() -> None:
    parameter = {name: parameter for parameter, name in parameter_names([*HARAKIRI, *INAV]).items()}
    assert parameter["LED_Toggle_Delay2"] == "LED_TOGGLE_DLY2"
    assert parameter["pitch_direction_l"] == "PITCH_DIR_L"
    assert parameter["failsafe_procedure"] == "FS_PROC"


def test_the_longest_names_of_inav_do_not_need_a_checksum() -> None:
    names = parameter_names(LONG.split())
    assert len(names) == len(LONG.split())
    assert not [name for name in names if "~" in name or len(name) > 16]
    assert parameter_names(["nav_wp_max_safe_distance"]).keys() == {"NAV_WP_MX_SF_DST"}
    assert parameter_names(["failsafe_min_distance_procedure"]).keys() == {"FS_MIN_DIST_PROC"}


def test_names_that_would_coincide_get_a_checksum() -> None:
    alike = ["failsafe_procedure_aa", "failsafe_procedure_ae", "fs_proc_aa"]
    names = parameter_names(alike)
    assert len(names) == 3
    assert all(len(name) <= 16 for name in names)


def test_a_short_name_is_independent_of_other_settings() -> None:
    alone = {name: parameter for setting in INAV for parameter, name in parameter_names([setting]).items()}
    together = {name: parameter for parameter, name in parameter_names(INAV).items()}
    assert sum(alone[name] != together[name] for name in INAV) == 0


def test_the_bridges_own_names_are_not_touched() -> None:
    assert "SYSID_THISMAV" not in parameter_names(["SYSID_THISMAV", "p_roll"], taken={"SYSID_THISMAV"})
