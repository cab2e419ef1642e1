# SPDX-License-Identifier: GPL-3.0-or-later
"""The messages and constants that we use, by pymavlink's names. Made by `make messages` from pymavlink, not by hand.

Each message is of the dialect ardupilotmega; a field of type char is bytes if set, and text if read.
"""

from collections.abc import Mapping, Sequence
from struct import Struct

from protocols.mavlink.message_base import MavlinkMessage, as_text

GPS_FIX_TYPE_NO_GPS = 0
MAG_CAL_FAILED = 5
MAG_CAL_RUNNING_STEP_ONE = 2
MAG_CAL_SUCCESS = 4
MAVLINK_MSG_ID_ATTITUDE = 30
MAVLINK_MSG_ID_ATTITUDE_QUATERNION = 31
MAVLINK_MSG_ID_AUTOPILOT_VERSION = 148
MAVLINK_MSG_ID_AUTOPILOT_VERSION_REQUEST = 183
MAVLINK_MSG_ID_BATTERY_STATUS = 147
MAVLINK_MSG_ID_COMMAND_ACK = 77
MAVLINK_MSG_ID_COMMAND_INT = 75
MAVLINK_MSG_ID_COMMAND_LONG = 76
MAVLINK_MSG_ID_EXTENDED_SYS_STATE = 245
MAVLINK_MSG_ID_FENCE_FETCH_POINT = 161
MAVLINK_MSG_ID_FENCE_POINT = 160
MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL = 110
MAVLINK_MSG_ID_GLOBAL_POSITION_INT = 33
MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN = 49
MAVLINK_MSG_ID_GPS_INJECT_DATA = 123
MAVLINK_MSG_ID_GPS_INPUT = 232
MAVLINK_MSG_ID_GPS_RAW_INT = 24
MAVLINK_MSG_ID_GPS_RTCM_DATA = 233
MAVLINK_MSG_ID_HEARTBEAT = 0
MAVLINK_MSG_ID_HIL_GPS = 113
MAVLINK_MSG_ID_HIL_RC_INPUTS_RAW = 92
MAVLINK_MSG_ID_HIL_SENSOR = 107
MAVLINK_MSG_ID_HIL_STATE = 90
MAVLINK_MSG_ID_HOME_POSITION = 242
MAVLINK_MSG_ID_LOCAL_POSITION_NED = 32
MAVLINK_MSG_ID_LOG_ERASE = 121
MAVLINK_MSG_ID_LOG_REQUEST_DATA = 119
MAVLINK_MSG_ID_LOG_REQUEST_END = 122
MAVLINK_MSG_ID_LOG_REQUEST_LIST = 117
MAVLINK_MSG_ID_MANUAL_CONTROL = 69
MAVLINK_MSG_ID_MANUAL_SETPOINT = 81
MAVLINK_MSG_ID_MESSAGE_INTERVAL = 244
MAVLINK_MSG_ID_MISSION_ACK = 47
MAVLINK_MSG_ID_MISSION_CLEAR_ALL = 45
MAVLINK_MSG_ID_MISSION_COUNT = 44
MAVLINK_MSG_ID_MISSION_CURRENT = 42
MAVLINK_MSG_ID_MISSION_ITEM = 39
MAVLINK_MSG_ID_MISSION_ITEM_INT = 73
MAVLINK_MSG_ID_MISSION_ITEM_REACHED = 46
MAVLINK_MSG_ID_MISSION_REQUEST = 40
MAVLINK_MSG_ID_MISSION_REQUEST_INT = 51
MAVLINK_MSG_ID_MISSION_REQUEST_LIST = 43
MAVLINK_MSG_ID_MISSION_REQUEST_PARTIAL_LIST = 37
MAVLINK_MSG_ID_MISSION_SET_CURRENT = 41
MAVLINK_MSG_ID_MISSION_WRITE_PARTIAL_LIST = 38
MAVLINK_MSG_ID_NAMED_VALUE_FLOAT = 251
MAVLINK_MSG_ID_NAMED_VALUE_INT = 252
MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT = 62
MAVLINK_MSG_ID_PARAM_EXT_ACK = 324
MAVLINK_MSG_ID_PARAM_EXT_REQUEST_LIST = 321
MAVLINK_MSG_ID_PARAM_EXT_REQUEST_READ = 320
MAVLINK_MSG_ID_PARAM_EXT_SET = 323
MAVLINK_MSG_ID_PARAM_EXT_VALUE = 322
MAVLINK_MSG_ID_PARAM_REQUEST_LIST = 21
MAVLINK_MSG_ID_PARAM_REQUEST_READ = 20
MAVLINK_MSG_ID_PARAM_SET = 23
MAVLINK_MSG_ID_PARAM_VALUE = 22
MAVLINK_MSG_ID_PING = 4
MAVLINK_MSG_ID_RADIO = 166
MAVLINK_MSG_ID_RADIO_STATUS = 109
MAVLINK_MSG_ID_RALLY_FETCH_POINT = 176
MAVLINK_MSG_ID_RALLY_POINT = 175
MAVLINK_MSG_ID_RAW_IMU = 27
MAVLINK_MSG_ID_RC_CHANNELS = 65
MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE = 70
MAVLINK_MSG_ID_RC_CHANNELS_RAW = 35
MAVLINK_MSG_ID_REQUEST_DATA_STREAM = 66
MAVLINK_MSG_ID_SCALED_PRESSURE = 29
MAVLINK_MSG_ID_SERIAL_CONTROL = 126
MAVLINK_MSG_ID_SERVO_OUTPUT_RAW = 36
MAVLINK_MSG_ID_SETUP_SIGNING = 256
MAVLINK_MSG_ID_SET_ACTUATOR_CONTROL_TARGET = 139
MAVLINK_MSG_ID_SET_ATTITUDE_TARGET = 82
MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN = 48
MAVLINK_MSG_ID_SET_HOME_POSITION = 243
MAVLINK_MSG_ID_SET_MODE = 11
MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT = 86
MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED = 84
MAVLINK_MSG_ID_STATUSTEXT = 253
MAVLINK_MSG_ID_SYSTEM_TIME = 2
MAVLINK_MSG_ID_SYS_STATUS = 1
MAVLINK_MSG_ID_TIMESYNC = 111
MAVLINK_MSG_ID_VFR_HUD = 74
MAVLINK_MSG_ID_VISION_POSITION_ESTIMATE = 102
MAV_AUTOPILOT_ARDUPILOTMEGA = 3
MAV_AUTOPILOT_INVALID = 8
MAV_CMD_COMPONENT_ARM_DISARM = 400
MAV_CMD_CONDITION_YAW = 115
MAV_CMD_DO_ACCEPT_MAG_CAL = 42425
MAV_CMD_DO_CANCEL_MAG_CAL = 42426
MAV_CMD_DO_CHANGE_ALTITUDE = 186
MAV_CMD_DO_CHANGE_SPEED = 178
MAV_CMD_DO_FENCE_ENABLE = 207
MAV_CMD_DO_FLIGHTTERMINATION = 185
MAV_CMD_DO_JUMP_TAG = 601
MAV_CMD_DO_MOTOR_TEST = 209
MAV_CMD_DO_PAUSE_CONTINUE = 193
MAV_CMD_DO_REPEAT_RELAY = 182
MAV_CMD_DO_REPEAT_SERVO = 184
MAV_CMD_DO_REPOSITION = 192
MAV_CMD_DO_SEND_BANNER = 42428
MAV_CMD_DO_SET_HOME = 179
MAV_CMD_DO_SET_MISSION_CURRENT = 224
MAV_CMD_DO_SET_MODE = 176
MAV_CMD_DO_SET_RELAY = 181
MAV_CMD_DO_SET_SERVO = 183
MAV_CMD_DO_START_MAG_CAL = 42424
MAV_CMD_GET_HOME_POSITION = 410
MAV_CMD_GET_MESSAGE_INTERVAL = 510
MAV_CMD_GUIDED_CHANGE_ALTITUDE = 43001
MAV_CMD_GUIDED_CHANGE_HEADING = 43002
MAV_CMD_GUIDED_CHANGE_SPEED = 43000
MAV_CMD_MISSION_START = 300
MAV_CMD_NAV_LAND = 21
MAV_CMD_NAV_LOITER_TIME = 19
MAV_CMD_NAV_LOITER_TURNS = 18
MAV_CMD_NAV_LOITER_UNLIM = 17
MAV_CMD_NAV_RETURN_TO_LAUNCH = 20
MAV_CMD_NAV_ROI = 80
MAV_CMD_NAV_TAKEOFF = 22
MAV_CMD_NAV_WAYPOINT = 16
MAV_CMD_OVERRIDE_GOTO = 252
MAV_CMD_PREFLIGHT_CALIBRATION = 241
MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN = 246
MAV_CMD_PREFLIGHT_STORAGE = 245
MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES = 520
MAV_CMD_REQUEST_CAMERA_INFORMATION = 521
MAV_CMD_REQUEST_MESSAGE = 512
MAV_CMD_REQUEST_PROTOCOL_VERSION = 519
MAV_CMD_RUN_PREARM_CHECKS = 401
MAV_CMD_SET_MESSAGE_INTERVAL = 511
MAV_DATA_STREAM_ALL = 0
MAV_FRAME_GLOBAL_RELATIVE_ALT = 3
MAV_LANDED_STATE_IN_AIR = 2
MAV_LANDED_STATE_ON_GROUND = 1
MAV_LANDED_STATE_UNDEFINED = 0
MAV_MISSION_ACCEPTED = 0
MAV_MISSION_ERROR = 1
MAV_MISSION_INVALID = 5
MAV_MISSION_INVALID_SEQUENCE = 13
MAV_MISSION_NO_SPACE = 4
MAV_MISSION_TYPE_ALL = 255
MAV_MISSION_TYPE_FENCE = 1
MAV_MISSION_TYPE_MISSION = 0
MAV_MISSION_TYPE_RALLY = 2
MAV_MODE_FLAG_CUSTOM_MODE_ENABLED = 1
MAV_MODE_FLAG_GUIDED_ENABLED = 8
MAV_MODE_FLAG_MANUAL_INPUT_ENABLED = 64
MAV_MODE_FLAG_SAFETY_ARMED = 128
MAV_MODE_FLAG_STABILIZE_ENABLED = 16
MAV_PARAM_ERROR_DOES_NOT_EXIST = 1
MAV_PARAM_ERROR_PERMISSION_DENIED = 3
MAV_PARAM_ERROR_READ_ONLY = 5
MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE = 2
MAV_PROTOCOL_CAPABILITY_COMMAND_INT = 8
MAV_PROTOCOL_CAPABILITY_FTP = 32
MAV_PROTOCOL_CAPABILITY_MAVLINK2 = 8192
MAV_PROTOCOL_CAPABILITY_MISSION_FENCE = 16384
MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT = 1
MAV_PROTOCOL_CAPABILITY_MISSION_INT = 4
MAV_PROTOCOL_CAPABILITY_MISSION_RALLY = 32768
MAV_STANDARD_MODE_ALTITUDE_HOLD = 4
MAV_STANDARD_MODE_CRUISE = 3
MAV_STANDARD_MODE_MISSION = 6
MAV_STANDARD_MODE_NON_STANDARD = 0
MAV_STANDARD_MODE_POSITION_HOLD = 1
MAV_STANDARD_MODE_SAFE_RECOVERY = 5
MAV_STANDARD_MODE_TAKEOFF = 8
MAV_STATE_ACTIVE = 4
MAV_STATE_CRITICAL = 5
MAV_STATE_STANDBY = 3
MAV_STATE_UNINIT = 0
MAV_SYS_STATUS_GEOFENCE = 1048576
MAV_SYS_STATUS_PREARM_CHECK = 268435456
MAV_SYS_STATUS_SENSOR_3D_ACCEL = 2
MAV_SYS_STATUS_SENSOR_3D_GYRO = 1
MAV_SYS_STATUS_SENSOR_3D_MAG = 4
MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE = 8
MAV_SYS_STATUS_SENSOR_GPS = 32
MAV_SYS_STATUS_SENSOR_LASER_POSITION = 256
MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS = 32768
MAV_SYS_STATUS_SENSOR_RC_RECEIVER = 65536
MAV_TYPE_GCS = 6
MAV_VTOL_STATE_UNDEFINED = 0

