# SPDX-License-Identifier: GPL-3.0-or-later
"""Offers the status page to phones that join the hotspot: answers the requests by which they look for a sign-in page.

A program of its own, because port 80 needs a privilege that the daemon must not have: systemd holds the port and
starts it for the first request (naze-bridge-captive.socket). The hotspot's name server (`dnsmasq_text`) sends only the
phones' own test addresses here.
"""

import sys
from collections.abc import Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socket import socket

#: The hosts that systems ask for a known text on the internet.
HOSTS = (
    "captive.apple.com",
    "clients3.google.com",  # Android, ChromeOS
    "connectivitycheck.android.com",
    "connectivitycheck.gstatic.com",
    "detectportal.firefox.com",
    "nmcheck.gnome.org",
    "www.msftconnecttest.com",
)
#: RFC 8908's description of the network.
API_PATH = "/captive-portal"
HOTSPOT_CARD = "wlan0"
#: sd_listen_fds(3): the first socket from systemd.
_SOCKET = 3
_IDLE_S, _REQUEST_TIMEOUT_S = 60.0, 5.0


def dnsmasq_text(address: str) -> str:
    """Settings for the hotspot's name and DHCP server: the test addresses are the Pi's, and DHCP announces the page."""
    lines = [f"dhcp-option=tag:{HOTSPOT_CARD},114,http://{address}{API_PATH}"]  # RFC 8910
    # `local`: no AAAA from a server upstream.
    lines += [line for host in HOSTS for line in (f"address=/{host}/{address}", f"local=/{host}/")]
    return "".join(f"{line}\n" for line in lines)


def reply_to(path: str, page: str) -> tuple[int, str, str, str]:
    """Status, Location, type and text of the reply; Location is empty unless it leads to the page."""
    if path == API_PATH:
        return 200, "", "application/captive+json", f'{{"captive": true, "user-portal-url": "{page}"}}'
    return 302, page, "text/html", f'<a href="{page}">The status page of naze-bridge</a>'


class _Handler(BaseHTTPRequestHandler):
    timeout = _REQUEST_TIMEOUT_S
    page = ""

    def do_GET(self) -> None:
        status, location, kind, text = reply_to(self.path, self.page)
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
        """A phone asks every few seconds: that is not logged."""


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
