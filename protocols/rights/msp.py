# SPDX-License-Identifier: GPL-3.0-or-later
"""The effect of each MSP request, by firmware. docs/rights.md is generated from this table.

A v2 frame of a command below 256 has the same effect as its v1 frame. A command without a row is refused, and so is a
payload of another length: Harakiri, baseflight and MultiWii read a missing payload from the buffer that the previous
request filled, and a payload above the buffer's size is not skipped but searched for frames.

From the firmware's own handlers: src/serial.c of Harakiri (TestCode3, HarakiriWebstore1) and baseflight; Protocol.cpp
of MultiWii 2.4; src/main/io/serial_msp.c and src/main/fc/fc_msp.c of Cleanflight 1.9 to 2.2; src/main/msp/msp.c of
Betaflight; src/main/fc/fc_msp.c of INAV.
"""

from collections.abc import Collection, Mapping
from enum import Enum
from typing import NamedTuple

from protocols.rights import Effect


class Firmware(Enum):
    """The firmware families whose handlers are known."""

    HARAKIRI = "Harakiri"
    HARAKIRI_MISSIONS = "Harakiri with the mission extension"
    BASEFLIGHT = "baseflight"
    MULTIWII = "MultiWii"
    CLEANFLIGHT = "Cleanflight"
    BETAFLIGHT = "Betaflight"
    INAV = "INAV"
    UNKNOWN = "any other"


class MspRight(NamedTuple):
    """The effect of a request. lengths: of the payload, bytes. reply: the largest payload of the reply.

    only: the payloads with this effect, if not every one of these lengths has it. otherwise: the effect of the others.
    """

    name: str
    effect: Effect
    lengths: Collection[int] = range(256)
    reply: int = 0
    only: frozenset[bytes] = frozenset()
    otherwise: Effect = Effect.UNKNOWN

    def effect_of(self, payload: bytes) -> Effect:
        if len(payload) not in self.lengths:
            return Effect.UNKNOWN
        return self.effect if not self.only or payload in self.only else self.otherwise


#: By command.
Rights = Mapping[int, MspRight]


def msp_right(firmware: Firmware, command: int, payload: bytes) -> MspRight:
    """The right of a request, or UNKNOWN without a known handler."""
    right = MSP_RIGHTS[firmware].get(command)
    if right is None:
        names = (rights[command].name for rights in MSP_RIGHTS.values() if command in rights)
        return MspRight(next(names, f"command {command}"), Effect.UNKNOWN)
    effect = right.effect_of(payload)
    return right if effect is right.effect else right._replace(effect=effect)


def _reads(**rows: tuple[int, ...]) -> Rights:
    """NAME=(command, largest reply, *payload lengths). Without lengths the request is empty."""
    return {row[0]: MspRight(name, Effect.READ, row[2:] or (0,), row[1]) for name, row in rows.items()}


def _changes(largest: int, **rows: int | tuple[int, ...]) -> Rights:
    """NAME=command, which takes up to `largest` bytes, or NAME=(command, *payload lengths)."""
    found: dict[int, MspRight] = {}
    for name, row in rows.items():
        command, lengths = (row[0], row[1:]) if isinstance(row, tuple) else (row, range(largest + 1))
        found[command] = MspRight(name, Effect.CHANGE, lengths, _LARGEST_ACK)
    return found


def _moves(**rows: int) -> Rights:
    return {command: MspRight(name, Effect.MOVE) for name, command in rows.items()}


def _refused(**rows: int) -> Rights:
    """Reads that do more than they say."""
    return {command: MspRight(name, Effect.UNKNOWN, ()) for name, command in rows.items()}


#: Some setters answer with a byte.
_LARGEST_ACK = 2
#: The receive buffers: INBUF_SIZE, NM_BUFFER_SIZE, MSP_PORT_INBUF_SIZE.
_BUFFER, _EXTENDED_BUFFER, _NEW_BUFFER = 64, 243, 192

# -- Descendants of MultiWii with the buffer ---------------------------------------------------------------------------