#: By MAV_CMD.
COMMAND_NAMES: Mapping[int, str] = {
    16: "NAV_WAYPOINT",
    17: "NAV_LOITER_UNLIM",
    18: "NAV_LOITER_TURNS",
    19: "NAV_LOITER_TIME",
    20: "NAV_RETURN_TO_LAUNCH",
    21: "NAV_LAND",
    22: "NAV_TAKEOFF",
    23: "NAV_LAND_LOCAL",
    24: "NAV_TAKEOFF_LOCAL",
    25: "NAV_FOLLOW",
    30: "NAV_CONTINUE_AND_CHANGE_ALT",
    31: "NAV_LOITER_TO_ALT",
    32: "DO_FOLLOW",
    33: "DO_FOLLOW_REPOSITION",
    34: "DO_ORBIT",
    35: "DO_FIGURE_EIGHT",
    36: "NAV_ARC_WAYPOINT",
    80: "NAV_ROI",
    81: "NAV_PATHPLANNING",
    82: "NAV_SPLINE_WAYPOINT",
    83: "NAV_ALTITUDE_WAIT",
    84: "NAV_VTOL_TAKEOFF",
    85: "NAV_VTOL_LAND",
    92: "NAV_GUIDED_ENABLE",
    93: "NAV_DELAY",
    94: "NAV_PAYLOAD_PLACE",
    95: "NAV_LAST",
    112: "CONDITION_DELAY",
    113: "CONDITION_CHANGE_ALT",
    114: "CONDITION_DISTANCE",
    115: "CONDITION_YAW",
    159: "CONDITION_LAST",
    176: "DO_SET_MODE",
    177: "DO_JUMP",
    178: "DO_CHANGE_SPEED",
    179: "DO_SET_HOME",
    180: "DO_SET_PARAMETER",
    181: "DO_SET_RELAY",
    182: "DO_REPEAT_RELAY",
    183: "DO_SET_SERVO",
    184: "DO_REPEAT_SERVO",
    185: "DO_FLIGHTTERMINATION",
    186: "DO_CHANGE_ALTITUDE",
    187: "DO_SET_ACTUATOR",
    188: "DO_RETURN_PATH_START",
    189: "DO_LAND_START",
    190: "DO_RALLY_LAND",
    191: "DO_GO_AROUND",
    192: "DO_REPOSITION",
    193: "DO_PAUSE_CONTINUE",
    194: "DO_SET_REVERSE",
    195: "DO_SET_ROI_LOCATION",
    196: "DO_SET_ROI_WPNEXT_OFFSET",
    197: "DO_SET_ROI_NONE",
    198: "DO_SET_ROI_SYSID",
    200: "DO_CONTROL_VIDEO",
    201: "DO_SET_ROI",
    202: "DO_DIGICAM_CONFIGURE",
    203: "DO_DIGICAM_CONTROL",
    204: "DO_MOUNT_CONFIGURE",
    205: "DO_MOUNT_CONTROL",
    206: "DO_SET_CAM_TRIGG_DIST",
    207: "DO_FENCE_ENABLE",
    208: "DO_PARACHUTE",
    209: "DO_MOTOR_TEST",
    210: "DO_INVERTED_FLIGHT",
    211: "DO_GRIPPER",
    212: "DO_AUTOTUNE_ENABLE",
    213: "NAV_SET_YAW_SPEED",
    214: "DO_SET_CAM_TRIGG_INTERVAL",
    215: "DO_SET_RESUME_REPEAT_DIST",
    216: "DO_SPRAYER",
    217: "DO_SEND_SCRIPT_MESSAGE",
    218: "DO_AUX_FUNCTION",
    220: "DO_MOUNT_CONTROL_QUAT",
    221: "DO_GUIDED_MASTER",
    222: "DO_GUIDED_LIMITS",
    223: "DO_ENGINE_CONTROL",
    224: "DO_SET_MISSION_CURRENT",
    240: "DO_LAST",
    241: "PREFLIGHT_CALIBRATION",
    242: "PREFLIGHT_SET_SENSOR_OFFSETS",
    243: "PREFLIGHT_UAVCAN",
    245: "PREFLIGHT_STORAGE",
    246: "PREFLIGHT_REBOOT_SHUTDOWN",
    252: "OVERRIDE_GOTO",
    260: "OBLIQUE_SURVEY",
    262: "DO_SET_STANDARD_MODE",
    300: "MISSION_START",
    310: "ACTUATOR_TEST",
    311: "CONFIGURE_ACTUATOR",
    400: "COMPONENT_ARM_DISARM",
    401: "RUN_PREARM_CHECKS",
    405: "ILLUMINATOR_ON_OFF",
    406: "DO_ILLUMINATOR_CONFIGURE",
    410: "GET_HOME_POSITION",
    420: "INJECT_FAILURE",
    500: "START_RX_PAIR",
    510: "GET_MESSAGE_INTERVAL",
    511: "SET_MESSAGE_INTERVAL",
    512: "REQUEST_MESSAGE",
    519: "REQUEST_PROTOCOL_VERSION",
    520: "REQUEST_AUTOPILOT_CAPABILITIES",
    521: "REQUEST_CAMERA_INFORMATION",
    522: "REQUEST_CAMERA_SETTINGS",
    525: "REQUEST_STORAGE_INFORMATION",
    526: "STORAGE_FORMAT",
    527: "REQUEST_CAMERA_CAPTURE_STATUS",
    528: "REQUEST_FLIGHT_INFORMATION",
    529: "RESET_CAMERA_SETTINGS",
    530: "SET_CAMERA_MODE",
    531: "SET_CAMERA_ZOOM",
    532: "SET_CAMERA_FOCUS",
    533: "SET_STORAGE_USAGE",
    534: "SET_CAMERA_SOURCE",
    600: "JUMP_TAG",
    601: "DO_JUMP_TAG",
    1000: "DO_GIMBAL_MANAGER_PITCHYAW",
    1001: "DO_GIMBAL_MANAGER_CONFIGURE",
    2000: "IMAGE_START_CAPTURE",
    2001: "IMAGE_STOP_CAPTURE",
    2002: "REQUEST_CAMERA_IMAGE_CAPTURE",
    2003: "DO_TRIGGER_CONTROL",
    2004: "CAMERA_TRACK_POINT",
    2005: "CAMERA_TRACK_RECTANGLE",
    2010: "CAMERA_STOP_TRACKING",
    2500: "VIDEO_START_CAPTURE",
    2501: "VIDEO_STOP_CAPTURE",
    2502: "VIDEO_START_STREAMING",
    2503: "VIDEO_STOP_STREAMING",
    2504: "REQUEST_VIDEO_STREAM_INFORMATION",
    2505: "REQUEST_VIDEO_STREAM_STATUS",
    2510: "LOGGING_START",
    2511: "LOGGING_STOP",
    2520: "AIRFRAME_CONFIGURATION",
    2600: "CONTROL_HIGH_LATENCY",
    2800: "PANORAMA_CREATE",
    3000: "DO_VTOL_TRANSITION",
    3001: "ARM_AUTHORIZATION_REQUEST",
    4000: "SET_GUIDED_SUBMODE_STANDARD",
    4001: "SET_GUIDED_SUBMODE_CIRCLE",
    4501: "CONDITION_GATE",
    5000: "NAV_FENCE_RETURN_POINT",
    5001: "NAV_FENCE_POLYGON_VERTEX_INCLUSION",
    5002: "NAV_FENCE_POLYGON_VERTEX_EXCLUSION",
    5003: "NAV_FENCE_CIRCLE_INCLUSION",
    5004: "NAV_FENCE_CIRCLE_EXCLUSION",
    5100: "NAV_RALLY_POINT",
    5200: "UAVCAN_GET_NODE_INFO",
    5300: "DO_SET_SAFETY_SWITCH_STATE",
    10001: "DO_ADSB_OUT_IDENT",
    10151: "LOWEHEISER_SET_STATE",
    30001: "PAYLOAD_PREPARE_DEPLOY",
    30002: "PAYLOAD_CONTROL_DEPLOY",
    31000: "WAYPOINT_USER_1",
    31001: "WAYPOINT_USER_2",
    31002: "WAYPOINT_USER_3",
    31003: "WAYPOINT_USER_4",
    31004: "WAYPOINT_USER_5",
    31005: "SPATIAL_USER_1",
    31006: "SPATIAL_USER_2",
    31007: "SPATIAL_USER_3",
    31008: "SPATIAL_USER_4",
    31009: "SPATIAL_USER_5",
    31010: "USER_1",
    31011: "USER_2",
    31012: "USER_3",
    31013: "USER_4",
    31014: "USER_5",
    32000: "CAN_FORWARD",
    42000: "POWER_OFF_INITIATED",
    42001: "SOLO_BTN_FLY_CLICK",
    42002: "SOLO_BTN_FLY_HOLD",
    42003: "SOLO_BTN_PAUSE_CLICK",
    42004: "FIXED_MAG_CAL",
    42005: "FIXED_MAG_CAL_FIELD",
    42006: "FIXED_MAG_CAL_YAW",
    42007: "SET_EKF_SOURCE_SET",
    42424: "DO_START_MAG_CAL",
    42425: "DO_ACCEPT_MAG_CAL",
    42426: "DO_CANCEL_MAG_CAL",
    42427: "SET_FACTORY_TEST_MODE",
    42428: "DO_SEND_BANNER",
    42429: "ACCELCAL_VEHICLE_POS",
    42501: "GIMBAL_RESET",
    42502: "GIMBAL_AXIS_CALIBRATION_STATUS",
    42503: "GIMBAL_REQUEST_AXIS_CALIBRATION",
    42505: "GIMBAL_FULL_RESET",
    42600: "DO_WINCH",
    42650: "FLASH_BOOTLOADER",
    42651: "BATTERY_RESET",
    42700: "DEBUG_TRAP",
    42701: "SCRIPTING",
    42702: "NAV_SCRIPT_TIME",
    42703: "NAV_ATTITUDE_TIME",
    43000: "GUIDED_CHANGE_SPEED",
    43001: "GUIDED_CHANGE_ALTITUDE",
    43002: "GUIDED_CHANGE_HEADING",
    43003: "EXTERNAL_POSITION_ESTIMATE",
    43005: "SET_HAGL",
}


class MAVLink_heartbeat_message(MavlinkMessage):
    __slots__ = ("type", "autopilot", "base_mode", "custom_mode", "system_status", "mavlink_version")
    msgid = 0
    msgname = "HEARTBEAT"
    unpacker = Struct("<IBBBBB")
    places = (1, 2, 3, 0, 4, 5)

    def __init__(self, type: int, autopilot: int, base_mode: int, custom_mode: int, system_status: int, mavlink_version: int) -> None:
        self.type = type
        self.autopilot = autopilot
        self.base_mode = base_mode
        self.custom_mode = custom_mode
        self.system_status = system_status
        self.mavlink_version = mavlink_version

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.custom_mode, self.type, self.autopilot, self.base_mode, self.system_status, self.mavlink_version)


class MAVLink_sys_status_message(MavlinkMessage):
    __slots__ = ("onboard_control_sensors_present", "onboard_control_sensors_enabled", "onboard_control_sensors_health", "load", "voltage_battery", "current_battery", "battery_remaining", "drop_rate_comm", "errors_comm", "errors_count1", "errors_count2", "errors_count3", "errors_count4", "onboard_control_sensors_present_extended", "onboard_control_sensors_enabled_extended", "onboard_control_sensors_health_extended")
    msgid = 1
    msgname = "SYS_STATUS"
    unpacker = Struct("<IIIHHhHHHHHHbIII")
    places = (0, 1, 2, 3, 4, 5, 12, 6, 7, 8, 9, 10, 11, 13, 14, 15)

    def __init__(self, onboard_control_sensors_present: int, onboard_control_sensors_enabled: int, onboard_control_sensors_health: int, load: int, voltage_battery: int, current_battery: int, battery_remaining: int, drop_rate_comm: int, errors_comm: int, errors_count1: int, errors_count2: int, errors_count3: int, errors_count4: int, onboard_control_sensors_present_extended: int = 0, onboard_control_sensors_enabled_extended: int = 0, onboard_control_sensors_health_extended: int = 0) -> None:
        self.onboard_control_sensors_present = onboard_control_sensors_present
        self.onboard_control_sensors_enabled = onboard_control_sensors_enabled
        self.onboard_control_sensors_health = onboard_control_sensors_health
        self.load = load
        self.voltage_battery = voltage_battery
        self.current_battery = current_battery
        self.battery_remaining = battery_remaining
        self.drop_rate_comm = drop_rate_comm
        self.errors_comm = errors_comm
        self.errors_count1 = errors_count1
        self.errors_count2 = errors_count2
        self.errors_count3 = errors_count3
        self.errors_count4 = errors_count4
        self.onboard_control_sensors_present_extended = onboard_control_sensors_present_extended
        self.onboard_control_sensors_enabled_extended = onboard_control_sensors_enabled_extended
        self.onboard_control_sensors_health_extended = onboard_control_sensors_health_extended

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.onboard_control_sensors_present, self.onboard_control_sensors_enabled, self.onboard_control_sensors_health, self.load, self.voltage_battery, self.current_battery, self.drop_rate_comm, self.errors_comm, self.errors_count1, self.errors_count2, self.errors_count3, self.errors_count4, self.battery_remaining, self.onboard_control_sensors_present_extended, self.onboard_control_sensors_enabled_extended, self.onboard_control_sensors_health_extended)


