# SPDX-License-Identifier: GPL-3.0-or-later
"""Telemetry log records, read by pymavlink, which also checks the CRCs."""

import hashlib
from pathlib import Path
from typing import Any

from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.tlog import tlog_records

NOON_US = 1_795_262_400_000_000
KEY = hashlib.sha256(b"a passphrase").digest()


def sender(*, signing: bool = False) -> Any:
    codec = messages.MAVLink(None, srcSystem=1, srcComponent=1)
    if signing:
        codec.signing.secret_key = KEY
        codec.signing.sign_outgoing = True
    return codec


def some_messages() -> list[Any]:
    return [
        messages.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3),
        messages.MAVLink_attitude_message(1000, 0.125, -0.25, 3.0, 0.0, 0.0, 0.0),
        messages.MAVLink_statustext_message(6, b"Found Harakiri"),
        messages.MAVLink_mission_item_int_message(1, 1, 7, 3, 16, 0, 1, 0, 2, 0, 0, 473977420, 85455940, 12.0),
        messages.MAVLink_param_value_message(b"SYSID_THISMAV", 1.0, 9, 1, 0),
    ]


def read_by_pymavlink(path: Path) -> list[Any]:
    reader = mavutil.mavlink_connection(str(path))
    found = []
    while (message := reader.recv_match()) is not None:
        found.append(message)
    reader.close()
    return found


def test_pymavlink_reads_the_written_records(tmp_path: Path) -> None:
    """Both versions of MAVLink, signed or not: contents and times read back, without signatures."""
    written: list[tuple[float, Any]] = []
    log = b""
    for version, signing in ((2, False), (1, False), (2, True)):
        codec = sender(signing=signing)
        for message in some_messages():
            # (The resolution is 4 microseconds: the lowest bits are the link's number.)
            at_us = NOON_US + len(written) * 40_000
            frame = bytes(message.pack(codec, force_mavlink1=version == 1))
            assert (frame[2] & 1 == 1 and version == 2) == signing
            log += tlog_records([frame], at_us)
            written.append((at_us * 1e-6, message))
    path = tmp_path / "flight.tlog"
    path.write_bytes(log)
    found = read_by_pymavlink(path)
    assert [(message._timestamp, message.to_dict()) for message in found] == [
        (at, message.to_dict()) for at, message in written
    ]
    assert not any(message.get_signed() for message in found)
    assert {message._link for message in found} == {0}


def test_a_signing_key_is_never_logged() -> None:
    for signing in (False, True):
        frame = bytes(messages.MAVLink_setup_signing_message(1, 1, KEY, 1).pack(sender(signing=signing)))
        assert KEY in frame
        assert tlog_records([frame], NOON_US) == b""