#: The first two are requested to distinguish these boards from newer boards: those answer with an error.
_OLD_READS = _reads(
    API_VERSION=(1, 0), FC_VARIANT=(2, 0),
    IDENT=(100, 7), STATUS=(101, 11), RAW_IMU=(102, 18), SERVO=(103, 16), MOTOR=(104, 16), RC=(105, 36),
    RAW_GPS=(106, 16), COMP_GPS=(107, 5), ATTITUDE=(108, 8), ALTITUDE=(109, 6), ANALOG=(110, 7), RC_TUNING=(111, 7),
    PID=(112, 30), BOX=(113, 96), MISC=(114, 22), MOTOR_PINS=(115, 8), BOXNAMES=(116, 200), PIDNAMES=(117, 48),
    DEBUG=(254, 8),
)  # fmt: skip
_OLD_CHANGES = _changes(
    _BUFFER,
    SET_PID=(202, 30), SET_BOX=(203, *range(2, _BUFFER + 1, 2)), SET_RC_TUNING=(204, 7), ACC_CALIBRATION=(205, 0),
    MAG_CALIBRATION=(206, 0), SET_MISC=(207, 22), RESET_CONF=(208, 0), EEPROM_WRITE=(250, 0),
)  # fmt: skip
_OLD_MOVES = _moves(SET_RAW_RC=200, SET_RAW_GPS=201)

#: WP with another number is answered with a header without a payload. BOX has two bytes a box, or four with 5 or 6 aux
#: channels. 209 (SET_WP) is not handled, and MISSION_INFO only one in the extension, which is recognised by it.
_HARAKIRI: Rights = {
    **_OLD_READS, **_OLD_MOVES, **_OLD_CHANGES,
    **_reads(
        RC=(105, 20), RAW_GPS=(106, 14), ANALOG=(110, 5), BOX=(113, 60), MISC=(114, 2), BOXNAMES=(116, 120),
        MISSION_INFO=(190, 0),
    ),
    **_changes(_BUFFER, SET_BOX=(203, 28, 30, 56, 60), SET_MISC=(207, *range(_BUFFER + 1))),
    118: MspRight("WP", Effect.READ, (1,), 12, frozenset((b"\x00", b"\x10"))),
}  # fmt: skip
#: The extension takes a request only with its own length, and leaves the reply in the receive buffer.
_HARAKIRI_MISSIONS: Rights = {
    **_HARAKIRI,
    **_reads(MISSION_INFO=(190, 24), MISSION_READ=(195, 243, 5), SETTING=(197, 218, 5), FLIGHT=(179, 26)),
    **_changes(
        _EXTENDED_BUFFER,
        MISSION_BEGIN=(191, 7), MISSION_CHUNK=(192, *range(19, _EXTENDED_BUFFER + 1, 16)), MISSION_COMMIT=(193, 7),
        MISSION_ABORT=(194, 0), MISSION_RADIUS=(196, 5), SET_SETTING=(198, 11),
    ),
}  # fmt: skip
#: GPSSVINFO makes the board poll the GPS. SET_WP moves home or the place that the craft holds.
_BASEFLIGHT: Rights = {
    **_OLD_READS, **_OLD_MOVES, **_OLD_CHANGES,
    **_reads(
        RCMAP=(64, 8), CONFIG=(66, 16), BUILDINFO=(69, 19), WP=(118, 18, 1), BOXIDS=(119, 24), SERVO_CONF=(120, 56),
        UID=(160, 12), GPSDEBUGINFO=(166, 16), ACC_TRIM=(240, 4),
    ),
    **_changes(_BUFFER, SET_RCMAP=(65, 8), SET_CONFIG=(67, 16), SELECT_SETTING=(210, 1), SET_SERVO_CONF=(212, 56),
               SET_ACC_TRIM=(239, 4)),
    **_moves(REBOOT=68, SET_WP=209, SET_HEAD=211, SET_MOTOR=214),
    **_refused(GPSSVINFO=164),
}  # fmt: skip
#: With navigation. A waypoint that is read stays in RAM, where it decides whether a return home lands; home (0) and the
#: place that the craft holds (255) do not. SET_WP of these two numbers moves them.
_MULTIWII: Rights = {
    **_OLD_READS, **_OLD_MOVES, **_OLD_CHANGES,
    **_reads(
        BOXIDS=(119, 48), SERVO_CONF=(120, 56), NAV_STATUS=(121, 7), NAV_CONFIG=(122, 32), ACC_TRIM=(240, 4),
    ),
    118: MspRight("WP", Effect.READ, (1,), 21, frozenset((b"\x00", b"\xff")), Effect.CHANGE),
    **_changes(_BUFFER, SET_WP=(209, 21), SELECT_SETTING=(210, 1), SET_SERVO_CONF=(212, 56), SET_NAV_CONFIG=(215, 22),
               SET_ACC_TRIM=(239, 4)),
    **_moves(SET_HEAD=211, SET_MOTOR=214, BIND=241),
}  # fmt: skip