class MAVLink_system_time_message(MavlinkMessage):
    __slots__ = ("time_unix_usec", "time_boot_ms")
    msgid = 2
    msgname = "SYSTEM_TIME"
    unpacker = Struct("<QI")
    places = (0, 1)

    def __init__(self, time_unix_usec: int, time_boot_ms: int) -> None:
        self.time_unix_usec = time_unix_usec
        self.time_boot_ms = time_boot_ms

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_unix_usec, self.time_boot_ms)


class MAVLink_ping_message(MavlinkMessage):
    __slots__ = ("time_usec", "seq", "target_system", "target_component")
    msgid = 4
    msgname = "PING"
    unpacker = Struct("<QIBB")
    places = (0, 1, 2, 3)

    def __init__(self, time_usec: int, seq: int, target_system: int, target_component: int) -> None:
        self.time_usec = time_usec
        self.seq = seq
        self.target_system = target_system
        self.target_component = target_component

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_usec, self.seq, self.target_system, self.target_component)


class MAVLink_set_mode_message(MavlinkMessage):
    __slots__ = ("target_system", "base_mode", "custom_mode")
    msgid = 11
    msgname = "SET_MODE"
    unpacker = Struct("<IBB")
    places = (1, 2, 0)

    def __init__(self, target_system: int, base_mode: int, custom_mode: int) -> None:
        self.target_system = target_system
        self.base_mode = base_mode
        self.custom_mode = custom_mode

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.custom_mode, self.target_system, self.base_mode)


class MAVLink_param_request_read_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "param_id", "_param_id", "param_index")
    msgid = 20
    msgname = "PARAM_REQUEST_READ"
    unpacker = Struct("<hBB16s")
    places = (1, 2, 3, 0)

    def __init__(self, target_system: int, target_component: int, param_id: bytes, param_index: int) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.param_id = as_text(param_id)
        self._param_id = param_id
        self.param_index = param_index

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.param_index, self.target_system, self.target_component, self._param_id)


class MAVLink_param_request_list_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component")
    msgid = 21
    msgname = "PARAM_REQUEST_LIST"
    unpacker = Struct("<BB")
    places = (0, 1)

    def __init__(self, target_system: int, target_component: int) -> None:
        self.target_system = target_system
        self.target_component = target_component

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.target_system, self.target_component)


class MAVLink_param_value_message(MavlinkMessage):
    __slots__ = ("param_id", "_param_id", "param_value", "param_type", "param_count", "param_index")
    msgid = 22
    msgname = "PARAM_VALUE"
    unpacker = Struct("<fHH16sB")
    places = (3, 0, 4, 1, 2)

    def __init__(self, param_id: bytes, param_value: float, param_type: int, param_count: int, param_index: int) -> None:
        self.param_id = as_text(param_id)
        self._param_id = param_id
        self.param_value = param_value
        self.param_type = param_type
        self.param_count = param_count
        self.param_index = param_index

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.param_value, self.param_count, self.param_index, self._param_id, self.param_type)


class MAVLink_param_set_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "param_id", "_param_id", "param_value", "param_type")
    msgid = 23
    msgname = "PARAM_SET"
    unpacker = Struct("<fBB16sB")
    places = (1, 2, 3, 0, 4)

    def __init__(self, target_system: int, target_component: int, param_id: bytes, param_value: float, param_type: int) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.param_id = as_text(param_id)
        self._param_id = param_id
        self.param_value = param_value
        self.param_type = param_type

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.param_value, self.target_system, self.target_component, self._param_id, self.param_type)


class MAVLink_gps_raw_int_message(MavlinkMessage):
    __slots__ = ("time_usec", "fix_type", "lat", "lon", "alt", "eph", "epv", "vel", "cog", "satellites_visible", "alt_ellipsoid", "h_acc", "v_acc", "vel_acc", "hdg_acc", "yaw")
    msgid = 24
    msgname = "GPS_RAW_INT"
    unpacker = Struct("<QiiiHHHHBBiIIIIH")
    places = (0, 8, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 12, 13, 14, 15)

    def __init__(self, time_usec: int, fix_type: int, lat: int, lon: int, alt: int, eph: int, epv: int, vel: int, cog: int, satellites_visible: int, alt_ellipsoid: int = 0, h_acc: int = 0, v_acc: int = 0, vel_acc: int = 0, hdg_acc: int = 0, yaw: int = 0) -> None:
        self.time_usec = time_usec
        self.fix_type = fix_type
        self.lat = lat
        self.lon = lon
        self.alt = alt
        self.eph = eph
        self.epv = epv
        self.vel = vel
        self.cog = cog
        self.satellites_visible = satellites_visible
        self.alt_ellipsoid = alt_ellipsoid
        self.h_acc = h_acc
        self.v_acc = v_acc
        self.vel_acc = vel_acc
        self.hdg_acc = hdg_acc
        self.yaw = yaw

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_usec, self.lat, self.lon, self.alt, self.eph, self.epv, self.vel, self.cog, self.fix_type, self.satellites_visible, self.alt_ellipsoid, self.h_acc, self.v_acc, self.vel_acc, self.hdg_acc, self.yaw)


class MAVLink_raw_imu_message(MavlinkMessage):
    __slots__ = ("time_usec", "xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro", "xmag", "ymag", "zmag", "id", "temperature")
    msgid = 27
    msgname = "RAW_IMU"
    unpacker = Struct("<QhhhhhhhhhBh")
    places = (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11)

    def __init__(self, time_usec: int, xacc: int, yacc: int, zacc: int, xgyro: int, ygyro: int, zgyro: int, xmag: int, ymag: int, zmag: int, id: int = 0, temperature: int = 0) -> None:
        self.time_usec = time_usec
        self.xacc = xacc
        self.yacc = yacc
        self.zacc = zacc
        self.xgyro = xgyro
        self.ygyro = ygyro
        self.zgyro = zgyro
        self.xmag = xmag
        self.ymag = ymag
        self.zmag = zmag
        self.id = id
        self.temperature = temperature

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_usec, self.xacc, self.yacc, self.zacc, self.xgyro, self.ygyro, self.zgyro, self.xmag, self.ymag, self.zmag, self.id, self.temperature)


class MAVLink_scaled_pressure_message(MavlinkMessage):
    __slots__ = ("time_boot_ms", "press_abs", "press_diff", "temperature", "temperature_press_diff")
    msgid = 29
    msgname = "SCALED_PRESSURE"
    unpacker = Struct("<Iffhh")
    places = (0, 1, 2, 3, 4)

    def __init__(self, time_boot_ms: int, press_abs: float, press_diff: float, temperature: int, temperature_press_diff: int = 0) -> None:
        self.time_boot_ms = time_boot_ms
        self.press_abs = press_abs
        self.press_diff = press_diff
        self.temperature = temperature
        self.temperature_press_diff = temperature_press_diff

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_boot_ms, self.press_abs, self.press_diff, self.temperature, self.temperature_press_diff)


class MAVLink_attitude_message(MavlinkMessage):
    __slots__ = ("time_boot_ms", "roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed")
    msgid = 30
    msgname = "ATTITUDE"
    unpacker = Struct("<Iffffff")
    places = (0, 1, 2, 3, 4, 5, 6)

    def __init__(self, time_boot_ms: int, roll: float, pitch: float, yaw: float, rollspeed: float, pitchspeed: float, yawspeed: float) -> None:
        self.time_boot_ms = time_boot_ms
        self.roll = roll
        self.pitch = pitch
        self.yaw = yaw
        self.rollspeed = rollspeed
        self.pitchspeed = pitchspeed
        self.yawspeed = yawspeed

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_boot_ms, self.roll, self.pitch, self.yaw, self.rollspeed, self.pitchspeed, self.yawspeed)


class MAVLink_attitude_quaternion_message(MavlinkMessage):
    __slots__ = ("time_boot_ms", "q1", "q2", "q3", "q4", "rollspeed", "pitchspeed", "yawspeed", "repr_offset_q")
    msgid = 31
    msgname = "ATTITUDE_QUATERNION"
    unpacker = Struct("<Ifffffff4f")
    places = (0, 1, 2, 3, 4, 5, 6, 7, slice(8, 12))

    def __init__(self, time_boot_ms: int, q1: float, q2: float, q3: float, q4: float, rollspeed: float, pitchspeed: float, yawspeed: float, repr_offset_q: Sequence[float] = (0, 0, 0, 0)) -> None:
        self.time_boot_ms = time_boot_ms
        self.q1 = q1
        self.q2 = q2
        self.q3 = q3
        self.q4 = q4
        self.rollspeed = rollspeed
        self.pitchspeed = pitchspeed
        self.yawspeed = yawspeed
        self.repr_offset_q = repr_offset_q

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_boot_ms, self.q1, self.q2, self.q3, self.q4, self.rollspeed, self.pitchspeed, self.yawspeed, *self.repr_offset_q)


class MAVLink_local_position_ned_message(MavlinkMessage):
    __slots__ = ("time_boot_ms", "x", "y", "z", "vx", "vy", "vz")
    msgid = 32
    msgname = "LOCAL_POSITION_NED"
    unpacker = Struct("<Iffffff")
    places = (0, 1, 2, 3, 4, 5, 6)

    def __init__(self, time_boot_ms: int, x: float, y: float, z: float, vx: float, vy: float, vz: float) -> None:
        self.time_boot_ms = time_boot_ms
        self.x = x
        self.y = y
        self.z = z
        self.vx = vx
        self.vy = vy
        self.vz = vz

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_boot_ms, self.x, self.y, self.z, self.vx, self.vy, self.vz)


class MAVLink_global_position_int_message(MavlinkMessage):
    __slots__ = ("time_boot_ms", "lat", "lon", "alt", "relative_alt", "vx", "vy", "vz", "hdg")
    msgid = 33
    msgname = "GLOBAL_POSITION_INT"
    unpacker = Struct("<IiiiihhhH")
    places = (0, 1, 2, 3, 4, 5, 6, 7, 8)

    def __init__(self, time_boot_ms: int, lat: int, lon: int, alt: int, relative_alt: int, vx: int, vy: int, vz: int, hdg: int) -> None:
        self.time_boot_ms = time_boot_ms
        self.lat = lat
        self.lon = lon
        self.alt = alt
        self.relative_alt = relative_alt
        self.vx = vx
        self.vy = vy
        self.vz = vz
        self.hdg = hdg

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_boot_ms, self.lat, self.lon, self.alt, self.relative_alt, self.vx, self.vy, self.vz, self.hdg)


class MAVLink_rc_channels_raw_message(MavlinkMessage):
    __slots__ = ("time_boot_ms", "port", "chan1_raw", "chan2_raw", "chan3_raw", "chan4_raw", "chan5_raw", "chan6_raw", "chan7_raw", "chan8_raw", "rssi")
    msgid = 35
    msgname = "RC_CHANNELS_RAW"
    unpacker = Struct("<IHHHHHHHHBB")
    places = (0, 9, 1, 2, 3, 4, 5, 6, 7, 8, 10)

    def __init__(self, time_boot_ms: int, port: int, chan1_raw: int, chan2_raw: int, chan3_raw: int, chan4_raw: int, chan5_raw: int, chan6_raw: int, chan7_raw: int, chan8_raw: int, rssi: int) -> None:
        self.time_boot_ms = time_boot_ms
        self.port = port
        self.chan1_raw = chan1_raw
        self.chan2_raw = chan2_raw
        self.chan3_raw = chan3_raw
        self.chan4_raw = chan4_raw
        self.chan5_raw = chan5_raw
        self.chan6_raw = chan6_raw
        self.chan7_raw = chan7_raw
        self.chan8_raw = chan8_raw
        self.rssi = rssi

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_boot_ms, self.chan1_raw, self.chan2_raw, self.chan3_raw, self.chan4_raw, self.chan5_raw, self.chan6_raw, self.chan7_raw, self.chan8_raw, self.port, self.rssi)


