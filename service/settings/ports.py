# SPDX-License-Identifier: GPL-3.0-or-later
"""Conflicts between settings: two users of one port, or of one link, found before either is opened."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from ipaddress import ip_address
from itertools import combinations

from service.settings.addresses import FcAddress, GcsAddress, TcpFc
from service.settings.share import ShareSettings
from service.settings.web import WebSettings
from service.settings.zenoh import ZenohSettings

#: The transport of each kind of link that listens; the others send.
_LISTENING = {"udpin": "UDP", "tcpin": "TCP"}
_ZENOH_OVER_TCP = ("tcp", "tls", "ws")


@dataclass(frozen=True, slots=True)
class _Use:
    user: str
    transport: str
    host: str
    port: int


def port_conflicts(
    fc: FcAddress | None,
    gcs: Sequence[GcsAddress],
    share: Sequence[ShareSettings],
    zenoh: ZenohSettings | None,
    web: WebSettings | None,
) -> Iterator[str]:
    """Yield a sentence for each pair that listens on one port, or that connects the bridge to itself."""
    for address, count in Counter(address for address in gcs if address.kind not in _LISTENING).items():
        if count > 1:
            yield f"gcs {address} is listed {count} times: remove the others"
    uses = list(_uses(gcs, share, zenoh, web))
    if isinstance(fc, TcpFc):
        for use in uses:
            if (use.transport, use.port) == ("TCP", fc.port) and _reaches(fc.host, use.host):
                yield f"fc {fc} is {use.user}, so the bridge would connect to itself: change one"
    for first, second in combinations(uses, 2):
        if (first.transport, first.port) == (second.transport, second.port) and _overlap(first.host, second.host):
            yield f"{first.user} and {second.user} would both listen on {first.transport} port {first.port}: change one"


def _uses(
    gcs: Sequence[GcsAddress], share: Sequence[ShareSettings], zenoh: ZenohSettings | None, web: WebSettings | None
) -> Iterator[_Use]:
    """Everything that listens."""
    links = [("gcs", address) for address in gcs] + [("share", each.address) for each in share]
    for setting, address in links:
        if address.kind in _LISTENING:
            yield _Use(f"{setting} {address}", _LISTENING[address.kind], address.host, address.port)
    if web is not None:
        yield _Use(f"web.listen {web.listen}", "TCP", web.listen.host, web.listen.port)
    for endpoint in () if zenoh is None else zenoh.listen:
        protocol, _, rest = endpoint.partition("/")
        host, _, port = rest.partition("#")[0].partition("?")[0].rpartition(":")
        if port.isdecimal():
            transport = "TCP" if protocol in _ZENOH_OVER_TCP else "UDP"
            yield _Use(f"zenoh.listen {endpoint}", transport, host.strip("[]"), int(port))


def _reaches(host: str, listening: str) -> bool:
    """True if a connection to `host` ends at `listening`. The machine's addresses other than loopback are unknown."""
    if host == listening:
        return True
    try:
        one = ip_address("127.0.0.1" if host == "localhost" else host)
        return one.is_loopback and ip_address(listening).is_unspecified
    except ValueError:
        return False


def _overlap(first: str, second: str) -> bool:
    if first == second:
        return True
    try:
        one, other = ip_address(first), ip_address(second)
    except ValueError:
        # Host names are only resolved when they are used.
        return False
    return one.version == other.version and (one.is_unspecified or other.is_unspecified)
