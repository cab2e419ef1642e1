# SPDX-License-Identifier: GPL-3.0-or-later
"""Facts about messages that pymavlink's ardupilotmega dialect lacks. Made by `make message-table`, not by hand."""

from protocols.mavlink.message_format import MessageFormat

#: The size in MAVLink 1, by message id, of the dialect's messages that have extension fields in MAVLink 2.
BASE_SIZES = {
    1: 31,  # SYS_STATUS
    24: 30,  # GPS_RAW_INT
    26: 22,  # SCALED_IMU
    27: 26,  # RAW_IMU
    29: 14,  # SCALED_PRESSURE
    31: 32,  # ATTITUDE_QUATERNION
    36: 21,  # SERVO_OUTPUT_RAW
    37: 6,  # MISSION_REQUEST_PARTIAL_LIST
    38: 6,  # MISSION_WRITE_PARTIAL_LIST
    39: 37,  # MISSION_ITEM
    40: 4,  # MISSION_REQUEST
    42: 2,  # MISSION_CURRENT
    43: 2,  # MISSION_REQUEST_LIST
    44: 4,  # MISSION_COUNT
    45: 2,  # MISSION_CLEAR_ALL
    47: 3,  # MISSION_ACK
    48: 13,  # SET_GPS_GLOBAL_ORIGIN
    49: 12,  # GPS_GLOBAL_ORIGIN
    51: 4,  # MISSION_REQUEST_INT
    69: 11,  # MANUAL_CONTROL
    70: 18,  # RC_CHANNELS_OVERRIDE
    73: 37,  # MISSION_ITEM_INT
    77: 3,  # COMMAND_ACK
    100: 26,  # OPTICAL_FLOW
    101: 32,  # GLOBAL_VISION_POSITION_ESTIMATE
    102: 32,  # VISION_POSITION_ESTIMATE
    103: 20,  # VISION_SPEED_ESTIMATE
    104: 32,  # VICON_POSITION_ESTIMATE
    105: 62,  # HIGHRES_IMU
    107: 64,  # HIL_SENSOR
    108: 84,  # SIM_STATE
    113: 36,  # HIL_GPS
    116: 22,  # SCALED_IMU2
    124: 35,  # GPS2_RAW
    129: 22,  # SCALED_IMU3
    132: 14,  # DISTANCE_SENSOR
    137: 14,  # SCALED_PRESSURE2
    138: 36,  # ATT_POS_MOCAP
    143: 14,  # SCALED_PRESSURE3
    147: 36,  # BATTERY_STATUS
    148: 60,  # AUTOPILOT_VERSION
    149: 30,  # LANDING_TARGET
    152: 4,  # MEMINFO
    158: 14,  # MOUNT_STATUS
    162: 8,  # FENCE_STATUS
    180: 45,  # CAMERA_FEEDBACK
    192: 44,  # MAG_CAL_REPORT
    193: 22,  # EKF_STATUS_REPORT
    194: 25,  # PID_TUNING
    225: 65,  # EFI_STATUS
    232: 63,  # GPS_INPUT
    242: 52,  # HOME_POSITION
    243: 53,  # SET_HOME_POSITION
    253: 51,  # STATUSTEXT
}
#: Messages of other dialects, by message id.
OTHER_FORMATS = {
    53: MessageFormat(3, 5, 5, None, None),  # MISSION_CHECKSUM
    220: MessageFormat(34, 32, 32, None, None),  # NAV_FILTER_BIAS
    221: MessageFormat(71, 42, 42, None, None),  # RADIO_CALIBRATION
    222: MessageFormat(15, 3, 3, None, None),  # UALBERTA_SYS_STATUS
    223: MessageFormat(119, 47, 47, 42, 43),  # COMMAND_INT_STAMPED
    224: MessageFormat(102, 45, 45, 42, 43),  # COMMAND_LONG_STAMPED
    397: MessageFormat(182, None, 108, None, None),  # COMPONENT_METADATA
    420: MessageFormat(20, None, 73, 6, 7),  # RADIO_RC_CHANNELS
    435: MessageFormat(134, None, 46, None, None),  # AVAILABLE_MODES
    436: MessageFormat(193, None, 9, None, None),  # CURRENT_MODE
    437: MessageFormat(30, None, 1, None, None),  # AVAILABLE_MODES_MONITOR
    441: MessageFormat(169, None, 17, None, None),  # GNSS_INTEGRITY
    513: MessageFormat(99, None, 45, 40, 41),  # RANGING_BEACON
    8002: MessageFormat(218, None, 16, None, None),  # SENS_POWER
    8003: MessageFormat(231, None, 41, None, None),  # SENS_MPPT
    8004: MessageFormat(172, None, 98, None, None),  # ASLCTRL_DATA
    8005: MessageFormat(251, None, 38, None, None),  # ASLCTRL_DEBUG
    8006: MessageFormat(97, None, 14, None, None),  # ASLUAV_STATUS
    8007: MessageFormat(64, None, 32, None, None),  # EKF_EXT
    8008: MessageFormat(234, None, 33, None, None),  # ASL_OBCTRL
    8009: MessageFormat(144, None, 16, None, None),  # SENS_ATMOS
    8010: MessageFormat(155, None, 41, None, None),  # SENS_BATMON
    8011: MessageFormat(20, None, 102, None, None),  # FW_SOARING_DATA
    8012: MessageFormat(54, None, 16, None, None),  # SENSORPOD_STATUS
    8013: MessageFormat(222, None, 46, None, None),  # SENS_POWER_BOARD
    8014: MessageFormat(200, None, 14, None, None),  # GSM_LINK_STATUS
    8015: MessageFormat(23, None, 24, None, None),  # SATCOM_LINK_STATUS
    8016: MessageFormat(149, None, 18, None, None),  # SENSOR_AIRFLOW_ANGLES
    17000: MessageFormat(103, None, 179, None, None),  # TEST_TYPES
    17150: MessageFormat(26, None, 33, None, None),  # ARRAY_TEST_0
    17151: MessageFormat(72, None, 16, None, None),  # ARRAY_TEST_1
    17153: MessageFormat(19, None, 17, None, None),  # ARRAY_TEST_3
    17154: MessageFormat(89, None, 17, None, None),  # ARRAY_TEST_4
    17155: MessageFormat(27, None, 10, None, None),  # ARRAY_TEST_5
    17156: MessageFormat(14, None, 91, None, None),  # ARRAY_TEST_6
    17157: MessageFormat(187, None, 84, None, None),  # ARRAY_TEST_7
    17158: MessageFormat(106, None, 24, None, None),  # ARRAY_TEST_8
    60000: MessageFormat(4, None, 22, 20, 21),  # AUTOPILOT_STATE_FOR_GIMBAL_DEVICE_EXT
    60010: MessageFormat(208, None, 33, None, None),  # STORM32_GIMBAL_MANAGER_INFORMATION
    60011: MessageFormat(183, None, 7, None, None),  # STORM32_GIMBAL_MANAGER_STATUS
    60012: MessageFormat(99, None, 36, 32, 33),  # STORM32_GIMBAL_MANAGER_CONTROL
    60013: MessageFormat(129, None, 24, 20, 21),  # STORM32_GIMBAL_MANAGER_CONTROL_PITCHYAW
    60014: MessageFormat(134, None, 8, 4, 5),  # STORM32_GIMBAL_MANAGER_CORRECT_ROLL
    60020: MessageFormat(202, None, 4, None, None),  # QSHOT_STATUS
    60040: MessageFormat(156, None, 245, None, None),  # FRSKY_PASSTHROUGH_ARRAY
    60041: MessageFormat(191, None, 255, None, None),  # PARAM_VALUE_ARRAY
    60045: MessageFormat(14, None, 23, 2, 3),  # MLRS_RADIO_LINK_STATS
    60046: MessageFormat(171, None, 28, 8, 9),  # MLRS_RADIO_LINK_INFORMATION
    60047: MessageFormat(55, None, 7, None, None),  # MLRS_RADIO_LINK_FLOW_CONTROL
    60050: MessageFormat(220, None, 14, None, None),  # AVSS_PRS_SYS_STATUS
    60051: MessageFormat(245, None, 24, None, None),  # AVSS_DRONE_POSITION
    60052: MessageFormat(101, None, 44, None, None),  # AVSS_DRONE_IMU
    60053: MessageFormat(45, None, 6, None, None),  # AVSS_DRONE_OPERATION_MODE
}
