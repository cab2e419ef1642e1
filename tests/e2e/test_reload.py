# SPDX-License-Identifier: GPL-3.0-or-later
"""SIGHUP: live settings, settings that need a restart, and an invalid file."""

import os
import signal
from pathlib import Path

import pytest

from service.daemon.client import ask_daemon
from tests.support.benches import Starter
from tests.support.plain_station import tcp_station, udp_station
from tests.support.programs import Program, free_port, until


class ConfiguredDaemon:
    """A daemon with a simulated Naze and a configuration file."""

    def __init__(self, start: Starter) -> None:
        self._config = start.directory / "config.toml"
        self._state = start.directory / "state"
        self.port, self.second, self.tcp = free_port(), free_port(), free_port()
        self.write(self.first_link)
        arguments = ("--config", str(self._config), "--state-dir", str(self._state))
        self._program: Program = start.program("log", "run", "--fc", "sim:", *arguments)
        until(lambda: "daemon.started" in self.log or not self._program.is_alive, "the daemon")

    @property
    def first_link(self) -> str:
        return f'"udpin:127.0.0.1:{self.port}"'

    @property
    def log(self) -> str:
        return self._program.printed

    def write(self, links: str, more: str = "") -> None:
        self._config.write_text(f"gcs = [{links}]\n{more}\n")

    def reload(self, word: str) -> None:
        """Send SIGHUP and wait for an event."""
        before = self.log.count(word)
        os.kill(self._program.process.pid, signal.SIGHUP)
        until(lambda: self.log.count(word) > before, word)

    def stations(self) -> list[str]:
        found: list[str] = ask_daemon(self._state, {"do": "status"})["ground_stations"]
        return found


@pytest.fixture
def daemon(start: Starter) -> ConfiguredDaemon:
    return ConfiguredDaemon(start)


def test_links_come_and_go_while_the_others_continue(daemon: ConfiguredDaemon) -> None:
    with udp_station(("127.0.0.1", daemon.port)) as first:
        for _ in range(2):
            first.send_heartbeat()
            first.wait_for("HEARTBEAT")
        daemon.write(f'{daemon.first_link}, "udpin:127.0.0.1:{daemon.second}", "tcpin:127.0.0.1:{daemon.tcp}"')
        daemon.reload("config.reloaded")
        with udp_station(("127.0.0.1", daemon.second)) as second, tcp_station(daemon.tcp) as third:
            for station in (second, third, second):
                station.send_heartbeat()
                station.wait_for("HEARTBEAT")
            assert len(daemon.stations()) == 3
            daemon.write(daemon.first_link)
            daemon.reload("config.reloaded")
            assert [station.split(":")[2].split()[0] for station in daemon.stations()] == [str(daemon.port)]
        first.received.clear()
        first.wait_for("HEARTBEAT")
    assert "config.needs_restart" not in daemon.log


def test_an_occupied_port_affects_only_the_link(daemon: ConfiguredDaemon) -> None:
    with udp_station(("127.0.0.1", daemon.port)) as taken:
        own_port = taken.own_address[1]
        daemon.write(f'{daemon.first_link}, "udpin:127.0.0.1:{own_port}"')
        daemon.reload("gcs.unavailable")
        taken.send_heartbeat()
        taken.wait_for("HEARTBEAT")
    # Once the port is free, the same settings open it.
    daemon.reload("config.reloaded")
    with udp_station(("127.0.0.1", own_port)) as station:
        station.send_heartbeat()
        station.wait_for("HEARTBEAT")


def test_settings_that_need_a_restart_are_named(daemon: ConfiguredDaemon) -> None:
    daemon.write(daemon.first_link, 'sysid = 7\ntakeoff_max_m = 20\nlog_level = "debug"\n[zenoh]')
    daemon.reload("config.needs_restart")
    assert '"settings": ["sysid", "takeoff_max_m", "zenoh"]' in daemon.log
    assert '"taken_over": ["log_level"]' in daemon.log
    with udp_station(("127.0.0.1", daemon.port)) as station:
        station.send_heartbeat()
        assert station.wait_for("HEARTBEAT").get_srcSystem() == 1


def test_write_access_is_not_changed_by_a_reload(daemon: ConfiguredDaemon) -> None:
    daemon.write(f'{{address = {daemon.first_link}, writers = []}}, "udpin:127.0.0.1:{daemon.second}"')
    daemon.reload("config.needs_restart")
    assert '"settings": ["gcs"]' in daemon.log
    assert '"taken_over": []' in daemon.log


def test_an_invalid_file_does_not_change_anything_and_is_explained(daemon: ConfiguredDaemon) -> None:
    daemon.write("", "sysidd = 1")
    daemon.reload("config.rejected")
    assert "gcs is empty" in daemon.log
    assert "did you mean 'sysid'?" in daemon.log
    with udp_station(("127.0.0.1", daemon.port)) as station:
        station.send_heartbeat()
        station.wait_for("HEARTBEAT")


def test_a_missing_file_does_not_change_anything(daemon: ConfiguredDaemon, start: Starter) -> None:
    Path(start.directory / "config.toml").unlink()
    daemon.reload("config.rejected")
    assert daemon.stations() == []


def test_a_pipe_in_place_of_the_file_does_not_delay_anything(daemon: ConfiguredDaemon, start: Starter) -> None:
    Path(start.directory / "config.toml").unlink()
    os.mkfifo(start.directory / "config.toml")
    daemon.reload("config.rejected")
    assert "not a regular file" in daemon.log
    assert daemon.stations() == []
