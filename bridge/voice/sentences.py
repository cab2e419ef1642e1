# SPDX-License-Identifier: GPL-3.0-or-later
"""The table: every sentence for pilots, with the severity, a short form for a HUD, and the longest values.

The mission rules' findings are values here: `reports.finding` has their texts, `mission_report` the summary.
"""

from collections.abc import Mapping, Sequence

from bridge.voice.happening import LINE_LENGTH, Happening, Sentence, Severity
from protocols.msp.mission_flight import FlightReason

_CRITICAL, _ERROR, _WARNING = Severity.CRITICAL, Severity.ERROR, Severity.WARNING
_NOTICE, _INFO = Severity.NOTICE, Severity.INFO
#: The longest values: a parameter's name, a value in single precision, a setting of INAV, the numbers of items and of
#: seconds, a host, a station.
_PARAMETER, _VALUE, _SETTING = "FAILSAFE_PRCDR_A", "-1.234567e+30", "osd_mah_remaining_precision_and_more"
_ITEMS, _SECONDS, _HOST = 1000, 99_999.0, "192.168.100.100"
_STATION = f"QGroundControl {_HOST}"
_REASON = "a reason of a board that is longer than any line of the HUD, with a remedy"
_SUMMARY = "145 of 146 stored: 1 dropped, 13 flown differently"

# The flight controller.
FOUND = Sentence(_INFO, "Found {}", "Harakiri without the mission extension")
NOT_FOUND = Sentence(_WARNING, "No flight controller found: {}", "check power, wiring")
LOST = Sentence(_WARNING, "Flight controller lost: silent for {:.0f} s", _SECONDS)
BACK = Sentence(_WARNING, "Flight controller back after {:.0f} s", _SECONDS)
IN_COMMAND_LINE = Sentence(_WARNING, "Board in its CLI: type exit, or unplug it")
FAILSAFE = Sentence(_CRITICAL, "Failsafe: the flight controller has taken over")
FAILSAFE_ENDED = Sentence(_NOTICE, "Failsafe ended: the pilot has control")
LEFT_MISSION = Sentence(_WARNING, "{}", "Returns: 199 m from the border of geozone 62")
EMERGENCY_LANDING = Sentence(_CRITICAL, "EMERGENCY LANDING")
BANNER = Sentence(_INFO, "naze-bridge {}: {}", "0.3.1.dev12+g1234567", "no flight controller")

# Arming. QGroundControl shows each text that begins with PreArm as a failure, and Mission Planner the last for 10 s.
NOT_READY = Sentence(_WARNING, "PreArm: {}", "no flight controller: check power, wiring")
READY = Sentence(_INFO, "Ready to arm", planner="PreArm: ready")

# Commands, and messages that do the same.
NO_BOARD_TO_COMMAND = Sentence(_ERROR, "No flight controller: the command has no effect")
ARM = Sentence(_ERROR, "Arm and disarm with the transmitter")
MODE = Sentence(_ERROR, "Modes are set with the transmitter switches")
MISSION_SWITCH = Sentence(_ERROR, "Use the {} switch to fly the mission", "GPS MISSION")
MISSION_START = Sentence(_ERROR, "Start the mission with the transmitter")
FLIES_NO_MISSIONS = Sentence(_ERROR, "This flight controller cannot fly missions")
REBOOT = Sentence(_ERROR, "The flight controller cannot be rebooted from here")
HOME = Sentence(_ERROR, "Home is set where the craft is armed")
FLY = Sentence(_ERROR, "Fly the craft with the transmitter")
OUTPUTS = Sentence(_ERROR, "Motors, servos and relays cannot be driven here")
JOYSTICK = Sentence(_ERROR, "Joystick ignored: fly with the transmitter")
NO_CAMERA = Sentence(_ERROR, "Cameras and gimbals are not controlled here")
ORIGIN = Sentence(_ERROR, "The origin is home, set by the flight controller")
#: The name comes last: QGroundControl shows a text that begins with "preflight" as a failed check.
NO_EFFECT = Sentence(_ERROR, "Not supported: {}", "COMPONENT_CONTROL_OF_A_LONG_NAME")
NO_FENCE = Sentence(_ERROR, "This flight controller has no fence")
FENCE_SWITCH = Sentence(_ERROR, "Switch geozones on or off in INAV's settings")

