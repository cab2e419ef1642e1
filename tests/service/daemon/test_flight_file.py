# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight memory counts only after a short stop, on the same port, and until the computer restarts."""

import re
from pathlib import Path

import pytest

from bridge.model.craft import Airframe, FlightMemory, FlightMode, Home
from service.daemon.kept_state import FLIGHT_FILE, FlightFile
from service.machine.host import Host
from tests.support.programs import until

HOME = Home(453838000, 84733000, 131.0)
FLIGHT = FlightMemory(
    "Harakiri", 100.0, 101.0, FlightMode.LOITER, HOME, ("ARM", "BARO"), (0, 7), Airframe.HEXAROTOR, (2, 1, 1), 3
)


def computer(root: Path, boot_id: str) -> Host:
    file = root / "proc/sys/kernel/random/boot_id"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"{boot_id}\n")
    return Host(root)


def leave(folder: Path, flight: FlightMemory | None, *, stopped_at: float = 200.0) -> None:
    file = FlightFile(folder, "/dev/ttyAMA0", computer(folder, "boot 1"))
    if flight is not None:
        file.save(flight)
    file.close(stopped_at)


def found(folder: Path, now: float = 210.0, port: str = "/dev/ttyAMA0", boot_id: str = "boot 1") -> FlightMemory | None:
    file = FlightFile(folder, port, computer(folder, boot_id))
    flight = file.load(now)
    file.close(now)
    return flight


def test_the_flight_is_continued(tmp_path: Path) -> None:
    for flight in (FLIGHT, FlightMemory("Harakiri", 1.0, 1.0, None, None, (), (), Airframe.QUADROTOR, None, 1)):
        leave(tmp_path, flight)
        assert found(tmp_path) == flight


def test_the_flight_is_continued_after_a_stop_and_a_later_crash(tmp_path: Path) -> None:
    leave(tmp_path, FLIGHT)
    crashed = FlightFile(tmp_path, "/dev/ttyAMA0", computer(tmp_path, "boot 1"))
    assert crashed.load(210.0) == FLIGHT
    until(lambda: '"stopped_at": null' in (tmp_path / FLIGHT_FILE).read_text(), "the file")
    assert found(tmp_path, now=900.0) == FLIGHT
    crashed.close(901.0)


def test_without_a_flight_there_is_no_file(tmp_path: Path) -> None:
    assert found(tmp_path) is None
    leave(tmp_path, FLIGHT)
    leave(tmp_path, None)
    assert found(tmp_path) == FLIGHT  # a daemon that has not heard the craft leaves it
    file = FlightFile(tmp_path, "/dev/ttyAMA0", computer(tmp_path, "boot 1"))
    file.load(210.0)
    file.save(None)
    file.close(211.0)
    assert found(tmp_path) is None


@pytest.mark.parametrize(
    "other", [{"now": 261.0}, {"now": 150.0}, {"port": "/dev/ttyUSB0"}, {"boot_id": "boot 2"}, {"boot_id": ""}], ids=str
)
def test_another_port_boot_or_time_is_another_flight(tmp_path: Path, other: dict[str, str]) -> None:
    leave(tmp_path, FLIGHT)
    assert found(tmp_path, **other) is None  # type: ignore[arg-type]


@pytest.mark.parametrize("damaged", [b"", b"{", b"[]", b"{}", b'{"flight": {}}', b"\xff\xfe"])
def test_a_damaged_file_is_ignored(tmp_path: Path, damaged: bytes) -> None:
    leave(tmp_path, FLIGHT)
    (tmp_path / FLIGHT_FILE).write_bytes(damaged)
    assert found(tmp_path) is None


@pytest.mark.parametrize(("name", "value"), [("altitude_m", "NaN"), ("altitude_m", "1e400"), ("lat_e7", "1e30")])
def test_a_place_out_of_range_is_ignored(tmp_path: Path, name: str, value: str) -> None:
    leave(tmp_path, FLIGHT)
    file = tmp_path / FLIGHT_FILE
    file.write_text(re.sub(rf'"{name}": [-.0-9]+', f'"{name}": {value}', file.read_text()))
    assert value in file.read_text()
    assert found(tmp_path) is None


def test_a_state_folder_is_not_needed(tmp_path: Path) -> None:
    file = FlightFile(None, "/dev/ttyAMA0", computer(tmp_path, "boot 1"))
    file.save(FLIGHT)
    assert file.load(1.0) == FLIGHT
    file.close(2.0)
