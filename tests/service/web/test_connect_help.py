# SPDX-License-Identifier: GPL-3.0-or-later
"""Where to connect: in Mission Planner's terms, and only addresses reachable from other devices."""

from service.settings.addresses import GcsAddress
from service.settings.web import ListenAddress
from service.web.api import connect_help, page_urls

ANY = "0.0.0.0"  # noqa: S104
OWN = ["10.42.0.1", "192.168.1.7"]


def test_a_page_on_any_address_is_listed_at_each() -> None:
    assert page_urls(ListenAddress(ANY, 8080), OWN) == ["http://10.42.0.1:8080/", "http://192.168.1.7:8080/"]
    assert page_urls(ListenAddress("10.42.0.1", 80), OWN) == ["http://10.42.0.1:80/"]


def test_a_page_on_loopback_is_not_listed() -> None:
    for host in ("127.0.0.1", "::1", "localhost"):
        assert page_urls(ListenAddress(host, 8080), OWN) == []


def test_links_have_mission_planners_names() -> None:
    links = [
        GcsAddress("udpin", ANY, 14550),
        GcsAddress("tcpin", "10.42.0.1", 5760),
        GcsAddress("udpout", "10.42.0.9", 14550),
    ]
    help_ = connect_help(ListenAddress(), links, OWN)
    assert help_["stations"] == [
        {"connection": "UDPCl", "hosts": OWN, "port": 14550},
        {"connection": "TCP", "hosts": ["10.42.0.1"], "port": 5760},
    ]
    assert help_["called"] == ["udpout:10.42.0.9:14550"]
