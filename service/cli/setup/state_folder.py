# SPDX-License-Identifier: GPL-3.0-or-later
"""The data that setup, as root, reads from the state folder of the service.

The service has no privileges, but a program that takes it over can write anything there: links, pipes, and texts meant
for root's terminal or for udev.
"""

import json
import re
from typing import NamedTuple

from service.links.port_memory import PORTS_FILE
from service.machine.host import Host
from service.settings.load import SERVICE_STATE
from service.web.token import DEFAULT_NAME
from storage.os_error import reason
from storage.small_files import read_bounded
from terminal.sentences import complain

_MAX_PORTS_FILE, _MAX_TOKEN_FILE = 1 << 16, 4096
#: SerialPort.key of a USB device: its socket ("1-1.3"), vendor and product, and possibly its serial number.
_USB_KEY = re.compile(r"usb ([0-9]{1,3}-[0-9]{1,3}(?:\.[0-9]{1,3}){0,6}) ([0-9a-f]{4}):([0-9a-f]{4})(?: .*)?")
_HEADER_KEY = re.compile(r"header /dev/[A-Za-z0-9]+")
#: More sockets than a Pi with hubs has.
_MOST_DEVICES = 64
_TOKEN = re.compile("[!-~]{1,256}")


class UsbDevice(NamedTuple):
    """A device by its USB socket ("1-1.3"), idVendor and idProduct."""

    socket: str
    vendor: str
    product: str


def other_devices(host: Host) -> list[UsbDevice]:
    """The USB devices on which the bridge heard something other than a flight controller."""
    path = host.path(f"{SERVICE_STATE}/{PORTS_FILE}")
    try:
        others = json.loads(read_bounded(path, _MAX_PORTS_FILE, follows_links=False))["others"]
        if not isinstance(others, dict):
            raise ValueError("it has no list of devices")
    except FileNotFoundError:
        return []
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        why = reason(error) if isinstance(error, OSError) else "it is damaged"
        complain(f"{path} is ignored: {why}")
        return []
    found = [UsbDevice(*key.groups()) for name in others if (key := _USB_KEY.fullmatch(name))]
    odd = len(others) - len(found) - sum(_HEADER_KEY.fullmatch(name) is not None for name in others)
    if odd or len(found) > _MOST_DEVICES:
        complain(f"{path} names devices that cannot exist, which are ignored: was the service taken over?")
    return found[:_MOST_DEVICES]


def page_token(host: Host) -> str:
    """The status page's token; empty if there is none that can be shown."""
    path = host.path(f"{SERVICE_STATE}/{DEFAULT_NAME}")
    try:
        token = read_bounded(path, _MAX_TOKEN_FILE, follows_links=False).decode().strip()
    except (OSError, ValueError):
        return ""
    return token if _TOKEN.fullmatch(token) else ""
