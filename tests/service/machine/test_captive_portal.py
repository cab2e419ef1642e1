# SPDX-License-Identifier: GPL-3.0-or-later
"""What phones, tablets and laptops are told when they test the hotspot for a sign-in page."""

import json
from collections.abc import Iterator
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from socket import create_server
from threading import Thread

import pytest

from service.cli.setup.answers import PAGE_PORT
from service.cli.setup.hotspot import ADDRESS
from service.machine import captive_portal
from service.machine.captive_portal import API_PATH, PROBES, dnsmasq_text, has_internet, reply_to, serve
from tests.support.programs import TIMEOUT_S

_PAGE = f"http://{ADDRESS}:{PAGE_PORT}/"
_SYSTEMD = Path(__file__).parents[3] / "systemd"
_ROUTES = "Iface\tDestination\tGateway\n"
_ASKED = [
    ("connectivitycheck.gstatic.com", "/generate_204"),
    ("clients3.google.com", "/generate_204"),
    ("captive.apple.com", "/hotspot-detect.html"),
    ("www.msftconnecttest.com", "/connecttest.txt"),
    ("detectportal.firefox.com", "/canonical.html"),
    ("detectportal.firefox.com", "/success.txt?ipv4"),
]


@pytest.mark.parametrize(("host", "path"), _ASKED)
def test_without_internet_every_test_leads_to_the_page(host: str, path: str) -> None:
    status, location, _, text = reply_to(host, path, _PAGE, is_online=False)
    assert (status, location) == (302, _PAGE)
    assert _PAGE in text


@pytest.mark.parametrize(("host", "path"), _ASKED)
def test_with_internet_every_test_succeeds(host: str, path: str) -> None:
    status, location, _, text = reply_to(f"{host.upper()}:80", path, _PAGE, is_online=True)
    assert (status, text) == PROBES[host, path.partition("?")[0]]
    assert not location


@pytest.mark.parametrize("is_online", [True, False])
def test_another_address_leads_to_the_page(*, is_online: bool) -> None:
    assert reply_to(ADDRESS, "/", _PAGE, is_online=is_online)[:2] == (302, _PAGE)
    assert reply_to("", "/../etc/passwd", _PAGE, is_online=is_online)[:2] == (302, _PAGE)


@pytest.mark.parametrize("is_online", [True, False])
def test_the_description_of_the_network(*, is_online: bool) -> None:
    status, _, kind, text = reply_to(ADDRESS, API_PATH, _PAGE, is_online=is_online)
    assert (status, kind) == (200, "application/captive+json")
    assert json.loads(text) == {"captive": not is_online, "user-portal-url": _PAGE}


@pytest.mark.parametrize(
    ("routes", "is_online"),
    [
        ("", False),
        (f"{_ROUTES}wlan0\t00002A0A\t00000000\n", False),
        (f"{_ROUTES}wlan0\t00000000\t0101A8C0\n", False),
        (f"{_ROUTES}wlan0\t00002A0A\t00000000\neth0\t00000000\t0101A8C0\n", True),
    ],
)
def test_an_internet_connection_to_share(routes: str, *, is_online: bool) -> None:
    assert has_internet(routes) is is_online


def test_only_test_addresses_are_the_pis() -> None:
    lines = dnsmasq_text(ADDRESS).splitlines()
    named = {line.split("/")[1] for line in lines if line.startswith("address=")}
    assert named == {host for host, _ in PROBES}
    assert not [line for line in lines if line.startswith("address=/#/")]
    # Other cards' clients get no such option.
    assert [line for line in lines if line.startswith("dhcp")] == [
        f"dhcp-option=tag:wlan0,114,http://{ADDRESS}{API_PATH}"
    ]


def test_the_units_have_the_hotspots_address() -> None:
    socket_unit = (_SYSTEMD / "naze-bridge-captive.socket").read_text().splitlines()
    assert [line for line in socket_unit if line.startswith("Listen")] == [f"ListenStream={ADDRESS}:80"]
    assert f"-m service.machine.captive_portal {_PAGE}\n" in (_SYSTEMD / "naze-bridge-captive.service").read_text()


@pytest.fixture
def port(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    monkeypatch.setattr(captive_portal._Server, "timeout", TIMEOUT_S)
    listening = create_server(("127.0.0.1", 0))
    serving = Thread(target=serve, args=(listening, _PAGE))
    number: int = listening.getsockname()[1]
    serving.start()
    yield number
    monkeypatch.setattr(captive_portal._Server, "timeout", 0)  # after the next request it finds no other
    ask(number, "GET", "", "/")
    serving.join()


def ask(port: int, method: str, host: str, path: str) -> tuple[HTTPResponse, bytes]:
    connection = HTTPConnection("127.0.0.1", port, timeout=TIMEOUT_S)
    connection.request(method, path, headers={"Host": host})
    response = connection.getresponse()
    body = response.read()
    connection.close()
    return response, body


def test_over_the_socket_of_systemd(port: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    routes = tmp_path / "route"
    routes.write_text(_ROUTES)
    monkeypatch.setattr(captive_portal, "_ROUTES", routes)
    response, body = ask(port, "GET", "captive.apple.com", "/hotspot-detect.html")
    assert (response.status, response.headers["Location"]) == (302, _PAGE)
    assert b"status page" in body
    routes.write_text(f"{_ROUTES}eth0\t00000000\t0101A8C0\n")
    response, body = ask(port, "GET", "connectivitycheck.gstatic.com", "/generate_204")
    assert (response.status, body) == (204, b"")
    response, body = ask(port, "HEAD", "captive.apple.com", "/hotspot-detect.html")
    assert (response.status, body) == (200, b"")
