# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of the network: the address for ground stations, listening ports, keys of the links, routers of zenoh."""

import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence

from payloads.names import ZenohSettingsError
from service.cli.doctor.checked import Checked, note, ok, problem
from service.cli.doctor.fixes import RESTART_BRIDGE, UNBLOCK_WIFI
from service.cli.doctor.machine import output_of
from service.machine.host import Host
from service.machine.package import page
from service.settings import Settings
from service.settings.addresses import GcsAddress
from service.settings.passphrase import STRONGER
from service.settings.write_access import WriteAccess
from service.settings.zenoh import ZenohSettings

#: The state of listening sockets in /proc/net/tcp.
_LISTENS = "0A"


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


def check_ports(
    host: Host, settings: Settings, *, is_running: bool, ask: Callable[..., str] = output_of
) -> Iterator[Checked]:
    """Check that a running daemon with these settings has their ports, or that they are free, and the firewall."""
    rules = ask("nft", "list", "ruleset")
    links = [*settings.gcs, *(share.address for share in settings.share)]
    ports = [(link.kind.removesuffix("in"), link.port) for link in links if link.kind in ("udpin", "tcpin")]
    ports += [("tcp", settings.web.listen.port)] if settings.web is not None else []
    for transport, port in dict.fromkeys(ports):
        yield _check_port(host, transport, port, is_running=is_running)
        if is_blocked(rules, transport, port):
            found = f"the firewall (nftables) drops packets to {transport.upper()} port {port}"
            rule = f"sudo nft insert rule {_input_chain(rules)} {transport} dport {port} accept"
            allow = (
                f"sudo ufw allow {port}/{transport}" if "ufw" in rules else f"{rule}; also add it to /etc/nftables.conf"
            )
            yield note("firewall", found, allow)


def _check_port(host: Host, transport: str, port: int, *, is_running: bool) -> Checked:
    what = f"{transport.upper()} port {port}"
    inode = _inode(host, transport, port)
    if inode is None and is_running:
        remedy = "look at its log (journalctl -u naze-bridge), and restart it: sudo systemctl restart naze-bridge"
        return problem("listening port", f"the daemon does not listen on {what}", remedy, RESTART_BRIDGE)
    if inode is None:
        return ok("listening port", f"{what} is free")
    holder = host.holder(f"socket:[{inode}]")
    if holder is not None and holder.is_naze_bridge:
        return ok("listening port", f"{what} is the running daemon's")
    if holder is None and os.geteuid() and is_running:
        return ok("listening port", f"{what} is in use; only root sees by which program")
    if holder is None and os.geteuid():
        hidden = "only root sees which: run doctor with sudo"
        return problem("listening port", f"{what} is used by another program", hidden)
    remedy = f"stop it: {host.stop_command(holder)}; or use another port" if holder else "restart the Pi"
    found = f"{what} is used by {holder or 'a program that is gone'}"
    return problem("listening port", found, remedy)


def is_blocked(rules: str, transport: str, port: int) -> bool:
    """True if the chain for arriving packets drops all that no rule accepts, and no rule names the port."""
    allowed = re.findall(rf"\b{transport} dport (?:\{{([^}}]*)\}}|([\d-]+))[^\n]*\baccept", rules)
    if any(_covers(part, port) for several, one in allowed for part in (several or one).split(",")):
        return False
    return re.search(r"hook input [^}]*(policy drop|\n\s*(counter [^\n]*)?(drop|reject))", rules) is not None


def _covers(part: str, port: int) -> bool:
    first, _, last = part.strip().partition("-")
    return first.isdecimal() and int(first) <= port <= int(last or first)


def _input_chain(rules: str) -> str:
    """The family, table and name of the chain for arriving packets: "inet filter input", or empty without one."""
    found = re.search(r"table (\w+ \S+) \{(?:(?!\ntable).)*?chain (\S+) \{\s*type filter hook input", rules, re.DOTALL)
    return "" if found is None else f"{found[1]} {found[2]}"


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
        if access.is_open and link.kind != "udpout" and link.is_public:
            found = f"{link}: anyone on this network can change missions and settings"
            yield note("key", found, "sudo naze-bridge setup --new-key makes a key that changes need, and shows it")
        elif access.weak_key is not None:
            yield note("key", f"{link}: {access.weak_key}", STRONGER)
        elif access.key is not None:
            yield ok("key", f"required for changes on {link}")


def check_zenoh(settings: ZenohSettings | None) -> Checked:
    """Check the configuration."""
    if settings is None:
        return ok("zenoh", "off")
    # Importing zenoh takes half a second.
    from payloads.endpoints import connect_endpoints
    from service.settings.zenoh_config import make_config

    try:
        config = make_config(settings)
    except ZenohSettingsError as error:
        return problem("zenoh", str(error), "correct the [zenoh] table or its config_file")
    me = f"{settings.prefix}/{settings.vehicle}"
    endpoints = connect_endpoints(config)
    if not endpoints:
        return ok("zenoh", f"{me}, opens no connections")
    return ok("zenoh", f"{me}, connects to {', '.join(endpoints)}; the log of the daemon says if they refuse")