# -- Cleanflight and its descendants -----------------------------------------------------------------------------------

_NEW_READS = _reads(
    API_VERSION=(1, 3), FC_VARIANT=(2, 4), FC_VERSION=(3, 64), BOARD_INFO=(4, 128), BUILD_INFO=(5, 128), NAME=(10, 32),
    MODE_RANGES=(34, 160), FEATURE=(36, 4), BOARD_ALIGNMENT=(38, 6), CURRENT_METER_CONFIG=(40, 16), MIXER=(42, 2),
    RX_CONFIG=(44, 64), LED_COLORS=(46, 64), LED_STRIP_CONFIG=(48, 512), RSSI_CONFIG=(50, 1),
    ADJUSTMENT_RANGES=(52, 256), CF_SERIAL_CONFIG=(54, 128), VOLTAGE_METER_CONFIG=(56, 32), SONAR_ALTITUDE=(58, 4),
    PID_CONTROLLER=(59, 1), ARMING_CONFIG=(61, 8), RX_MAP=(64, 16), BF_CONFIG=(66, 16), BF_BUILD_INFO=(69, 19),
    DATAFLASH_SUMMARY=(70, 13), DATAFLASH_READ=(71, 4112, 4, 6), LOOP_TIME=(73, 2), FAILSAFE_CONFIG=(75, 24),
    SDCARD_SUMMARY=(79, 11), BLACKBOX_CONFIG=(80, 16), TRANSPONDER_CONFIG=(82, 32), OSD_CONFIG=(84, 400),
    VTX_CONFIG=(88, 32), ADVANCED_CONFIG=(90, 32), FILTER_CONFIG=(92, 64), PID_ADVANCED=(94, 96),
    SENSOR_CONFIG=(96, 16), IDENT=(100, 7), STATUS=(101, 48), RAW_IMU=(102, 18), SERVO=(103, 48), MOTOR=(104, 24),
    RC=(105, 68), RAW_GPS=(106, 18), COMP_GPS=(107, 5), ATTITUDE=(108, 6), ALTITUDE=(109, 10), ANALOG=(110, 9),
    RC_TUNING=(111, 32), PID=(112, 64), BOX=(113, 96), MISC=(114, 22), MOTOR_PINS=(115, 8), BOXNAMES=(116, 512),
    PIDNAMES=(117, 64), BOXIDS=(119, 64), SERVO_CONFIGURATIONS=(120, 256), MOTOR_3D_CONFIG=(124, 6),
    RC_DEADBAND=(125, 8), SENSOR_ALIGNMENT=(126, 32), LED_STRIP_MODECOLOR=(127, 180), BATTERY_STATE=(130, 16),
    STATUS_EX=(150, 48), UID=(160, 12), GPSSVINFO=(164, 160), GPSSTATISTICS=(166, 32), TX_INFO=(187, 8),
    ACC_TRIM=(240, 4), SERVO_MIX_RULES=(241, 512), DEBUG=(254, 16), COMMON_SERIAL_CONFIG=(0x1009, 160),
)  # fmt: skip
_NEW_CHANGES = _changes(
    _NEW_BUFFER,
    SET_NAME=11, SET_MODE_RANGE=35, SET_FEATURE=37, SET_BOARD_ALIGNMENT=39, SET_CURRENT_METER_CONFIG=41, SET_MIXER=43,
    SET_RX_CONFIG=45, SET_LED_COLORS=47, SET_LED_STRIP_CONFIG=49, SET_RSSI_CONFIG=51, SET_ADJUSTMENT_RANGE=53,
    SET_CF_SERIAL_CONFIG=55, SET_VOLTAGE_METER_CONFIG=57, SET_PID_CONTROLLER=60, SET_ARMING_CONFIG=62, SET_RX_MAP=65,
    SET_BF_CONFIG=67, DATAFLASH_ERASE=72, SET_LOOP_TIME=74, SET_FAILSAFE_CONFIG=76, SET_BLACKBOX_CONFIG=81,
    SET_TRANSPONDER_CONFIG=83, SET_OSD_CONFIG=85, OSD_CHAR_WRITE=87, SET_VTX_CONFIG=89, SET_ADVANCED_CONFIG=91,
    SET_FILTER_CONFIG=93, SET_PID_ADVANCED=95, SET_SENSOR_CONFIG=97, SET_PID=202, SET_RC_TUNING=204,
    ACC_CALIBRATION=205, MAG_CALIBRATION=206, SET_MISC=207, RESET_CONF=208, SELECT_SETTING=210,
    SET_SERVO_CONFIGURATION=212, SET_MOTOR_3D_CONFIG=217, SET_RC_DEADBAND=218, SET_RESET_CURR_PID=219,
    SET_SENSOR_ALIGNMENT=220, SET_LED_STRIP_MODECOLOR=221, SET_ACC_TRIM=239, SET_SERVO_MIX_RULE=242, EEPROM_WRITE=250,
    COMMON_SET_SERIAL_CONFIG=0x100A,
)  # fmt: skip
_NEW_MOVES = {
    **_moves(REBOOT=68, SET_TX_INFO=186, SET_RAW_RC=200, SET_RAW_GPS=201, SET_HEAD=211, SET_MOTOR=214,
             PASSTHROUGH_SERIAL=244, SET_PASSTHROUGH=245, RX_BIND=0x3000),
    **{command: MspRight("a sensor's value", Effect.MOVE) for command in range(0x1F01, 0x1F10)},
}  # fmt: skip

