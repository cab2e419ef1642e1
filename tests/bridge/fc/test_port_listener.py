# SPDX-License-Identifier: GPL-3.0-or-later
"""GPS receivers and radios on a port are recognised before anything is sent there."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.fc.port_listener import LISTENING_SPEEDS, GpsWatch, PortListener
from protocols.mavlink.codec import FrameWriter
from protocols.msp.commands import Msp
from protocols.msp.frame import request
from tests.support.packing import pack

NMEA = b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n"
RADIO_STATUS = FrameWriter(51, 68).frame(pack(m.MAVLink_radio_status_message(0, 0, 100, 0, 0, 0, 0)), 1)


def heartbeat(kind: int, autopilot: int, sysid: int = 1) -> bytes:
    return FrameWriter(sysid, 1).frame(pack(m.MAVLink_heartbeat_message(kind, autopilot, 0, 0, 4, 3)), 1)


def ubx(payload: bytes) -> bytes:
    body = b"\x01\x07" + len(payload).to_bytes(2, "little") + payload
    first = second = 0
    for byte in body:
        first = (first + byte) % 256
        second = (second + first) % 256
    return b"\xb5\x62" + body + bytes((first, second))


@pytest.mark.parametrize(
    ("sent", "named"),
    [
        (NMEA, "GPS receiver (NMEA)"),
        (ubx(bytes(92)), "GPS receiver (UBX)"),
        (RADIO_STATUS, "SiK telemetry radio"),
        (heartbeat(6, 8, 255), "ground station"),
    ],
)
@pytest.mark.parametrize("size", [1, 7, 1000])
def test_gps_receivers_and_radios_are_recognised(sent: bytes, named: str, size: int) -> None:
    watch = PortListener(0.0)
    data = b"\x00\xff" + sent + sent
    for start in range(0, len(data), size):
        watch.receive(data[start : start + size])
    assert named in watch.what


@pytest.mark.parametrize("sent", [heartbeat(2, 3), request(Msp.IDENT), b"$M>\x07\x64\xd3\x03\x00\x00\x00\x00\x80\x37"])
def test_a_flight_controller_is_not_mistaken_for_another_device(sent: bytes) -> None:
    watch = PortListener(0.0)
    watch.receive(sent * 3)
    assert not watch.what


def test_a_damaged_sentence_is_not_enough() -> None:
    watch = PortListener(0.0)
    watch.receive(NMEA.replace(b"123519", b"123518") + ubx(bytes(92))[:-1] + b"\x00")
    assert not watch.what


@given(st.lists(st.binary(max_size=64), max_size=20))
def test_noise_is_not_a_radio_and_does_not_raise(chunks: list[bytes]) -> None:
    watch = PortListener(0.0)
    for chunk in chunks:
        watch.receive(chunk)
    assert "radio" not in watch.what


def listen(sent_at: dict[int, bytes]) -> tuple[str, list[int]]:
    """Run a listener on a line with data every second; return its result and the speeds it tried."""
    now = 0.0
    speeds: list[int] = []
    listener = PortListener(now)
    while not listener.is_done:
        if not speeds or speeds[-1] != listener.speed:
            speeds.append(listener.speed)
        # At a speed other than the sender's the bits give other bytes.
        listener.receive(sent_at.get(listener.speed, b"\x00\xfe\x80" * 10 if sent_at else b""))
        now = max(now + 0.5, now)
        listener.tick(now)
    return listener.what, speeds


def test_on_a_silent_port_only_one_speed_is_tried() -> None:
    assert listen({}) == ("", [115200])


def test_a_gps_receiver_is_found_at_its_own_speed() -> None:
    assert listen({9600: NMEA}) == ("a GPS receiver (NMEA)", [115200, 9600])


def test_a_vehicle_at_the_first_speed_ends_the_listening() -> None:
    assert listen({115200: heartbeat(2, 3)}) == ("", [115200])


def test_unknown_data_is_listened_to_at_every_speed() -> None:
    assert listen({1: b""}) == ("", list(LISTENING_SPEEDS))


def test_each_speed_is_listened_to_for_the_same_time() -> None:
    listener = PortListener(0.0)
    ends = []
    while not listener.is_done:
        ends.append(listener.ends)
        listener.receive(bytes(range(256)))
        listener.tick(listener.ends - 0.001)
        assert listener.ends == ends[-1]
        listener.tick(listener.ends)
    assert ends == pytest.approx([ends[0] * (number + 1) for number in range(len(LISTENING_SPEEDS))])


SENTENCE = b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n"
#: ACK-ACK of CFG-PRT.
FRAME = bytes.fromhex("b562 0501 0200 0600 0e37")
KINDS = pytest.mark.parametrize(("whole", "name"), [(SENTENCE, "NMEA"), (FRAME, "UBX")])


def heard(*chunks: bytes) -> str:
    watch = GpsWatch()
    for chunk in chunks:
        watch.feed(chunk)
    return watch.heard


@KINDS
@given(before=st.text("\0U,*,\n7", max_size=40), cut=st.integers(0, 80))
def test_it_is_heard_wherever_a_read_ends(whole: bytes, name: str, before: str, cut: int) -> None:
    data = before.encode() + whole
    assert heard(data[:cut], data[cut:]) == name


@KINDS
@given(at=st.integers(1, 1000), bit=st.integers(0, 7))
def test_a_damaged_sentence_is_not_heard(whole: bytes, name: str, at: int, bit: int) -> None:
    data = bytearray(whole.rstrip(b"\r\n"))
    data[at % len(data)] ^= 1 << bit
    assert heard(bytes(data)) == ""