# Set WP.
NOT_SET_TO_ITEM = Sentence(_ERROR, "Set WP: not possible on this flight controller")
SET_ON_NEWER_INAV = Sentence(_ERROR, "Set WP: needs INAV 9.1, this is {}", "255.255.255")
SET_REFUSED_BY_INAV = Sentence(_ERROR, "Set WP: INAV refused it")
SET_IN_FLIGHT = Sentence(_ERROR, "Set WP: only in flight, in NAV WP mode")
SET_WHILE_LANDING = Sentence(_ERROR, "Set WP: it is landing, or has landed")
SET_ON_CHANGED_LIST = Sentence(_ERROR, "Set WP: read the mission from the board first")
SET_WITHOUT_EFFECT = Sentence(_ERROR, "Set WP failed: INAV flies on as before")
SET_UNANSWERED = Sentence(_ERROR, "Set WP: no answer from INAV, watch where it flies")
SET_TOO_SOON = Sentence(_ERROR, "Set WP: another request is running, try again")
SET_TO_HOME = Sentence(_ERROR, "Set WP: item 0 is home")
SET_TO_MISSING = Sentence(_ERROR, "Set WP: there is no item {:.0f} on board", 65535.0)
SET_TO_ACTION = Sentence(_ERROR, "Set WP: item {:.0f} ({}) is not flown to", 999.0, "DO_SET_ROI_LOCATION")
SET_WITHOUT_RIGHT = Sentence(_ERROR, "Set WP: {}", "needs a key, or pass_through = everything")
NO_MISSION_RESET = Sentence(_ERROR, "Set WP: the mission cannot be restarted")
SET_BY_ANOTHER = Sentence(_NOTICE, "Another ground station has set the waypoint")

# Calibration. Mission Planner's page waits for "calibration failed" or "calibration successful".
CALIBRATING_ACCELEROMETER = Sentence(_NOTICE, "Keep the craft level and still")
CALIBRATING_COMPASS = Sentence(_NOTICE, "Turn the craft about all axes")
RESTARTS_AFTERWARDS = Sentence(_NOTICE, "Calibrating: the board then reboots (up to 5 min)")
CALIBRATING_NOW = Sentence(_ERROR, "Calibrating: try again when it is done")
CALIBRATED = Sentence(_NOTICE, "{} calibration successful", "Compass")
NOT_CALIBRATED = Sentence(_ERROR, "{} calibration failed: {}", "Compass", "use INAV Configurator")
NOT_CANCELLED = Sentence(_ERROR, "Cannot be cancelled: wait, or power off the craft")

# Settings.
SETTINGS_SAVED = Sentence(_INFO, "Settings saved")
ONLY_SAVED = Sentence(_ERROR, "Settings can be saved, but not loaded or reset")
FLASH_WEAR = Sentence(_ERROR, "Flash wear limit: try again in 10 minutes")
SETTINGS_CHANGED = Sentence(
    _WARNING,
    "Settings changed elsewhere: {0}",
    f"{_SETTING}, {_SETTING}",
    "nav_fw_pos_z_p, +1",
    short="Settings changed elsewhere: {1}",
)
SETTINGS_ARMED = Sentence(_ERROR, "Armed: disarm to change settings")
SETTINGS_UNANSWERED = Sentence(_ERROR, "No answer from the board: read the settings again")
LIST_UNANSWERED = Sentence(_INFO, "No answer from the board: read the settings again")
BOARD_LIMITS_SAVES = Sentence(_ERROR, "The board limits flash wear: one save every 5 min")
SETTINGS_BUSY = Sentence(_ERROR, "The board is writing its settings: try again")
SETTINGS_NOT_SAVED = Sentence(_ERROR, "Not saved by the board: read the settings again")
VALUE_NOT_TAKEN = Sentence(_ERROR, "The flight controller did not accept the value")
NO_SETTINGS = Sentence(_ERROR, "This flight controller's settings cannot be read")
SETTINGS_OCCUPIED = Sentence(_ERROR, "A mission is being transferred: try again later")
SETTINGS_UNREAD = Sentence(_ERROR, "The settings are still being read: try again")
TOO_MANY_CHANGES = Sentence(_ERROR, "Too many changes at once: try again")
NO_ARM_FLAG = Sentence(_ERROR, "Not changed: the board does not report arming")
RESTORE_RUNS = Sentence(_ERROR, "Another restore is running: wait until it ends")
NO_SUCH_SETTING = Sentence(_ERROR, "There is no setting {}", _PARAMETER)
READ_ONLY = Sentence(_ERROR, "{} is read-only", _PARAMETER)
REFUSED_BY_BOARD = Sentence(_ERROR, "{} stays {}: refused", _PARAMETER, _VALUE)
STAYS = Sentence(_ERROR, "{0} stays {1}: {2}", _PARAMETER, _VALUE, _REASON, short="{0} stays {1}: see Messages")
WRONG_FORM = Sentence(_ERROR, "{0}: {1}", _PARAMETER, _REASON, short="{0}: not understood, see Messages")
_FROM, _TO = "Cleanflight 255.255.255", "Betaflight 255.255.255"
OTHER_FIRMWARE = Sentence(
    _ERROR, "These settings are from {}, but the board has {}", _FROM, _TO, short="Settings of another firmware"
)
NONE_OF_THESE = Sentence(_ERROR, "The board has none of these settings")
#: WPNAV_RADIUS, which Mission Planner sends with each Write.
RADIUS_KEPT = Sentence(_NOTICE, "{0} stays {1}: {2}", _PARAMETER, _VALUE, "10..1000 cm")

