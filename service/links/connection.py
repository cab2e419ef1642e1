# SPDX-License-Identifier: GPL-3.0-or-later
"""Connection strings, as pymavlink and MAVProxy users know them."""

import socket
from dataclasses import dataclass

UNKNOWN_HOST_HINT = "check the name and the network, or give the address in numbers"


class AddressError(ValueError):
    """A connection string that cannot be understood; the text says what to write instead."""


@dataclass(frozen=True, slots=True)
class SerialFc:
    """A flight controller on a serial port. `baud` None: the speed is sensed."""

    path: str
    baud: int | None

    def __str__(self) -> str:
        return self.path if self.baud is None else f"{self.path},{self.baud}"


@dataclass(frozen=True, slots=True)
class TcpFc:
    """A flight controller behind TCP: a simulator, or a Wi-Fi serial adapter."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"tcp:{self.host}:{self.port}"


@dataclass(frozen=True, slots=True)
class SimulatedFc:
    """The simulated Naze within the daemon."""

    def __str__(self) -> str:
        return "sim:"


FcAddress = SerialFc | TcpFc | SimulatedFc


@dataclass(frozen=True, slots=True)
class GcsAddress:
    """Where ground stations are. `kind`: udpin, udpout, udpbcast or tcpin."""

    kind: str
    host: str
    port: int

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.kind}:{host}:{self.port}"


_GCS_KINDS = ("udpin", "udpout", "udpbcast", "tcpin")
_FC_FORMS = "write /dev/serial0, /dev/ttyUSB0,57600, tcp:HOST:PORT or sim:"
_GCS_FORMS = "write udpin:0.0.0.0:14550, udpout:HOST:PORT, udpbcast:ADDR:PORT or tcpin:HOST:PORT"
_PORT_NAMES = ("tty", "serial", "rfcomm")
_MIN_BAUD, _MAX_BAUD = 1200, 4_000_000


def parse_fc(text: str) -> FcAddress:
    """Read the --fc string; AddressError if it makes no sense."""
    if text == "sim:":
        return SimulatedFc()
    if text.startswith("tcp:"):
        host, port = parse_host_port(text, text.removeprefix("tcp:"), _FC_FORMS)
        return TcpFc(host, port)
    path, comma, baud = text.partition(",")
    if not path.startswith("/"):
        hint = f"did you mean /dev/{text}? Else " if path.startswith(_PORT_NAMES) else ""
        raise AddressError(f"{text!r} is no flight controller connection: {hint}{_FC_FORMS}")
    if not comma:
        return SerialFc(path, None)
    if not baud.isdecimal() or not _MIN_BAUD <= int(baud) <= _MAX_BAUD:
        raise AddressError(f"{text!r}: {baud!r} is no speed in baud; leave it out to have it sensed")
    return SerialFc(path, int(baud))


def parse_gcs(text: str) -> GcsAddress:
    """Read one --gcs string; AddressError if it makes no sense."""
    kind, _, rest = text.partition(":")
    if kind not in _GCS_KINDS:
        raise AddressError(f"{text!r} is no ground station connection: {_GCS_FORMS}")
    return GcsAddress(kind, *parse_host_port(text, rest, _GCS_FORMS))


def family_of(host: str) -> socket.AddressFamily:
    """Return IPv6 for such an address; a name stands for an IPv4 address."""
    return socket.AF_INET6 if ":" in host else socket.AF_INET


def parse_host_port(text: str, rest: str, forms: str) -> tuple[str, int]:
    """Read "HOST:PORT", the `rest` of `text`; AddressError says what is wrong with `text`, and which `forms` it has."""
    host, colon, port = rest.rpartition(":")
    if host.startswith("[") and host.endswith("]"):
        host = host[1:-1]
    elif ":" in host:
        raise AddressError(f"{text!r}: an IPv6 address stands in brackets, as in [::1]:5760")
    if not colon or not host:
        raise AddressError(f"{text!r} needs a host and a port: {forms}")
    if not port.isdecimal() or not 0 < int(port) < 65536:
        raise AddressError(f"{text!r}: {port!r} is no port number (1..65535)")
    try:
        host.encode("idna")
    except UnicodeError:
        raise AddressError(f"{text!r}: {host!r} can be no host's name: {forms}") from None
    return host, int(port)
