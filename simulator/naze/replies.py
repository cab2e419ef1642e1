# SPDX-License-Identifier: GPL-3.0-or-later
"""The board's side of the mission extension's messages: requests unmasked, replies encoded (docs/msp-mission.md)."""

import struct
from typing import NamedTuple

from protocols.mission_item import pack_records
from protocols.msp.frame import apply_mask, masked_request
from protocols.msp.mission import Info, MissionCommand, Records, ReplyStatus, Staged, Stored
from protocols.msp.mission_flight import FlightProgress
from protocols.msp.setting_table import WHOLE_TABLE, SettingsReply, TableReply

MAX_RADIUS_CM = 2000
#: The largest payload of a reply with settings, bytes.
SETTINGS_SIZE = 218
_INFO = struct.Struct("<BBBBBBHHIHHHI")
_PROGRESS = struct.Struct("<BHI")
_SHORT = struct.Struct("<BH")
_TABLE = struct.Struct("<BHHI")
_FLIGHT, _FLIGHT_VERSION, _NO_RECORD = struct.Struct("<6B3HIHhIh"), 2, 0xFFFF


class Radius(NamedTuple):
    """Reply to RADIUS: the gps_wp_radius in force, cm."""

    status: ReplyStatus
    wp_radius_cm: int


Reply = Info | Staged | Stored | Records | Radius | SettingsReply | TableReply


def unmask(payload: bytes) -> bytes | None:
    """A request's payload without the mask, or None if it is not masked."""
    return apply_mask(payload[1:], payload[0]) if len(payload) % 2 else None


def encode_reply(reply: Reply) -> bytes:
    """The reply's payload."""
    match reply:
        case Info():
            return _INFO.pack(ReplyStatus.OK, *reply[:6], reply.stored.count, reply.stored.checksum, *reply[7:])
        case Stored(status, stored):
            return _PROGRESS.pack(status, stored.count, stored.checksum)
        case Records(status, first, records):
            return _SHORT.pack(status, first) + pack_records(records)
        case SettingsReply(status, first, settings):
            return _SHORT.pack(status, first) + b"".join(held.encode() for held in settings)
        case TableReply(status, total, checksum):
            return _TABLE.pack(status, WHOLE_TABLE, total, checksum)
        case Staged():
            return _PROGRESS.pack(*reply)
        case Radius():
            return _SHORT.pack(*reply)


def encode_radius(wp_radius_cm: int) -> bytes:
    """The request RADIUS, which the bridge does not send: 0..2000 cm."""
    return masked_request(MissionCommand.RADIUS, struct.pack("<HH", wp_radius_cm, wp_radius_cm ^ 0xFFFF))


def decode_radius(payload: bytes) -> Radius:
    status, radius_cm = _SHORT.unpack(payload)
    return Radius(ReplyStatus(status), radius_cm)


def encode_flight(flight: FlightProgress) -> bytes:
    """The payload of the reply to FLIGHT."""
    records = (_NO_RECORD if record is None else record for record in (flight.record, flight.reached))
    target = (round(flight.distance * 100), round(flight.bearing * 100), round(flight.height_error * 100))
    state_ms, compass = round(flight.state_s * 1000), round((flight.compass or 0) * 100)
    head = 0, _FLIGHT_VERSION, flight.summary >> 16 & 0xFF, flight.state, flight.reason, 0
    return _FLIGHT.pack(*head, *records, 0, *target, state_ms, compass)
