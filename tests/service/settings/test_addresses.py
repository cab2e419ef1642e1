# SPDX-License-Identifier: GPL-3.0-or-later
"""An address as text is read back as the same address: `setup` writes it into the settings, `status` shows it."""

import pytest

from service.settings.addresses import AddressError, GcsAddress, parse_fc, parse_gcs
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


@pytest.mark.parametrize(
    ("text", "host", "port"),
    [
        ("udpin:[::]:14550", "::", 14550),
        ("tcpin:[::1]:5760", "::1", 5760),
        ("udpout:pc.local:1", "pc.local", 1),
    ],
)
def test_addresses_are_written_like_they_are_read(text: str, host: str, port: int) -> None:
    address = parse_gcs(text)
    assert (address.host, address.port, str(address)) == (host, port, text)
    assert isinstance(address, GcsAddress)


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("UDPIN:14550", "udpin:0.0.0.0:14550"),
        ("udp:14550", "udpin:0.0.0.0:14550"),
        ("udp://:14550", "udpin:0.0.0.0:14550"),
        ("udpin://0.0.0.0:14550", "udpin:0.0.0.0:14550"),
        ("udpout:pc.local,14550", "udpout:pc.local:14550"),
        ("tcp:0.0.0.0:5760", "tcpin:0.0.0.0:5760"),
        ("tcpin:5760", "tcpin:0.0.0.0:5760"),
    ],
)
def test_other_programs_notations_are_accepted(text: str, meant: str) -> None:
    assert str(parse_gcs(text)) == meant


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("udp:192.168.4.20:14550", "write udpout:192.168.4.20:14550 to send there, udpin:0.0.0.0:14550 to listen"),
        ("tcp:192.168.4.20:5760", "write tcpin:0.0.0.0:5760 to listen"),
        ("udpin", "use udpin:0.0.0.0:14550"),
        ("udpout:14550", "needs a host and a port"),
        ("serial:/dev/ttyS0", "udpin:0.0.0.0:14550"),
        ("udpin:0.0.0.0:mavlink", "not a port number"),
        ("udpout:10.0.0.1:70000", "not a port number"),
        ("/dev/ttyUSB0", "lacks the radio's serial speed; add it, as in /dev/ttyUSB0,57600"),
    ],
)
def test_ambiguous_connections_are_explained(text: str, words: str) -> None:
    with pytest.raises(AddressError) as caught:
        parse_gcs(text)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("AUTO", "auto"),
        ("sim", "sim:"),
        ("SIM:", "sim:"),
        ("/dev/ttyAMA0:57600", "/dev/ttyAMA0,57600"),
        ("serial:/dev/ttyAMA0:57600", "/dev/ttyAMA0,57600"),
        ("serial:///dev/ttyAMA0", "/dev/ttyAMA0"),
        ("/dev/serial/by-path/pci-0:1:1.0-port0", "/dev/serial/by-path/pci-0:1:1.0-port0"),
        ("tcp://127.0.0.1:5760", "tcp:127.0.0.1:5760"),
    ],
)
def test_other_programs_notations_of_flight_controllers_are_accepted(text: str, meant: str) -> None:
    assert str(parse_fc(text)) == meant


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("naze", "/dev/serial0"),
        ("ttyUSB0,57600", "did you mean /dev/ttyUSB0,57600?"),
        ("tcp:naze..local:5760", "not a host name"),
        ("/dev/ttyUSB0,fast", "not a baud rate"),
        ("/dev/ttyUSB0,12", "not a baud rate"),
        ("tcp:naze.local", "needs a host and a port"),
    ],
)
def test_a_wrong_flight_controllers_address_is_explained(text: str, words: str) -> None:
    with pytest.raises(AddressError) as caught:
        parse_fc(text)
    assert words in str(caught.value)


def test_ipv6_without_brackets_is_explained() -> None:
    with pytest.raises(AddressError, match=r"brackets, as in \[::1\]:5760"):
        parse_gcs("udpin:::1:14550")