#: SET_WP moves home or the place that a Cleanflight holds. MULTIPLE_MSP hides other requests.
_BETAFLIGHT: Rights = {
    **_NEW_READS, **_NEW_MOVES, **_NEW_CHANGES,
    **_reads(
        BATTERY_CONFIG=(32, 16), RXFAIL_CONFIG=(77, 64), BOXNAMES=(116, 512, 0, 1), WP=(118, 18, 1),
        BOXIDS=(119, 64, 0, 1), VOLTAGE_METERS=(128, 64), CURRENT_METERS=(129, 64), MOTOR_CONFIG=(131, 16),
        GPS_CONFIG=(132, 8), COMPASS_CONFIG=(133, 4), ESC_SENSOR_DATA=(134, 64), GPS_RESCUE=(135, 32),
        GPS_RESCUE_PIDS=(136, 16), VTXTABLE_BAND=(137, 48, 1), VTXTABLE_POWERLEVEL=(138, 16, 1),
        MOTOR_TELEMETRY=(139, 128), SIMPLIFIED_TUNING=(140, 64), ATTITUDE_QUATERNION=(167, 8), BEEPER_CONFIG=(184, 9),
        OSD_CANVAS=(189, 2), MODE_RANGES_EXTRA=(238, 96), RTC=(247, 16), MOTOR_OUTPUT_REORDERING=(0x3001, 16),
        VTX_DEVICE_STATUS=(0x3004, 64), OSD_WARNINGS=(0x3005, 64), GET_TEXT=(0x3006, 64, 1),
        LED_STRIP_CONFIG_VALUES=(0x3008, 8), SENSOR_CONFIG_ACTIVE=(0x300A, 16), MCU_INFO=(0x300C, 64),
        GYRO_SENSOR_ACTIVE=(0x300D, 16), BATTERY_PROFILE=(0x300E, 16, 0, 1),
    ),
    **_changes(
        _NEW_BUFFER,
        SET_BATTERY_CONFIG=33, SET_RXFAIL_CONFIG=78, SET_ARMING_DISABLED=99, SET_SIMPLIFIED_TUNING=141,
        COPY_PROFILE=183, SET_BEEPER_CONFIG=185, SET_OSD_CANVAS=188, SET_MOTOR_CONFIG=222, SET_GPS_CONFIG=223,
        SET_COMPASS_CONFIG=224, SET_GPS_RESCUE=225, SET_GPS_RESCUE_PIDS=226, SET_VTXTABLE_BAND=227,
        SET_VTXTABLE_POWERLEVEL=228, SET_RTC=246, SET_BOARD_INFO=248, SET_SIGNATURE=249,
        SET_MOTOR_OUTPUT_REORDERING=0x3002, SET_TEXT=0x3007, SET_LED_STRIP_CONFIG_VALUES=0x3009,
        SET_BATTERY_PROFILE=0x300F,
    ),
    **_moves(SET_WP=209, SEND_DSHOT_COMMAND=0x3003),
    **_refused(MULTIPLE_MSP=230),
}  # fmt: skip
#: Only later versions understand v2. The first versions have the buffer of MultiWii.
_CLEANFLIGHT: Rights = {
    command: right._replace(lengths=range(_BUFFER + 1)) if right.effect is Effect.CHANGE else right
    for command, right in _BETAFLIGHT.items()
    if command < 256
}
#: The reply to LOGIC_CONDITIONS overruns the buffer of boards without a flash chip. PID_V2 derives the PIDs again if
#: EZ Tune is on: to the same values, unless others were typed into the command line. 246 reads the clock, and sets that
#: of Betaflight. SET_WP of the numbers 0 and 255 moves home or the place that the craft holds.
_INAV: Rights = {
    **_NEW_READS, **_NEW_MOVES, **_NEW_CHANGES,
    **_reads(
        INAV_PID=(6, 16), NAV_POSHOLD=(12, 16), CALIBRATION_DATA=(14, 32), POSITION_ESTIMATION_CONFIG=(16, 16),
        WP_GETINFO=(20, 4), RTH_AND_LAND_CONFIG=(21, 32), FW_CONFIG=(23, 16), WP=(118, 21, 1), NAV_STATUS=(121, 16),
        VTXTABLE_POWERLEVEL=(138, 16, 1), SENSOR_STATUS=(151, 9), RTC=(246, 6), COMMON_TZ=(0x1001, 3),
        COMMON_SETTING=(0x1003, 256, *range(2, 65)), COMMON_MOTOR_MIXER=(0x1005, 192),
        COMMON_SETTING_INFO=(0x1007, 1024, *range(2, 65)), COMMON_PG_LIST=(0x1008, 1024, 0, 2),
        COMMON_GET_RADAR_GPS=(0x100F, 64),
        INAV_STATUS=(0x2000, 32), INAV_OPTICAL_FLOW=(0x2001, 9), INAV_ANALOG=(0x2002, 32), INAV_MISC=(0x2003, 48),
        INAV_BATTERY_CONFIG=(0x2005, 32), INAV_RATE_PROFILE=(0x2007, 16), INAV_AIR_SPEED=(0x2009, 4),
        INAV_OUTPUT_MAPPING=(0x200A, 32), INAV_MC_BRAKING=(0x200B, 16), INAV_OUTPUT_MAPPING_EXT=(0x200D, 64),
        INAV_TIMER_OUTPUT_MODE=(0x200E, 64, 0, 1), INAV_MIXER=(0x2010, 16), INAV_OSD_LAYOUTS=(0x2012, 512, 0, 1, 3),
        INAV_OSD_ALARMS=(0x2014, 32), INAV_OSD_PREFERENCES=(0x2016, 16), INAV_DEBUG=(0x2019, 32),
        BLACKBOX_CONFIG_V2=(0x201A, 16), INAV_TEMP_SENSOR_CONFIG=(0x201C, 160), INAV_TEMPERATURES=(0x201E, 16),
        INAV_SERVO_MIXER=(0x2020, 512), INAV_GLOBAL_FUNCTIONS=(0x2024, 128), INAV_LOGIC_CONDITIONS_STATUS=(0x2026, 256),
        INAV_GVAR_STATUS=(0x2027, 64), INAV_PROGRAMMING_PID=(0x2028, 96), INAV_PROGRAMMING_PID_STATUS=(0x202A, 16),
        PID_V2=(0x2030, 64), INAV_SAFEHOME=(0x2038, 16, 1), INAV_MISC2=(0x203A, 16),
        INAV_LOGIC_CONDITIONS_SINGLE=(0x203B, 16, 1), INAV_LOGIC_CONDITIONS_CONFIGURED=(0x203C, 8),
        INAV_ESC_RPM=(0x2040, 64), INAV_ESC_TELEM=(0x2041, 256), INAV_LED_STRIP_CONFIG_EX=(0x2048, 1024),
        INAV_FW_APPROACH=(0x204A, 16, 1), INAV_RATE_DYNAMICS=(0x2060, 8), INAV_EZ_TUNE=(0x2070, 16),
        ADSB_VEHICLE_LIST=(0x2090, 512), INAV_CUSTOM_OSD_ELEMENTS=(0x2100, 4), INAV_CUSTOM_OSD_ELEMENT=(0x2101, 64, 1),
        INAV_GET_LINK_STATS=(0x2103, 8), INAV_OUTPUT_MAPPING_EXT2=(0x210D, 192), INAV_SERVO_CONFIG=(0x2200, 256),
        INAV_GEOZONE=(0x2210, 16, 1), INAV_GEOZONE_VERTEX=(0x2212, 16, 2), INAV_FULL_LOCAL_POSE=(0x2220, 32),
        INAV_WIND=(0x2231, 8),
    ),
    **_changes(
        _NEW_BUFFER,
        SET_INAV_PID=7, SET_NAV_POSHOLD=13, SET_CALIBRATION_DATA=15, SET_POSITION_ESTIMATION_CONFIG=17,
        WP_MISSION_LOAD=(18, 1), WP_MISSION_SAVE=(19, 1), SET_RTH_AND_LAND_CONFIG=22, SET_FW_CONFIG=24,
        SET_WP=(209, 21), SET_RTC=247, COMMON_SET_TZ=0x1002, COMMON_SET_SETTING=0x1004, COMMON_SET_MOTOR_MIXER=0x1006,
        COMMON_SET_RADAR_POS=0x100B, COMMON_SET_RADAR_ITD=0x100C, INAV_SET_MISC=0x2004, INAV_SET_BATTERY_CONFIG=0x2006,
        INAV_SET_RATE_PROFILE=0x2008, INAV_SET_MC_BRAKING=0x200C, INAV_SET_TIMER_OUTPUT_MODE=0x200F,
        INAV_SET_MIXER=0x2011, INAV_OSD_SET_LAYOUT_ITEM=0x2013, INAV_OSD_SET_ALARMS=0x2015,
        INAV_OSD_SET_PREFERENCES=0x2017, INAV_SELECT_BATTERY_PROFILE=0x2018, SET_BLACKBOX_CONFIG_V2=0x201B,
        INAV_SET_TEMP_SENSOR_CONFIG=0x201D, INAV_SET_SERVO_MIXER=0x2021, INAV_SET_LOGIC_CONDITIONS=0x2023,
        INAV_SET_GLOBAL_FUNCTIONS=0x2025, INAV_SET_PROGRAMMING_PID=0x2029, SET_PID_V2=0x2031,
        INAV_OPFLOW_CALIBRATION=0x2032, INAV_SET_SAFEHOME=(0x2039, 10), INAV_SET_LED_STRIP_CONFIG_EX=0x2049,
        INAV_SET_FW_APPROACH=(0x204B, 15), INAV_SET_RATE_DYNAMICS=0x2061, INAV_EZ_TUNE_SET=0x2071,
        INAV_SELECT_MIXER_PROFILE=0x2080, INAV_SET_CUSTOM_OSD_ELEMENTS=0x2102, INAV_OSD_UPDATE_POSITION=0x2118,
        INAV_SET_SERVO_CONFIG=0x2201, INAV_SET_GEOZONE=(0x2211, 14),
        INAV_SET_GEOZONE_VERTEX=(0x2213, 10, 14), INAV_SET_GVAR=0x2214,
    ),
    **_moves(
        COMMON_SET_MSP_RC_LINK_STATS=0x100D, COMMON_SET_MSP_RC_INFO=0x100E, SIMULATOR=0x201F,
        FWUPDT_PREPARE=0x2033, FWUPDT_STORE=0x2034, FWUPDT_EXEC=0x2035, FWUPDT_ROLLBACK_PREPARE=0x2036,
        FWUPDT_ROLLBACK_EXEC=0x2037, GPS_UBLOX_COMMAND=0x2050,
        SET_CRUISE_HEADING=0x2223, SET_AUX_RC=0x2230, RX_BIND=0x3001,
    ),
    # The one move that the bridge itself sends, over a link with a key or writers.
    0x2221: MspRight("INAV_SET_WP_INDEX", Effect.MOVE, (1,)),
    **_refused(INAV_LOGIC_CONDITIONS=0x2022),
}  # fmt: skip


MSP_RIGHTS: Mapping[Firmware, Rights] = {
    Firmware.HARAKIRI: _HARAKIRI,
    Firmware.HARAKIRI_MISSIONS: _HARAKIRI_MISSIONS,
    Firmware.BASEFLIGHT: _BASEFLIGHT,
    Firmware.MULTIWII: _MULTIWII,
    Firmware.CLEANFLIGHT: _CLEANFLIGHT,
    Firmware.BETAFLIGHT: _BETAFLIGHT,
    Firmware.INAV: _INAV,
    # Reads on every firmware above.
    Firmware.UNKNOWN: {**_OLD_READS, 118: MspRight("WP", Effect.READ, (1,), 21, frozenset((b"\x00",)))},
}