class MAVLink_servo_output_raw_message(MavlinkMessage):
    __slots__ = ("time_usec", "port", "servo1_raw", "servo2_raw", "servo3_raw", "servo4_raw", "servo5_raw", "servo6_raw", "servo7_raw", "servo8_raw", "servo9_raw", "servo10_raw", "servo11_raw", "servo12_raw", "servo13_raw", "servo14_raw", "servo15_raw", "servo16_raw")
    msgid = 36
    msgname = "SERVO_OUTPUT_RAW"
    unpacker = Struct("<IHHHHHHHHBHHHHHHHH")
    places = (0, 9, 1, 2, 3, 4, 5, 6, 7, 8, 10, 11, 12, 13, 14, 15, 16, 17)

    def __init__(self, time_usec: int, port: int, servo1_raw: int, servo2_raw: int, servo3_raw: int, servo4_raw: int, servo5_raw: int, servo6_raw: int, servo7_raw: int, servo8_raw: int, servo9_raw: int = 0, servo10_raw: int = 0, servo11_raw: int = 0, servo12_raw: int = 0, servo13_raw: int = 0, servo14_raw: int = 0, servo15_raw: int = 0, servo16_raw: int = 0) -> None:
        self.time_usec = time_usec
        self.port = port
        self.servo1_raw = servo1_raw
        self.servo2_raw = servo2_raw
        self.servo3_raw = servo3_raw
        self.servo4_raw = servo4_raw
        self.servo5_raw = servo5_raw
        self.servo6_raw = servo6_raw
        self.servo7_raw = servo7_raw
        self.servo8_raw = servo8_raw
        self.servo9_raw = servo9_raw
        self.servo10_raw = servo10_raw
        self.servo11_raw = servo11_raw
        self.servo12_raw = servo12_raw
        self.servo13_raw = servo13_raw
        self.servo14_raw = servo14_raw
        self.servo15_raw = servo15_raw
        self.servo16_raw = servo16_raw

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_usec, self.servo1_raw, self.servo2_raw, self.servo3_raw, self.servo4_raw, self.servo5_raw, self.servo6_raw, self.servo7_raw, self.servo8_raw, self.port, self.servo9_raw, self.servo10_raw, self.servo11_raw, self.servo12_raw, self.servo13_raw, self.servo14_raw, self.servo15_raw, self.servo16_raw)


class MAVLink_mission_request_partial_list_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "start_index", "end_index", "mission_type")
    msgid = 37
    msgname = "MISSION_REQUEST_PARTIAL_LIST"
    unpacker = Struct("<hhBBB")
    places = (2, 3, 0, 1, 4)

    def __init__(self, target_system: int, target_component: int, start_index: int, end_index: int, mission_type: int = 0) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.start_index = start_index
        self.end_index = end_index
        self.mission_type = mission_type

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.start_index, self.end_index, self.target_system, self.target_component, self.mission_type)


class MAVLink_mission_write_partial_list_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "start_index", "end_index", "mission_type")
    msgid = 38
    msgname = "MISSION_WRITE_PARTIAL_LIST"
    unpacker = Struct("<hhBBB")
    places = (2, 3, 0, 1, 4)

    def __init__(self, target_system: int, target_component: int, start_index: int, end_index: int, mission_type: int = 0) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.start_index = start_index
        self.end_index = end_index
        self.mission_type = mission_type

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.start_index, self.end_index, self.target_system, self.target_component, self.mission_type)


class MAVLink_mission_item_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "seq", "frame", "command", "current", "autocontinue", "param1", "param2", "param3", "param4", "x", "y", "z", "mission_type")
    msgid = 39
    msgname = "MISSION_ITEM"
    unpacker = Struct("<fffffffHHBBBBBB")
    places = (9, 10, 7, 11, 8, 12, 13, 0, 1, 2, 3, 4, 5, 6, 14)

    def __init__(self, target_system: int, target_component: int, seq: int, frame: int, command: int, current: int, autocontinue: int, param1: float, param2: float, param3: float, param4: float, x: float, y: float, z: float, mission_type: int = 0) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.seq = seq
        self.frame = frame
        self.command = command
        self.current = current
        self.autocontinue = autocontinue
        self.param1 = param1
        self.param2 = param2
        self.param3 = param3
        self.param4 = param4
        self.x = x
        self.y = y
        self.z = z
        self.mission_type = mission_type

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.param1, self.param2, self.param3, self.param4, self.x, self.y, self.z, self.seq, self.command, self.target_system, self.target_component, self.frame, self.current, self.autocontinue, self.mission_type)


class MAVLink_mission_request_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "seq", "mission_type")
    msgid = 40
    msgname = "MISSION_REQUEST"
    unpacker = Struct("<HBBB")
    places = (1, 2, 0, 3)

    def __init__(self, target_system: int, target_component: int, seq: int, mission_type: int = 0) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.seq = seq
        self.mission_type = mission_type

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.seq, self.target_system, self.target_component, self.mission_type)


class MAVLink_mission_set_current_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "seq")
    msgid = 41
    msgname = "MISSION_SET_CURRENT"
    unpacker = Struct("<HBB")
    places = (1, 2, 0)

    def __init__(self, target_system: int, target_component: int, seq: int) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.seq = seq

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.seq, self.target_system, self.target_component)


class MAVLink_mission_current_message(MavlinkMessage):
    __slots__ = ("seq", "total", "mission_state", "mission_mode")
    msgid = 42
    msgname = "MISSION_CURRENT"
    unpacker = Struct("<HHBB")
    places = (0, 1, 2, 3)

    def __init__(self, seq: int, total: int = 0, mission_state: int = 0, mission_mode: int = 0) -> None:
        self.seq = seq
        self.total = total
        self.mission_state = mission_state
        self.mission_mode = mission_mode

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.seq, self.total, self.mission_state, self.mission_mode)


class MAVLink_mission_request_list_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "mission_type")
    msgid = 43
    msgname = "MISSION_REQUEST_LIST"
    unpacker = Struct("<BBB")
    places = (0, 1, 2)

    def __init__(self, target_system: int, target_component: int, mission_type: int = 0) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.mission_type = mission_type

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.target_system, self.target_component, self.mission_type)


class MAVLink_mission_count_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "count", "mission_type")
    msgid = 44
    msgname = "MISSION_COUNT"
    unpacker = Struct("<HBBB")
    places = (1, 2, 0, 3)

    def __init__(self, target_system: int, target_component: int, count: int, mission_type: int = 0) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.count = count
        self.mission_type = mission_type

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.count, self.target_system, self.target_component, self.mission_type)


class MAVLink_mission_clear_all_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "mission_type")
    msgid = 45
    msgname = "MISSION_CLEAR_ALL"
    unpacker = Struct("<BBB")
    places = (0, 1, 2)

    def __init__(self, target_system: int, target_component: int, mission_type: int = 0) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.mission_type = mission_type

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.target_system, self.target_component, self.mission_type)


class MAVLink_mission_item_reached_message(MavlinkMessage):
    __slots__ = ("seq",)
    msgid = 46
    msgname = "MISSION_ITEM_REACHED"
    unpacker = Struct("<H")
    places = (0,)

    def __init__(self, seq: int) -> None:
        self.seq = seq

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.seq)


class MAVLink_mission_ack_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "type", "mission_type")
    msgid = 47
    msgname = "MISSION_ACK"
    unpacker = Struct("<BBBB")
    places = (0, 1, 2, 3)

    def __init__(self, target_system: int, target_component: int, type: int, mission_type: int = 0) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.type = type
        self.mission_type = mission_type

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.target_system, self.target_component, self.type, self.mission_type)


class MAVLink_set_gps_global_origin_message(MavlinkMessage):
    __slots__ = ("target_system", "latitude", "longitude", "altitude", "time_usec")
    msgid = 48
    msgname = "SET_GPS_GLOBAL_ORIGIN"
    unpacker = Struct("<iiiBQ")
    places = (3, 0, 1, 2, 4)

    def __init__(self, target_system: int, latitude: int, longitude: int, altitude: int, time_usec: int = 0) -> None:
        self.target_system = target_system
        self.latitude = latitude
        self.longitude = longitude
        self.altitude = altitude
        self.time_usec = time_usec

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.latitude, self.longitude, self.altitude, self.target_system, self.time_usec)


class MAVLink_gps_global_origin_message(MavlinkMessage):
    __slots__ = ("latitude", "longitude", "altitude", "time_usec")
    msgid = 49
    msgname = "GPS_GLOBAL_ORIGIN"
    unpacker = Struct("<iiiQ")
    places = (0, 1, 2, 3)

    def __init__(self, latitude: int, longitude: int, altitude: int, time_usec: int = 0) -> None:
        self.latitude = latitude
        self.longitude = longitude
        self.altitude = altitude
        self.time_usec = time_usec

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.latitude, self.longitude, self.altitude, self.time_usec)


class MAVLink_mission_request_int_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "seq", "mission_type")
    msgid = 51
    msgname = "MISSION_REQUEST_INT"
    unpacker = Struct("<HBBB")
    places = (1, 2, 0, 3)

    def __init__(self, target_system: int, target_component: int, seq: int, mission_type: int = 0) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.seq = seq
        self.mission_type = mission_type

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.seq, self.target_system, self.target_component, self.mission_type)


class MAVLink_nav_controller_output_message(MavlinkMessage):
    __slots__ = ("nav_roll", "nav_pitch", "nav_bearing", "target_bearing", "wp_dist", "alt_error", "aspd_error", "xtrack_error")
    msgid = 62
    msgname = "NAV_CONTROLLER_OUTPUT"
    unpacker = Struct("<fffffhhH")
    places = (0, 1, 5, 6, 7, 2, 3, 4)

    def __init__(self, nav_roll: float, nav_pitch: float, nav_bearing: int, target_bearing: int, wp_dist: int, alt_error: float, aspd_error: float, xtrack_error: float) -> None:
        self.nav_roll = nav_roll
        self.nav_pitch = nav_pitch
        self.nav_bearing = nav_bearing
        self.target_bearing = target_bearing
        self.wp_dist = wp_dist
        self.alt_error = alt_error
        self.aspd_error = aspd_error
        self.xtrack_error = xtrack_error

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.nav_roll, self.nav_pitch, self.alt_error, self.aspd_error, self.xtrack_error, self.nav_bearing, self.target_bearing, self.wp_dist)


class MAVLink_rc_channels_message(MavlinkMessage):
    __slots__ = ("time_boot_ms", "chancount", "chan1_raw", "chan2_raw", "chan3_raw", "chan4_raw", "chan5_raw", "chan6_raw", "chan7_raw", "chan8_raw", "chan9_raw", "chan10_raw", "chan11_raw", "chan12_raw", "chan13_raw", "chan14_raw", "chan15_raw", "chan16_raw", "chan17_raw", "chan18_raw", "rssi")
    msgid = 65
    msgname = "RC_CHANNELS"
    unpacker = Struct("<IHHHHHHHHHHHHHHHHHHBB")
    places = (0, 19, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 20)

    def __init__(self, time_boot_ms: int, chancount: int, chan1_raw: int, chan2_raw: int, chan3_raw: int, chan4_raw: int, chan5_raw: int, chan6_raw: int, chan7_raw: int, chan8_raw: int, chan9_raw: int, chan10_raw: int, chan11_raw: int, chan12_raw: int, chan13_raw: int, chan14_raw: int, chan15_raw: int, chan16_raw: int, chan17_raw: int, chan18_raw: int, rssi: int) -> None:
        self.time_boot_ms = time_boot_ms
        self.chancount = chancount
        self.chan1_raw = chan1_raw
        self.chan2_raw = chan2_raw
        self.chan3_raw = chan3_raw
        self.chan4_raw = chan4_raw
        self.chan5_raw = chan5_raw
        self.chan6_raw = chan6_raw
        self.chan7_raw = chan7_raw
        self.chan8_raw = chan8_raw
        self.chan9_raw = chan9_raw
        self.chan10_raw = chan10_raw
        self.chan11_raw = chan11_raw
        self.chan12_raw = chan12_raw
        self.chan13_raw = chan13_raw
        self.chan14_raw = chan14_raw
        self.chan15_raw = chan15_raw
        self.chan16_raw = chan16_raw
        self.chan17_raw = chan17_raw
        self.chan18_raw = chan18_raw
        self.rssi = rssi

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_boot_ms, self.chan1_raw, self.chan2_raw, self.chan3_raw, self.chan4_raw, self.chan5_raw, self.chan6_raw, self.chan7_raw, self.chan8_raw, self.chan9_raw, self.chan10_raw, self.chan11_raw, self.chan12_raw, self.chan13_raw, self.chan14_raw, self.chan15_raw, self.chan16_raw, self.chan17_raw, self.chan18_raw, self.chancount, self.rssi)


