# SPDX-License-Identifier: GPL-3.0-or-later
"""The addresses for ground stations and other browsers, and the page's address as a QR code."""

import ipaddress
from collections.abc import Iterable, Sequence
from io import BytesIO

import segno

from payloads.mission_data import Json
from service.settings.addresses import GcsAddress, client_hosts, is_any_address
from service.settings.web import ListenAddress

#: Mission Planner's name for the connection type to choose.
_CONNECTIONS = {"udpin": "UDPCl", "tcpin": "TCP"}


def page_urls(listen: ListenAddress, own: Iterable[str]) -> list[str]:
    """The page's addresses for other devices; none if only this machine can open it. own: this machine's addresses."""
    hosts = own if is_any_address(listen.host) else [] if _is_loopback(listen.host) else [listen.host]
    return [f"http://{ListenAddress(host, listen.port)}/" for host in hosts]


def connect_help(listen: ListenAddress, links: Sequence[GcsAddress], own: list[str]) -> Json:
    """Lines for a ground station: the connection in Mission Planner's words, hosts and port."""
    stations = [
        {
            "connection": _CONNECTIONS[link.kind],
            "hosts": client_hosts(link.host, own),
            "port": link.port,
        }
        for link in links
        if link.kind in _CONNECTIONS
    ]
    called = [str(link) for link in links if link.kind not in _CONNECTIONS]
    return {"pages": page_urls(listen, own), "stations": stations, "called": called}


def qr_code(text: str) -> bytes:
    """An SVG image, always dark on white, as scanners expect."""
    image = BytesIO()
    segno.make(text, error="m").save(image, kind="svg", scale=4, border=4, dark="#000", light="#fff")
    return image.getvalue()


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