# Other programs, strangers, and the Pi.
PROGRAM_REFUSED = Sentence(_NOTICE, "{}: {} refused ({})", _HOST, "SET_MOTOR_MIXER", "bytes that open the command line")
FRAME_REFUSED = Sentence(_WARNING, "Refused: {}", "set the key in naze-bridge's settings")
BEHIND_A_ROUTER = Sentence(_WARNING, "Behind a router: use a key, or connect by TCP")
OF_THE_PI = Sentence(_WARNING, "{}", "Missions are kept in memory: state folder unusable")

# Missions: refused before they are written.
ARMED = Sentence(_ERROR, "Armed: disarm to change the mission")
NO_LINK = Sentence(_ERROR, "No link to the flight controller")
NO_ANSWER = Sentence(_ERROR, "No answer from the board: try again")
BUSY = Sentence(_ERROR, "Flight controller is busy writing: try again")
STOPPING = Sentence(_ERROR, "naze-bridge is stopping: try again later")
OCCUPIED = Sentence(_ERROR, "Another mission transfer is running: try again")
ARMED_AND_UNKNOWN = Sentence(_ERROR, "Armed, mission not known: disarm to read it")
VEHICLE_UNKNOWN = Sentence(_ERROR, "The mission on board is not known yet: try again")
NO_MISSIONS = Sentence(_ERROR, "This flight controller cannot store missions")
NOT_PATCHED = Sentence(_ERROR, "This Harakiri lacks the mission patch")
SPEAKS_MAVLINK = Sentence(_ERROR, "Write missions to it from a ground station")
NO_PLACES = Sentence(_ERROR, "Fences and rally points are not stored here")
ONLY_MISSIONS = Sentence(_INFO, "Fences and rally points are not stored here")
TOO_MANY_UPLOADS = Sentence(_ERROR, "Too many uploads: wait a few seconds")
NOT_WHOLE = Sentence(_ERROR, "A mission can only be written as a whole")
BEYOND_THE_COUNT = Sentence(_ERROR, "WP {} is beyond the {} items announced", 65535, 65535)
WOULD_ERASE = Sentence(_ERROR, "No item can be stored: it would erase the mission")
REJECTED = Sentence(_ERROR, "{}", _REASON, lasts=True)

# Missions: uploads that ended early.
UPLOAD_SILENT = Sentence(_ERROR, "Upload stalled for {:.0f} s, old mission kept", 99.0, lasts=True)
ITEMS_MISSING = Sentence(_ERROR, "Mission NOT written: {} of {} missing, use Write", 999, 999, lasts=True)
MESSAGES_LOST = Sentence(_ERROR, "Mission NOT written: messages lost, use Write", lasts=True)
CANCELLED = Sentence(_ERROR, "Upload cancelled, old mission kept")
CANCELLED_WITH = Sentence(_ERROR, "Upload cancelled (result {}), old mission kept", 255)
DISCONNECTED = Sentence(_ERROR, "Upload ended: disconnected, old mission kept")
BRIDGE_STOPS = Sentence(_ERROR, "Upload ended: naze-bridge stops, old mission kept", lasts=True)
LOST_DURING_UPLOAD = Sentence(_ERROR, "Flight controller lost during the upload", lasts=True)
STILL_WRITING = Sentence(_ERROR, "Still writing the mission: wait for the result", lasts=True)
SUPERSEDED = Sentence(_ERROR, "superseded: {}", "the station is reading the mission")