class MAVLink_request_data_stream_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "req_stream_id", "req_message_rate", "start_stop")
    msgid = 66
    msgname = "REQUEST_DATA_STREAM"
    unpacker = Struct("<HBBBB")
    places = (1, 2, 3, 0, 4)

    def __init__(self, target_system: int, target_component: int, req_stream_id: int, req_message_rate: int, start_stop: int) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.req_stream_id = req_stream_id
        self.req_message_rate = req_message_rate
        self.start_stop = start_stop

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.req_message_rate, self.target_system, self.target_component, self.req_stream_id, self.start_stop)


class MAVLink_manual_control_message(MavlinkMessage):
    __slots__ = ("target", "x", "y", "z", "r", "buttons", "buttons2", "enabled_extensions", "s", "t", "aux1", "aux2", "aux3", "aux4", "aux5", "aux6")
    msgid = 69
    msgname = "MANUAL_CONTROL"
    unpacker = Struct("<hhhhHBHBhhhhhhhh")
    places = (5, 0, 1, 2, 3, 4, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)

    def __init__(self, target: int, x: int, y: int, z: int, r: int, buttons: int, buttons2: int = 0, enabled_extensions: int = 0, s: int = 0, t: int = 0, aux1: int = 0, aux2: int = 0, aux3: int = 0, aux4: int = 0, aux5: int = 0, aux6: int = 0) -> None:
        self.target = target
        self.x = x
        self.y = y
        self.z = z
        self.r = r
        self.buttons = buttons
        self.buttons2 = buttons2
        self.enabled_extensions = enabled_extensions
        self.s = s
        self.t = t
        self.aux1 = aux1
        self.aux2 = aux2
        self.aux3 = aux3
        self.aux4 = aux4
        self.aux5 = aux5
        self.aux6 = aux6

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.x, self.y, self.z, self.r, self.buttons, self.target, self.buttons2, self.enabled_extensions, self.s, self.t, self.aux1, self.aux2, self.aux3, self.aux4, self.aux5, self.aux6)


class MAVLink_rc_channels_override_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "chan1_raw", "chan2_raw", "chan3_raw", "chan4_raw", "chan5_raw", "chan6_raw", "chan7_raw", "chan8_raw", "chan9_raw", "chan10_raw", "chan11_raw", "chan12_raw", "chan13_raw", "chan14_raw", "chan15_raw", "chan16_raw", "chan17_raw", "chan18_raw")
    msgid = 70
    msgname = "RC_CHANNELS_OVERRIDE"
    unpacker = Struct("<HHHHHHHHBBHHHHHHHHHH")
    places = (8, 9, 0, 1, 2, 3, 4, 5, 6, 7, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19)

    def __init__(self, target_system: int, target_component: int, chan1_raw: int, chan2_raw: int, chan3_raw: int, chan4_raw: int, chan5_raw: int, chan6_raw: int, chan7_raw: int, chan8_raw: int, chan9_raw: int = 0, chan10_raw: int = 0, chan11_raw: int = 0, chan12_raw: int = 0, chan13_raw: int = 0, chan14_raw: int = 0, chan15_raw: int = 0, chan16_raw: int = 0, chan17_raw: int = 0, chan18_raw: int = 0) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.chan1_raw = chan1_raw
        self.chan2_raw = chan2_raw
        self.chan3_raw = chan3_raw
        self.chan4_raw = chan4_raw
        self.chan5_raw = chan5_raw
        self.chan6_raw = chan6_raw
        self.chan7_raw = chan7_raw
        self.chan8_raw = chan8_raw
        self.chan9_raw = chan9_raw
        self.chan10_raw = chan10_raw
        self.chan11_raw = chan11_raw
        self.chan12_raw = chan12_raw
        self.chan13_raw = chan13_raw
        self.chan14_raw = chan14_raw
        self.chan15_raw = chan15_raw
        self.chan16_raw = chan16_raw
        self.chan17_raw = chan17_raw
        self.chan18_raw = chan18_raw

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.chan1_raw, self.chan2_raw, self.chan3_raw, self.chan4_raw, self.chan5_raw, self.chan6_raw, self.chan7_raw, self.chan8_raw, self.target_system, self.target_component, self.chan9_raw, self.chan10_raw, self.chan11_raw, self.chan12_raw, self.chan13_raw, self.chan14_raw, self.chan15_raw, self.chan16_raw, self.chan17_raw, self.chan18_raw)


class MAVLink_mission_item_int_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "seq", "frame", "command", "current", "autocontinue", "param1", "param2", "param3", "param4", "x", "y", "z", "mission_type")
    msgid = 73
    msgname = "MISSION_ITEM_INT"
    unpacker = Struct("<ffffiifHHBBBBBB")
    places = (9, 10, 7, 11, 8, 12, 13, 0, 1, 2, 3, 4, 5, 6, 14)

    def __init__(self, target_system: int, target_component: int, seq: int, frame: int, command: int, current: int, autocontinue: int, param1: float, param2: float, param3: float, param4: float, x: int, y: int, z: float, mission_type: int = 0) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.seq = seq
        self.frame = frame
        self.command = command
        self.current = current
        self.autocontinue = autocontinue
        self.param1 = param1
        self.param2 = param2
        self.param3 = param3
        self.param4 = param4
        self.x = x
        self.y = y
        self.z = z
        self.mission_type = mission_type

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.param1, self.param2, self.param3, self.param4, self.x, self.y, self.z, self.seq, self.command, self.target_system, self.target_component, self.frame, self.current, self.autocontinue, self.mission_type)


class MAVLink_vfr_hud_message(MavlinkMessage):
    __slots__ = ("airspeed", "groundspeed", "heading", "throttle", "alt", "climb")
    msgid = 74
    msgname = "VFR_HUD"
    unpacker = Struct("<ffffhH")
    places = (0, 1, 4, 5, 2, 3)

    def __init__(self, airspeed: float, groundspeed: float, heading: int, throttle: int, alt: float, climb: float) -> None:
        self.airspeed = airspeed
        self.groundspeed = groundspeed
        self.heading = heading
        self.throttle = throttle
        self.alt = alt
        self.climb = climb

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.airspeed, self.groundspeed, self.alt, self.climb, self.heading, self.throttle)


class MAVLink_command_int_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "frame", "command", "current", "autocontinue", "param1", "param2", "param3", "param4", "x", "y", "z")
    msgid = 75
    msgname = "COMMAND_INT"
    unpacker = Struct("<ffffiifHBBBBB")
    places = (8, 9, 10, 7, 11, 12, 0, 1, 2, 3, 4, 5, 6)

    def __init__(self, target_system: int, target_component: int, frame: int, command: int, current: int, autocontinue: int, param1: float, param2: float, param3: float, param4: float, x: int, y: int, z: float) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.frame = frame
        self.command = command
        self.current = current
        self.autocontinue = autocontinue
        self.param1 = param1
        self.param2 = param2
        self.param3 = param3
        self.param4 = param4
        self.x = x
        self.y = y
        self.z = z

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.param1, self.param2, self.param3, self.param4, self.x, self.y, self.z, self.command, self.target_system, self.target_component, self.frame, self.current, self.autocontinue)


class MAVLink_command_long_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "command", "confirmation", "param1", "param2", "param3", "param4", "param5", "param6", "param7")
    msgid = 76
    msgname = "COMMAND_LONG"
    unpacker = Struct("<fffffffHBBB")
    places = (8, 9, 7, 10, 0, 1, 2, 3, 4, 5, 6)

    def __init__(self, target_system: int, target_component: int, command: int, confirmation: int, param1: float, param2: float, param3: float, param4: float, param5: float, param6: float, param7: float) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.command = command
        self.confirmation = confirmation
        self.param1 = param1
        self.param2 = param2
        self.param3 = param3
        self.param4 = param4
        self.param5 = param5
        self.param6 = param6
        self.param7 = param7

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.param1, self.param2, self.param3, self.param4, self.param5, self.param6, self.param7, self.command, self.target_system, self.target_component, self.confirmation)


class MAVLink_command_ack_message(MavlinkMessage):
    __slots__ = ("command", "result", "progress", "result_param2", "target_system", "target_component")
    msgid = 77
    msgname = "COMMAND_ACK"
    unpacker = Struct("<HBBiBB")
    places = (0, 1, 2, 3, 4, 5)

    def __init__(self, command: int, result: int, progress: int = 0, result_param2: int = 0, target_system: int = 0, target_component: int = 0) -> None:
        self.command = command
        self.result = result
        self.progress = progress
        self.result_param2 = result_param2
        self.target_system = target_system
        self.target_component = target_component

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.command, self.result, self.progress, self.result_param2, self.target_system, self.target_component)


class MAVLink_manual_setpoint_message(MavlinkMessage):
    __slots__ = ("time_boot_ms", "roll", "pitch", "yaw", "thrust", "mode_switch", "manual_override_switch")
    msgid = 81
    msgname = "MANUAL_SETPOINT"
    unpacker = Struct("<IffffBB")
    places = (0, 1, 2, 3, 4, 5, 6)

    def __init__(self, time_boot_ms: int, roll: float, pitch: float, yaw: float, thrust: float, mode_switch: int, manual_override_switch: int) -> None:
        self.time_boot_ms = time_boot_ms
        self.roll = roll
        self.pitch = pitch
        self.yaw = yaw
        self.thrust = thrust
        self.mode_switch = mode_switch
        self.manual_override_switch = manual_override_switch

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_boot_ms, self.roll, self.pitch, self.yaw, self.thrust, self.mode_switch, self.manual_override_switch)


class MAVLink_set_attitude_target_message(MavlinkMessage):
    __slots__ = ("time_boot_ms", "target_system", "target_component", "type_mask", "q", "body_roll_rate", "body_pitch_rate", "body_yaw_rate", "thrust")
    msgid = 82
    msgname = "SET_ATTITUDE_TARGET"
    unpacker = Struct("<I4fffffBBB")
    places = (0, 9, 10, 11, slice(1, 5), 5, 6, 7, 8)

    def __init__(self, time_boot_ms: int, target_system: int, target_component: int, type_mask: int, q: Sequence[float], body_roll_rate: float, body_pitch_rate: float, body_yaw_rate: float, thrust: float) -> None:
        self.time_boot_ms = time_boot_ms
        self.target_system = target_system
        self.target_component = target_component
        self.type_mask = type_mask
        self.q = q
        self.body_roll_rate = body_roll_rate
        self.body_pitch_rate = body_pitch_rate
        self.body_yaw_rate = body_yaw_rate
        self.thrust = thrust

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_boot_ms, *self.q, self.body_roll_rate, self.body_pitch_rate, self.body_yaw_rate, self.thrust, self.target_system, self.target_component, self.type_mask)


class MAVLink_set_position_target_local_ned_message(MavlinkMessage):
    __slots__ = ("time_boot_ms", "target_system", "target_component", "coordinate_frame", "type_mask", "x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate")
    msgid = 84
    msgname = "SET_POSITION_TARGET_LOCAL_NED"
    unpacker = Struct("<IfffffffffffHBBB")
    places = (0, 13, 14, 15, 12, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11)

    def __init__(self, time_boot_ms: int, target_system: int, target_component: int, coordinate_frame: int, type_mask: int, x: float, y: float, z: float, vx: float, vy: float, vz: float, afx: float, afy: float, afz: float, yaw: float, yaw_rate: float) -> None:
        self.time_boot_ms = time_boot_ms
        self.target_system = target_system
        self.target_component = target_component
        self.coordinate_frame = coordinate_frame
        self.type_mask = type_mask
        self.x = x
        self.y = y
        self.z = z
        self.vx = vx
        self.vy = vy
        self.vz = vz
        self.afx = afx
        self.afy = afy
        self.afz = afz
        self.yaw = yaw
        self.yaw_rate = yaw_rate

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_boot_ms, self.x, self.y, self.z, self.vx, self.vy, self.vz, self.afx, self.afy, self.afz, self.yaw, self.yaw_rate, self.type_mask, self.target_system, self.target_component, self.coordinate_frame)


