# SPDX-License-Identifier: GPL-3.0-or-later
"""Offers the status page to phones that join the hotspot: answers the requests by which they look for a sign-in page.

A program of its own, because port 80 needs a privilege that the daemon must not have: systemd holds the port and
starts it for the first request (naze-bridge-captive.socket). The hotspot's name server (`dnsmasq_text`) sends only the
phones' own test addresses here. Where the Pi has an internet connection to share, the expected replies are given, so
that phones use it.
"""

import sys
from collections.abc import Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from socket import socket

#: The host and path that a system asks for, and the status and text it expects on the internet.
PROBES = {
    ("connectivitycheck.gstatic.com", "/generate_204"): (204, ""),  # Android, ChromeOS
    ("connectivitycheck.android.com", "/generate_204"): (204, ""),
    ("clients3.google.com", "/generate_204"): (204, ""),
    ("captive.apple.com", "/hotspot-detect.html"): (
        200,
        "<HTML><HEAD><TITLE>Success</TITLE></HEAD><BODY>Success</BODY></HTML>",
    ),
    ("www.msftconnecttest.com", "/connecttest.txt"): (200, "Microsoft Connect Test"),
    ("detectportal.firefox.com", "/success.txt"): (200, "success\n"),
    ("detectportal.firefox.com", "/canonical.html"): (
        200,
        '<meta http-equiv="refresh" content="0;url=https://support.mozilla.org/kb/captive-portal"/>',
    ),
    ("nmcheck.gnome.org", "/check_network_status.txt"): (200, "NetworkManager is online\n"),
}
#: RFC 8908's description of the network.
API_PATH = "/captive-portal"
HOTSPOT_CARD = "wlan0"
_ROUTES = Path("/proc/net/route")
#: sd_listen_fds(3): the first socket from systemd.
_SOCKET = 3
_IDLE_S, _REQUEST_TIMEOUT_S = 60.0, 5.0


def dnsmasq_text(address: str) -> str:
    """Settings for the hotspot's name and DHCP server: the test addresses are the Pi's, and DHCP announces the page."""
    hosts = sorted({host for host, _ in PROBES})
    lines = [f"dhcp-option=tag:{HOTSPOT_CARD},114,http://{address}{API_PATH}"]  # RFC 8910
    # `local`: no AAAA from a server upstream.
    lines += [line for host in hosts for line in (f"address=/{host}/{address}", f"local=/{host}/")]
    return "".join(f"{line}\n" for line in lines)


def has_internet(routes: str) -> bool:
    """True if /proc/net/route has a default route that is not over the hotspot's card."""
    rows = [line.split() for line in routes.splitlines()[1:]]
    return any(row[1] == "00000000" and row[0] != HOTSPOT_CARD for row in rows if len(row) > 1)


def reply_to(host: str, path: str, page: str, *, is_online: bool) -> tuple[int, str, str, str]:
    """Status, Location, type and text of the reply; Location is empty unless it leads to the page."""
    expected = PROBES.get((host.partition(":")[0].lower(), path.partition("?")[0]))
    if path == API_PATH:
        text = f'{{"captive": {str(not is_online).lower()}, "user-portal-url": "{page}"}}'
        return 200, "", "application/captive+json", text
    if expected is not None and is_online:
        return expected[0], "", "text/html", expected[1]
    return 302, page, "text/html", f'<a href="{page}">The status page of naze-bridge</a>'


class _Handler(BaseHTTPRequestHandler):
    timeout = _REQUEST_TIMEOUT_S
    page = ""

    def do_GET(self) -> None:
        is_online = has_internet(_ROUTES.read_text())
        status, location, kind, text = reply_to(self.headers.get("Host", ""), self.path, self.page, is_online=is_online)
        self.send_response(status)
        if location:
            self.send_header("Location", location)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(text)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        if self.command == "GET":
            self.wfile.write(text.encode())

    do_HEAD = do_GET  # noqa: N815  # the name that BaseHTTPRequestHandler looks for

    def log_message(self, *_: object) -> None:
        """A phone asks every few seconds: nothing is logged."""


class _Server(ThreadingHTTPServer):
    timeout = _IDLE_S
    is_idle = False

    def handle_timeout(self) -> None:
        self.is_idle = True


def serve(listening: socket, page: str) -> None:
    """Answer requests until there is none for a minute."""
    handler = type("Handler", (_Handler,), {"page": page})
    with _Server(listening.getsockname(), handler, bind_and_activate=False) as server:
        server.socket.close()
        server.socket = listening
        while not server.is_idle:
            server.handle_request()


def main(arguments: Sequence[str]) -> None:
    (page,) = arguments
    serve(socket(fileno=_SOCKET), page)


if __name__ == "__main__":
    main(sys.argv[1:])
