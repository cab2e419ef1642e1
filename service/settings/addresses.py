# SPDX-License-Identifier: GPL-3.0-or-later
"""Connection strings, in the forms of pymavlink, MAVProxy and MAVSDK."""

import socket
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from protocols.remedies import FC_FORMS, GCS_FORMS, Fault


class AddressError(ValueError):
    """A connection string that cannot be understood. The text says what to write instead."""


@dataclass(frozen=True, slots=True)
class SerialFc:
    """A flight controller on a serial port. `baud` None: detect the speed."""

    path: str
    baud: int | None

    def __str__(self) -> str:
        return self.path if self.baud is None else f"{self.path},{self.baud}"


@dataclass(frozen=True, slots=True)
class AutoFc:
    """A flight controller on any serial port."""

    def __str__(self) -> str:
        return "auto"


@dataclass(frozen=True, slots=True)
class TcpFc:
    """A flight controller over TCP: a simulator, or a Wi-Fi serial adapter."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"tcp:{host_port(self.host, self.port)}"


@dataclass(frozen=True, slots=True)
class UdpFc:
    """A flight controller behind a Wi-Fi bridge (ESP8266, ESP32) that carries MSP in datagrams.

    `listens`: the bridge sends to us first, and is answered where it sends from. Else we send to it.
    """

    host: str
    port: int
    listens: bool = False

    def __str__(self) -> str:
        return f"{'udpin' if self.listens else 'udp'}:{host_port(self.host, self.port)}"


@dataclass(frozen=True, slots=True)
class SimulatedFc:
    """The simulated Naze within the daemon."""

    def __str__(self) -> str:
        return "sim:"


FcAddress = AutoFc | SerialFc | TcpFc | UdpFc | SimulatedFc


@dataclass(frozen=True, slots=True)
class GcsAddress:
    """A link to ground stations. `kind`: udpin, udpout, udpbcast, tcpin, or serial with a path and baud instead."""

    kind: str
    host: str
    port: int

    @property
    def is_serial(self) -> bool:
        return self.kind == "serial"

    @property
    def is_public(self) -> bool:
        """True if other machines may reach it: not a radio, and not this machine's own address."""
        return not self.is_serial and not self.host.startswith(("127.", "::1", "localhost"))

    def __str__(self) -> str:
        return f"{self.host},{self.port}" if self.is_serial else f"{self.kind}:{host_port(self.host, self.port)}"


_GCS_KINDS = ("udpin", "udpout", "udpbcast", "tcpin")
_EVERY_ADDRESS = ("", "0.0.0.0", "[::]")  # noqa: S104  # ground stations may come over any network
_PORT_NAMES = ("tty", "serial", "rfcomm", "naze")
_MIN_BAUD, _MAX_BAUD = 1200, 4_000_000


def parse_fc(text: str) -> FcAddress:
    """Read the --fc string. Raises AddressError if it is not valid."""
    kind, colon, rest = text.strip().partition(":")
    match kind.lower():
        case "auto" if not rest:
            return AutoFc()
        case "sim" if not rest:
            return SimulatedFc()
        case "tcp" if colon:
            return TcpFc(*parse_host_port(text, rest.removeprefix("//"), FC_FORMS))
        case ("udp" | "udpin" | "udpout") as form if colon:
            place = rest.removeprefix("//").removeprefix(":")
            if place.isdecimal():  # mwp's udp://:14014
                place = f"0.0.0.0:{place}"
            host, port = parse_host_port(text, place, FC_FORMS)
            return UdpFc(host, port, form == "udpin" or (form == "udp" and is_any_address(host)))
        case "serial" if colon:
            return _parse_serial(text, rest.removeprefix("//") if rest.startswith("///") else rest)
    return _parse_serial(text, text.strip())


def _parse_serial(text: str, port: str) -> SerialFc:
    """Read "PATH", "PATH,BAUD" or "PATH:BAUD"; paths in /dev/serial/by-path contain colons."""
    path, separator, baud = port.partition(",")
    if not separator:
        before, separator, after = port.rpartition(":")
        if separator and "/by-" not in before:
            path, baud = before, after
        else:
            separator = ""
    if not path.startswith("/"):
        hint = f"did you mean /dev/{port}? Else " if path.startswith(_PORT_NAMES) else ""
        raise AddressError(Fault.NOT_AN_FC.text(text=repr(text), hint=hint))
    if not separator:
        return SerialFc(path, None)
    if not baud.isdecimal() or not _MIN_BAUD <= int(baud) <= _MAX_BAUD:
        raise AddressError(Fault.NOT_A_BAUD.text(text=repr(text), baud=repr(baud)))
    return SerialFc(path, int(baud))


