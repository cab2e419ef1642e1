# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of a daemon: every key of the configuration file but those of [zenoh] and [web]."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Annotated

from bridge.config import BridgeSettings
from service.settings.addresses import AddressError, AutoFc, FcAddress, GcsAddress, parse_fc, parse_table
from service.settings.key import Default, Example, file_name, several, text
from service.settings.web import WebSettings
from service.settings.write_access import WriteAccess, parse_link
from service.settings.zenoh import ZenohSettings

DEFAULT_GCS = "udpin:0.0.0.0:14550"


@dataclass(frozen=True, slots=True)
class ShareSettings:
    """`address`: tcpin or udpin. `write`: also forward requests that change something."""

    address: GcsAddress
    write: bool = False


def parse_share(entry: object, _folder: Path) -> ShareSettings:
    """Read one entry of `share`, or one [[share]] table. AddressError explains problems."""
    address, table = parse_table(entry, "share", "tcpin:127.0.0.1:5761", ["write"])
    if address.kind != "tcpin":
        raise AddressError(f"share {address}: programs connect to it, so write tcpin:ADDR:PORT")
    write = table.get("write", False)
    if not isinstance(write, bool):
        raise AddressError(f"share {address}: write is {write!r}, but must be true or false")
    return ShareSettings(address, write)


class LogLevel(StrEnum):
    """From the least to the most important."""

    DEBUG = "debug"
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, slots=True)
class Settings(BridgeSettings):
    """The settings of a daemon. Without `state_dir` it does not store anything.

    `access`: write permission per link, by its address as text. Links not in it are open. `sources`: where each given
    key was found ("FILE:LINE", or a flag). `zenoh` None if not used. `web` None without a status page.
    """

    fc: Annotated[
        FcAddress,
        text(parse=parse_fc),
        "The flight controller: auto looks for it on the header's UART and on USB; /dev/ttyAMA0 (detects the speed), "
        "/dev/ttyUSB0,57600 (baud), tcp:HOST:PORT, udp:HOST:PORT for MSP over UDP (udpin:0.0.0.0:PORT if the other end "
        "sends first), or sim for a simulated one.",
    ] = AutoFc()  # noqa: RUF009  # frozen
    gcs: Annotated[
        Sequence[GcsAddress],
        several(f'as in ["{DEFAULT_GCS}"]', parse_link, may_be_empty=False),
        "Links to ground stations: udpin:ADDR:PORT, udpout:HOST:PORT, udpbcast:ADDR:PORT, tcpin:ADDR:PORT, or "
        "/dev/ttyUSB1,57600 for a telemetry radio. As a table, "
        '{address = "udpin:0.0.0.0:14550", key_file = "gcs.key", writers = ["192.168.4.0/24"]}, a link limits who may '
        "write.",
        Default(f'["{DEFAULT_GCS}"]'),
    ] = ()
    key_file: Annotated[
        Path | None,
        file_name(in_config_folder=True),
        "File with the MAVLink signing passphrase required for changes on every ground station link; a link's own "
        "key_file comes first.",
        Example('"gcs.key"'),
    ] = None
    state_dir: Annotated[
        Path | None,
        "Folder for stored missions and telemetry logs. By default systemd's StateDirectory, else "
        "~/.local/state/naze-bridge.",
        Example('"/var/lib/naze-bridge"'),
    ] = None
    share: Annotated[
        Sequence[ShareSettings],
        several('as in [{address = "tcpin:127.0.0.1:5761"}]', parse_share),
        "Ports on which INAV Configurator, MultiWiiConf or mwp may speak MSP through the bridge; also as [[share]] "
        "tables. write = true lets them change settings while the craft is disarmed: MSP has no password, so anyone "
        "who reaches the port can.",
        Example('[{address = "tcpin:127.0.0.1:5761", write = false}]'),
    ] = ()
    record_tlog: Annotated[bool, "Record telemetry, for replay in Mission Planner."] = True
    tlog_total_mb: Annotated[
        int,
        range(2, (1 << 20) + 1),
        "Size of all telemetry logs together, megabytes; the oldest are deleted, flights last.",
    ] = 256
    log_level: Annotated[LogLevel, "Minimum level of logged events: debug, info, warning or error."] = LogLevel.INFO
    access: Mapping[str, WriteAccess] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict, compare=False)
    zenoh: Annotated[
        ZenohSettings | None,
        "Eclipse zenoh: telemetry and missions for subscribers anywhere, off without this table.",
    ] = None
    web: Annotated[WebSettings | None, "The status page, off without this table."] = None

    @property
    def tlog(self) -> int | None:
        """The size of all telemetry logs, bytes, or None if telemetry is not recorded."""
        return self.tlog_total_mb << 20 if self.record_tlog else None
