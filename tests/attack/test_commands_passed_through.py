# SPDX-License-Identifier: GPL-3.0-or-later
"""A stranger on an open link tries to command an autopilot that speaks MAVLink itself."""

import math
import socket
import threading
from contextlib import ExitStack
from functools import partial
from typing import Any

import pytest

from tests.support.attack_pilot import HELLO, m, sign
from tests.support.benches import Starter
from tests.support.plain_station import udp_station
from tests.support.programs import TIMEOUT_S, Daemon, free_port, happens, until

COMMANDS = {
    "forced disarm": m.MAVLink_command_long_message(1, 1, 400, 0, 0, 21196, 0, 0, 0, 0, 0),
    "reboot": m.MAVLink_command_long_message(1, 1, 246, 0, 1, 0, 0, 0, 0, 0, 0),
    "motor test": m.MAVLink_command_long_message(1, 1, 209, 0, 1, 0, 50, 5, 0, 0, 0),
    "a future command": m.MAVLink_command_int_message(1, 1, 0, 31999, 0, 0, 1, 1, 1, 1, 1, 1, 1),
    "RC override": m.MAVLink_rc_channels_override_message(1, 1, *[1900] * 8),
    "SET_MODE": m.MAVLink_set_mode_message(1, 1, 3),
    "manual control": m.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0),
    "fly to here": m.MAVLink_mission_item_int_message(1, 1, 0, 3, 16, 2, 1, 0, 0, 0, 0, 1, 1, 9.0),
    "another current item": m.MAVLink_mission_set_current_message(1, 1, 3),
    "GPS for it": m.MAVLink_gps_inject_data_message(1, 1, 4, list(range(1, 111))),
    "a script by FTP": m.MAVLink_file_transfer_protocol_message(0, 1, 1, [0, 0, 0, 6, *[1] * 247]),
    "a shell": m.MAVLink_serial_control_message(10, 0, 0, 0, 1, [13] * 70),
    "no telemetry": m.MAVLink_request_data_stream_message(1, 1, 0, 4, 0),
    "hardly any telemetry": m.MAVLink_command_long_message(1, 1, 511, 0, 30, 1e9, 0, 0, 0, 0, 0),
    "an odd interval": m.MAVLink_command_long_message(1, 1, 511, 0, 30, math.nan, 0, 0, 0, 0, 0),
}
#: Rate requests are refused without a text: clients repeat them.
RATES = {"no telemetry", "hardly any telemetry", "an odd interval"}


class Autopilot(threading.Thread):
    """An ArduPilot on TCP: sends heartbeats and records received frames."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self._server = socket.create_server(("127.0.0.1", 0))
        self.fc = f"tcp:127.0.0.1:{self._server.getsockname()[1]}"
        self._over = threading.Event()
        self.received: list[Any] = []

    def run(self) -> None:
        codec: Any = m.MAVLink(None, srcSystem=1, srcComponent=1)
        codec.robust_parsing = True
        connection, _ = self._server.accept()
        with connection:
            connection.settimeout(0.2)
            while not self._over.is_set():
                try:
                    connection.sendall(bytes(m.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3).pack(codec)))
                    self.received += codec.parse_buffer(connection.recv(4096)) or []
                except TimeoutError:
                    continue
                except OSError:  # the daemon has ended
                    return

    def kinds(self) -> list[str]:
        """The received MAVLink messages, without the bridge's earlier MSP probes."""
        return [message.get_type() for message in self.received if message.get_type() != "BAD_DATA"]

    def was_asked_for(self, parameter: str) -> bool:
        return any(getattr(message, "param_id", "") == parameter for message in self.received)

    def end(self) -> None:
        self._over.set()
        self.join(TIMEOUT_S)
        self._server.close()


@pytest.fixture
def autopilot(stack: ExitStack) -> Autopilot:
    autopilot = Autopilot()
    autopilot.start()
    stack.callback(autopilot.end)
    return autopilot


def passing(start: Starter, autopilot: Autopilot, settings: str) -> Daemon:
    link = f"udpin:127.0.0.1:{free_port()}"
    daemon = start.daemon(autopilot.fc, [link], config=settings.replace("LINK", link))
    daemon.port = int(link.rpartition(":")[2])
    daemon.wait("MAVLink")
    return daemon