def parse_gcs(text: str) -> GcsAddress:
    """Read one --gcs string. Raises AddressError if it is not valid, or ambiguous.

    >>> str(parse_gcs("udpin:0.0.0.0:14550"))
    'udpin:0.0.0.0:14550'
    """
    if text.strip().startswith("/"):
        radio = _parse_serial(text, text.strip())
        if radio.baud is None:
            raise AddressError(Fault.NO_RADIO_SPEED.text(text=repr(text), path=radio.path))
        return GcsAddress("serial", radio.path, radio.baud)
    word, colon, rest = text.strip().partition(":")
    kind = word.lower()
    rest = rest.removeprefix("//")
    host, _, port = rest.replace(",", ":").rpartition(":")
    if colon and kind in ("udp", "tcp"):
        # pymavlink listens at udp:, MAVSDK listens or sends. In both, tcp: connects, which the bridge does not.
        if host not in _EVERY_ADDRESS:
            port = port if port.isdecimal() else "14550"
            sending = f"udpout:{host}:{port} to send there, " if kind == "udp" else ""
            raise AddressError(Fault.SENT_OR_HEARD.text(text=repr(text), sending=sending, kind=kind, port=port))
        kind += "in"
    if not colon or kind not in _GCS_KINDS:
        raise AddressError(Fault.NOT_A_GCS.text(text=repr(text), hint=_meant_gcs(word, rest)))
    if kind in ("udpin", "tcpin") and not host and port.isdecimal():
        host = "0.0.0.0"  # noqa: S104  # as above
    return GcsAddress(kind, *parse_host_port(text, f"{host}:{port}" if host else rest, GCS_FORMS))


def parse_table(entry: object, setting: str, example: str, keys: Sequence[str]) -> tuple[GcsAddress, dict[str, object]]:
    """The address of a link's table {address = ...}, and the table itself. Other keys than `keys` are errors."""
    if not isinstance(entry, dict) or not isinstance(entry.get("address"), str):
        raise AddressError(f'{setting}: {entry!r} is not a table with address = "{example}"')
    address = parse_gcs(entry["address"])
    known = ("address", *keys)
    for key in entry:
        if key not in known:
            raise AddressError(
                f"{setting} {address}: {key!r} is not a setting of this table; there are {', '.join(known)}"
            )
    return address, entry


def _meant_gcs(word: str, rest: str) -> str:
    near = get_close_matches(word.lower(), _GCS_KINDS, n=1)
    if near and rest:
        return f"did you mean {near[0]}:{rest}? Else "
    if rest.isdecimal() and "/" not in word:
        return f"did you mean udpout:{word}:{rest}? Else "
    return f"did you mean udpin:{word}? Else " if word.isdecimal() else ""


def family_of(host: str) -> socket.AddressFamily:
    """AF_INET6 for an IPv6 address. A name means an IPv4 address."""
    return socket.AF_INET6 if ":" in host else socket.AF_INET


def bindable(host: str, port: int) -> tuple[Any, ...]:
    """The address for bind(), which does not itself read the interface of a link-local one (fe80::1%eth0). OSError."""
    return socket.getaddrinfo(host, port, family_of(host))[0][4]


def client_hosts(listening: str, own: Sequence[str]) -> Sequence[str]:
    """The hosts to give a client for a listening address. own: this machine's addresses, none without a network."""
    return (own or ["127.0.0.1"]) if is_any_address(listening) else [listening]


def is_any_address(host: str) -> bool:
    """True for the addresses that stand for all of a machine's own."""
    return host in ("", "0.0.0.0", "::")  # noqa: S104


def host_port(host: str, port: int) -> str:
    """The text that `parse_host_port` reads: an IPv6 address is in brackets."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def parse_host_port(text: str, rest: str, forms: str) -> tuple[str, int]:
    """Read "HOST:PORT", the `rest` of `text`. AddressError names `text` and its valid `forms`."""
    host, colon, port = rest.rpartition(":")
    if host.startswith("[") and host.endswith("]"):
        host = host[1:-1]
    elif ":" in host:
        raise AddressError(Fault.NO_BRACKETS.text(text=repr(text)))
    if not colon or not host:
        raise AddressError(Fault.NO_PORT.text(text=repr(text), forms=forms))
    if not port.isdecimal() or not 0 < int(port) < 65536:
        raise AddressError(Fault.NOT_A_PORT.text(text=repr(text), port=repr(port)))
    try:
        host.encode("idna")
    except UnicodeError:
        raise AddressError(Fault.NOT_A_HOST.text(text=repr(text), host=repr(host), forms=forms)) from None
    return host, int(port)
