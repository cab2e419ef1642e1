# SPDX-License-Identifier: GPL-3.0-or-later
"""A mission list written to the board by its extension, as the bridge does it (docs/msp-mission.md), and read back."""

from collections.abc import Sequence

from protocols.mission_item import identify, pack_records
from protocols.msp.mission import (
    INFO_REQUEST,
    MissionCommand,
    WpRecord,
    decode_info,
    decode_progress,
    encode_begin,
    encode_chunk,
    encode_commit,
)
from protocols.msp.mission_flight import FLIGHT, FLIGHT_REQUEST, FlightProgress, decode_flight
from simulator.emulated_naze.console import Console

_TRIES = 3
_WRITE_S = 3.0


class UnfitImageError(Exception):
    """The image cannot fly missions; one sentence."""


def progress_of(console: Console) -> FlightProgress | None:
    """The board's own report on the mission flight, or None without one."""
    reply = console.exchange(FLIGHT_REQUEST, FLIGHT)
    return None if reply is None else decode_flight(reply)


def require_mission_flight(console: Console, name: str) -> None:
    """UnfitImageError unless the firmware stores missions and flies them."""
    if console.exchange(INFO_REQUEST, MissionCommand.INFO) is None:
        raise UnfitImageError(
            f"{name} cannot store missions: build it with the patch, firmware/apply (firmware/README.md)"
        )
    progress = progress_of(console)
    if progress is None:
        raise UnfitImageError(
            f"{name} stores missions, but does not fly them: build it from TestCode3 (firmware/README.md)"
        )
    if not progress.is_enabled:
        raise UnfitImageError(f"mission flight is off in the settings of {name}: type `set mission_fly = 1` in its CLI")


def upload(console: Console, records: Sequence[WpRecord]) -> None:
    """Write the list and check what is stored. UnfitImageError."""
    identity, packed, first = identify(records), pack_records(records), 0
    _ask(console, encode_begin(identity), MissionCommand.BEGIN)
    info = decode_info(_ask(console, INFO_REQUEST, MissionCommand.INFO))
    assert info is not None
    while first < len(records):
        chunk = encode_chunk(packed, first, info.chunk_records)
        staged = decode_progress(_ask(console, chunk.frame, MissionCommand.CHUNK))
        if staged is None:
            raise UnfitImageError(f"the board refused the mission at record {first}")
        first += chunk.count
    _ask(console, encode_commit(identity), MissionCommand.COMMIT)
    info = decode_info(_ask(console, INFO_REQUEST, MissionCommand.INFO))
    if info is None or info.stored != identity:
        raise UnfitImageError(f"the board stored another mission than was sent: {info and info.stored}, not {identity}")


def _ask(console: Console, frame: bytes, command: int) -> bytes:
    for _ in range(_TRIES):
        if (reply := console.exchange(frame, command, _WRITE_S)) is not None:
            return reply
    raise UnfitImageError(f"the board does not answer MSP command {command}")