def test_no_command_passes_an_open_link(start: Starter, autopilot: Autopilot) -> None:
    daemon = passing(start, autopilot, "")
    for number, (name, command) in enumerate(COMMANDS.items()):
        # Each from a host of its own: the stations of one are limited to 16 at once.
        with udp_station(daemon.address, host=f"127.0.0.{number + 2}") as stranger:
            stranger.send(HELLO)
            stranger.wait_for("HEARTBEAT")
            stranger.send(HELLO)  # shows that its address receives
            if not number:
                stranger.wait_for("HEARTBEAT")  # the autopilot's
            stranger.send(command)
            # The reply to the next request shows that it was handled.
            question = f"LAST{number}"
            stranger.send(m.MAVLink_param_request_read_message(1, 1, question.encode(), -1))
            until(partial(autopilot.was_asked_for, question), "the question behind it")
            is_command = "COMMAND" in command.get_type()
            if name not in RATES:
                assert "pass_through" in stranger.wait_for("STATUSTEXT").text
            elif is_command:
                stranger.wait_for("COMMAND_ACK")
            if is_command:
                answers = [message for message in stranger.received if message.get_type() == "COMMAND_ACK"]
                assert [answer.result for answer in answers] == [m.MAV_RESULT_DENIED]
    assert set(autopilot.kinds()) == {"HEARTBEAT", "PARAM_REQUEST_READ"}


def test_missions_and_parameters_pass_an_open_link(start: Starter, autopilot: Autopilot) -> None:
    daemon = passing(start, autopilot, "")
    allowed = (
        m.MAVLink_mission_count_message(1, 1, 3),
        m.MAVLink_mission_item_int_message(1, 1, 1, 3, 16, 0, 1, 0, 0, 0, 0, 1, 1, 9.0),
        m.MAVLink_param_set_message(1, 1, b"WPNAV_SPEED", 300, 9),
        m.MAVLink_request_data_stream_message(1, 1, 0, 4, 1),
        m.MAVLink_command_int_message(1, 1, 0, 511, 0, 0, 30, 1e6, 0, 0, 0, 0, 0),
        m.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0),
        m.MAVLink_file_transfer_protocol_message(0, 1, 1, [0, 0, 0, 4, *[1] * 247]),
    )
    with udp_station(daemon.address) as station:
        for message in allowed:
            station.send(message)
        kinds = {message.get_type() for message in allowed}
        until(lambda: kinds <= set(autopilot.kinds()), "the messages that pass an open link")


@pytest.mark.parametrize(
    "settings", ['pass_through = "everything"\n', 'gcs = [{address = "LINK", writers = ["127.0.0.1"]}]\n']
)
def test_commands_pass_with_a_list_of_writers(start: Starter, autopilot: Autopilot, settings: str) -> None:
    daemon = passing(start, autopilot, settings)
    with udp_station(daemon.address) as station:
        for message in COMMANDS.values():
            station.send(message)
        kinds = {message.get_type() for message in COMMANDS.values()}
        assert happens(lambda: kinds <= set(autopilot.kinds())), autopilot.kinds()


def test_signed_commands_pass(start: Starter, autopilot: Autopilot) -> None:
    daemon = passing(start, autopilot, f'gcs = [{{address = "LINK", key_file = "{start.key_file()}"}}]\n')
    with udp_station(daemon.address) as pilot, udp_station(daemon.address) as stranger:
        sign(pilot._codec, "loop the loop")
        stranger.send(HELLO)
        stranger.wait_for("HEARTBEAT")
        stranger.send(HELLO)  # shows that its address receives
        stranger.wait_for("HEARTBEAT")  # the autopilot's
        stranger.send(COMMANDS["forced disarm"])
        stranger.send(m.MAVLink_radio_status_message(0, 0, 0, 0, 0, 0, 0))
        assert stranger.wait_for("COMMAND_ACK").result == m.MAV_RESULT_DENIED
        pilot.send(COMMANDS["reboot"])
        until(lambda: "COMMAND_LONG" in autopilot.kinds(), "the signed command")
        assert set(autopilot.kinds()) == {"COMMAND_LONG"}
        assert [message.command for message in autopilot.received if message.get_type() == "COMMAND_LONG"] == [246]
