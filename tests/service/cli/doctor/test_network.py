# SPDX-License-Identifier: GPL-3.0-or-later
"""The network: Wi-Fi without address, occupied ports."""

from service.cli.doctor.checked import Checked
from service.cli.doctor.network import check_keys, check_ports
from service.settings import Settings
from service.settings.addresses import parse_gcs
from service.settings.settings import ShareSettings
from service.settings.web import ListenAddress, WebSettings
from service.settings.write_access import WriteAccess
from tests.support.doctor import GCS, assert_note, assert_ok, assert_problem
from tests.support.faulty_machine import PORT, FaultyMachine

UDP_14550 = "   1: 00000000:38D6 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000        0 4711 2 0 0\n"


TCP_14550 = "   1: 0100007F:38D6 0100007F:1F90 01 00000000:00000000 00:00000000 00000000  1000        0 4712 1 0 0\n"


def ports(
    pi: FaultyMachine, link: str = "udpin:0.0.0.0:14550", rules: str = "", *, is_running: bool = False
) -> list[Checked]:
    settings = Settings(PORT, [parse_gcs(link)])
    return list(check_ports(pi, settings, is_running=is_running, ask=lambda *_: rules))


def test_a_network_port_used_by_our_daemon_is_fine(pi: FaultyMachine) -> None:
    pi.sockets(udp=UDP_14550)
    pi.runs(55, "/usr/lib/naze-bridge/bin/python3", "-I", "/usr/bin/naze-bridge", "run", has_open="socket:[4711]")
    assert_ok(ports(pi, is_running=True), "the running daemon's")


def test_the_ports_of_the_page_and_of_shares_are_checked(pi: FaultyMachine) -> None:
    share = ShareSettings(parse_gcs("tcpin:127.0.0.1:5761"))
    settings = Settings(PORT, GCS, share=[share], web=WebSettings(ListenAddress("0.0.0.0", 8080)))  # noqa: S104
    found = check_ports(pi, settings, is_running=True, ask=lambda *_: "")
    assert [each.found.rpartition("on ")[2] for each in found] == ["UDP port 14550", "TCP port 5761", "TCP port 8080"]


def test_an_outgoing_connection_does_not_occupy_the_port(pi: FaultyMachine) -> None:
    pi.sockets(tcp=TCP_14550)
    assert_ok(ports(pi, "tcpin:0.0.0.0:14550"), "TCP port 14550 is free")
    pi.sockets(tcp=TCP_14550.replace(" 01 ", " 0A "))
    assert_problem(ports(pi, "tcpin:0.0.0.0:14550"), "TCP port 14550 is used", "")


_CLOSED = """table inet filter {
	chain input {
		type filter hook input priority filter; policy drop;
		tcp dport { 22, 8080 } accept
		udp dport 5000-6000 accept
	}
}
"""


def test_a_firewall_with_a_drop_policy_is_reported(pi: FaultyMachine) -> None:
    _, found = ports(pi, rules=_CLOSED)
    assert_note(found, "the firewall (nftables) drops packets to UDP port 14550")
    assert found.remedy.startswith("sudo nft insert rule inet filter input udp dport 14550 accept")
    _, found = ports(pi, rules=_CLOSED.replace("inet filter", "ip ufw"))
    assert found.remedy == "sudo ufw allow 14550/udp"
    for open_rules in ("", _CLOSED.replace("policy drop", "policy accept"), _CLOSED.replace("5000-6000", "14550")):
        assert_ok(ports(pi, rules=open_rules), "free")
    assert len(ports(pi, "tcpin:0.0.0.0:8080", rules=_CLOSED)) == 1


def test_a_link_open_to_everyone_is_reported() -> None:
    assert_note(check_keys(GCS, {}), "udpin:0.0.0.0:14550: anyone on this network can change missions")
    assert list(check_keys(GCS, {str(GCS[0]): WriteAccess(writers=())})) == []
    assert list(check_keys([parse_gcs("tcpin:127.0.0.1:1"), parse_gcs("udpout:gcs.local:2")], {})) == []
