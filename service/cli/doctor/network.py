# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of the network: the address for ground stations, listening ports, keys of the links, routers of zenoh."""

import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence

from payloads.names import ZenohSettingsError
from protocols.remedies import Fault
from service.cli.doctor.checked import Checked, note, ok, problem
from service.cli.doctor.fixes import RESTART_BRIDGE, UNBLOCK_WIFI
from service.cli.doctor.machine import output_of
from service.machine.host import Host
from service.machine.package import page
from service.settings import Settings
from service.settings.addresses import GcsAddress
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
        return [problem("Wi-Fi", *Fault.WIFI_BLOCKED(), UNBLOCK_WIFI)]
    cards = host.wifi_cards()
    if not cards:
        return [note("Wi-Fi", *Fault.NO_WIFI())]
    return [_card(host, card, gcs) for card in cards]


def _card(host: Host, card: str, gcs: Sequence[GcsAddress]) -> Checked:
    address = host.address(card)
    if address is None:
        return note("Wi-Fi", *Fault.NO_ADDRESS(card=card, page=page("docs/howto/wifi-access-point.md")))
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
            fault = Fault.FIREWALL_UFW if "ufw" in rules else Fault.FIREWALL
            what, chain = f"{transport.upper()} port {port}", _input_chain(rules)
            yield note("firewall", *fault(what=what, chain=chain, transport=transport, port=port))


def _check_port(host: Host, transport: str, port: int, *, is_running: bool) -> Checked:
    what = f"{transport.upper()} port {port}"
    inode = _inode(host, transport, port)
    if inode is None and is_running:
        return problem("listening port", *Fault.NOT_LISTENING(what=what), RESTART_BRIDGE)
    if inode is None:
        return ok("listening port", f"{what} is free")
    holder = host.holder(f"socket:[{inode}]")
    if holder is not None and holder.is_naze_bridge:
        return ok("listening port", f"{what} is the running daemon's")
    if holder is None and os.geteuid() and is_running:
        return ok("listening port", f"{what} is in use; only root can see by which program")
    if holder is None and os.geteuid():
        return problem("listening port", *Fault.HIDDEN_LISTENER(what=what))
    if holder is None:
        return problem("listening port", *Fault.LOST_LISTENER(what=what))
    found = Fault.OTHER_LISTENER(what=what, program=holder, command=host.stop_command(holder))
    return problem("listening port", *found)


def is_blocked(rules: str, transport: str, port: int) -> bool:
    """True if the chain for arriving packets drops all packets without a rule, and the port does not have one."""
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
            yield note("key", *Fault.NO_KEY(link=link))
        elif access.weak_key is not None:
            yield note("key", *Fault.WEAK_KEY(why=f"{link}: {access.weak_key}"))
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
        return problem("zenoh", *Fault.BAD_ZENOH(why=error))
    me = f"{settings.prefix}/{settings.vehicle}"
    endpoints = connect_endpoints(config)
    if not endpoints:
        return ok("zenoh", f"{me}, does not open connections")
    return ok("zenoh", f"{me}, connects to {', '.join(endpoints)}; the daemon's log shows whether they refuse")