class MAVLink_set_position_target_global_int_message(MavlinkMessage):
    __slots__ = ("time_boot_ms", "target_system", "target_component", "coordinate_frame", "type_mask", "lat_int", "lon_int", "alt", "vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate")
    msgid = 86
    msgname = "SET_POSITION_TARGET_GLOBAL_INT"
    unpacker = Struct("<IiifffffffffHBBB")
    places = (0, 13, 14, 15, 12, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11)

    def __init__(self, time_boot_ms: int, target_system: int, target_component: int, coordinate_frame: int, type_mask: int, lat_int: int, lon_int: int, alt: float, vx: float, vy: float, vz: float, afx: float, afy: float, afz: float, yaw: float, yaw_rate: float) -> None:
        self.time_boot_ms = time_boot_ms
        self.target_system = target_system
        self.target_component = target_component
        self.coordinate_frame = coordinate_frame
        self.type_mask = type_mask
        self.lat_int = lat_int
        self.lon_int = lon_int
        self.alt = alt
        self.vx = vx
        self.vy = vy
        self.vz = vz
        self.afx = afx
        self.afy = afy
        self.afz = afz
        self.yaw = yaw
        self.yaw_rate = yaw_rate

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_boot_ms, self.lat_int, self.lon_int, self.alt, self.vx, self.vy, self.vz, self.afx, self.afy, self.afz, self.yaw, self.yaw_rate, self.type_mask, self.target_system, self.target_component, self.coordinate_frame)


class MAVLink_hil_state_message(MavlinkMessage):
    __slots__ = ("time_usec", "roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed", "lat", "lon", "alt", "vx", "vy", "vz", "xacc", "yacc", "zacc")
    msgid = 90
    msgname = "HIL_STATE"
    unpacker = Struct("<Qffffffiiihhhhhh")
    places = (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)

    def __init__(self, time_usec: int, roll: float, pitch: float, yaw: float, rollspeed: float, pitchspeed: float, yawspeed: float, lat: int, lon: int, alt: int, vx: int, vy: int, vz: int, xacc: int, yacc: int, zacc: int) -> None:
        self.time_usec = time_usec
        self.roll = roll
        self.pitch = pitch
        self.yaw = yaw
        self.rollspeed = rollspeed
        self.pitchspeed = pitchspeed
        self.yawspeed = yawspeed
        self.lat = lat
        self.lon = lon
        self.alt = alt
        self.vx = vx
        self.vy = vy
        self.vz = vz
        self.xacc = xacc
        self.yacc = yacc
        self.zacc = zacc

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_usec, self.roll, self.pitch, self.yaw, self.rollspeed, self.pitchspeed, self.yawspeed, self.lat, self.lon, self.alt, self.vx, self.vy, self.vz, self.xacc, self.yacc, self.zacc)


class MAVLink_hil_rc_inputs_raw_message(MavlinkMessage):
    __slots__ = ("time_usec", "chan1_raw", "chan2_raw", "chan3_raw", "chan4_raw", "chan5_raw", "chan6_raw", "chan7_raw", "chan8_raw", "chan9_raw", "chan10_raw", "chan11_raw", "chan12_raw", "rssi")
    msgid = 92
    msgname = "HIL_RC_INPUTS_RAW"
    unpacker = Struct("<QHHHHHHHHHHHHB")
    places = (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13)

    def __init__(self, time_usec: int, chan1_raw: int, chan2_raw: int, chan3_raw: int, chan4_raw: int, chan5_raw: int, chan6_raw: int, chan7_raw: int, chan8_raw: int, chan9_raw: int, chan10_raw: int, chan11_raw: int, chan12_raw: int, rssi: int) -> None:
        self.time_usec = time_usec
        self.chan1_raw = chan1_raw
        self.chan2_raw = chan2_raw
        self.chan3_raw = chan3_raw
        self.chan4_raw = chan4_raw
        self.chan5_raw = chan5_raw
        self.chan6_raw = chan6_raw
        self.chan7_raw = chan7_raw
        self.chan8_raw = chan8_raw
        self.chan9_raw = chan9_raw
        self.chan10_raw = chan10_raw
        self.chan11_raw = chan11_raw
        self.chan12_raw = chan12_raw
        self.rssi = rssi

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_usec, self.chan1_raw, self.chan2_raw, self.chan3_raw, self.chan4_raw, self.chan5_raw, self.chan6_raw, self.chan7_raw, self.chan8_raw, self.chan9_raw, self.chan10_raw, self.chan11_raw, self.chan12_raw, self.rssi)


class MAVLink_vision_position_estimate_message(MavlinkMessage):
    __slots__ = ("usec", "x", "y", "z", "roll", "pitch", "yaw", "covariance", "reset_counter")
    msgid = 102
    msgname = "VISION_POSITION_ESTIMATE"
    unpacker = Struct("<Qffffff21fB")
    places = (0, 1, 2, 3, 4, 5, 6, slice(7, 28), 28)

    def __init__(self, usec: int, x: float, y: float, z: float, roll: float, pitch: float, yaw: float, covariance: Sequence[float] = (0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0), reset_counter: int = 0) -> None:
        self.usec = usec
        self.x = x
        self.y = y
        self.z = z
        self.roll = roll
        self.pitch = pitch
        self.yaw = yaw
        self.covariance = covariance
        self.reset_counter = reset_counter

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.usec, self.x, self.y, self.z, self.roll, self.pitch, self.yaw, *self.covariance, self.reset_counter)


class MAVLink_hil_sensor_message(MavlinkMessage):
    __slots__ = ("time_usec", "xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro", "xmag", "ymag", "zmag", "abs_pressure", "diff_pressure", "pressure_alt", "temperature", "fields_updated", "id")
    msgid = 107
    msgname = "HIL_SENSOR"
    unpacker = Struct("<QfffffffffffffIB")
    places = (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)

    def __init__(self, time_usec: int, xacc: float, yacc: float, zacc: float, xgyro: float, ygyro: float, zgyro: float, xmag: float, ymag: float, zmag: float, abs_pressure: float, diff_pressure: float, pressure_alt: float, temperature: float, fields_updated: int, id: int = 0) -> None:
        self.time_usec = time_usec
        self.xacc = xacc
        self.yacc = yacc
        self.zacc = zacc
        self.xgyro = xgyro
        self.ygyro = ygyro
        self.zgyro = zgyro
        self.xmag = xmag
        self.ymag = ymag
        self.zmag = zmag
        self.abs_pressure = abs_pressure
        self.diff_pressure = diff_pressure
        self.pressure_alt = pressure_alt
        self.temperature = temperature
        self.fields_updated = fields_updated
        self.id = id

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_usec, self.xacc, self.yacc, self.zacc, self.xgyro, self.ygyro, self.zgyro, self.xmag, self.ymag, self.zmag, self.abs_pressure, self.diff_pressure, self.pressure_alt, self.temperature, self.fields_updated, self.id)


class MAVLink_radio_status_message(MavlinkMessage):
    __slots__ = ("rssi", "remrssi", "txbuf", "noise", "remnoise", "rxerrors", "fixed")
    msgid = 109
    msgname = "RADIO_STATUS"
    unpacker = Struct("<HHBBBBB")
    places = (2, 3, 4, 5, 6, 0, 1)

    def __init__(self, rssi: int, remrssi: int, txbuf: int, noise: int, remnoise: int, rxerrors: int, fixed: int) -> None:
        self.rssi = rssi
        self.remrssi = remrssi
        self.txbuf = txbuf
        self.noise = noise
        self.remnoise = remnoise
        self.rxerrors = rxerrors
        self.fixed = fixed

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.rxerrors, self.fixed, self.rssi, self.remrssi, self.txbuf, self.noise, self.remnoise)


class MAVLink_file_transfer_protocol_message(MavlinkMessage):
    __slots__ = ("target_network", "target_system", "target_component", "payload")
    msgid = 110
    msgname = "FILE_TRANSFER_PROTOCOL"
    unpacker = Struct("<BBB251B")
    places = (0, 1, 2, slice(3, 254))

    def __init__(self, target_network: int, target_system: int, target_component: int, payload: Sequence[int]) -> None:
        self.target_network = target_network
        self.target_system = target_system
        self.target_component = target_component
        self.payload = payload

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.target_network, self.target_system, self.target_component, *self.payload)


class MAVLink_timesync_message(MavlinkMessage):
    __slots__ = ("tc1", "ts1")
    msgid = 111
    msgname = "TIMESYNC"
    unpacker = Struct("<qq")
    places = (0, 1)

    def __init__(self, tc1: int, ts1: int) -> None:
        self.tc1 = tc1
        self.ts1 = ts1

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.tc1, self.ts1)


class MAVLink_hil_gps_message(MavlinkMessage):
    __slots__ = ("time_usec", "fix_type", "lat", "lon", "alt", "eph", "epv", "vel", "vn", "ve", "vd", "cog", "satellites_visible", "id", "yaw")
    msgid = 113
    msgname = "HIL_GPS"
    unpacker = Struct("<QiiiHHHhhhHBBBH")
    places = (0, 11, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 13, 14)

    def __init__(self, time_usec: int, fix_type: int, lat: int, lon: int, alt: int, eph: int, epv: int, vel: int, vn: int, ve: int, vd: int, cog: int, satellites_visible: int, id: int = 0, yaw: int = 0) -> None:
        self.time_usec = time_usec
        self.fix_type = fix_type
        self.lat = lat
        self.lon = lon
        self.alt = alt
        self.eph = eph
        self.epv = epv
        self.vel = vel
        self.vn = vn
        self.ve = ve
        self.vd = vd
        self.cog = cog
        self.satellites_visible = satellites_visible
        self.id = id
        self.yaw = yaw

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_usec, self.lat, self.lon, self.alt, self.eph, self.epv, self.vel, self.vn, self.ve, self.vd, self.cog, self.fix_type, self.satellites_visible, self.id, self.yaw)


class MAVLink_log_request_list_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "start", "end")
    msgid = 117
    msgname = "LOG_REQUEST_LIST"
    unpacker = Struct("<HHBB")
    places = (2, 3, 0, 1)

    def __init__(self, target_system: int, target_component: int, start: int, end: int) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.start = start
        self.end = end

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.start, self.end, self.target_system, self.target_component)


class MAVLink_log_entry_message(MavlinkMessage):
    __slots__ = ("id", "num_logs", "last_log_num", "time_utc", "size")
    msgid = 118
    msgname = "LOG_ENTRY"
    unpacker = Struct("<IIHHH")
    places = (2, 3, 4, 0, 1)

    def __init__(self, id: int, num_logs: int, last_log_num: int, time_utc: int, size: int) -> None:
        self.id = id
        self.num_logs = num_logs
        self.last_log_num = last_log_num
        self.time_utc = time_utc
        self.size = size

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_utc, self.size, self.id, self.num_logs, self.last_log_num)


class MAVLink_log_request_data_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "id", "ofs", "count")
    msgid = 119
    msgname = "LOG_REQUEST_DATA"
    unpacker = Struct("<IIHBB")
    places = (3, 4, 2, 0, 1)

    def __init__(self, target_system: int, target_component: int, id: int, ofs: int, count: int) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.id = id
        self.ofs = ofs
        self.count = count

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.ofs, self.count, self.id, self.target_system, self.target_component)


class MAVLink_log_erase_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component")
    msgid = 121
    msgname = "LOG_ERASE"
    unpacker = Struct("<BB")
    places = (0, 1)

    def __init__(self, target_system: int, target_component: int) -> None:
        self.target_system = target_system
        self.target_component = target_component

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.target_system, self.target_component)


class MAVLink_log_request_end_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component")
    msgid = 122
    msgname = "LOG_REQUEST_END"
    unpacker = Struct("<BB")
    places = (0, 1)

    def __init__(self, target_system: int, target_component: int) -> None:
        self.target_system = target_system
        self.target_component = target_component

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.target_system, self.target_component)


class MAVLink_gps_inject_data_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "len", "data")
    msgid = 123
    msgname = "GPS_INJECT_DATA"
    unpacker = Struct("<BBB110B")
    places = (0, 1, 2, slice(3, 113))

    def __init__(self, target_system: int, target_component: int, len: int, data: Sequence[int]) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.len = len
        self.data = data

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.target_system, self.target_component, self.len, *self.data)


class MAVLink_serial_control_message(MavlinkMessage):
    __slots__ = ("device", "flags", "timeout", "baudrate", "count", "data")
    msgid = 126
    msgname = "SERIAL_CONTROL"
    unpacker = Struct("<IHBBB70B")
    places = (2, 3, 1, 0, 4, slice(5, 75))

    def __init__(self, device: int, flags: int, timeout: int, baudrate: int, count: int, data: Sequence[int]) -> None:
        self.device = device
        self.flags = flags
        self.timeout = timeout
        self.baudrate = baudrate
        self.count = count
        self.data = data

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.baudrate, self.timeout, self.device, self.flags, self.count, *self.data)


