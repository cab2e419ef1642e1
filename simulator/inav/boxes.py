# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's modes: MSP_BOXNAMES and MSP_BOXIDS. A copter's with GPS are as each version's own simulator lists them."""

ARM, ANGLE, NAV_ALTHOLD, NAV_RTH, NAV_POSHOLD, NAV_WP = 0, 1, 3, 10, 11, 28
NAMES = {
    0: "ARM", 1: "ANGLE", 2: "HORIZON", 3: "NAV ALTHOLD", 5: "HEADING HOLD", 6: "HEADFREE", 7: "HEADADJ", 8: "CAMSTAB",
    10: "NAV RTH", 11: "NAV POSHOLD", 13: "BEEPER", 19: "OSD OFF", 27: "FAILSAFE", 28: "NAV WP", 30: "HOME RESET",
    31: "GCS NAV", 32: "FPV ANGLE MIX", 35: "TURN ASSIST", 38: "KILLSWITCH", 39: "CAMERA CONTROL 1",
    40: "CAMERA CONTROL 2", 41: "CAMERA CONTROL 3", 42: "OSD ALT 1", 43: "OSD ALT 2", 44: "OSD ALT 3",
    45: "NAV COURSE HOLD", 46: "MC BRAKING", 50: "MSP RC OVERRIDE", 51: "PREARM", 53: "NAV CRUISE", 55: "WP PLANNER",
    59: "MISSION CHANGE", 60: "BEEPER MUTE", 61: "MULTI FUNCTION", 62: "MIXER PROFILE 2", 63: "MIXER TRANSITION",
    65: "GIMBAL LEVEL TILT", 66: "GIMBAL LEVEL ROLL", 67: "GIMBAL CENTER", 12: "MANUAL", 16: "LIGHTS", 21: "AUTO TUNE",
    26: "BLACKBOX", 29: "AIR MODE", 34: "FLAPERON", 36: "NAV LAUNCH", 37: "SERVO AUTOTRIM", 49: "LOITER CHANGE",
    54: "AUTO LEVEL TRIM", 56: "SOARING", 64: "ANGLE HOLD",
}  # fmt: skip

_BOXES_6 = (
    0, 51, 1, 2, 35, 5, 8, 6, 7, 32, 11, 10, 28, 30, 31, 55, 59, 46, 3, 13, 19, 38, 27, 39, 40, 41, 42, 43, 44,
)  # fmt: skip
_BOXES_7 = (
    0, 51, 61, 1, 2, 35, 5, 8, 6, 7, 32, 11, 10, 28, 53, 45, 30, 31, 55, 59, 46, 3, 13, 60, 19, 38, 27, 39, 40, 41, 42,
    43, 44, 62, 63,
)  # fmt: skip
_BOXES_8 = (*(box for box in _BOXES_7 if box != 38), 65, 66, 67)
_BOXES_9 = (*_BOXES_8[:32], 50, *_BOXES_8[32:])
BOXES = {"6.1.1": _BOXES_6, "7.1.2": _BOXES_7, "8.0.1": _BOXES_8, "9.0.1": _BOXES_9, "9.1.0": _BOXES_9}
#: An aeroplane's on a board with lights and a black box (fc_msp_box.c): FAILSAFE is beyond the 32 flags of MSP_STATUS.
PLANE_BOXES = (
    0, 51, 61, 1, 2, 35, 29, 5, 8, 11, 49, 10, 28, 53, 45, 30, 31, 55, 59, 56, 3, 12, 36, 37, 21, 54, 64, 34, 13, 60,
    16, 19, 26, 27, 62, 63,
)  # fmt: skip
