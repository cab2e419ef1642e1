# SPDX-License-Identifier: GPL-3.0-or-later
"""Floods of requests, each enough to harm the pilot, the board or its flash."""

import socket
from contextlib import ExitStack, suppress
from typing import Any

import pytest

from protocols.mavlink.dialect import Message
from tests.support.attack_pilot import HELLO, Attack, Stranger, Watch, assert_uploads, m
from tests.support.benches import Bench, Starter
from tests.support.plain_station import udp_station
from tests.support.plan import plain_plan
from tests.support.programs import comes, free_port, until


@pytest.fixture
def bench(start: Starter) -> Bench:
    return start.bench()


def command(number: int, p1: float = 0.0, p2: float = 0.0) -> Message:
    return m.MAVLink_command_long_message(1, 1, number, 0, p1, p2, 0, 0, 0, 0, 0)


def test_texts_go_only_to_their_cause(bench: Bench, stack: ExitStack) -> None:
    """A stranger's refusals do not reach the pilot."""
    stranger = Stranger(bench.daemon.address)
    stack.callback(stranger.close)
    loud = (command(42428), command(400, 1.0), m.MAVLink_set_mode_message(1, 1, 3), command(22, 1.0))
    with udp_station(bench.daemon.address) as pilot:
        pilot.send(HELLO)
        pilot.wait_for("HEARTBEAT")
        with Watch(bench.daemon) as witness, Attack(lambda: stranger.send(*loud), per_s=125) as attack:
            assert comes(lambda: attack.count > 600)
            assert_uploads(pilot, bench.board, plain_plan(20))
        assert witness.frames[m.MAVLINK_MSG_ID_STATUSTEXT] <= 4


def test_floods_of_tcp_the_page_and_the_control_socket(start: Starter) -> None:
    """Each connection makes an expensive request and disconnects without reading the reply."""
    page, tcp = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_STREAM)
    config = start.directory / "naze-bridge.toml"
    config.write_text(f'[web]\nlisten = "127.0.0.1:{page}"\n')
    udp = free_port()
    links = [f"udpin:127.0.0.1:{udp}", f"tcpin:127.0.0.1:{tcp}"]
    bench = start.bench(gcs=links, daemon_options=("--config", str(config)))
    bench.daemon.port = udp
    until(lambda: bench.daemon.has_logged("web.listening"), "the page")
    control = str(bench.daemon.state_dir / "control.sock")
    parameters = bytes(m.MAVLink_param_request_list_message(1, 1).pack(m.MAVLink(None)))
    targets: list[tuple[int, Any, bytes]] = [
        (socket.AF_INET, ("127.0.0.1", page), b"GET /api/missions HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"),
        (socket.AF_INET, ("127.0.0.1", tcp), parameters * 50 + bytes(1000)),
        (socket.AF_UNIX, control, b'{"do": "status"}\n'),
    ]

    def ask_and_leave() -> None:
        for family, address, request in targets:
            with socket.socket(family) as connection, suppress(OSError):
                connection.settimeout(1.0)
                connection.connect(address)
                connection.sendall(request)

    with Watch(bench.daemon), Attack(ask_and_leave, per_s=100) as attack, udp_station(bench.daemon.address) as pilot:
        assert comes(lambda: attack.count > 200)
        assert_uploads(pilot, bench.board, plain_plan(20))
    assert "Traceback" not in bench.daemon.printed
