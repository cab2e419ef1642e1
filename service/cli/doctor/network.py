# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of the network: the address for ground stations, listening ports, keys of the links, routers of zenoh."""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from payloads.names import ZenohSettingsError
from service.cli.doctor.checked import Checked, note, ok, problem
from service.cli.doctor.fixes import UNBLOCK_WIFI
from service.machine.host import Host
from service.machine.package import page
from service.settings.addresses import GcsAddress
from service.settings.passphrase import STRONGER
from service.settings.write_access import WriteAccess
from service.settings.zenoh import ZenohSettings

#: The state of listening sockets in /proc/net/tcp.
_LISTENS = "0A"
_LOOPBACK = ("127.", "::1", "localhost")
_CONNECT_TIMEOUT_MS = 2000


def check_wifi(host: Host, gcs: Sequence[GcsAddress]) -> list[Checked]:
    """Check for an address to enter in Mission Planner."""
    blocked = [
        name
        for name in host.names("/sys/class/rfkill")
        if host.read(f"/sys/class/rfkill/{name}/type").strip() == "wlan"
        and host.read(f"/sys/class/rfkill/{name}/soft").strip() == "1"
    ]
    if blocked:
        remedy = "set the country (sudo raspi-config nonint do_wifi_country DE), then: sudo rfkill unblock wlan"
        return [problem("Wi-Fi", "is switched off (rfkill)", remedy, UNBLOCK_WIFI)]
    cards = host.wifi_cards()
    if not cards:
        return [note("Wi-Fi", "there is no Wi-Fi card", "connect ground stations by cable, or plug a card in")]
    return [_card(host, card, gcs) for card in cards]


def _card(host: Host, card: str, gcs: Sequence[GcsAddress]) -> Checked:
    address = host.address(card)
    if address is None:
        return note(
            "Wi-Fi",
            f"{card} has no address",
            f"join a network, or open a hotspot: {page('docs/howto/wifi-access-point.md')}",
        )
    ports = [str(link.port) for link in gcs if link.kind in ("udpin", "tcpin")]
    return ok(
        "Wi-Fi", f"{card} is {address}" + (f"; ground stations connect to port {', '.join(ports)}" if ports else "")
    )


def check_ports(host: Host, gcs: Sequence[GcsAddress]) -> list[Checked]:
    """Check that the bridge's listening ports are free, or its own."""
    return [_check_port(host, link) for link in gcs if link.kind in ("udpin", "tcpin")]


def _check_port(host: Host, link: GcsAddress) -> Checked:
    transport = "tcp" if link.kind == "tcpin" else "udp"
    what = f"{transport.upper()} port {link.port}"
    inode = _inode(host, transport, link.port)
    if inode is None:
        return ok("port for ground stations", f"{what} is free")
    holder = host.holder(f"socket:[{inode}]")
    if holder is not None and holder.is_naze_bridge:
        return ok("port for ground stations", f"{what} is the running daemon's")
    if holder is None and os.geteuid():
        hidden = "only root sees which: run doctor with sudo"
        return problem("port for ground stations", f"{what} is used by another program", hidden)
    remedy = f"stop it: sudo kill {holder.pid}; or give gcs another port" if holder else "restart the Pi"
    found = f"{what} is used by {holder or 'a program that is gone'}"
    return problem("port for ground stations", found, remedy)


def _inode(host: Host, transport: str, port: int) -> str | None:
    for table in (transport, f"{transport}6"):
        for line in host.read(f"/proc/net/{table}").splitlines()[1:]:
            words = line.split()
            taken = re.fullmatch(r"[0-9A-F]+:([0-9A-F]{4})", words[1])
            if taken and int(taken[1], 16) == port and (transport == "udp" or words[3] == _LISTENS):
                return words[9]
    return None


def check_keys(gcs: Sequence[GcsAddress], access_by_link: Mapping[str, WriteAccess]) -> Iterator[Checked]:
    """Check that the links have keys that cannot be guessed, or a list of writers."""
    for link in gcs:
        access = access_by_link.get(str(link), WriteAccess())
        if access.is_open and link.kind not in ("udpout", "serial") and not link.host.startswith(_LOOPBACK):
            found = f"{link}: anyone on this network can change missions and settings"
            yield note("key", found, "sudo naze-bridge setup --new-key makes a key that changes need, and shows it")
        elif access.weak_key is not None:
            yield note("key", f"{link}: {access.weak_key}", STRONGER)
        elif access.key is not None:
            yield ok("key", f"required for changes on {link}")


def check_zenoh(settings: ZenohSettings | None) -> Checked:
    """Check the configuration, and try to connect to its endpoints."""
    if settings is None:
        return ok("zenoh", "off")
    # Importing zenoh takes half a second.
    from payloads.endpoints import connect_endpoints, endpoint_trouble, tls_files
    from service.settings.zenoh_config import make_config

    try:
        config = make_config(settings)
    except ZenohSettingsError as error:
        return problem("zenoh", str(error), "correct the [zenoh] table or its config_file")
    me = f"{settings.prefix}/{settings.vehicle}"
    endpoints = connect_endpoints(config)
    if not endpoints:
        return ok("zenoh", f"{me}, opens no connections")
    if _joins(config):
        return ok("zenoh", f"{me}, accepted by {', '.join(endpoints)}")
    trouble = endpoint_trouble(endpoints, tls_files(config))
    return note("zenoh", f"{me}: {trouble}", "start the router there, or correct zenoh.connect")


def _joins(config: Any) -> bool:
    """True if a router accepts the session: a client that does not listen, so that it does not disturb a daemon."""
    import zenoh

    config.insert_json5("mode", '"client"')
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5("connect/timeout_ms", str(_CONNECT_TIMEOUT_MS))
    try:
        zenoh.open(config).close()  # type: ignore[no-untyped-call]
    except zenoh.ZError:
        return False
    return True
