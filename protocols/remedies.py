# SPDX-License-Identifier: GPL-3.0-or-later
"""The faults of files, links and machines that a person can remove: cause, sentence, action.

tests/service/cli/test_remedies.py carries out each action on a faulty file or machine, and sees the fault gone. The
table is in this room because every other room may import it.
"""

from enum import Enum, unique

_MISSION_AS = "save the mission as QGC WPL 110 (.waypoints) or as a QGroundControl plan (.plan)"
_AGAIN = "save it again from the program that made it"
_ITSELF = "save the one to be flown as a file of its own"
_ONE_BOARD = "give the settings of one board"
FC_FORMS = "use auto, /dev/serial0, /dev/ttyUSB0,57600, tcp:HOST:PORT, udp:HOST:PORT, udpin:0.0.0.0:PORT or sim"
GCS_FORMS = (
    "use udpin:0.0.0.0:14550, udpout:HOST:PORT, udpbcast:ADDR:PORT, tcpin:HOST:PORT or, for a radio, /dev/ttyUSB1,57600"
)
_BETTER_UART = "printf '\\n[all]\\ndtoverlay=disable-bt\\n' | sudo tee -a {config} && sudo reboot"
_SET_CLOCK = "sudo date --set 'YEAR-MONTH-DAY HOUR:MINUTE', with the present time"


