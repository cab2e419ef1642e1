# SPDX-License-Identifier: GPL-3.0-or-later
"""Signing timestamps survive a restart on a machine without a battery-backed clock."""

import asyncio
import json
import os
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from structlog.testing import capture_logs

from protocols.mavlink.frame import MavlinkFrame
from protocols.mavlink.signing import Check, SignedPeer, Signing, key_from_passphrase, ticks
from service.links.signing_state import FILE_NAME, SigningState
from service.settings.addresses import GcsAddress
from service.settings.write_access import WriteAccess
from tests.support.programs import until_async

#: MAVLink's signing: ticks of 10 us, and the greatest lag of a new stream, one minute.
TICKS_PER_S, TOLERANCE = 100_000, 6_000_000


KEY = key_from_passphrase("a passphrase")
NOON = 1_795_262_400.0
UDP, TCP = GcsAddress("udpin", "127.0.0.1", 14550), GcsAddress("tcpin", "127.0.0.1", 5760)


#: Lead of the stored timestamp over the one in use.
AHEAD = 10 * TICKS_PER_S


class Pi:
    """A machine: its clock and its daemon's state directory."""

    def __init__(self, folder: Path, key: bytes | None = KEY) -> None:
        self.unix_s = NOON
        access = WriteAccess(key, () if key is None else None)
        self._folder, self._access = folder, {str(UDP): access, str(TCP): access}
        self.path = folder / FILE_NAME

    def boot(self) -> SigningState:
        state = SigningState(self._folder, (UDP, TCP), self._access, lambda: self.unix_s)
        state.start()
        return state

    def stored(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(self.path.read_bytes())
        return found


def signing(state: SigningState, link: GcsAddress = UDP) -> Signing:
    found = state.links[str(link)].signing
    assert found is not None
    return found


def frame(timestamp: int, link_id: int = 7) -> MavlinkFrame:
    station = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    station.signing.secret_key, station.signing.sign_outgoing = KEY, True
    station.signing.timestamp, station.signing.link_id = timestamp, link_id
    return MavlinkFrame(bytes(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(station)))


def our_timestamp(state: SigningState) -> int:
    return int.from_bytes(SignedPeer(signing(state), 0, "gcs").sign(bytes(10))[1:7], "little")


async def until_written(pi: Pi, least: int) -> None:
    await until_async(lambda: pi.path.exists() and pi.stored()["timestamp"] >= least, "the timestamp in the file")


async def test_timestamps_continue_after_a_restart_without_a_clock(tmp_path: Path) -> None:
    pi = Pi(tmp_path)
    state = pi.boot()
    received = frame(ticks(NOON) + 5)
    assert signing(state).check(received) is Check.VALID
    last = our_timestamp(state)
    state.close()
    assert pi.stored()["timestamp"] == last
    pi.unix_s = 0.0
    state = pi.boot()
    assert our_timestamp(state) == last + 1
    assert signing(state).check(received) is Check.REPLAYED
    assert signing(state).check(frame(ticks(NOON) + 6)) is Check.VALID
    state.close()


async def test_timestamps_do_not_repeat_after_a_power_cut(tmp_path: Path) -> None:
    pi = Pi(tmp_path)
    pi.boot()
    await until_written(pi, ticks(NOON) + AHEAD)
    # The stored timestamp leads, so every one used before the power cut is below it.
    pi.unix_s = 0.0
    state = pi.boot()
    assert our_timestamp(state) > ticks(NOON) + AHEAD
    assert signing(state).check(frame(ticks(NOON) - TOLERANCE)) is Check.UNSURE
    state.close()


async def test_frames_from_before_a_power_cut_are_replays_after_it(tmp_path: Path) -> None:
    pi = Pi(tmp_path)
    state = pi.boot()
    await until_written(pi, ticks(NOON) + AHEAD)
    # Received after the last write, and so not stored.
    recorded = frame(ticks(NOON) + 9 * TICKS_PER_S)
    assert signing(state).check(recorded) is Check.VALID
    state = pi.boot()
    assert signing(state).check(recorded) is Check.UNSURE
    state.close()
    # A regular stop forgets nothing of that.
    state = pi.boot()
    assert signing(state).check(recorded) is Check.UNSURE
    assert signing(state).check(frame(ticks(NOON) + AHEAD + 2 * TICKS_PER_S)) is Check.VALID
    state.close()
    # After a regular stop the state is exact.
    state = pi.boot()
    assert signing(state).check(frame(ticks(NOON) + AHEAD + 2 * TICKS_PER_S + 1)) is Check.VALID
    state.close()


async def test_a_laptop_with_a_fast_clock_does_not_lock_others_out_after_a_power_cut(tmp_path: Path) -> None:
    pi = Pi(tmp_path)
    state = pi.boot()
    ahead = frame(ticks(NOON) + 80_000 * TICKS_PER_S, link_id=1)
    assert signing(state).check(ahead) is Check.VALID
    await until_async(lambda: pi.path.exists() and (pi.stored()["newest"] or 0) > ticks(NOON), "the file")
    pi.unix_s += 20.0
    state = pi.boot()
    assert signing(state).check(frame(ticks(pi.unix_s))) is Check.VALID
    assert signing(state).check(ahead) is Check.REPLAYED
    state.close()


async def test_a_reset_believes_the_next_ground_station_also_after_a_restart(tmp_path: Path) -> None:
    pi = Pi(tmp_path)
    pi.unix_s = NOON - 30 * 86400
    state = pi.boot()
    assert signing(state).check(frame(ticks(NOON))) is Check.EARLY
    state.reset()
    state.close()
    state = pi.boot()
    assert signing(state).check(frame(ticks(NOON))) is Check.VALID
    assert signing(state).check(frame(ticks(NOON) + 2 * 86400 * TICKS_PER_S, link_id=1)) is Check.EARLY
    state.close()
    state = pi.boot()
    assert signing(state).check(frame(ticks(NOON) + 1)) is Check.VALID
    state.close()


async def test_it_is_written_every_10_s_while_packets_are_signed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.links.signing_state._LOOK_S", 0.001)
    pi = Pi(tmp_path)
    state = pi.boot()
    await until_written(pi, 1)
    written = pi.path.stat().st_mtime_ns
    for second in range(9):
        pi.unix_s = NOON + second
        our_timestamp(state)
        await asyncio.sleep(0.003)
    assert pi.path.stat().st_mtime_ns == written
    pi.unix_s = NOON + 600
    await asyncio.sleep(0.05)
    assert pi.path.stat().st_mtime_ns == written
    our_timestamp(state)
    await until_written(pi, ticks(pi.unix_s) + AHEAD)
    state.close()


async def test_two_links_with_one_key_share_the_state(tmp_path: Path) -> None:
    state = Pi(tmp_path).boot()
    recorded = frame(ticks(NOON))
    assert signing(state, UDP).check(recorded) is Check.VALID
    assert signing(state, TCP).check(recorded) is Check.REPLAYED
    assert {access.link_id for access in state.links.values()} == {0, 1}
    state.close()


async def test_without_a_key_there_is_no_file(tmp_path: Path) -> None:
    pi = Pi(tmp_path, key=None)
    state = pi.boot()
    assert all(access.signing is None and access.may_write is not None for access in state.links.values())
    state.close()
    assert not pi.path.exists()


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{",
        "[]",
        "7",
        '{"timestamp": 5}',
        '{"timestamp": "x", "streams": {}}',
        '{"timestamp": 1, "streams": []}',
        '{"timestamp": 1, "streams": {"udpin:127.0.0.1:14550": [[1]]}}',
        "\xff",
    ],
)
async def test_a_damaged_file_is_reported_and_replaced(tmp_path: Path, content: str) -> None:
    pi = Pi(tmp_path)
    pi.path.write_bytes(content.encode("latin-1"))
    with capture_logs() as logged:
        state = pi.boot()
        assert signing(state).check(frame(ticks(NOON))) is Check.VALID
        state.close()
    assert pi.stored()["timestamp"] == ticks(NOON)
    assert [entry["event"] for entry in logged] == ["state.lost"]


async def test_an_unwritable_disk_does_not_stop_signing(tmp_path: Path) -> None:
    pi = Pi(tmp_path / "missing")
    with capture_logs() as logged:
        state = pi.boot()
        assert signing(state).check(frame(ticks(NOON))) is Check.VALID
        state.close()
    assert "state.not_stored" in [entry["event"] for entry in logged]


async def test_the_file_is_private_and_does_not_hold_a_key(tmp_path: Path) -> None:
    pi = Pi(tmp_path)
    state = pi.boot()
    signing(state).check(frame(ticks(NOON)))
    state.close()
    assert pi.path.stat().st_mode & 0o777 == 0o600
    assert KEY.hex() not in pi.path.read_text()
    assert os.listdir(tmp_path) == [FILE_NAME]
