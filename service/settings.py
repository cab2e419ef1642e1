"""Where settings come from: flags over environment over the configuration file over defaults."""

import difflib
import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from bridge.fc_session import Autopilot
from service.bounded_file import read_bounded
from service.connection import AddressError, FcAddress, GcsAddress, parse_fc, parse_gcs
from service.write_access import WriteAccess, parse_link
from service.zenoh_link.settings import ZenohSettings, ZenohSettingsError, parse_zenoh

DEFAULT_GCS = "udpin:0.0.0.0:14550"
DEFAULT_SYSID = 1
DEFAULT_TAKEOFF_MAX_M = 15


class SettingsError(ValueError):
    """A setting that cannot be used; the text says which, where, and what would be right."""


@dataclass(frozen=True, slots=True)
class TlogLimits:
    """Bytes of one telemetry log (a second's records come on top) and of all together; days for which one is kept."""

    file_size: int = 16 << 20
    total_size: int = 256 << 20
    days: int = 30


@dataclass(frozen=True, slots=True)
class Settings:
    """What a daemon is started with. Without `state_dir` nothing is stored; `tlog` None: telemetry is not recorded.

    `access`: who may write over a link, by its address as text; over others everyone may. `zenoh` None: it is not
    joined.
    """

    fc: FcAddress
    gcs: Sequence[GcsAddress] = ()
    state_dir: Path | None = None
    sysid: int = DEFAULT_SYSID
    takeoff_max_m: int = DEFAULT_TAKEOFF_MAX_M
    tlog: TlogLimits | None = None
    record_uart: Path | None = None
    autopilot: Autopilot = Autopilot.AUTO
    access: Mapping[str, WriteAccess] = field(default_factory=dict)
    zenoh: ZenohSettings | None = None


_MAX_CONFIG_BYTES = 1 << 20
_IN_WORDS = {
    str: "text in quotes",
    int: "a whole number",
    bool: "true or false",
    list: "a list in brackets",
    dict: "a table",
}

#: Keys of the configuration file: name -> (type, what it is).
_KEYS: dict[str, tuple[type, str]] = {
    "fc": (str, "flight controller connection"),
    "gcs": (list, "list of ground station connections, each text or a table"),
    "state_dir": (str, "folder for stored missions"),
    "sysid": (int, "MAVLink system id, 1..255"),
    "takeoff_max_m": (int, "greatest take-off height in metres, 2..255"),
    "record_tlog": (bool, "whether telemetry is recorded"),
    "tlog_file_mb": (int, "size of one telemetry log, 1..1024"),
    "tlog_total_mb": (int, "size of all telemetry logs, at least twice tlog_file_mb"),
    "tlog_days": (int, "how many days a telemetry log is kept, 1..3650"),
    "record_uart": (str, "file to record the UART into"),
    "autopilot": (str, "whose MAVLink is heard on the port: auto, harakiri or other"),
    "zenoh": (dict, "table of zenoh's settings"),
}


def default_state_dir() -> Path:
    """Return systemd's StateDirectory, else the user's own folder for state; SettingsError if there is no such user."""
    given = os.environ.get("STATE_DIRECTORY")
    if given:
        return Path(given.split(":")[0])
    try:
        base = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    except RuntimeError:
        raise SettingsError("this user has no home folder: name a folder for missions with --state-dir") from None
    return Path(base) / "naze-bridge"


def load_settings(
    config: Path | None,
    fc: str | None,
    gcs: Sequence[str],
    state_dir: Path | None,
    record_uart: Path | None = None,
) -> Settings:
    """Put the settings of `run` together; SettingsError or AddressError if one cannot be used."""
    flags = _Flags(parse_fc(fc) if fc else None, [parse_gcs(text) for text in gcs], state_dir, record_uart)
    if config is None:
        return _put_together(flags, {}, Path())
    try:
        return _put_together(flags, _read_config(config), config.parent)
    except ZenohSettingsError as error:
        raise SettingsError(f"{config}: {error}") from error
    except (AddressError, SettingsError) as error:
        raise type(error)(f"{config}: {error}") from error


