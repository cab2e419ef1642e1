# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon whose link requires a key or an address, with pymavlink as a signing ground station."""

import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.mavlink.signing import key_from_passphrase, ticks
from protocols.mission_item import MissionResult
from tests.support.benches import Starter
from tests.support.plain_station import PlainStation
from tests.support.plan import plain_plan
from tests.support.programs import Daemon, free_port, run_naze_bridge, until

PASSPHRASE = "loop the loop"  # noqa: S105 - it is only ours
KEY = key_from_passphrase(PASSPHRASE)


class SignedBench:
    """A board, its daemon with one protected UDP link, and ground stations."""

    def __init__(self, start: Starter, stack: ExitStack, guard: str) -> None:
        self._stack = stack
        port = free_port()
        link = f"udpin:127.0.0.1:{port}"
        self.address = "127.0.0.1", port
        config = f'gcs = [{{address = "{link}", {guard}}}]\n'
        self.board = start.board()
        self.daemon: Daemon = start.daemon(str(self.board.link), (link,), options=("--verbose",), config=config)
        self.daemon.wait()

    def station(self, key: bytes | None = None, host: str = "127.0.0.1", sysid: int = 250) -> PlainStation:
        connection = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        connection.bind((host, 0))
        connection.connect(self.address)
        station = self._stack.enter_context(PlainStation(connection, sysid=sysid))
        if key is not None:
            signing = station._codec.signing
            signing.secret_key, signing.sign_outgoing, signing.link_id = key, True, 5
            signing.timestamp = ticks(time.time())
        return station

    def refused(self) -> list[str]:
        found: list[str] = self.daemon.ask({"do": "status"})["refused"]
        return sorted(found)


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def keyed(start: Starter, stack: ExitStack) -> SignedBench:
    return SignedBench(start, stack, f'key_file = "{start.key_file(PASSPHRASE)}"')


def signed(station: PlainStation, message: Any) -> bytes:
    return bytes(message.pack(station._codec))


def assert_key_is_not_leaked(bench: SignedBench) -> None:
    """It is neither in the log nor in any stored file."""
    places = [path for path in bench.daemon.state_dir.rglob("*") if path.is_file()]
    assert any(path.suffix == ".tlog" and path.stat().st_size for path in places)
    for content in [bench.daemon.printed.encode(), *(path.read_bytes() for path in places)]:
        for secret in (KEY, KEY.hex().encode(), repr(KEY).encode(), PASSPHRASE.encode()):
            assert secret not in content


def test_only_the_key_allows_writing(keyed: SignedBench) -> None:
    thief, pilot, other = keyed.station(), keyed.station(KEY), keyed.station(key_from_passphrase("guessed"), sysid=251)
    plan = plain_plan(9)
    assert thief.upload(plan) is MissionResult.DENIED
    # A station with another key would drop all frames, so this one ignores signatures.
    other.send_count(9)
    until(lambda: any("another key" in line for line in keyed.refused()), "the refusal")
    assert keyed.board.records() == []
    assert pilot.upload(plan) is MissionResult.ACCEPTED
    stored = keyed.board.records()
    assert len(stored) == 9
    # Every frame the pilot accepts is signed; the other station can still read.
    assert len(pilot.download()) == len(thief.download()) == 9
    thief.send(messages.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    assert thief.wait_for("COMMAND_ACK").result == messages.MAV_RESULT_DENIED
    assert thief.clear() is MissionResult.DENIED
    pilot.send(messages.MAVLink_setup_signing_message(1, 1, KEY, 1))
    thief.send(messages.MAVLink_setup_signing_message(1, 1, KEY, 1))
    until(lambda: any("set the key" in line for line in keyed.refused()), "the refusal of SETUP_SIGNING")
    assert keyed.board.records() == stored
    shown = run_naze_bridge("status", "--state-dir", keyed.daemon.state_dir).stdout
    assert "not signed" in shown
    assert keyed.daemon.end() == 0
    refusals = [event for event in keyed.daemon.events() if event["event"] == "gcs.refused"]
    assert sorted(event["why"] for event in refusals).count("not signed") == 1
    assert {event["level"] for event in refusals} == {"warning"}
    assert keyed.daemon.has_logged("gcs.open") is None
    assert_key_is_not_leaked(keyed)


def test_replayed_frames_are_refused_even_after_a_restart(keyed: SignedBench) -> None:
    pilot = keyed.station(KEY)
    assert pilot.upload(plain_plan(5)) is MissionResult.ACCEPTED
    clear = signed(pilot, messages.MAVLink_mission_clear_all_message(1, 1))
    pilot._socket.send(clear)
    assert pilot.wait_for("MISSION_ACK").type == MissionResult.ACCEPTED
    assert pilot.upload(plain_plan(7)) is MissionResult.ACCEPTED
    stored = keyed.board.records()
    for _ in range(2):
        thief = keyed.station()
        thief._socket.send(clear)
        assert thief.wait_for("MISSION_ACK").type == MissionResult.DENIED
        assert keyed.refused() == [f"1 x its timestamp was used before (udpin:127.0.0.1:{keyed.address[1]})"]
        assert keyed.daemon.end() == 0
        keyed.daemon.process = keyed.daemon._start()
        keyed.daemon.wait()
    assert keyed.board.records() == stored
    # The pilot continues and accepts the new daemon's signed frames.
    assert pilot.upload(plain_plan(4)) is MissionResult.ACCEPTED
    assert keyed.daemon.end() == 0
    assert_key_is_not_leaked(keyed)


def test_only_listed_addresses_may_write(start: Starter, stack: ExitStack) -> None:
    bench = SignedBench(start, stack, 'writers = ["127.0.0.2/32"]')
    guest, pilot = bench.station(host="127.0.0.1"), bench.station(host="127.0.0.2")
    assert guest.upload(plain_plan(3)) is MissionResult.DENIED
    assert pilot.upload(plain_plan(6)) is MissionResult.ACCEPTED
    assert len(guest.download()) == 6
    assert bench.daemon.has_logged("gcs.open") is None


def test_an_open_link_is_reported_once_unless_it_is_of_this_machine_alone(start: Starter) -> None:
    board = start.board()
    links = [f"udpin:{host}:{free_port()}" for host in ("127.0.0.1", "0.0.0.0")]  # noqa: S104
    daemon = start.daemon(str(board.link), links)
    daemon.wait()
    opened = [event for event in daemon.events() if event["event"] == "gcs.open"]
    assert [(event["link"], event["level"]) for event in opened] == [(links[1], "warning")]