# Missions: writes that failed.
ARMED_BEFORE = Sentence(_ERROR, "Not written: armed, disarm first")
BUSY_BEFORE = Sentence(_ERROR, "Not written: the board is busy, try again")
WRITES_SPENT = Sentence(_ERROR, "Not written: the board limits writes, wait 5 min")
NO_SPACE = Sentence(_ERROR, "Not written: the list does not fit the board")
RECORD_REFUSED = Sentence(_ERROR, "Not written: the board refused an item")
UNSAFE = Sentence(_ERROR, "Not written (firmware bug): move a waypoint a bit")
FLASH_FAILED = Sentence(_ERROR, "Not written: flash failed, old mission kept", lasts=True)
WRITE_UNANSWERED = Sentence(_ERROR, "No answer, old mission kept: write it again", lasts=True)
OUT_OF_TIME = Sentence(_ERROR, "Not written in time, old one kept: check wiring", lasts=True)
STOPPED_WHILE_WRITING = Sentence(_ERROR, "Not written: naze-bridge stopped, old one kept", lasts=True)
UNCERTAIN = Sentence(_ERROR, "Link lost while writing: will check on reconnect", lasts=True)
INCOMPLETE = Sentence(_ERROR, "Interrupted, no mission on board: write it again", lasts=True)
ARMED_WHILE_WRITING = Sentence(_ERROR, "Armed while writing, no mission on board: disarm", lasts=True)
NOT_SAVED = Sentence(_ERROR, "Mission not saved, lost at power-off: write again", lasts=True)
PLACES_KEPT = Sentence(_ERROR, "not written, old kept: try again", lasts=True)
PLACES_PARTLY = Sentence(_ERROR, "partly written, not saved: try again", lasts=True)
PLACES_NOT_SAVED = Sentence(_ERROR, "lost at power-off: try again", lasts=True)
PLACES_FAILED = Sentence(_ERROR, "{}: {}", "Rally points", PLACES_KEPT.text, lasts=True)

# Missions: written.
STORED = Sentence(_INFO, "{}", _SUMMARY)
STORED_WITH_LOSSES = Sentence(_WARNING, "{}", _SUMMARY, lasts=True)
CLEARED = Sentence(_WARNING, "Mission on the flight controller cleared", lasts=True)
ALREADY_CLEAR = Sentence(_INFO, "No mission to clear on the flight controller")
DANGER = Sentence(_WARNING, "{}", _REASON)
CHANGED_ITEM = Sentence(_NOTICE, "{}", _REASON)
ROUNDED_ITEM = Sentence(_INFO, "{}", _REASON)
MORE_FINDINGS = Sentence(_INFO, "and {} more: see the status page or naze-bridge missions show", _ITEMS)
PLACES_STORED = Sentence(_INFO, "{} verified: {} items{}", "Rally points", _ITEMS, ", unchanged")
PLACES_STORED_WITH_LOSSES = Sentence(
    _WARNING, "{} verified: {} items{}, warnings: {}", "Rally points", 127, "", 127, lasts=True
)
PLACES_CLEARED = Sentence(_INFO, "{} cleared{}", "Rally points", ", unchanged")
PART_OF_LAST = Sentence(_INFO, "The previous whole mission: see Missions on the page, or missions restore")
EMPTY_PLAN = Sentence(_WARNING, "Plan without waypoints: fences are not stored here")
NO_LIST = Sentence(_INFO, "No mission to read: {}", _REASON)
NOT_STORED_ON_PI = Sentence(_WARNING, "The mission could not be stored on the Pi")
NEW_MISSION = Sentence(_INFO, "New mission, {} items, by {}", _ITEMS, _STATION)
ERASED_BY = Sentence(_WARNING, "Mission erased by {}", _STATION, lasts=True)
NEW_PLACES = Sentence(_INFO, "{} written by {}", "Rally points", _STATION)
PUSHED = Sentence(_NOTICE, "{0}: {1}", "a program with a long name", _SUMMARY)
PUSHED_WITH_LOSSES = Sentence(_WARNING, "{0}: {1}", "a program with a long name", _SUMMARY, short="{1}", lasts=True)

# Missions: found on the board.
LOADED_AGAIN = Sentence(_NOTICE, "Saved mission loaded again: {} records", _ITEMS)
LOADED_FOREIGN = Sentence(_NOTICE, "Saved mission loaded, not written by naze-bridge: {} records", _ITEMS)
NOT_LOADED = Sentence(_WARNING, "No mission is loaded: disarm to load it")
CHANGED_ON_BOARD = Sentence(_WARNING, "Mission on board changed: {} records", _ITEMS)
DID_ARRIVE = Sentence(_NOTICE, "The mission did arrive: {} records", _ITEMS)
DID_NOT_ARRIVE = Sentence(_WARNING, "Mission did not arrive: write it again", lasts=True)
ARRIVED_INCOMPLETE = Sentence(_WARNING, "The mission arrived incomplete: write it again", lasts=True)
INTERRUPTED = Sentence(_NOTICE, "interrupted, old mission kept")

