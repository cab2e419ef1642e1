# SPDX-License-Identifier: GPL-3.0-or-later
"""The network: Wi-Fi without address, occupied ports."""

import os

from service.cli.doctor.network import check_keys, check_ports, check_wifi
from service.settings.addresses import parse_gcs
from service.settings.write_access import WriteAccess
from tests.support.doctor import GCS, assert_note, assert_ok, assert_problem
from tests.support.faulty_machine import FaultyMachine

UDP_14550 = "   1: 00000000:38D6 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000        0 4711 2 0 0\n"


TCP_14550 = "   1: 0100007F:38D6 0100007F:1F90 01 00000000:00000000 00:00000000 00000000  1000        0 4712 1 0 0\n"


def test_a_wifi_without_address_or_switched_off_is_reported(pi: FaultyMachine) -> None:
    pi.addresses.clear()
    assert_note(check_wifi(pi, GCS), "wlan0 has no address")
    pi.write("/sys/class/rfkill/rfkill0/type", "wlan\n")
    pi.write("/sys/class/rfkill/rfkill0/soft", "1\n")
    assert_problem(check_wifi(pi, GCS), "switched off (rfkill)", "sudo rfkill unblock wlan")
    pi.write("/sys/class/rfkill/rfkill0/type", "bluetooth\n")
    pi.path("/sys/class/net/wlan0/wireless/x").unlink()
    pi.path("/sys/class/net/wlan0/wireless").rmdir()
    assert_note(check_wifi(pi, GCS), "no Wi-Fi card")


def test_an_occupied_network_port_is_a_problem(pi: FaultyMachine) -> None:
    pi.sockets(udp=UDP_14550)
    assert_problem(
        check_ports(pi, GCS), "UDP port 14550 is used by ", "restart the Pi" if os.geteuid() == 0 else "with sudo"
    )
    pi.runs(55, "/usr/bin/python3", "/usr/local/bin/mavproxy.py", has_open="socket:[4711]")
    assert_problem(check_ports(pi, GCS), "python3 (pid 55)", "stop it")


def test_a_network_port_used_by_our_daemon_is_fine(pi: FaultyMachine) -> None:
    pi.sockets(udp=UDP_14550)
    pi.runs(55, "/usr/lib/naze-bridge/bin/python3", "-I", "/usr/bin/naze-bridge", "run", has_open="socket:[4711]")
    assert_ok(check_ports(pi, GCS), "the running daemon's")


def test_an_outgoing_connection_does_not_occupy_its_port(pi: FaultyMachine) -> None:
    pi.sockets(tcp=TCP_14550)
    assert_ok(check_ports(pi, [parse_gcs("tcpin:0.0.0.0:14550")]), "TCP port 14550 is free")
    pi.sockets(tcp=TCP_14550.replace(" 01 ", " 0A "))
    assert_problem(check_ports(pi, [parse_gcs("tcpin:0.0.0.0:14550")]), "TCP port 14550 is used", "")


def test_a_link_open_to_everyone_is_reported() -> None:
    assert_note(check_keys(GCS, {}), "udpin:0.0.0.0:14550: anyone on this network can change missions")
    assert list(check_keys(GCS, {str(GCS[0]): WriteAccess(writers=())})) == []
    assert list(check_keys([parse_gcs("tcpin:127.0.0.1:1"), parse_gcs("udpout:gcs.local:2")], {})) == []
