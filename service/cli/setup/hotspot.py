# SPDX-License-Identifier: GPL-3.0-or-later
"""The Wi-Fi hotspot: a NetworkManager connection, opened by a separate process.

Opening it ends the Wi-Fi connection over which setup may be run. So setup reports everything first and then starts
this module as a transient unit: `python -m service.cli.setup.hotspot`. If no device joins in time, the previous network
returns.
"""

import re
import sys
import time
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path

from service.cli.setup.change import Change, Machine, RemoveFile, Run, SetupError, Step, WriteFile, later
from service.machine.captive_portal import HOTSPOT_CARD, dnsmasq_text
from service.machine.host import Host

CONNECTION = "naze-bridge-hotspot"
HOTSPOT_FILE = f"/etc/NetworkManager/system-connections/{CONNECTION}.nmconnection"
ADDRESS = "10.42.0.1"
#: For the name server of connections that NetworkManager shares. Read when the hotspot opens.
CAPTIVE_FILE = "/etc/NetworkManager/dnsmasq-shared.d/naze-bridge-captive.conf"
_CAPTIVE_SOCKET = "naze-bridge-captive.socket"
JOIN_S = 180
#: Time to join a known network after the hotspot is closed.
_LEAVE_S = 60
_CLOSE = "close"
#: A file for each device, which names its active connection.
_NM_DEVICES = "/run/NetworkManager/devices"
#: NetworkManager's DHCP server notes here which devices joined.
_LEASES = f"/var/lib/NetworkManager/dnsmasq-{HOTSPOT_CARD}.leases"
_OFF, _ON = "autoconnect=false", "autoconnect=true"
#: Time for setup's last lines to reach the pilot.
_DELAY_S = 3
_RELOAD = ("nmcli", "connection", "reload")
_OPEN = ("nmcli", "connection", "up", CONNECTION)


def hotspot_steps(host: Host, hotspot: tuple[str, str] | None, *, is_kept: bool = False) -> Iterator[Step]:
    """Open the hotspot. If `is_kept`, at once and for good."""
    if hotspot is None:
        return
    ssid, password = hotspot
    identity = _identity(ssid)
    text = (
        "# Written by `naze-bridge setup`.\n"
        f"[connection]\nid={CONNECTION}\nuuid={identity}\ntype=wifi\n"
        f"interface-name={HOTSPOT_CARD}\n{_ON}\nautoconnect-priority=100\n\n"
        f"[wifi]\nmode=ap\nband=bg\nssid={_byte_list(ssid)}\n\n[wifi-security]\nkey-mgmt=wpa-psk\n"
        f"psk={_escaped(password)}\n\n"
        f"[ipv4]\nmethod=shared\naddress1={ADDRESS}/24\n\n[ipv6]\nmethod=disabled\n"
    )
    purpose = f"open the Wi-Fi hotspot {ssid!r}"
    if not host.path("/run/systemd/system").exists():
        if host.read(HOTSPOT_FILE) != text:
            yield Step(purpose, [WriteFile(HOTSPOT_FILE, text, secret=True)])
        return
    if host.read(HOTSPOT_FILE) == text and hotspot_is_open(host):
        return
    if is_kept:
        yield Step(purpose, [WriteFile(HOTSPOT_FILE, text, secret=True), Run(_RELOAD), Run(_OPEN)], cuts_network=True)
        return
    # Not opened at boot before a device has joined it once.
    changes: list[Change] = [WriteFile(HOTSPOT_FILE, text.replace(_ON, _OFF), secret=True), Run(_RELOAD)]
    yield Step(purpose, [*changes, *switch_step(is_on=True).changes], cuts_network=True)


def switch_step(*, is_on: bool) -> Step:
    """Open or close the hotspot of an earlier setup, in a separate process."""
    program = (sys.executable, "-I", "-m", "service.cli.setup.hotspot", *(() if is_on else (_CLOSE,)))
    purpose = f"{'open' if is_on else 'close'} the hotspot"
    return Step(purpose, [Run(later(program, _DELAY_S, CONNECTION))], cuts_network=True)


def hotspot_is_open(host: Host) -> bool:
    identity = _identity(hotspot_name(host) or "")
    devices = [host.read(f"{_NM_DEVICES}/{name}") for name in host.names(_NM_DEVICES)]
    return any(f"connection-uuid={identity}" in device for device in devices)


def _identity(ssid: str) -> uuid.UUID:
    return uuid.uuid5(uuid.NAMESPACE_DNS, ssid)