# A mission in flight (Harakiri).
LOW_BATTERY = Sentence(_WARNING, "Battery low: land, or switch GPS HOME on")
DECLINATION = Sentence(_WARNING, "Compass {} deg off: set {} to {}", 180, "mag_declination", -18000)
COMPASS_OFF = Sentence(_WARNING, "Compass about {} deg off: check mag_dec", 180)
_FLIGHT_TEXTS: Mapping[FlightReason, str] = {
    FlightReason.DISABLED: "Mission not started: mission_fly is 0",
    FlightReason.NOT_ARMED: "Mission not started: switch was on at arming",
    FlightReason.FIX_MISSING: "Mission not started: no GPS fix",
    FlightReason.HOME_MISSING: "Mission not started: no home position",
    FlightReason.NOT_READY: "Mission not started: calibrate compass and baro",
    FlightReason.LIST_EMPTY: "Mission refused: the list is empty",
    FlightReason.LIST_DAMAGED: "Mission refused: the list is damaged",
    FlightReason.LIST_CHANGED: "Mission refused: list changed since arming",
    FlightReason.BAD_ORDER: "Mission refused: wrong command or order",
    FlightReason.BAD_PLACE: "Mission refused: a position is missing",
    FlightReason.FIRST_FAR: "Mission refused: first waypoint is too far away",
    FlightReason.LEG_LONG: "Mission refused: a leg is too long",
    FlightReason.TOO_HIGH: "Mission refused: an altitude is too high",
    FlightReason.ON_GROUND: "Mission refused: below 1 m it needs TAKEOFF first",
    FlightReason.THROTTLE_LOW: "Mission stopped: throttle not centred",
    FlightReason.NO_LIFT: "Mission stopped: the craft did not lift off",
    FlightReason.CLIMB_SLOW: "Mission stopped: the climb took too long",
    FlightReason.STALLED: "Mission stopped: too slow against the wind",
    FlightReason.TURN_SLOW: "Mission stopped: the craft did not turn",
    FlightReason.LAND_SLOW: "Landing takes too long",
    FlightReason.STICKS: "Mission stopped: roll or pitch stick moved",
    FlightReason.THROTTLE: "Mission stopped: throttle stick moved",
    FlightReason.FIX_LOST: "Mission stopped: GPS fix lost, fly by hand",
    FlightReason.RTL: "Mission ended: return to launch",
    FlightReason.FAILSAFE: "Mission ended: failsafe",
    FlightReason.AWAY: "Mission stopped: off course, compass or GPS wrong",
    FlightReason.COMPASS: "Mission stopped: the compass is wrong",
    FlightReason.HOLD_LOST: "Landing: it cannot hold position",
    FlightReason.BLIND: "Landing: no GPS fix for too long",
    FlightReason.FENCE: "Mission stopped: outside mission_radius or _height",
    FlightReason.BATTERY: "Mission ended: battery low",
    FlightReason.JUMP: "Mission stopped: the GPS has jumped",
}
_FLIGHT = {reason: Sentence(_WARNING, text) for reason, text in _FLIGHT_TEXTS.items()} | {
    FlightReason.FLOWN: Sentence(_NOTICE, "Mission flown")
}


def of_flight(reason: FlightReason) -> Happening | None:
    """None for the pilot's own switch and disarming."""
    return _FLIGHT[reason]() if reason in _FLIGHT else None


def settings_changed(names: Sequence[str]) -> Happening:
    """All names, and for a HUD as many as fit."""
    room = LINE_LENGTH - len(SETTINGS_CHANGED.text) + len("{0}")
    for count in range(len(names), -1, -1):
        more = [f"+{len(names) - count}"] if count < len(names) else []
        if len(fitting := ", ".join([*names[:count], *more])) <= room:
            break
    return SETTINGS_CHANGED(", ".join(names), fitting)


def prearm_lines(reasons: tuple[str, ...]) -> list[Happening]:
    """The reasons not to arm, in as few lines as possible."""
    lines: list[Happening] = []
    for reason in reasons:
        joined = NOT_READY(f"{lines[-1].values[0]}, {reason}") if lines else NOT_READY(reason)
        if lines and joined.text == joined.line:
            lines[-1] = joined
        else:
            lines.append(NOT_READY(reason))
    return lines


def table() -> dict[str, Sentence[*tuple[object, ...]]]:
    """Every sentence by the name here."""
    named = {name: value for name, value in globals().items() if isinstance(value, Sentence)}
    return {**named, **{f"FLIGHT_{reason.name}": sentence for reason, sentence in _FLIGHT.items()}}
