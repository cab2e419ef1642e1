# SPDX-License-Identifier: GPL-3.0-or-later
"""What phones, tablets and laptops are told when they test the hotspot for a sign-in page."""

import json
from collections.abc import Iterator
from contextlib import suppress
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from socket import create_server
from threading import Thread

import pytest

from service.cli.setup.answers import PAGE_PORT
from service.cli.setup.hotspot import ADDRESS
from service.machine import captive_portal
from service.machine.captive_portal import API_PATH, HOSTS, dnsmasq_text, reply_to, serve
from tests.support.programs import TIMEOUT_S

_PAGE = f"http://{ADDRESS}:{PAGE_PORT}/"
_SYSTEMD = Path(__file__).parents[3] / "systemd"


def test_every_test_leads_to_the_page() -> None:
    for path in ("/generate_204", "/hotspot-detect.html", "/", "/../etc/passwd"):
        status, location, _, text = reply_to(path, _PAGE)
        assert (status, location) == (302, _PAGE)
        assert _PAGE in text


def test_the_description_of_the_network() -> None:
    status, _, kind, text = reply_to(API_PATH, _PAGE)
    assert (status, kind) == (200, "application/captive+json")
    assert json.loads(text) == {"captive": True, "user-portal-url": _PAGE}


def test_only_test_addresses_are_the_pis() -> None:
    lines = dnsmasq_text(ADDRESS).splitlines()
    named = {line.split("/")[1] for line in lines if line.startswith("address=")}
    assert named == {*HOSTS}
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
    # The server ends after the next request, or at once if it was not waiting yet.
    monkeypatch.setattr(captive_portal._Server, "timeout", 0)
    with suppress(ConnectionError):
        ask(number, "GET", "", "/")
    serving.join()


def ask(port: int, method: str, host: str, path: str) -> tuple[HTTPResponse, bytes]:
    connection = HTTPConnection("127.0.0.1", port, timeout=TIMEOUT_S)
    connection.request(method, path, headers={"Host": host})
    response = connection.getresponse()
    body = response.read()
    connection.close()
    return response, body


def test_over_the_socket_of_systemd(port: int) -> None:
    response, body = ask(port, "GET", "captive.apple.com", "/hotspot-detect.html")
    assert (response.status, response.headers["Location"]) == (302, _PAGE)
    assert b"status page" in body
    response, body = ask(port, "HEAD", "captive.apple.com", "/hotspot-detect.html")
    assert (response.status, body) == (302, b"")
