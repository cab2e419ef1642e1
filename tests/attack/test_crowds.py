# SPDX-License-Identifier: GPL-3.0-or-later
"""A crowd of strangers on the Pi's own network, or one that impersonates the pilot."""

import itertools
import socket
from contextlib import ExitStack

from protocols.mavlink.dialect import Message
from protocols.mission_item import MissionResult
from tests.support.attack_pilot import HELLO, Attack, Stranger, Watch, assert_uploads, has_read_all, m, sign
from tests.support.benches import Bench, Starter
from tests.support.plain_station import PlainStation, tcp_station, udp_station
from tests.support.plan import plain_plan
from tests.support.programs import free_port, happens, until

PASSPHRASE = "loop the loop"  # noqa: S105 - it is only ours
#: More than the stations that are served.
CROWD = 48


def guarded(start: Starter) -> Bench:
    link = f"udpin:127.0.0.1:{free_port()}"
    bench = start.bench(gcs=[link], config=f'gcs = [{{address = "{link}", key_file = "{start.key_file()}"}}]\n')
    bench.daemon.port = int(link.rpartition(":")[2])
    return bench


def crowd(
    bench: Bench, stack: ExitStack, *messages: Message, size: int = CROWD, per_s: float = 30, at_once: int = 1
) -> Attack:
    """Strangers, each with its own address and ids, that send heartbeats and other messages from time to time.

    `per_s` times a second, the next `at_once` of them.
    """
    strangers = [
        Stranger(bench.daemon.address, f"127.0.{1 + row}.{1 + number}", sysid=1 + number, compid=190 + row)
        for row, number in (divmod(each, 200) for each in range(size))
    ]
    for stranger in strangers:
        stack.callback(stranger.close)
    turns = itertools.cycle(strangers)

    def send() -> None:
        happens(lambda: has_read_all(bench.daemon.address[1]))
        for stranger in itertools.islice(turns, at_once):
            stranger.send(*messages or (HELLO,))

    return Attack(send, per_s=per_s)


def receives_heartbeats(station: PlainStation, count: int) -> bool:
    """Send a heartbeat every second until `count` heartbeats have been received."""
    for _ in range(60):
        station.send(HELLO)
        count -= len([message for message in station._messages(1.0) if message.get_type() == "HEARTBEAT"])
        if count <= 0:
            return True
    return False


def test_a_crowd_does_not_displace_a_pilot(start: Starter, stack: ExitStack) -> None:
    """Three hundred stations, each of which sends heartbeats and asks for everything."""
    bench = start.bench()

    def connected() -> list[str]:
        found: list[str] = bench.daemon.ask({"do": "status"})["ground_stations"]
        return found

    def is_full() -> bool:
        pilot.send(HELLO)  # a station that falls silent makes room
        return len(connected()) == 32

    with udp_station(bench.daemon.address, sysid=253) as pilot:
        assert receives_heartbeats(pilot, 3)
        streams = m.MAVLink_request_data_stream_message(1, 1, 0, 50, 1)
        with Watch(bench.daemon), crowd(bench, stack, HELLO, streams, size=300, per_s=10, at_once=10):
            until(is_full, "the crowd")
            assert receives_heartbeats(pilot, 3)
            assert any(str(pilot.own_address[1]) in station for station in connected())
            assert_uploads(pilot, bench.board, plain_plan(20))


