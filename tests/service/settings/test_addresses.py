# SPDX-License-Identifier: GPL-3.0-or-later
"""An address as text is read back as the same address: `setup` writes it into the settings, `status` shows it."""

import pytest

from service.settings.addresses import parse_fc, parse_gcs
from service.settings.web import parse_listen


@pytest.mark.parametrize(
    "text",
    [
        "auto",
        "sim:",
        "/dev/ttyAMA0",
        "/dev/ttyUSB0,57600",
        "/dev/serial/by-path/platform-fd500000.pcie-usb-0:1.2:1.0-port0",
        "tcp:192.168.4.7:5760",
        "tcp:[fe80::7]:5760",
    ],
)
def test_a_flight_controllers_address_reads_back(text: str) -> None:
    assert str(parse_fc(text)) == text


@pytest.mark.parametrize("text", ["udpin:0.0.0.0:14550", "udpout:laptop.lan:14550", "tcpin:[::]:5760"])
def test_a_ground_stations_address_reads_back(text: str) -> None:
    assert str(parse_gcs(text)) == text


@pytest.mark.parametrize("text", ["0.0.0.0:8080", "[::1]:8080"])
def test_the_pages_address_reads_back(text: str) -> None:
    assert str(parse_listen(text)) == text
