# SPDX-License-Identifier: GPL-3.0-or-later
"""A zenoh configuration: the file, the endpoints, and why one rejects a session: zenoh reports only that it failed."""

import json
import os
import re
import socket
import ssl
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import zenoh

from storage.os_error import reason
from storage.small_files import read_bounded

_TLS = "transport/link/tls"
_MAX_BYTES = 1 << 20
#: Settings that name a file.
_FILES = (
    f"{_TLS}/root_ca_certificate",
    f"{_TLS}/listen_certificate",
    f"{_TLS}/listen_private_key",
    f"{_TLS}/connect_certificate",
    f"{_TLS}/connect_private_key",
    "transport/auth/usrpwd/dictionary_file",
)
_ENDPOINT = re.compile(r"(?P<protocol>[a-z_]+)/(?P<host>\[[^\]]*\]|[^:/?#]+):(?P<port>\d+)(?:[?#].*)?")
_CONNECT_TIMEOUT_S = 2.0
#: How long to wait for a rejection of our own certificate: in TLS 1.3 it comes after the handshake.
_REFUSAL_S = 0.5
#: X509_V_ERR_CERT_NOT_YET_VALID and _HAS_EXPIRED: a Pi without a network resumes the time of the last shutdown.
_BY_CLOCK = (9, 10)
_OVER_TCP = ("tcp", "tls", "ws")


def read_zenoh_file(path: Path) -> zenoh.Config:
    """Read a configuration, whose files are in its folder; zenoh.ZError if it is not one.

    OSError if it or a file that it names cannot be read. zenoh itself would look in the working directory, and would
    read a device or wait for a pipe without end.
    """
    read_bounded(path, _MAX_BYTES)
    config = zenoh.Config.from_file(path)
    for setting in _FILES:
        name = json.loads(config.get_json(setting))
        if name:
            file = path.absolute().parent / name
            if file.exists():
                read_bounded(file, _MAX_BYTES)
            config.insert_json5(setting, json.dumps(str(file)))
    return config


@dataclass(frozen=True, slots=True)
class TlsFiles:
    """PEM files as zenoh's `transport/link/tls` names them, or None if not given."""

    root_ca_certificate: Path | None = None
    connect_certificate: Path | None = None
    connect_private_key: Path | None = None


def connect_endpoints(config: zenoh.Config) -> list[str]:
    return all_endpoints(json.loads(config.get_json("connect/endpoints")))


def tls_files(config: zenoh.Config) -> TlsFiles:
    tls = json.loads(config.get_json("transport/link/tls"))
    return TlsFiles(*(Path(tls[field.name]) if tls[field.name] else None for field in fields(TlsFiles)))


def in_short(error: Exception) -> str:
    """An error of zenoh on one line, without the places in zenoh's source."""
    text = " ".join(str(error).split())
    return text.split(" at /")[0].removesuffix(".")


def all_endpoints(setting: Any) -> list[str]:
    """All endpoints. A setting may have them per mode."""
    by_mode = setting.values() if isinstance(setting, dict) else [setting]
    return [
        each["endpoint"] if isinstance(each, dict) else each for endpoints in by_mode if endpoints for each in endpoints
    ]


def endpoint_trouble(endpoints: Sequence[str], files: TlsFiles) -> str:
    """The problem of each endpoint, in one line. Blocks for up to a few seconds: not for an event loop.

    Repeats the first steps with the standard library, which distinguishes an expired certificate from a wrong name.
    """
    return "; ".join(f"{endpoint}: {_trouble(endpoint, files)}" for endpoint in endpoints)


def _trouble(endpoint: str, files: TlsFiles) -> str:
    match = _ENDPOINT.fullmatch(endpoint)
    if match is None:
        return 'this is not an endpoint, which looks like "tcp/192.168.4.1:7447"'
    if match["protocol"] not in _OVER_TCP:
        return "no answer"
    host, port = match["host"].strip("[]"), int(match["port"])
    try:
        with socket.create_connection((host, port), _CONNECT_TIMEOUT_S) as connection:
            if match["protocol"] == "tls":
                return _tls_trouble(connection, host, files)
    except ssl.SSLCertVerificationError as error:
        hint = "; check our clock, too" if error.verify_code in _BY_CLOCK else ""
        return f"the router's certificate is not accepted: {error.verify_message}{hint}"
    except ssl.SSLError as error:
        return f"no secure connection: {_words(error)}"
    except (socket.gaierror, UnicodeError):  # UnicodeError: an empty or too long part of the name
        return f"the host name {host!r} is unknown"
    except TimeoutError:
        return "no answer"
    except ConnectionRefusedError:
        return "no router is running there (connection refused)"
    except OverflowError:
        return "a port is at most 65535"
    except OSError as error:
        return reason(error).lower()
    return "a program there rejected the session: check user, password, max_sessions, and that it is a zenoh router"


def _tls_trouble(connection: socket.socket, host: str, files: TlsFiles) -> str:
    """Continue with TLS as zenoh does. SSLError or OSError also describe the problem."""
    context = ssl.create_default_context()
    for path in (files.root_ca_certificate, files.connect_certificate, files.connect_private_key):
        if path is not None and not os.access(path, os.R_OK):
            return f"{path} cannot be read: check its owner and mode" if path.exists() else f"there is no file {path}"
    try:
        if files.root_ca_certificate is not None:
            context = ssl.create_default_context(cafile=files.root_ca_certificate)
        if files.connect_certificate is not None:
            context.load_cert_chain(files.connect_certificate, files.connect_private_key)
    except ssl.SSLError as error:
        return f"our own certificate or its key cannot be used: {_words(error)}"
    with context.wrap_socket(connection, server_hostname=host) as secured:
        secured.settimeout(_REFUSAL_S)
        try:
            secured.recv(1)
        except TimeoutError:
            return "it accepted our certificate but refused the session: check user and password, and the router's log"
        except ssl.SSLError as error:
            return f"the router refuses our certificate: {_words(error)}"
    return "the router closes the connection: is it a zenoh router?"


def _words(error: ssl.SSLError) -> str:
    """OpenSSL's reason in lower case, as in "tlsv13 alert certificate required"."""
    return (error.reason or error.strerror or str(error)).replace("_", " ").lower()
