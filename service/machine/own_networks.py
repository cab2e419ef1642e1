# SPDX-License-Identifier: GPL-3.0-or-later
"""The networks that this machine is connected to itself, without a router in between."""

from collections.abc import Callable, Iterator
from ipaddress import IPv4Network, IPv6Network, ip_address
from math import inf
from time import monotonic

from service.machine.host import Host

_GATEWAY = 0x0002  # RTF_GATEWAY
#: A wider route, as of a mobile modem, is a way to the internet.
_WIDEST = 8
_LOOPBACK = IPv4Network("127.0.0.0/8")
#: Wi-Fi may come up, and change the address, at any time.
_FRESH_S = 1.0


class OwnNetworks:
    """Tells addresses on the machine's own networks from those behind a router.

    >>> OwnNetworks(Host())("127.0.0.1")
    True
    """

    def __init__(self, host: Host, clock: Callable[[], float] = monotonic) -> None:
        self._host = host
        self._clock = clock
        self._read_at = -inf
        self._networks: list[IPv4Network | IPv6Network] = []

    def __call__(self, address: str) -> bool:
        if (now := self._clock()) >= self._read_at + _FRESH_S:
            self._networks, self._read_at = [_LOOPBACK, *self._connected_v4(), *self._connected_v6()], now
        found = ip_address(address)
        return any(found in network for network in self._networks)

    def _connected_v4(self) -> Iterator[IPv4Network]:
        for line in self._host.read("/proc/net/route").splitlines()[1:]:
            _, destination, _, flags, _, _, _, mask, *_ = line.split()
            network = IPv4Network((_number(destination), _number(mask).bit_count()))
            if not int(flags, 16) & _GATEWAY and network.prefixlen >= _WIDEST:
                yield network

    def _connected_v6(self) -> Iterator[IPv6Network]:
        for line in self._host.read("/proc/net/if_inet6").splitlines():
            address, _, prefix, *_ = line.split()
            yield IPv6Network((int(address, 16), int(prefix, 16)), strict=False)


def _number(address: str) -> int:
    """An IPv4 address from the kernel's table, where a PC's byte order reverses it."""
    return int.from_bytes(bytes.fromhex(address), "little")
