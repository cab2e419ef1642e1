# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of all settings, used by the reader, the sample file, the reference page and the environment."""

import re
from functools import partial
from pathlib import Path

from bridge.model.autopilot import Autopilot
from payloads.keys import PayloadEncoding
from payloads.names import check_name
from service.settings.addresses import parse_fc
from service.settings.key import Key, Unfit, choice, file_name, several, text, whole, yes_no
from service.settings.settings import DEFAULT_GCS, LogLevel, PassThroughRule, Settings, TlogLimits
from service.settings.share import parse_share
from service.settings.web import WebSettings, parse_listen
from service.settings.write_access import parse_link
from service.settings.zenoh import I_KNOW, ZenohProfile, ZenohSettings

_DEFAULT = Settings()
_LIMITS = TlogLimits()
_ZENOH = ZenohSettings()


def _endpoint(entry: object, _folder: Path) -> str:
    if not isinstance(entry, str) or "/" not in entry:
        raise Unfit(f'holds {entry!r}, which is not an endpoint: write one like "tcp/192.168.4.1:7447"')
    return entry


def _host_name(entry: object, _folder: Path) -> str:
    if not isinstance(entry, str) or re.fullmatch(r"[A-Za-z0-9-]+(\.[A-Za-z0-9-]+)*", entry) is None:
        raise Unfit(f'holds {entry!r}, which is not a host name: write one like "naze-1.example.ts.net"')
    return entry.lower()