def captive_steps(host: Host, hotspot: tuple[str, str] | None, *, has_page: bool) -> Iterator[Step]:
    """Offer the page to phones that join the hotspot, or no longer."""
    is_wanted = has_page and (hotspot is not None or hotspot_name(host) is not None)
    text = f"# Written by `naze-bridge setup`.\n{dnsmasq_text(ADDRESS)}"
    now = ("--now", "--no-block") if host.path("/run/systemd/system").exists() else ()
    if is_wanted and host.read(CAPTIVE_FILE) != text and not _is_shared_elsewhere(host):
        on = Run(("systemctl", "enable", *now, _CAPTIVE_SOCKET))
        yield Step("offer the page to phones that join the hotspot", [WriteFile(CAPTIVE_FILE, text), on])
    elif not is_wanted and host.path(CAPTIVE_FILE).exists():
        off = Run(("systemctl", "disable", *now, _CAPTIVE_SOCKET))
        yield Step("no longer offer the page to phones that join", [RemoveFile(CAPTIVE_FILE), off])


def _is_shared_elsewhere(host: Host) -> bool:
    """True if NetworkManager shares another connection: its name server reads the same folder as the hotspot's."""
    folder = str(Path(HOTSPOT_FILE).parent)
    others = [f"{folder}/{name}" for name in host.names(folder) if f"{folder}/{name}" != HOTSPOT_FILE]
    return any(re.search("^method=shared", host.read(path), re.MULTILINE) for path in others)


def hotspot_name(host: Host) -> str | None:
    """The name of the hotspot's network, or None without one."""
    found = re.search(r"^ssid=((?:[0-9]{1,3};)+)$", host.read(HOTSPOT_FILE), re.MULTILINE)
    return found and bytes(int(number) & 0xFF for number in found[1].split(";")[:-1]).decode(errors="replace")


def _byte_list(ssid: str) -> str:
    """A network name for NetworkManager's key file. As text, 70;71; would be read as FG."""
    return "".join(f"{byte};" for byte in ssid.encode())


def _escaped(password: str) -> str:
    """A password for NetworkManager's key file, where leading blanks are lost and a backslash begins an escape."""
    return password.replace("\\", "\\\\").replace(" ", "\\s")


def open_hotspot(host: Host, machine: Machine, sleep: Callable[[float], None] = time.sleep) -> str:
    """Open the hotspot, and return to the previous network if no device joins. Returns the outcome, a sentence."""
    active = machine.run(("nmcli", "--terse", "--fields", "UUID,DEVICE", "connection", "show", "--active"))
    previous = next((line.split(":")[0] for line in active.splitlines() if line.endswith(f":{HOTSPOT_CARD}")), None)
    leases = host.read(_LEASES)
    try:
        machine.run(_OPEN)
    except SetupError as error:
        if previous is not None:
            return f"{error}; {_return_to(previous, machine)}"
        # It is the only way to this Pi: NetworkManager tries again by itself, and at each start.
        _open_at_boot(host, machine, is_on=True)
        return f"{error}; it is tried again, because there is no other network"
    for _ in range(JOIN_S if previous is not None else 0):
        if host.read(_LEASES) != leases or _has_neighbour(host):
            break
        sleep(1)
    else:
        if previous is not None:
            return f"no device joined the hotspot within {JOIN_S} s; {_return_to(previous, machine)}"
    _open_at_boot(host, machine, is_on=True)
    return "the hotspot is open"


def close_hotspot(host: Host, machine: Machine, sleep: Callable[[float], None] = time.sleep) -> str:
    """Close the hotspot until it is opened again. It stays open where the Pi lacks another network."""
    _open_at_boot(host, machine, is_on=False)
    machine.run(("nmcli", "connection", "down", CONNECTION))
    for _ in range(_LEAVE_S):
        if set(host.ipv4_addresses()) - {ADDRESS}:
            return "the hotspot is closed"
        sleep(1)
    machine.run(_OPEN)
    _open_at_boot(host, machine, is_on=True)
    return "the Pi has no other network in reach; the hotspot is open again"


def _open_at_boot(host: Host, machine: Machine, *, is_on: bool) -> None:
    text = host.read(HOTSPOT_FILE)
    text = text.replace(_OFF, _ON) if is_on else text.replace(_ON, _OFF)
    machine.carry_out(WriteFile(HOTSPOT_FILE, text, secret=True))
    machine.run(_RELOAD)


def _return_to(previous: str, machine: Machine) -> str:
    """Close the hotspot. The connection is removed, so that a restart does not open it either."""
    machine.carry_out(RemoveFile(HOTSPOT_FILE))
    machine.run(_RELOAD)
    machine.run(("nmcli", "connection", "up", previous))
    return "back on the previous network"


def _has_neighbour(host: Host) -> bool:
    """True if a device in the hotspot's network answered (/proc/net/arp: address, type, flags, ..., card)."""
    network = ADDRESS.rpartition(".")[0] + "."
    rows = [line.split() for line in host.read("/proc/net/arp").splitlines()[1:]]
    return any(row[0].startswith(network) and row[2] == "0x2" and row[-1] == HOTSPOT_CARD for row in rows)


if __name__ == "__main__":
    machine_itself = Host()
    switch = close_hotspot if sys.argv[1:] == [_CLOSE] else open_hotspot
    sys.stdout.write(f"{switch(machine_itself, Machine(machine_itself))}\n")