class MAVLink_set_actuator_control_target_message(MavlinkMessage):
    __slots__ = ("time_usec", "group_mlx", "target_system", "target_component", "controls")
    msgid = 139
    msgname = "SET_ACTUATOR_CONTROL_TARGET"
    unpacker = Struct("<Q8fBBB")
    places = (0, 9, 10, 11, slice(1, 9))

    def __init__(self, time_usec: int, group_mlx: int, target_system: int, target_component: int, controls: Sequence[float]) -> None:
        self.time_usec = time_usec
        self.group_mlx = group_mlx
        self.target_system = target_system
        self.target_component = target_component
        self.controls = controls

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_usec, *self.controls, self.group_mlx, self.target_system, self.target_component)


class MAVLink_battery_status_message(MavlinkMessage):
    __slots__ = ("id", "battery_function", "type", "temperature", "voltages", "current_battery", "current_consumed", "energy_consumed", "battery_remaining", "time_remaining", "charge_state", "voltages_ext", "mode", "fault_bitmask")
    msgid = 147
    msgname = "BATTERY_STATUS"
    unpacker = Struct("<iih10HhBBBbiB4HBI")
    places = (14, 15, 16, 2, slice(3, 13), 13, 0, 1, 17, 18, 19, slice(20, 24), 24, 25)

    def __init__(self, id: int, battery_function: int, type: int, temperature: int, voltages: Sequence[int], current_battery: int, current_consumed: int, energy_consumed: int, battery_remaining: int, time_remaining: int = 0, charge_state: int = 0, voltages_ext: Sequence[int] = (0, 0, 0, 0), mode: int = 0, fault_bitmask: int = 0) -> None:
        self.id = id
        self.battery_function = battery_function
        self.type = type
        self.temperature = temperature
        self.voltages = voltages
        self.current_battery = current_battery
        self.current_consumed = current_consumed
        self.energy_consumed = energy_consumed
        self.battery_remaining = battery_remaining
        self.time_remaining = time_remaining
        self.charge_state = charge_state
        self.voltages_ext = voltages_ext
        self.mode = mode
        self.fault_bitmask = fault_bitmask

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.current_consumed, self.energy_consumed, self.temperature, *self.voltages, self.current_battery, self.id, self.battery_function, self.type, self.battery_remaining, self.time_remaining, self.charge_state, *self.voltages_ext, self.mode, self.fault_bitmask)


class MAVLink_autopilot_version_message(MavlinkMessage):
    __slots__ = ("capabilities", "flight_sw_version", "middleware_sw_version", "os_sw_version", "board_version", "flight_custom_version", "middleware_custom_version", "os_custom_version", "vendor_id", "product_id", "uid", "uid2")
    msgid = 148
    msgname = "AUTOPILOT_VERSION"
    unpacker = Struct("<QQIIIIHH8B8B8B18B")
    places = (0, 2, 3, 4, 5, slice(8, 16), slice(16, 24), slice(24, 32), 6, 7, 1, slice(32, 50))

    def __init__(self, capabilities: int, flight_sw_version: int, middleware_sw_version: int, os_sw_version: int, board_version: int, flight_custom_version: Sequence[int], middleware_custom_version: Sequence[int], os_custom_version: Sequence[int], vendor_id: int, product_id: int, uid: int, uid2: Sequence[int] = (0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)) -> None:
        self.capabilities = capabilities
        self.flight_sw_version = flight_sw_version
        self.middleware_sw_version = middleware_sw_version
        self.os_sw_version = os_sw_version
        self.board_version = board_version
        self.flight_custom_version = flight_custom_version
        self.middleware_custom_version = middleware_custom_version
        self.os_custom_version = os_custom_version
        self.vendor_id = vendor_id
        self.product_id = product_id
        self.uid = uid
        self.uid2 = uid2

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.capabilities, self.uid, self.flight_sw_version, self.middleware_sw_version, self.os_sw_version, self.board_version, self.vendor_id, self.product_id, *self.flight_custom_version, *self.middleware_custom_version, *self.os_custom_version, *self.uid2)


class MAVLink_fence_point_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "idx", "count", "lat", "lng")
    msgid = 160
    msgname = "FENCE_POINT"
    unpacker = Struct("<ffBBBB")
    places = (2, 3, 4, 5, 0, 1)

    def __init__(self, target_system: int, target_component: int, idx: int, count: int, lat: float, lng: float) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.idx = idx
        self.count = count
        self.lat = lat
        self.lng = lng

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.lat, self.lng, self.target_system, self.target_component, self.idx, self.count)


class MAVLink_fence_fetch_point_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "idx")
    msgid = 161
    msgname = "FENCE_FETCH_POINT"
    unpacker = Struct("<BBB")
    places = (0, 1, 2)

    def __init__(self, target_system: int, target_component: int, idx: int) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.idx = idx

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.target_system, self.target_component, self.idx)


class MAVLink_radio_message(MavlinkMessage):
    __slots__ = ("rssi", "remrssi", "txbuf", "noise", "remnoise", "rxerrors", "fixed")
    msgid = 166
    msgname = "RADIO"
    unpacker = Struct("<HHBBBBB")
    places = (2, 3, 4, 5, 6, 0, 1)

    def __init__(self, rssi: int, remrssi: int, txbuf: int, noise: int, remnoise: int, rxerrors: int, fixed: int) -> None:
        self.rssi = rssi
        self.remrssi = remrssi
        self.txbuf = txbuf
        self.noise = noise
        self.remnoise = remnoise
        self.rxerrors = rxerrors
        self.fixed = fixed

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.rxerrors, self.fixed, self.rssi, self.remrssi, self.txbuf, self.noise, self.remnoise)


class MAVLink_rally_point_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "idx", "count", "lat", "lng", "alt", "break_alt", "land_dir", "flags")
    msgid = 175
    msgname = "RALLY_POINT"
    unpacker = Struct("<iihhHBBBBB")
    places = (5, 6, 7, 8, 0, 1, 2, 3, 4, 9)

    def __init__(self, target_system: int, target_component: int, idx: int, count: int, lat: int, lng: int, alt: int, break_alt: int, land_dir: int, flags: int) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.idx = idx
        self.count = count
        self.lat = lat
        self.lng = lng
        self.alt = alt
        self.break_alt = break_alt
        self.land_dir = land_dir
        self.flags = flags

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.lat, self.lng, self.alt, self.break_alt, self.land_dir, self.target_system, self.target_component, self.idx, self.count, self.flags)


class MAVLink_rally_fetch_point_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "idx")
    msgid = 176
    msgname = "RALLY_FETCH_POINT"
    unpacker = Struct("<BBB")
    places = (0, 1, 2)

    def __init__(self, target_system: int, target_component: int, idx: int) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.idx = idx

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.target_system, self.target_component, self.idx)


class MAVLink_autopilot_version_request_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component")
    msgid = 183
    msgname = "AUTOPILOT_VERSION_REQUEST"
    unpacker = Struct("<BB")
    places = (0, 1)

    def __init__(self, target_system: int, target_component: int) -> None:
        self.target_system = target_system
        self.target_component = target_component

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.target_system, self.target_component)


class MAVLink_mag_cal_progress_message(MavlinkMessage):
    __slots__ = ("compass_id", "cal_mask", "cal_status", "attempt", "completion_pct", "completion_mask", "direction_x", "direction_y", "direction_z")
    msgid = 191
    msgname = "MAG_CAL_PROGRESS"
    unpacker = Struct("<fffBBBBB10B")
    places = (3, 4, 5, 6, 7, slice(8, 18), 0, 1, 2)

    def __init__(self, compass_id: int, cal_mask: int, cal_status: int, attempt: int, completion_pct: int, completion_mask: Sequence[int], direction_x: float, direction_y: float, direction_z: float) -> None:
        self.compass_id = compass_id
        self.cal_mask = cal_mask
        self.cal_status = cal_status
        self.attempt = attempt
        self.completion_pct = completion_pct
        self.completion_mask = completion_mask
        self.direction_x = direction_x
        self.direction_y = direction_y
        self.direction_z = direction_z

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.direction_x, self.direction_y, self.direction_z, self.compass_id, self.cal_mask, self.cal_status, self.attempt, self.completion_pct, *self.completion_mask)


class MAVLink_mag_cal_report_message(MavlinkMessage):
    __slots__ = ("compass_id", "cal_mask", "cal_status", "autosaved", "fitness", "ofs_x", "ofs_y", "ofs_z", "diag_x", "diag_y", "diag_z", "offdiag_x", "offdiag_y", "offdiag_z", "orientation_confidence", "old_orientation", "new_orientation", "scale_factor")
    msgid = 192
    msgname = "MAG_CAL_REPORT"
    unpacker = Struct("<ffffffffffBBBBfBBf")
    places = (10, 11, 12, 13, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 14, 15, 16, 17)

    def __init__(self, compass_id: int, cal_mask: int, cal_status: int, autosaved: int, fitness: float, ofs_x: float, ofs_y: float, ofs_z: float, diag_x: float, diag_y: float, diag_z: float, offdiag_x: float, offdiag_y: float, offdiag_z: float, orientation_confidence: float = 0, old_orientation: int = 0, new_orientation: int = 0, scale_factor: float = 0) -> None:
        self.compass_id = compass_id
        self.cal_mask = cal_mask
        self.cal_status = cal_status
        self.autosaved = autosaved
        self.fitness = fitness
        self.ofs_x = ofs_x
        self.ofs_y = ofs_y
        self.ofs_z = ofs_z
        self.diag_x = diag_x
        self.diag_y = diag_y
        self.diag_z = diag_z
        self.offdiag_x = offdiag_x
        self.offdiag_y = offdiag_y
        self.offdiag_z = offdiag_z
        self.orientation_confidence = orientation_confidence
        self.old_orientation = old_orientation
        self.new_orientation = new_orientation
        self.scale_factor = scale_factor

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.fitness, self.ofs_x, self.ofs_y, self.ofs_z, self.diag_x, self.diag_y, self.diag_z, self.offdiag_x, self.offdiag_y, self.offdiag_z, self.compass_id, self.cal_mask, self.cal_status, self.autosaved, self.orientation_confidence, self.old_orientation, self.new_orientation, self.scale_factor)


class MAVLink_gps_input_message(MavlinkMessage):
    __slots__ = ("time_usec", "gps_id", "ignore_flags", "time_week_ms", "time_week", "fix_type", "lat", "lon", "alt", "hdop", "vdop", "vn", "ve", "vd", "speed_accuracy", "horiz_accuracy", "vert_accuracy", "satellites_visible", "yaw")
    msgid = 232
    msgname = "GPS_INPUT"
    unpacker = Struct("<QIiifffffffffHHBBBH")
    places = (0, 15, 13, 1, 14, 16, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 17, 18)

    def __init__(self, time_usec: int, gps_id: int, ignore_flags: int, time_week_ms: int, time_week: int, fix_type: int, lat: int, lon: int, alt: float, hdop: float, vdop: float, vn: float, ve: float, vd: float, speed_accuracy: float, horiz_accuracy: float, vert_accuracy: float, satellites_visible: int, yaw: int = 0) -> None:
        self.time_usec = time_usec
        self.gps_id = gps_id
        self.ignore_flags = ignore_flags
        self.time_week_ms = time_week_ms
        self.time_week = time_week
        self.fix_type = fix_type
        self.lat = lat
        self.lon = lon
        self.alt = alt
        self.hdop = hdop
        self.vdop = vdop
        self.vn = vn
        self.ve = ve
        self.vd = vd
        self.speed_accuracy = speed_accuracy
        self.horiz_accuracy = horiz_accuracy
        self.vert_accuracy = vert_accuracy
        self.satellites_visible = satellites_visible
        self.yaw = yaw

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_usec, self.time_week_ms, self.lat, self.lon, self.alt, self.hdop, self.vdop, self.vn, self.ve, self.vd, self.speed_accuracy, self.horiz_accuracy, self.vert_accuracy, self.ignore_flags, self.time_week, self.gps_id, self.fix_type, self.satellites_visible, self.yaw)


class MAVLink_gps_rtcm_data_message(MavlinkMessage):
    __slots__ = ("flags", "len", "data")
    msgid = 233
    msgname = "GPS_RTCM_DATA"
    unpacker = Struct("<BB180B")
    places = (0, 1, slice(2, 182))

    def __init__(self, flags: int, len: int, data: Sequence[int]) -> None:
        self.flags = flags
        self.len = len
        self.data = data

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.flags, self.len, *self.data)