KEYS = (
    Key(
        "fc",
        text(parse=parse_fc),
        "The flight controller: auto looks for it on the header's UART and on USB; /dev/ttyAMA0 (detects the speed), "
        "/dev/ttyUSB0,57600 (baud), tcp:HOST:PORT, or sim for a simulated one.",
        default='"auto"',
    ),
    Key(
        "gcs",
        several(f'as in ["{DEFAULT_GCS}"]', parse_link, may_be_empty=False),
        "Links to ground stations: udpin:ADDR:PORT, udpout:HOST:PORT, udpbcast:ADDR:PORT, tcpin:ADDR:PORT. As a table, "
        '{address = "udpin:0.0.0.0:14550", key_file = "gcs.key", writers = ["192.168.4.0/24"]}, a link limits who may '
        "write.",
        default=f'["{DEFAULT_GCS}"]',
        is_live=True,
    ),
    Key(
        "share",
        several('as in [{address = "tcpin:127.0.0.1:5761"}]', parse_share),
        "Ports on which INAV Configurator, MultiWiiConf or mwp may speak MSP through the bridge; also as [[share]] "
        "tables. write = true lets them change settings while the craft is disarmed: MSP has no password, so anyone "
        "who reaches the port can.",
        example='[{address = "tcpin:127.0.0.1:5761", write = false}]',
    ),
    Key(
        "state_dir",
        file_name(),
        "Folder for stored missions and telemetry logs. By default systemd's StateDirectory, else "
        "~/.local/state/naze-bridge.",
        example='"/var/lib/naze-bridge"',
    ),
    Key("sysid", whole(1, 255), "MAVLink system id of the vehicle, 1..255.", str(_DEFAULT.sysid)),
    Key(
        "takeoff_max_m",
        whole(2, 255),
        "Maximum take-off altitude of a mission, metres, 2..255; a higher one is lowered to it.",
        str(_DEFAULT.takeoff_max_m),
    ),
    Key(
        "autopilot",
        choice(Autopilot),
        'The sender of MAVLink on the port: "auto" detects it, "harakiri" is translated, "other" is passed through.',
        f'"{_DEFAULT.autopilot.value}"',
    ),
    Key(
        "pass_through",
        choice(PassThroughRule),
        "Messages for an autopilot in pass-through from links with neither key_file nor writers: "
        '"missions" (and parameters and requests), or "everything": arming, modes and control, too.',
        f'"{_DEFAULT.pass_through.value}"',
    ),
    Key("record_tlog", yes_no(), "Record telemetry, for replay in Mission Planner.", "true"),
    Key("tlog_file_mb", whole(1, 1024), "Size of one telemetry log, megabytes, 1..1024.", str(_LIMITS.file_size >> 20)),
    Key(
        "tlog_total_mb",
        whole(2, 1 << 20),
        "Size of all telemetry logs together, megabytes, at least twice tlog_file_mb; the oldest are deleted.",
        str(_LIMITS.total_size >> 20),
    ),
    Key(
        "tlog_days",
        whole(1, 3650),
        "How long a telemetry log without a flight is kept, days, 1..3650.",
        str(_LIMITS.days),
    ),
    Key(
        "record_uart",
        file_name(),
        "File for a recording of the traffic with the flight controller, for a bug report. Off by default.",
        example='"/var/lib/naze-bridge/naze.uart"',
    ),
    Key(
        "log_level",
        choice(LogLevel),
        "Minimum level of logged events: debug, info, warning or error.",
        f'"{_DEFAULT.log_level}"',
        is_live=True,
    ),
    Key(
        "zenoh.prefix",
        text(parse=partial(check_name, "zenoh.prefix")),
        "First chunk of all zenoh keys.",
        f'"{_ZENOH.prefix}"',
    ),
    Key(
        "zenoh.vehicle",
        text(parse=partial(check_name, "zenoh.vehicle")),
        "This vehicle's name, the second chunk; unique within a fleet. By default the host's name.",
        example='"naze-1"',
    ),
    Key(
        "zenoh.encoding",
        choice(PayloadEncoding),
        "Encoding of payloads: json or cbor.",
        f'"{_ZENOH.encoding.value}"',
    ),
    Key(
        "zenoh.profile",
        choice(ZenohProfile),
        "Data volume: full sends each sample; metered a group every 5 s, or 30 s if unchanged, but arming at once.",
        f'"{_ZENOH.profile.value}"',
    ),
    Key(
        "zenoh.connect",
        several('as in ["tcp/192.168.4.1:7447"]', _endpoint),
        "Endpoints to join: a router or other peers.",
        "[]",
    ),
    Key(
        "zenoh.listen",
        several('as in ["tcp/0.0.0.0:7447"]', _endpoint),
        "Endpoints on which to accept other sessions.",
        "[]",
    ),
    Key(
        "zenoh.config_file",
        file_name(in_config_folder=True),
        "A zenoh configuration file, for TLS, passwords, access control, namespace.",
        example='"zenoh.json5"',
    ),
    Key(
        "zenoh.commands",
        yes_no(),
        "Allow writing and clearing missions over zenoh; the transport must be authenticated.",
        "false",
    ),
    Key(
        "zenoh.commands_without_authentication",
        text(f'"{I_KNOW}", or omitted'),
        f'"{I_KNOW}": accept commands without authentication, from anyone who reaches the session.',
        example=f'"{I_KNOW}"',
    ),
    Key(
        "zenoh.mavlink_in",
        yes_no(),
        "Accept raw MAVLink frames over zenoh, under the same condition as commands.",
        "false",
    ),
    Key(
        "web.listen",
        text('"HOST:PORT"', parse_listen),
        "Address of the status page: 0.0.0.0:8080 for the whole network, 127.0.0.1:8080 for this machine only.",
        f'"{WebSettings().listen}"',
    ),
    Key(
        "web.hosts",
        several('as in ["naze-1.example.ts.net"]', _host_name),
        "Full names by which browsers may open the page; addresses and local names always work.",
        "[]",
    ),
    Key(
        "web.token_file",
        file_name(in_config_folder=True),
        "File with the token for writing missions and fetching logs, created if it is missing. By default web-token in"
        " state_dir.",
        example='"/etc/naze-bridge/web-token"',
    ),
)

#: Tables whose presence enables a part.
TABLES = {
    "zenoh": "Eclipse zenoh: telemetry and missions for subscribers anywhere, off without this table.",
    "web": "The status page, off without this table.",
}