def test_strangers_on_a_keyed_link_do_not_displace_the_pilot(start: Starter, stack: ExitStack) -> None:
    bench = guarded(start)
    with crowd(bench, stack) as attack:
        assert happens(lambda: attack.count > 2 * CROWD)
        with udp_station(bench.daemon.address) as pilot:
            # Like Mission Planner, sign once a signed heartbeat was received.
            assert receives_heartbeats(pilot, 2)
            sign(pilot._codec, PASSPHRASE)
            assert_uploads(pilot, bench.board, plain_plan(30))
            listener = stack.enter_context(udp_station(bench.daemon.address))
            assert receives_heartbeats(listener, 2)
            assert listener.upload(plain_plan(3)) is MissionResult.DENIED
            listener.send(m.MAVLink_command_long_message(1, 1, 511, 0, 30, 10000, 0, 0, 0, 0, 0))
            assert listener.wait_for("COMMAND_ACK").result == m.MAV_RESULT_DENIED
    # Texts to the pilot do not go to strangers, even if there is room.
    with udp_station(bench.daemon.address) as pilot, udp_station(bench.daemon.address) as listener:
        assert receives_heartbeats(listener, 2)
        sign(pilot._codec, PASSPHRASE)
        assert_uploads(pilot, bench.board, plain_plan(10))
        assert receives_heartbeats(listener, 2)
        assert "STATUSTEXT" not in {message.get_type() for message in listener.received}


def test_an_unsigned_frame_does_not_change_the_pilots_rates(start: Starter, stack: ExitStack) -> None:
    """Forged: unsigned, from the pilot's own address."""
    bench = guarded(start)
    with udp_station(bench.daemon.address) as pilot:
        sign(pilot._codec, PASSPHRASE)
        pilot.send(HELLO)
        pilot.wait_for("ATTITUDE")
        forger = m.MAVLink(None, srcSystem=250, srcComponent=191)
        for message in (
            m.MAVLink_request_data_stream_message(1, 1, 0, 4, 0),
            m.MAVLink_command_long_message(1, 1, 511, 0, 30, -1, 0, 0, 0, 0, 0),
            m.MAVLink_param_request_list_message(1, 1),
        ):
            pilot._socket.send(bytes(message.pack(forger)))
        until(lambda: "3 x not signed" in str(bench.daemon.ask({"do": "status"})["refused"]), "the refusals")
        pilot.received.clear()
        for _ in range(20):
            pilot.wait_for("ATTITUDE")
        assert "PARAM_VALUE" not in {message.get_type() for message in pilot.received}


def test_idle_connections_do_not_lock_a_pilot_out(start: Starter, stack: ExitStack) -> None:
    port = free_port(socket.SOCK_STREAM)
    bench = start.bench(gcs=[f"tcpin:127.0.0.1:{port}"])
    with tcp_station(port) as first:
        first.send(HELLO)
        first.wait_for("HEARTBEAT")
        for _ in range(CROWD):
            idle = stack.enter_context(socket.create_connection(("127.0.0.1", port)))
            idle.settimeout(5)
        with tcp_station(port) as pilot:
            pilot.send(HELLO)
            pilot.wait_for("HEARTBEAT")
            assert_uploads(pilot, bench.board, plain_plan(15))
        # The first one is still connected.
        assert_uploads(first, bench.board, plain_plan(9))


def test_slow_uploads_and_forged_addresses_do_not_delay_the_pilot(start: Starter, stack: ExitStack) -> None:
    """Twenty stations announce a list and send one item; 600 addresses send a heartbeat, 100 a second."""
    bench = start.bench()
    with udp_station(bench.daemon.address) as pilot:
        pilot.send(HELLO)
        pilot.wait_for("HEARTBEAT")
        slow = [Stranger(bench.daemon.address, f"127.0.2.{number}", sysid=number) for number in range(1, 21)]
        many = [Stranger(bench.daemon.address, f"127.0.1.{number % 200 + 1}") for number in range(600)]
        for stranger in (*slow, *many):
            stack.callback(stranger.close)
        turns = itertools.cycle(many)
        for stranger in slow:
            stranger.send(m.MAVLink_mission_count_message(1, 1, 100))
        with Watch(bench.daemon) as monitor, Attack(lambda: next(turns).send(HELLO), per_s=100) as attack:
            assert happens(lambda: attack.count > 100)
            for stranger in slow:
                stranger.send(m.MAVLink_mission_item_int_message(1, 1, 0, 3, 16, 0, 1, 0, 0, 0, 0, 1, 1, 9.0))
            assert_uploads(pilot, bench.board, plain_plan(30))
            until(lambda: len(monitor.gaps_s) >= 4, "heartbeats")
