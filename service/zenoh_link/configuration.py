# SPDX-License-Identifier: GPL-3.0-or-later
"""The zenoh configuration of the daemon's session: the file that is passed through, and ours where it says nothing."""

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import zenoh

from service.zenoh_link.endpoint_trouble import TlsFiles
from service.zenoh_link.settings import I_KNOW, ZenohSettings, ZenohSettingsError

#: A command of 10 MB is answered; what is larger is not even put together in a Pi's memory.
_MAX_MESSAGE_BYTES = 16 << 20
#: The kernel doubles it. Two seconds of telemetry; enough for 300 kB/s at a round trip of 100 ms.
_SEND_BUFFER_BYTES = 16 << 10
#: What we set where the configuration is as zenoh's own default is: key, value.
_DEFAULTS: dict[str, object] = {
    "scouting/multicast/enabled": False,
    "listen/endpoints": [],
    # A slow subscriber costs the event loop nothing, not even the millisecond that zenoh would wait.
    "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 0,
    "transport/link/rx/max_message_size": _MAX_MESSAGE_BYTES,
    # Samples that are kept are numbered by their time of publication.
    "timestamping/enabled": True,
    # A stalled router must not collect seconds of telemetry that it later passes on as fresh.
    "transport/link/tcp/so_sndbuf": _SEND_BUFFER_BYTES,
    # 16 MB that help only programs on the same machine.
    "transport/shared_memory/enabled": False,
}
_AUTHENTICATED = ("tls/", "quic/")


def make_config(settings: ZenohSettings) -> zenoh.Config:
    """Return the session's configuration; ZenohSettingsError says in one sentence why there is none."""
    config = zenoh.Config() if settings.config_file is None else _read(settings)
    usual = zenoh.Config()
    for key, value in _DEFAULTS.items():
        if json.loads(config.get_json(key)) == json.loads(usual.get_json(key)):
            config.insert_json5(key, json.dumps(value))
    for setting, endpoints in (("connect", settings.connect), ("listen", settings.listen)):
        if endpoints:
            try:
                config.insert_json5(f"{setting}/endpoints", json.dumps(endpoints))
            except zenoh.ZError as error:
                raise ZenohSettingsError(f"zenoh.{setting} cannot be used: {in_short(error)}") from error
    if json.loads(config.get_json("mode")) is None:
        # Peers that meet at a router only do not see each other through it; a client is seen by all.
        listens = _endpoints(json.loads(config.get_json("listen/endpoints")))
        config.insert_json5("mode", '"peer"' if listens else '"client"')
    if settings.commands or settings.mavlink_in:
        _insist_on_authentication(settings, config)
    return config


def connect_endpoints(config: zenoh.Config) -> list[str]:
    """Return where the session connects to."""
    return _endpoints(json.loads(config.get_json("connect/endpoints")))


def tls_files(config: zenoh.Config) -> TlsFiles:
    """Return the certificates that it connects with."""
    tls = json.loads(config.get_json("transport/link/tls"))
    return TlsFiles(*(Path(tls[field.name]) if tls[field.name] else None for field in fields(TlsFiles)))


def in_short(error: Exception) -> str:
    """Return what zenoh says, on one line and without the places in its source."""
    text = " ".join(str(error).split())
    return text.split(" at /")[0].removesuffix(".")


def _read(settings: ZenohSettings) -> zenoh.Config:
    assert settings.config_file is not None
    try:
        return zenoh.Config.from_file(settings.config_file)
    except zenoh.ZError as error:
        raise ZenohSettingsError(
            f"zenoh.config_file {settings.config_file} cannot be used: {in_short(error)}"
        ) from error


def _insist_on_authentication(settings: ZenohSettings, config: zenoh.Config) -> None:
    if settings.commands_without_authentication == I_KNOW:
        return
    open_to = _without_authentication(config)
    if open_to is not None:
        setting = "commands" if settings.commands else "mavlink_in"
        raise ZenohSettingsError(
            f"zenoh.{setting} is on, but nobody {open_to} proves who it is: give a zenoh configuration with mTLS or "
            f'with user and password (docs/zenoh.md), or set commands_without_authentication = "{I_KNOW}"'
        )


def _without_authentication(config: zenoh.Config) -> str | None:
    """Name a way into the session that proves nobody's identity; None if there is none."""

    def said(key: str) -> Any:
        return json.loads(config.get_json(key))

    password = said("transport/auth/usrpwd")
    if not password["dictionary_file"]:
        tls = said("transport/link/tls")
        if said("scouting/multicast/enabled"):
            return "who comes by multicast scouting"
        for endpoint in _endpoints(said("listen/endpoints")):
            if not (endpoint.startswith(_AUTHENTICATED) and tls["enable_mtls"] and tls["root_ca_certificate"]):
                return f"who comes in at {endpoint}"
        for endpoint in _endpoints(said("connect/endpoints")):
            by_certificate = endpoint.startswith(_AUTHENTICATED) and tls["connect_certificate"]
            if not by_certificate and not (password["user"] and password["password"]):
                return f"behind {endpoint}"
    return None


def _endpoints(said: Any) -> list[str]:
    """Return endpoints, which may be given for each mode of a session."""
    by_mode = said.values() if isinstance(said, dict) else [said]
    return [
        each["endpoint"] if isinstance(each, dict) else each for endpoints in by_mode if endpoints for each in endpoints
    ]
