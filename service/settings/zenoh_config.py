# SPDX-License-Identifier: GPL-3.0-or-later
"""The zenoh configuration of the daemon's session: the user's file, completed by the bridge's defaults."""

import json
from typing import Any

import zenoh

from payloads.endpoints import all_endpoints, in_short, read_zenoh_file
from payloads.names import ZenohSettingsError
from service.settings.zenoh import I_KNOW, ZenohSettings
from storage.os_error import reason

#: Commands up to 10 MB get a reply. Larger commands are not assembled in a Pi's memory.
_MAX_MESSAGE_BYTES = 16 << 20
#: Bytes, doubled by the kernel. Two seconds of telemetry; enough for 300 kB/s at a round trip of 100 ms.
_SEND_BUFFER_BYTES = 16 << 10
#: Set where the configuration still has zenoh's own default.
_DEFAULTS: dict[str, object] = {
    "scouting/multicast/enabled": False,
    "listen/endpoints": [],
    # A slow subscriber must not delay the event loop, not even by the millisecond that zenoh would wait.
    "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 0,
    "transport/link/rx/max_message_size": _MAX_MESSAGE_BYTES,
    # Kept samples are ordered by their time of publication.
    "timestamping/enabled": True,
    # A stalled router must not collect seconds of telemetry and pass it on later as fresh.
    "transport/link/tcp/so_sndbuf": _SEND_BUFFER_BYTES,
    # It takes 16 MB and helps only programs on the same machine.
    "transport/shared_memory/enabled": False,
}
_AUTHENTICATED = ("tls/", "quic/")


def make_config(settings: ZenohSettings) -> zenoh.Config:
    """The session's configuration. ZenohSettingsError says in one sentence why it cannot be used."""
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
        # Peers that have only a router in common do not see each other. Every session sees a client.
        listens = all_endpoints(json.loads(config.get_json("listen/endpoints")))
        config.insert_json5("mode", '"peer"' if listens else '"client"')
    if settings.commands or settings.mavlink_in:
        _require_authentication(settings, config)
    return config


def _read(settings: ZenohSettings) -> zenoh.Config:
    assert settings.config_file is not None
    try:
        return read_zenoh_file(settings.config_file)
    except (zenoh.ZError, OSError) as error:
        why = reason(error) if isinstance(error, OSError) else in_short(error)
        raise ZenohSettingsError(f"zenoh.config_file {settings.config_file} cannot be used: {why}") from error


def _require_authentication(settings: ZenohSettings, config: zenoh.Config) -> None:
    if settings.commands_without_authentication == I_KNOW:
        return
    open_to = _without_authentication(config)
    if open_to is not None:
        setting = "commands" if settings.commands else "mavlink_in"
        raise ZenohSettingsError(
            f"zenoh.{setting} is on, but sessions {open_to} are not authenticated: give a zenoh configuration with "
            f'mTLS or with user and password (docs/zenoh.md), or set commands_without_authentication = "{I_KNOW}"'
        )


def _without_authentication(config: zenoh.Config) -> str | None:
    """How a session can be reached without authentication, or None if it cannot."""

    def setting(key: str) -> Any:
        return json.loads(config.get_json(key))

    password = setting("transport/auth/usrpwd")
    if not password["dictionary_file"]:
        tls = setting("transport/link/tls")
        if setting("scouting/multicast/enabled"):
            return "found by multicast scouting"
        for endpoint in all_endpoints(setting("listen/endpoints")):
            if not (endpoint.startswith(_AUTHENTICATED) and tls["enable_mtls"] and tls["root_ca_certificate"]):
                return f"accepted at {endpoint}"
        for endpoint in all_endpoints(setting("connect/endpoints")):
            by_certificate = endpoint.startswith(_AUTHENTICATED) and tls["connect_certificate"]
            if not by_certificate and not (password["user"] and password["password"]):
                return f"behind {endpoint}"
    return None
