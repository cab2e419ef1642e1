# SPDX-License-Identifier: GPL-3.0-or-later
"""Noise, malformed data and strangers on the network and the UART have no effect."""

import os
import random
import re
import select
import socket
import tty
from collections.abc import Iterator
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.msp.commands import Msp
from protocols.msp.frame import is_clean, request
from tests.support.benches import Bench, Starter
from tests.support.mission_planner import MissionPlanner
from tests.support.plain_station import PlainStation, udp_station
from tests.support.plan import judge, plain_plan, records_of
from tests.support.programs import free_port, happens, until

MEGABYTE = 1 << 20
#: The only bytes that may be sent to an unknown device are complete read requests.
PROBES = b"(%b)+" % b"|".join(re.escape(request(command)) for command in Msp)


def nonsense(seed: int) -> Iterator[bytes]:
    """Datagrams of noise, a megabyte in total; every other one begins like a MAVLink frame.

    In one of ten megabytes, 16 bits of noise happen to be a valid checksum; the seeds used have none.
    """
    chance = random.Random(seed)
    left = MEGABYTE
    while left > 0:
        data = chance.randbytes(chance.randint(1, 1400))
        left -= len(data)
        yield (chance.choice((b"\xfd", b"\xfe")) + data) if chance.random() < 0.5 else data


def damaged_frames(seed: int, count: int) -> Iterator[bytes]:
    """Mission messages for the daemon, each with one flipped bit."""
    chance = random.Random(seed)
    codec = messages.MAVLink(None, srcSystem=255, srcComponent=190)
    originals = [
        messages.MAVLink_mission_count_message(1, 1, 0, 0),
        messages.MAVLink_mission_clear_all_message(1, 1, 0),
        plain_plan(3)[2].int_message(1, 1, 2),
        messages.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", 900.0, 9),
    ]
    for _ in range(count):
        frame = bytearray(chance.choice(originals).pack(codec, force_mavlink1=chance.random() < 0.5))
        frame[chance.randrange(len(frame))] ^= 1 << chance.randrange(8)
        yield bytes(frame)


def test_a_megabyte_of_noise_on_udp_is_harmless(shared: Bench, kept: list[str]) -> None:
    status = shared.daemon.status()
    assert status is not None
    before = status["ground_stations"]
    planner = shared.mission_planner()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for number, data in enumerate((*nonsense(3), *damaged_frames(2, 2000))):
            stranger.sendto(data, shared.daemon.address)
            if number % 64 == 0:
                # Each reply proves that the daemon has read everything sent before.
                assert planner.command(messages.MAV_CMD_REQUEST_MESSAGE, 148, tries=2) is not None
    status = shared.daemon.status()
    assert status is not None
    assert len(status["ground_stations"]) == len(before) + 1
    assert shared.board.records() == kept
    plan = plain_plan(12, start=9)
    planner.write(plan)
    assert shared.board.records() == records_of(judge(plan))


def test_a_megabyte_of_noise_from_a_tcp_client_is_harmless(start: Starter) -> None:
    port = free_port(socket.SOCK_STREAM)
    bench = start.bench(gcs=[f"tcpin:127.0.0.1:{port}"])
    with socket.create_connection(("127.0.0.1", port)) as stranger:
        for data in nonsense(3):
            stranger.sendall(data)
        with PlainStation(socket.create_connection(("127.0.0.1", port))) as station:
            assert station.upload(plain_plan(12)) == 0
        # The same client is served as soon as it sends valid frames.
        station = PlainStation(stranger)
        assert station.upload(plain_plan(13)) == 0
    assert bench.board.records() == records_of(judge(plain_plan(13)))


# -- the UART ------------------------------------------------------------------------------------------------