@unique
class Fault(Enum):
    """The name is the cause, the value the sentence and the action. Braces are filled in where the fault is found."""

    # Mission files
    STRANGE_FILE = "a mission does not begin with {line}", _MISSION_AS
    OTHER_FILE = "this is {kind}", _MISSION_AS
    WEB_PAGE = "this file contains a web page", "download the file itself (on GitHub: Raw)"
    OTHER_PLAN = "this file contains {kinds}", "give the mission's own file"
    SETTINGS_FOR_MISSION = (
        "this file contains settings",
        "give the mission's own file; `naze-bridge settings restore` takes settings",
    )
    NO_HEADER = "this file contains items without the header", "write QGC WPL 110 into a line above them"
    UNKNOWN_HEADER = "the header is {header}, not 'QGC WPL 110'", "save it as a QGC WPL 110 file (.waypoints)"
    NO_TITLES = (
        "this file contains a table without titles for latitude and longitude",
        "name the columns in the first line: latitude,longitude,altitude(m)",
    )
    UNKNOWN_XML = "this XML contains <{tag}>", "give a mission of INAV Configurator or mwp, a KML or a GPX"
    LONG_XML = "this XML is longer than 2 MB", "save only the path to be flown"
    DOCUMENT_TYPE = "this XML has a document type", "delete the line that begins with <!DOCTYPE"
    DAMAGED_FILE = "this {kind} is damaged", _AGAIN
    NO_ITEMS = "the file has no items", _AGAIN
    TRUNCATED_LINE = "{count} fields where an item has {wanted}, the line is truncated or damaged", _AGAIN
    DECIMAL_COMMA = (
        "{text} has a decimal comma",
        "set the decimal symbol of Windows' region to a point and save it again, or replace the commas with points",
    )
    NOT_A_NUMBER = "{what} is {text}, not a number", _AGAIN
    NOT_WHOLE = "{what} is {text}, not a whole number from 0 to {most}", _AGAIN
    OUT_OF_RANGE = "{what} is {text}, out of range", _AGAIN
    NOT_DEGREES = "{what} is {text}", "give it in degrees"
    UNKNOWN_ACTION = "its action is {text}", "use one of {actions}"
    NOT_A_WP_LINE = "{line} is not a waypoint", "write wp NUMBER ACTION LAT LON ALT P1 P2 P3 FLAG, as `dump` does"
    MANY_MISSIONS = "the file contains {count} missions", "save one of them as a file of its own"
    MANY_PATHS = "the file contains {count} {kind}", _ITSELF
    NO_PATH = "the file does not contain a path", "draw a path, not an area, and save it again"
    NO_ALTITUDE = (
        "the path has no altitude",
        "save it with altitudes, or set one: `naze-bridge convert {name} MISSION.waypoints --alt METRES`",
    )
    NOT_A_PLACE = "{text} is not LON,LAT,ALT", "use decimal points, and spaces only between positions"
    NO_KML = "this zip archive does not contain a KML", "unpack it and give the mission file"
    SAME_TITLES = "two columns are titled {title}", "remove one of them"
    UNEQUAL_ROW = "{count} columns, but {wanted} titles", "save the table again, with decimal points"
    PLAN_VERSION = (
        "{what} has version {version}, but only {known} can be read",
        "open it in QGroundControl and save it as .plan",
    )
    NOT_A_PLAN = "{why}", "save it again from QGroundControl"
    SURVEY_WITHOUT_ITEMS = "a {kind} does not contain plain items", "use waypoints instead"
    FOREIGN_ENDING = "a mission read from the board cannot be written as {ending}", "name the file .waypoints or .plan"
    UNKNOWN_ENDING = "this ending is not known", "name it .waypoints, .plan or .mission"
    OWN_ALTITUDES = "the file already has altitudes", "omit --alt, which is for a KML, GPX or CSV"
    # Files of settings
    MISSION_FOR_SETTINGS = "this file contains a mission", "give a .param file or a dump (`diff all`)"
    NO_SETTINGS = "this file does not contain settings", "give a .param file or a dump (`diff all`)"
    BAD_COMMAND = "{line} cannot be read", "write {form}"
    NOT_A_SETTING = "{line} is not a name and a value", "write NAME,VALUE, with a decimal point"
    NOT_A_NAME = "{name} is not a setting's name", "write NAME,VALUE"
    NOT_A_VALUE = "{name} is {value}, not a number", "write NAME,VALUE"
    TWO_VALUES = "{name} is {first} in line {line} and {second} here", "delete one of the lines"
    MANY_SETTINGS = "the file has over {most} settings, more than any flight controller", _ONE_BOARD
    LONG_SETTINGS = "the file is longer than 1 MB", _ONE_BOARD
    # All files
    UNREADABLE_FILE = "{why}", "check the path and its permissions"
    FULL_DISK = "{why}", "delete other files there"
    NO_FILE = "{why}", "name another file"
    # Links
    NOT_AN_FC = "{text} is not a flight controller connection", "{hint}" + FC_FORMS
    NOT_A_GCS = "{text} is not a ground station connection", "{hint}" + GCS_FORMS
    NOT_A_BAUD = "{text}: {baud} is not a baud rate", "omit it to auto-detect"
    NO_RADIO_SPEED = "{text} lacks the radio's serial speed", "add it, as in {path},57600"
    SENT_OR_HEARD = (
        "{text}: it is not clear who connects",
        "write {sending}{kind}in:0.0.0.0:{port} to listen for ground stations",
    )
    NO_BRACKETS = "{text} contains an IPv6 address without brackets", "write it in brackets, as in [::1]:5760"
    NO_PORT = "{text} needs a host and a port", "{forms}"
    NOT_A_PORT = "{text}: {port} is not a port number", "give one from 1 to 65535"
    NOT_A_HOST = "{text}: {host} is not a host name", "{forms}"
    LINK_IN_USE = "{why}", "stop the program that uses it, or choose another port"
    LINK_ELSEWHERE = "{why}", "this machine does not have that address; 0.0.0.0 means all its addresses"
    LINK_OF_ROOT = "{why}", "ports below 1024 need root; choose another port"
    UNKNOWN_HOST = "{why}", "check the name and the network, or give the address in numbers"
    KEY_FILE_OPEN = "key_file {path} is readable by other users", "run chmod 600 {path}"
    KEY_FILE_LINES = "key_file {path} must contain one line of text", "write only the passphrase into it"
    # The machine: naze-bridge doctor
    BAD_CONFIGURATION = "{why}", "correct this, and run doctor again"
    DEBUG_SOCKET = "/dev/serial0 is the debug socket on a {model}: the header's pins are {header}", "{set_fc}"
    PORT_UNPLUGGED = "{path} is missing or not a serial port", "plug the flight controller in{other}"
    PORT_OFF = "{path} is missing or not a serial port", "enable the UART on the header: sudo naze-bridge setup{other}"
    PORT_OFF_ELSEWHERE = (
        "{path} is missing or not a serial port",
        "enable this UART in the board's own boot settings{other}",
    )
    NO_PORTS = (
        "there is no serial port for a flight controller",
        "plug the flight controller into USB, or name its port: sudo naze-bridge setup --fc /dev/NAME",
    )
    PORT_CLOSED_TO_US = (
        "{device} belongs to the group {group} with {mode}, not to dialout",
        "sudo udevadm trigger --settle --subsystem-match=tty; if that does not help, another udev rule decides: {page}",
    )
    CONSOLE_RUNS = "{getty} {state}", "sudo systemctl disable --now {getty}.service"
    CONSOLE_IN_FILE = "{word} is in {file}", "sudo sed -i 's/console={name}[^ ]* *//' {file} && sudo reboot"
    CONSOLE_OF_KERNEL = "the kernel was started with {word}", "sudo naze-bridge setup && sudo reboot"
    CONSOLE_ELSEWHERE = (
        "the kernel was started with {word}",
        "remove that word from the boot loader's command line, and reboot",
    )
    BLUETOOTH_PORT = "{program} has {device} open", "this UART belongs to Bluetooth, the header has another: {set_fc}"
    PORT_IN_USE = "{program} has {device} open", "stop it: {command}"
    NOT_CHECKED = "{fc} was not checked", "fix its port first, then run `sudo naze-bridge doctor`"
    PORT_NOT_OPEN = "{fc} cannot be opened yet", "check the port and the daemon's log"
    BOARD_IN_CLI = "{why}", "after that, run `sudo naze-bridge doctor` again"
    SILENT_LINE = (
        "{why}",
        "is it powered? Connect TX to RX, RX to TX and GND to GND, unplug USB from a Naze, and enable MSP on this UART",
    )
    SILENT_NETWORK = (
        "{why}",
        "is it on and in this network{ping}, is this its MSP port, and is no other program connected to it?",
    )
    WRONG_SPEED = (
        "no reply on {fc}, but {heard} bytes were received that are not frames",
        "{baud} baud is probably wrong; let the bridge detect the speed: {set_fc}",
    )
    NO_FRAMES = (
        "no reply on {fc}, but {heard} bytes were received that are not frames",
        "is only MSP enabled on this UART (not GPS or a receiver)? Is TX connected only to RX, and GND at both ends?",
    )
    MINI_UART = (
        "{found}; the port is the mini-UART",
        "{remedy} If all that is right, give the header Bluetooth's UART: " + _BETTER_UART,
    )
    UNPATCHED_BOARD = (
        "this Harakiri lacks the mission extension, so it cannot store missions",
        "telemetry works; for missions flash the patch: {page}",
    )
    BAD_LINE = (
        "{damaged} damaged replies in {minutes:.0f} min",
        "shorten the wires, keep them away from motors and regulators, connect GND at both ends, check 3.3 V",
    )
    UNSIGNED_STATION = (
        "{count} requests on {link} were refused: {why}",
        "enter the key in the ground station ({page}); sudo naze-bridge setup --new-key makes a new one and shows it",
    )
    LATE_STATION = (
        "{count} requests on {link} were refused: {why}",
        "set the clocks of the ground station and of the Pi; then: naze-bridge signing reset",
    )
    WRONG_IDS = (
        "{count} messages on {link} were ignored: {why}",
        "in that program, set its own sysid such as 255, and the vehicle's ids (by default 1 and 1) as target",
    )
    STORE_FAILS = (
        "the daemon cannot store missions: {why}",
        "see disk and missions below; then: sudo systemctl restart naze-bridge",
    )
    LATE_CLOCK = "the Pi's clock is {far} {side} {whose}", "sudo date --set '{off_s:+.0f} seconds'"
    OLD_CLOCK = "it is {time}, years in the past", _SET_CLOCK
    UNSET_CLOCK = (
        "{time}, not set by the network since the start",
        "connect to the Internet once, or before the flight: " + _SET_CLOCK,
    )
    ROOT_IN_MEMORY = (
        "an overlay in memory: settings, missions and logs are lost at power-off",
        "sudo raspi-config nonint disable_overlayfs && sudo reboot",
    )
    READ_ONLY_ROOT = (
        "read-only: settings and updates cannot be stored",
        "sudo mount -o remount,rw /; if that fails, the card may be worn out: look at `sudo dmesg`",
    )
    STATE_DIR_IS_FILE = "{path} cannot be used: {folder} is a file", "move {folder} away, or set another state_dir"
    STATE_DIR_NOT_KEPT = "{path} cannot be created: {folder} does not keep files", "set state_dir to a folder on a disk"
    NOT_ALLOWED = "no permission to {use} {path}", "run doctor with sudo"
    READ_ONLY_DISK = (
        "{path} is on a read-only disk",
        "the card may be worn out: look at `sudo dmesg`, then sudo mount -o remount,rw /",
    )
    DISK_NEARLY_FULL = "{free} MB free for {path}", "remove unneeded files, such as old logs: ls -l {path}/logs"
    STORE_UNUSABLE = "{why}", "move it away, and restart the bridge"
    STORE_DAMAGED = (
        "{path} is damaged: {why}",
        "restart the bridge: it sets the file aside and creates a new one (sudo systemctl restart naze-bridge)",
    )
    STORE_KEPT_ASIDE = (
        "a damaged store was kept as {path}",
        "to save its readable part: sqlite3 {path} .recover; then move it away",
    )
    LOW_VOLTAGE = (
        "the supply's voltage {when}",
        "use the Pi's own supply or a BEC of 5.1 V and 3 A, with short, thick wires",
    )
    WIFI_BLOCKED = (
        "is switched off (rfkill)",
        "set the country (sudo raspi-config nonint do_wifi_country DE), then: sudo rfkill unblock wlan",
    )
    NO_WIFI = "there is no Wi-Fi card", "connect ground stations by cable, or plug a card in"
    NO_ADDRESS = "{card} has no address", "join a network, or open a hotspot: {page}"
    FIREWALL = (
        "the firewall (nftables) drops packets to {what}",
        "sudo nft insert rule {chain} {transport} dport {port} accept; also add it to /etc/nftables.conf",
    )
    FIREWALL_UFW = "the firewall (ufw) drops packets to {what}", "sudo ufw allow {port}/{transport}"
    NOT_LISTENING = (
        "the daemon does not listen on {what}",
        "look at its log (journalctl -u naze-bridge), and restart it: sudo systemctl restart naze-bridge",
    )
    HIDDEN_LISTENER = "{what} is used by another program", "only root can see which: run doctor with sudo"
    OTHER_LISTENER = "{what} is used by {program}", "stop it: {command}; or use another port"
    LOST_LISTENER = "{what} is used by a program that no longer runs", "restart the Pi"
    NO_KEY = (
        "{link}: anyone on this network can change missions and settings",
        "sudo naze-bridge setup --new-key makes and shows a key, which changes then require",
    )
    WEAK_KEY = "{why}", "make a random one: sudo naze-bridge setup --new-key"
    BAD_ZENOH = "{why}", "correct the [zenoh] table or its config_file"
    # naze-bridge setup, card and token
    NOT_ROOT = "setup needs root", "run `sudo naze-bridge setup`, or see the changes with --dry-run"
    TOKEN_NOT_ROOT = "only root can read the token", "run `sudo naze-bridge token`"
    NO_TOKEN = "the status page has no token yet", "switch it on: `sudo naze-bridge setup --page`"
    TWO_KEYS = "--key-file and --new-key cannot be used together", "give one of them"
    NO_HOTSPOT_CARD = "this machine has no Wi-Fi card for a hotspot", "plug one in, or omit --hotspot"
    NO_PASSWORD = "a hotspot needs a password", "give it: --password-file FILE"
    NOT_AN_SSID = (
        "{text} is not a network name",
        "use 1 to {most} printable characters (those outside ASCII count as 2 to 4)",
    )
    NOT_A_PASSWORD = "this is not a Wi-Fi password", "use 8 to 63 letters, digits, spaces and ASCII punctuation"
    NOT_A_COUNTRY = "{text} is not a country code", "use two letters, such as DE"
    NOT_A_HOST_NAME = "{text} is not a host name", "use letters, digits and hyphens, at most 63"
    SECRET_LINES = "{path} must contain one line of text", "write it without spaces around it"
    SHADOWED_ANSWER = "{file} sets {name}, which overrides the answer to setup", "remove it there to use the answer"
    FAILED_CHANGE = "{why}", "earlier changes are kept: correct this, and run setup again"
    # naze-bridge check
    SETTINGS_OF_OTHERS = "--settings is for --kind inav", "omit it: the other rules do not use settings"
    BAD_SAVED_VALUE = "{why}", "correct that line, or save the settings again"
    HOME_MISSING = "the list has no home", "--home LAT,LON adds it"

    def __call__(self, **values: object) -> tuple[str, str]:
        """The sentence and the action with these values."""
        sentence, action = self.value
        return sentence.format(**values), action.format(**values)

    def text(self, **values: object) -> str:
        """Both in one sentence."""
        return "; ".join(self(**values))
