# SPDX-License-Identifier: GPL-3.0-or-later
"""Addresses on the Pi's own networks, by the kernel's tables of a Pi with Wi-Fi, a mobile modem and IPv6."""

from pathlib import Path

import pytest

from service.machine.host import Host
from service.machine.own_networks import OwnNetworks

#: wlan0 192.168.4.1/24 with a route by a router; wwan0 10.64.0.2/30 with default routes that have no gateway.
ROUTES = """\
Iface\tDestination\tGateway \tFlags\tRefCnt\tUse\tMetric\tMask\t\tMTU\tWindow\tIRTT
wwan0\t00000000\t00000000\t0001\t0\t0\t700\t00000000\t0\t0\t0
wwan0\t00000080\t00000000\t0001\t0\t0\t700\t00000080\t0\t0\t0
wwan0\t0000400A\t00000000\t0001\t0\t0\t700\tFCFFFFFF\t0\t0\t0
wlan0\t0004A8C0\t00000000\t0001\t0\t0\t600\t00FFFFFF\t0\t0\t0
wlan0\t0005A8C0\t0204A8C0\t0003\t0\t0\t600\t00FFFFFF\t0\t0\t0
"""
ADDRESSES_V6 = """\
fe80000000000000ba27ebfffe000001 03 40 20 80    wlan0
fd000000000400000000000000000001 03 40 00 80    wlan0
00000000000000000000000000000001 01 80 10 80       lo
"""


def machine(root: Path) -> Host:
    (root / "proc/net").mkdir(parents=True)
    (root / "proc/net/route").write_text(ROUTES)
    (root / "proc/net/if_inet6").write_text(ADDRESSES_V6)
    return Host(root)


@pytest.mark.parametrize(
    ("address", "is_own"),
    [
        ("127.0.0.2", True),
        ("::1", True),
        ("192.168.4.77", True),
        ("10.64.0.1", True),
        ("fe80::77%wlan0", True),
        ("fd00:0:4::77", True),
        ("192.168.5.77", False),
        ("10.64.0.9", False),
        ("198.51.100.7", False),
        ("fd00:0:5::77", False),
        ("2001:db8::7", False),
    ],
)
def test_only_addresses_without_a_router_in_between_are_its_own(tmp_path: Path, address: str, *, is_own: bool) -> None:
    assert OwnNetworks(machine(tmp_path))(address) is is_own


def test_follows_a_wifi_that_comes_up_later(tmp_path: Path) -> None:
    now = [0.0]
    networks = OwnNetworks(Host(tmp_path), lambda: now[0])
    assert not networks("192.168.4.77")
    machine(tmp_path)
    now[0] = 1.0
    assert networks("192.168.4.77")