class NoisyWire:
    """A pty between the test and the daemon, which opens `path`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.received = bytearray()
        self._near, self._far = os.openpty()
        tty.setraw(self._far)
        os.set_blocking(self._near, False)
        path.symlink_to(os.ttyname(self._far))

    def send(self, data: bytes) -> None:
        while data:
            readable, writable, _ = select.select([self._near], [self._near], [])
            if readable:
                self.received += os.read(self._near, 4096)
            if writable:
                data = data[os.write(self._near, data[:1024]) :]

    def listen(self) -> bytearray:
        while select.select([self._near], [], [], 0)[0]:
            self.received += os.read(self._near, 4096)
        return self.received

    def unplug(self) -> None:
        self.path.unlink()
        os.close(self._far)
        os.close(self._near)


def test_a_megabyte_of_noise_on_the_uart_is_harmless(start: Starter) -> None:
    wire = NoisyWire(start.directory / "naze")
    daemon = start.daemon(str(wire.path))
    daemon.wait("searching")
    chance = random.Random(4)
    with MissionPlanner(daemon.address) as planner:
        for _ in range(MEGABYTE // 4096):
            wire.send(chance.randbytes(4096))
        planner.wait_for_vehicle()
        heartbeats = planner.messages("HEARTBEAT")
    assert {heartbeat.system_status for heartbeat in heartbeats} == {messages.MAV_STATE_UNINIT}
    status = daemon.status()
    assert status is not None
    assert (status["state"], status["flight_controller"]) == ("searching", None)
    assert daemon.has_logged("fc.found") is None
    # It sent only complete, harmless probes, whatever it received.
    until(lambda: len(wire.listen()) > 100, "probes")
    assert is_clean(bytes(wire.received))
    assert re.fullmatch(PROBES, wire.received)
    # The same daemon then finds a real board.
    wire.unplug()
    board = start.board()
    daemon.wait()
    board.assert_unharmed()


# -- strangers -----------------------------------------------------------------------------------------------


def test_messages_for_others_are_ignored(shared: Bench, kept: list[str]) -> None:
    m = messages
    with udp_station(shared.daemon.address) as station:
        station.send_heartbeat()
        for system, component in ((2, 1), (1, 100), (255, 190)):
            station.send(m.MAVLink_mission_count_message(system, component, 0, 0))
            station.send(m.MAVLink_mission_count_message(system, component, 12, 0))
            station.send(plain_plan(3)[2].int_message(system, component, 0))
            station.send(m.MAVLink_mission_clear_all_message(system, component, 0))
            station.send(m.MAVLink_mission_request_list_message(system, component, 0))
            station.send(m.MAVLink_param_set_message(system, component, b"WPNAV_RADIUS", 900.0, 9))
            station.send(m.MAVLink_command_long_message(system, component, 400, 0, 1, 0, 0, 0, 0, 0, 0))
        # The reply to this valid request shows that everything above was read.
        station.send(m.MAVLink_param_request_read_message(1, 1, b"WPNAV_RADIUS", -1))
        assert station.wait_for("PARAM_VALUE").param_value == 200
        addressed = {"MISSION_ACK", "MISSION_REQUEST", "MISSION_COUNT", "COMMAND_ACK", "STATUSTEXT"}
        assert not addressed & {message.get_type() for message in station.received}
    assert shared.board.records() == kept


def test_messages_with_our_own_ids_are_ignored(shared: Bench, kept: list[str]) -> None:
    """They may be an echo of our own messages."""
    with udp_station(shared.daemon.address, sysid=1, compid=1) as echo, udp_station(shared.daemon.address) as station:
        echo.send_heartbeat()
        echo.send(messages.MAVLink_mission_clear_all_message(1, 1, 0))
        echo.send_count(12)
        station.send_heartbeat()
        station.wait_for("HEARTBEAT")
        assert station.upload(plain_plan(12, start=30)) == 0
        assert station.upload(plain_plan(12)) == 0
        assert echo.received == []
        assert happens(echo.has_data, seconds=0.1) is False
    assert shared.board.records() == kept


def test_other_vehicles_on_the_network_do_not_disturb_an_upload(shared: Bench) -> None:
    """A second vehicle sends its own mission traffic to the same port."""
    planner = shared.mission_planner()
    with udp_station(shared.daemon.address, sysid=7) as vehicle:
        m = messages
        plan = plain_plan(30, start=60)
        planner.write_begun(plan, 10)
        vehicle.send(m.MAVLink_heartbeat_message(2, 3, 0x81, 0, 4, 3))
        vehicle.send(m.MAVLink_mission_ack_message(255, 190, 5, 0))
        vehicle.send(m.MAVLink_mission_request_message(255, 190, 3, 0))
        vehicle.send(m.MAVLink_mission_count_message(255, 190, 44, 0))
        planner.write_rest(plan, 10)
    assert shared.board.records() == records_of(judge(plan))
    assert not planner.armed
