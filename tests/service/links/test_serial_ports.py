# SPDX-License-Identifier: GPL-3.0-or-later
"""Ports that may have a flight controller."""

import re
from pathlib import Path

import pytest

from service.links.serial_ports import USB_CHIPS, serial_ports
from tests.support.pi_with_ports import CP2102, Pi


@pytest.mark.parametrize(
    ("model", "serial0", "header"),
    [
        ("Raspberry Pi 3 Model B Plus Rev 1.3", "ttyS0", "/dev/ttyS0"),
        ("Raspberry Pi 4 Model B Rev 1.4", "ttyS0", "/dev/ttyS0"),
        ("Raspberry Pi 5 Model B Rev 1.0", "ttyAMA10", "/dev/ttyAMA0"),
        ("Raspberry Pi Zero 2 W Rev 1.0", "ttyAMA0", "/dev/ttyAMA0"),
    ],
)
def test_the_headers_uart_depends_on_the_model(pi: Pi, model: str, serial0: str, header: str) -> None:
    pi.write("/proc/device-tree/model", f"{model}\0")
    for name in ("ttyS0", "ttyAMA0", "ttyAMA10"):
        pi.write(f"/dev/{name}")
    pi.path("/dev/serial0").unlink()
    pi.path("/dev/serial0").symlink_to(serial0)
    assert [port.path for port in serial_ports(pi)] == [header]


@pytest.mark.parametrize(
    ("chip", "is_candidate"),
    [
        (CP2102, True),
        (("1a86", "7523", "1a86", "USB Serial"), True),
        (("1546", "01a7", "u-blox AG", "u-blox 7 - GPS/GNSS Receiver"), False),
        (("0403", "6001", "3D Robotics", "SiK Radio"), False),
        (("2341", "0043", "Arduino", "Uno"), False),
    ],
)
def test_only_known_usb_chips_are_searched(pi: Pi, chip: tuple[str, str, str, str], is_candidate: bool) -> None:
    pi.path("/dev/serial0").unlink()
    pi.usb("ttyUSB0", "1-1", chip)
    pi.write("/dev/ttyUSB0")
    assert [port.path for port in serial_ports(pi)] == ["/dev/ttyUSB0"] * is_candidate


def test_udev_knows_the_same_chips() -> None:
    rules = (Path(__file__).parents[3] / "systemd" / "60-naze-bridge.rules").read_text()
    named = re.findall(r'ATTRS{idVendor}=="(\w+)", ATTRS{idProduct}=="([\w|]+)"', rules)
    assert {(vendor, product) for vendor, products in named for product in products.split("|")} == set(USB_CHIPS)
