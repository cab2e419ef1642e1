# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge doctor` as used by a person and by a script, on the machine running the tests."""

import json
from pathlib import Path

import pytest

from tests.support.benches import Starter
from tests.support.programs import free_port, run_naze_bridge, until


def test_the_flight_controller_is_found(start: Starter) -> None:
    board = start.board()
    config = start.directory / "config.toml"
    config.write_text(f'fc = "{board.link}"\ngcs = ["udpin:127.0.0.1:{free_port()}"]\n')
    ended = run_naze_bridge("doctor", "--config", config, "--state-dir", start.directory)
    # A pty does not belong to the group dialout, which is reported as a problem.
    assert ended.returncode == 1
    assert f"ok       configuration: {config} can be used" in ended.stdout
    assert "problem  permission: " in ended.stdout
    assert "         -> sudo udevadm trigger " in ended.stdout


def test_a_running_daemon_is_asked_and_not_disturbed(start: Starter) -> None:
    bench = start.bench(gcs=())
    config = start.directory / "config.toml"
    config.write_text(f'fc = "{bench.board.link}"\ngcs = ["udpin:127.0.0.1:{bench.daemon.port}"]\n')
    asked = until(lambda: bench.daemon.status(), "a daemon")
    ended = run_naze_bridge("doctor", "--config", config, "--state-dir", bench.daemon.state_dir, "--json")
    found = {line["check"]: line for line in map(json.loads, ended.stdout.splitlines())}
    assert found["daemon"]["found"] == "running"
    assert asked["flight_controller"] in found["flight controller"]["found"]
    assert found["missions"]["grade"] == "ok"
    assert found["listening port"]["found"].startswith(f"UDP port {bench.daemon.port} is ")
    assert bench.daemon.has_logged("fc.lost") is None
    assert bench.daemon.has_logged("fc.port_lost") is None


def test_the_running_service_is_asked(start: Starter, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its control socket is outside its state directory."""
    runtime = start.directory / "run"
    runtime.mkdir()
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(runtime))
    start.daemon("sim:")
    monkeypatch.setenv("XDG_STATE_HOME", str(start.directory / "a home without a daemon"))
    until(lambda: run_naze_bridge("status").returncode == 0, "a reply of the service")
    assert "daemon: running" in run_naze_bridge("doctor", "--fc", "sim:").stdout


def test_without_problems_the_exit_status_is_0(tmp_path: Path) -> None:
    config = tmp_path / "config.toml"
    config.write_text(f'fc = "sim:"\ngcs = ["udpin:127.0.0.1:{free_port()}"]\n')
    ended = run_naze_bridge("doctor", "--config", config, "--state-dir", tmp_path)
    assert ended.returncode == 0, ended.stdout
    assert "ok       flight controller: Harakiri with the mission extension" in ended.stdout


def test_an_invalid_configuration_is_the_first_problem(tmp_path: Path) -> None:
    config = tmp_path / "config.toml"
    config.write_text('fc = "sim:"\nsysidd = 300\n')
    ended = run_naze_bridge("doctor", "--config", config)
    assert ended.returncode == 1
    assert ended.stdout.startswith(f"problem  configuration: {config}:2: ")
    assert "sysid" in ended.stdout