class MAVLink_home_position_message(MavlinkMessage):
    __slots__ = ("latitude", "longitude", "altitude", "x", "y", "z", "q", "approach_x", "approach_y", "approach_z", "time_usec")
    msgid = 242
    msgname = "HOME_POSITION"
    unpacker = Struct("<iiifff4ffffQ")
    places = (0, 1, 2, 3, 4, 5, slice(6, 10), 10, 11, 12, 13)

    def __init__(self, latitude: int, longitude: int, altitude: int, x: float, y: float, z: float, q: Sequence[float], approach_x: float, approach_y: float, approach_z: float, time_usec: int = 0) -> None:
        self.latitude = latitude
        self.longitude = longitude
        self.altitude = altitude
        self.x = x
        self.y = y
        self.z = z
        self.q = q
        self.approach_x = approach_x
        self.approach_y = approach_y
        self.approach_z = approach_z
        self.time_usec = time_usec

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.latitude, self.longitude, self.altitude, self.x, self.y, self.z, *self.q, self.approach_x, self.approach_y, self.approach_z, self.time_usec)


class MAVLink_set_home_position_message(MavlinkMessage):
    __slots__ = ("target_system", "latitude", "longitude", "altitude", "x", "y", "z", "q", "approach_x", "approach_y", "approach_z", "time_usec")
    msgid = 243
    msgname = "SET_HOME_POSITION"
    unpacker = Struct("<iiifff4ffffBQ")
    places = (13, 0, 1, 2, 3, 4, 5, slice(6, 10), 10, 11, 12, 14)

    def __init__(self, target_system: int, latitude: int, longitude: int, altitude: int, x: float, y: float, z: float, q: Sequence[float], approach_x: float, approach_y: float, approach_z: float, time_usec: int = 0) -> None:
        self.target_system = target_system
        self.latitude = latitude
        self.longitude = longitude
        self.altitude = altitude
        self.x = x
        self.y = y
        self.z = z
        self.q = q
        self.approach_x = approach_x
        self.approach_y = approach_y
        self.approach_z = approach_z
        self.time_usec = time_usec

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.latitude, self.longitude, self.altitude, self.x, self.y, self.z, *self.q, self.approach_x, self.approach_y, self.approach_z, self.target_system, self.time_usec)


class MAVLink_message_interval_message(MavlinkMessage):
    __slots__ = ("message_id", "interval_us")
    msgid = 244
    msgname = "MESSAGE_INTERVAL"
    unpacker = Struct("<iH")
    places = (1, 0)

    def __init__(self, message_id: int, interval_us: int) -> None:
        self.message_id = message_id
        self.interval_us = interval_us

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.interval_us, self.message_id)


class MAVLink_extended_sys_state_message(MavlinkMessage):
    __slots__ = ("vtol_state", "landed_state")
    msgid = 245
    msgname = "EXTENDED_SYS_STATE"
    unpacker = Struct("<BB")
    places = (0, 1)

    def __init__(self, vtol_state: int, landed_state: int) -> None:
        self.vtol_state = vtol_state
        self.landed_state = landed_state

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.vtol_state, self.landed_state)


class MAVLink_named_value_float_message(MavlinkMessage):
    __slots__ = ("time_boot_ms", "name", "_name", "value")
    msgid = 251
    msgname = "NAMED_VALUE_FLOAT"
    unpacker = Struct("<If10s")
    places = (0, 2, 1)

    def __init__(self, time_boot_ms: int, name: bytes, value: float) -> None:
        self.time_boot_ms = time_boot_ms
        self.name = as_text(name)
        self._name = name
        self.value = value

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_boot_ms, self.value, self._name)


class MAVLink_named_value_int_message(MavlinkMessage):
    __slots__ = ("time_boot_ms", "name", "_name", "value")
    msgid = 252
    msgname = "NAMED_VALUE_INT"
    unpacker = Struct("<Ii10s")
    places = (0, 2, 1)

    def __init__(self, time_boot_ms: int, name: bytes, value: int) -> None:
        self.time_boot_ms = time_boot_ms
        self.name = as_text(name)
        self._name = name
        self.value = value

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.time_boot_ms, self.value, self._name)


class MAVLink_statustext_message(MavlinkMessage):
    __slots__ = ("severity", "text", "_text", "id", "chunk_seq")
    msgid = 253
    msgname = "STATUSTEXT"
    unpacker = Struct("<B50sHB")
    places = (0, 1, 2, 3)

    def __init__(self, severity: int, text: bytes, id: int = 0, chunk_seq: int = 0) -> None:
        self.severity = severity
        self.text = as_text(text)
        self._text = text
        self.id = id
        self.chunk_seq = chunk_seq

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.severity, self._text, self.id, self.chunk_seq)


class MAVLink_setup_signing_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "secret_key", "initial_timestamp")
    msgid = 256
    msgname = "SETUP_SIGNING"
    unpacker = Struct("<QBB32B")
    places = (1, 2, slice(3, 35), 0)

    def __init__(self, target_system: int, target_component: int, secret_key: Sequence[int], initial_timestamp: int) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.secret_key = secret_key
        self.initial_timestamp = initial_timestamp

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.initial_timestamp, self.target_system, self.target_component, *self.secret_key)


class MAVLink_param_ext_request_read_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "param_id", "_param_id", "param_index")
    msgid = 320
    msgname = "PARAM_EXT_REQUEST_READ"
    unpacker = Struct("<hBB16s")
    places = (1, 2, 3, 0)

    def __init__(self, target_system: int, target_component: int, param_id: bytes, param_index: int) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.param_id = as_text(param_id)
        self._param_id = param_id
        self.param_index = param_index

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.param_index, self.target_system, self.target_component, self._param_id)


class MAVLink_param_ext_request_list_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component")
    msgid = 321
    msgname = "PARAM_EXT_REQUEST_LIST"
    unpacker = Struct("<BB")
    places = (0, 1)

    def __init__(self, target_system: int, target_component: int) -> None:
        self.target_system = target_system
        self.target_component = target_component

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.target_system, self.target_component)


class MAVLink_param_ext_value_message(MavlinkMessage):
    __slots__ = ("param_id", "_param_id", "param_value", "_param_value", "param_type", "param_count", "param_index")
    msgid = 322
    msgname = "PARAM_EXT_VALUE"
    unpacker = Struct("<HH16s128sB")
    places = (2, 3, 4, 0, 1)

    def __init__(self, param_id: bytes, param_value: bytes, param_type: int, param_count: int, param_index: int) -> None:
        self.param_id = as_text(param_id)
        self._param_id = param_id
        self.param_value = as_text(param_value)
        self._param_value = param_value
        self.param_type = param_type
        self.param_count = param_count
        self.param_index = param_index

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.param_count, self.param_index, self._param_id, self._param_value, self.param_type)


class MAVLink_param_ext_set_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "param_id", "_param_id", "param_value", "_param_value", "param_type")
    msgid = 323
    msgname = "PARAM_EXT_SET"
    unpacker = Struct("<BB16s128sB")
    places = (0, 1, 2, 3, 4)

    def __init__(self, target_system: int, target_component: int, param_id: bytes, param_value: bytes, param_type: int) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.param_id = as_text(param_id)
        self._param_id = param_id
        self.param_value = as_text(param_value)
        self._param_value = param_value
        self.param_type = param_type

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.target_system, self.target_component, self._param_id, self._param_value, self.param_type)


class MAVLink_param_ext_ack_message(MavlinkMessage):
    __slots__ = ("param_id", "_param_id", "param_value", "_param_value", "param_type", "param_result")
    msgid = 324
    msgname = "PARAM_EXT_ACK"
    unpacker = Struct("<16s128sBB")
    places = (0, 1, 2, 3)

    def __init__(self, param_id: bytes, param_value: bytes, param_type: int, param_result: int) -> None:
        self.param_id = as_text(param_id)
        self._param_id = param_id
        self.param_value = as_text(param_value)
        self._param_value = param_value
        self.param_type = param_type
        self.param_result = param_result

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self._param_id, self._param_value, self.param_type, self.param_result)


class MAVLink_param_error_message(MavlinkMessage):
    __slots__ = ("target_system", "target_component", "param_id", "_param_id", "param_index", "error")
    msgid = 345
    msgname = "PARAM_ERROR"
    unpacker = Struct("<hBB16sB")
    places = (1, 2, 3, 0, 4)

    def __init__(self, target_system: int, target_component: int, param_id: bytes, param_index: int, error: int) -> None:
        self.target_system = target_system
        self.target_component = target_component
        self.param_id = as_text(param_id)
        self._param_id = param_id
        self.param_index = param_index
        self.error = error

    def to_payload(self) -> bytes:
        return self.unpacker.pack(self.param_index, self.target_system, self.target_component, self._param_id, self.error)


#: By message id.
KINDS: Mapping[int, type[MavlinkMessage]] = {
    0: MAVLink_heartbeat_message,
    1: MAVLink_sys_status_message,
    2: MAVLink_system_time_message,
    4: MAVLink_ping_message,
    11: MAVLink_set_mode_message,
    20: MAVLink_param_request_read_message,
    21: MAVLink_param_request_list_message,
    22: MAVLink_param_value_message,
    23: MAVLink_param_set_message,
    24: MAVLink_gps_raw_int_message,
    27: MAVLink_raw_imu_message,
    29: MAVLink_scaled_pressure_message,
    30: MAVLink_attitude_message,
    31: MAVLink_attitude_quaternion_message,
    32: MAVLink_local_position_ned_message,
    33: MAVLink_global_position_int_message,
    35: MAVLink_rc_channels_raw_message,
    36: MAVLink_servo_output_raw_message,
    37: MAVLink_mission_request_partial_list_message,
    38: MAVLink_mission_write_partial_list_message,
    39: MAVLink_mission_item_message,
    40: MAVLink_mission_request_message,
    41: MAVLink_mission_set_current_message,
    42: MAVLink_mission_current_message,
    43: MAVLink_mission_request_list_message,
    44: MAVLink_mission_count_message,
    45: MAVLink_mission_clear_all_message,
    46: MAVLink_mission_item_reached_message,
    47: MAVLink_mission_ack_message,
    48: MAVLink_set_gps_global_origin_message,
    49: MAVLink_gps_global_origin_message,
    51: MAVLink_mission_request_int_message,
    62: MAVLink_nav_controller_output_message,
    65: MAVLink_rc_channels_message,
    66: MAVLink_request_data_stream_message,
    69: MAVLink_manual_control_message,
    70: MAVLink_rc_channels_override_message,
    73: MAVLink_mission_item_int_message,
    74: MAVLink_vfr_hud_message,
    75: MAVLink_command_int_message,
    76: MAVLink_command_long_message,
    77: MAVLink_command_ack_message,
    81: MAVLink_manual_setpoint_message,
    82: MAVLink_set_attitude_target_message,
    84: MAVLink_set_position_target_local_ned_message,
    86: MAVLink_set_position_target_global_int_message,
    90: MAVLink_hil_state_message,
    92: MAVLink_hil_rc_inputs_raw_message,
    102: MAVLink_vision_position_estimate_message,
    107: MAVLink_hil_sensor_message,
    109: MAVLink_radio_status_message,
    110: MAVLink_file_transfer_protocol_message,
    111: MAVLink_timesync_message,
    113: MAVLink_hil_gps_message,
    117: MAVLink_log_request_list_message,
    118: MAVLink_log_entry_message,
    119: MAVLink_log_request_data_message,
    121: MAVLink_log_erase_message,
    122: MAVLink_log_request_end_message,
    123: MAVLink_gps_inject_data_message,
    126: MAVLink_serial_control_message,
    139: MAVLink_set_actuator_control_target_message,
    147: MAVLink_battery_status_message,
    148: MAVLink_autopilot_version_message,
    160: MAVLink_fence_point_message,
    161: MAVLink_fence_fetch_point_message,
    166: MAVLink_radio_message,
    175: MAVLink_rally_point_message,
    176: MAVLink_rally_fetch_point_message,
    183: MAVLink_autopilot_version_request_message,
    191: MAVLink_mag_cal_progress_message,
    192: MAVLink_mag_cal_report_message,
    232: MAVLink_gps_input_message,
    233: MAVLink_gps_rtcm_data_message,
    242: MAVLink_home_position_message,
    243: MAVLink_set_home_position_message,
    244: MAVLink_message_interval_message,
    245: MAVLink_extended_sys_state_message,
    251: MAVLink_named_value_float_message,
    252: MAVLink_named_value_int_message,
    253: MAVLink_statustext_message,
    256: MAVLink_setup_signing_message,
    320: MAVLink_param_ext_request_read_message,
    321: MAVLink_param_ext_request_list_message,
    322: MAVLink_param_ext_value_message,
    323: MAVLink_param_ext_set_message,
    324: MAVLink_param_ext_ack_message,
    345: MAVLink_param_error_message,
}