@dataclass(frozen=True, slots=True)
class _Flags:
    fc: FcAddress | None
    gcs: Sequence[GcsAddress]
    state_dir: Path | None
    record_uart: Path | None


def _put_together(flags: _Flags, values: dict[str, object], folder: Path) -> Settings:
    """Take from the flags, then from the file in `folder` whose `values` these are."""
    fc = flags.fc or (parse_fc(str(values["fc"])) if "fc" in values else None)
    if fc is None:
        raise SettingsError("name the flight controller: --fc /dev/serial0, or --fc sim: to try it without one")
    links = _links(values.get("gcs"), folder)
    return Settings(
        fc=fc,
        gcs=flags.gcs or list(links) or [parse_gcs(DEFAULT_GCS)],
        state_dir=flags.state_dir or _path(values.get("state_dir")) or default_state_dir(),
        sysid=_in_range(values, "sysid", 1, 255, DEFAULT_SYSID),
        takeoff_max_m=_in_range(values, "takeoff_max_m", 2, 255, DEFAULT_TAKEOFF_MAX_M),
        tlog=_tlog_limits(values) if values.get("record_tlog", True) else None,
        record_uart=flags.record_uart or _path(values.get("record_uart")),
        autopilot=_autopilot(values.get("autopilot", Autopilot.AUTO.value)),
        # A link that is named by a flag, too, stays as safe as the file says.
        access={str(address): access for address, access in links.items() if not access.is_open},
        zenoh=_zenoh(values.get("zenoh"), folder),
    )


def _zenoh(table: object, folder: Path) -> ZenohSettings | None:
    return parse_zenoh(table, folder) if isinstance(table, dict) else None


def _links(entries: object, folder: Path) -> dict[GcsAddress, WriteAccess]:
    if entries is None:
        return {}
    assert isinstance(entries, list)
    if not entries:
        raise SettingsError(f'gcs is empty: name a link as in ["{DEFAULT_GCS}"], or leave gcs away')
    return dict(parse_link(entry, folder) for entry in entries)


def _tlog_limits(values: dict[str, object]) -> TlogLimits:
    default = TlogLimits()
    file_mb = _in_range(values, "tlog_file_mb", 1, 1024, default.file_size >> 20)
    total_mb = _in_range(values, "tlog_total_mb", 2 * file_mb, 1 << 20, max(default.total_size >> 20, 2 * file_mb))
    days = _in_range(values, "tlog_days", 1, 3650, default.days)
    return TlogLimits(file_mb << 20, total_mb << 20, days)


def _autopilot(text: object) -> Autopilot:
    try:
        return Autopilot(text)
    except ValueError as error:
        choices = ", ".join(each.value for each in Autopilot)
        raise SettingsError(f"autopilot is {text!r}, but must be one of {choices}") from error


def _path(text: object) -> Path | None:
    return None if text is None else Path(str(text))


def _read_config(path: Path) -> dict[str, object]:
    try:
        values = tomllib.loads(read_bounded(path, _MAX_CONFIG_BYTES).decode("utf-8-sig"))
    except OSError as error:
        raise SettingsError(f"this cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise SettingsError(f"this is no valid TOML: {error}") from error
    for key, value in values.items():
        if key not in _KEYS:
            near = difflib.get_close_matches(key, _KEYS, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(_KEYS)}"
            raise SettingsError(f"{key!r} is no setting; {hint}")
        kind, meaning = _KEYS[key]
        if type(value) is not kind:
            raise SettingsError(f"{key} must be {_IN_WORDS[kind]} ({meaning})")
    return values


def _in_range(values: dict[str, object], key: str, least: int, most: int, default: int) -> int:
    value = values.get(key, default)
    if not isinstance(value, int) or not least <= value <= most:
        raise SettingsError(f"{key} is {value}, but must be {least}..{most} ({_KEYS[key][1]})")
    return value
