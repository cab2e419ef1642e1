# SPDX-License-Identifier: GPL-3.0-or-later
"""Doctor finds each injected fault and gives its remedy."""

import os
import sqlite3
from collections.abc import Iterable
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace

import pytest

from bridge.fc.states.cli import Cli
from payloads.mission_data import Json
from service.cli.doctor.checked import Checked, Grade
from service.cli.doctor.examination import examine
from service.cli.doctor.flight_controller import check_flight_controller
from service.cli.doctor.machine import check_clock, check_database, check_disk
from service.cli.doctor.network import check_ports, check_wifi
from service.cli.doctor.port import check_console, check_holder, check_modem_manager, check_permission, check_port
from service.cli.doctor.zenoh import check_zenoh
from service.daemon.client import ControlError
from service.settings import Settings, load_settings
from service.settings.addresses import AutoFc, SerialFc, parse_gcs
from service.settings.zenoh import ZenohSettings
from storage.mission_store import open_store
from tests.support.faulty_machine import PORT, FaultyMachine

GCS = [parse_gcs("udpin:0.0.0.0:14550")]
STATUS = {"flight_controller": "Harakiri", "state": "MSP", "speed_baud": 115200, "armed": False}
UDP_14550 = "   1: 00000000:38D6 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000        0 4711 2 0 0\n"
TCP_14550 = "   1: 0100007F:38D6 0100007F:1F90 01 00000000:00000000 00:00000000 00000000  1000        0 4712 1 0 0\n"
NOW = datetime(2026, 11, 21, 12, tzinfo=UTC)


@pytest.fixture
def pi(tmp_path: Path) -> FaultyMachine:
    return FaultyMachine(tmp_path / "root")


def one(found: Checked | Iterable[Checked] | None) -> Checked:
    assert found is not None
    if isinstance(found, Checked):
        return found
    (single,) = found
    return single


def assert_problem(found: Checked | Iterable[Checked] | None, named: str, remedy: str) -> None:
    checked = one(found)
    assert checked.grade is Grade.PROBLEM
    assert named in checked.found
    assert remedy in checked.remedy


def assert_note(found: Checked | Iterable[Checked] | None, named: str) -> None:
    checked = one(found)
    assert checked.grade is Grade.NOTE
    assert named in checked.found
    assert checked.remedy


def assert_ok(found: Checked | Iterable[Checked] | None, named: str) -> None:
    checked = one(found)
    assert (checked.grade, checked.remedy) == (Grade.OK, "")
    assert named in checked.found


@pytest.mark.parametrize(("passphrase", "is_weak"), [("q", True), ("k7mq2-x9tvb-3hndc-pw4ea", False)])
def test_a_key_that_can_be_guessed(pi: FaultyMachine, tmp_path: Path, passphrase: str, is_weak: bool) -> None:
    key, config = tmp_path / "gcs.key", tmp_path / "config.toml"
    key.write_text(passphrase)
    key.chmod(0o600)
    config.write_text(f'gcs = [{{address = "{GCS[0]}", key_file = "{key}"}}]')
    settings = load_settings(config, None, (), tmp_path)
    (found,) = (each for each in examine(pi, settings, no_answer, lambda: STATUS) if each.check == "key")
    if is_weak:
        assert_note(found, f"the key in {key} is weak")
        assert "setup --new-key" in found.remedy
    else:
        assert_ok(found, "required")


def no_answer() -> dict[str, object]:
    raise ControlError("no flight controller answers on /dev/serial0")


def test_a_healthy_pi_has_no_problem(pi: FaultyMachine, tmp_path: Path) -> None:
    settings = Settings(PORT, GCS, tmp_path / "state")
    found = list(examine(pi, settings, no_answer, lambda: STATUS))
    # Only root can give a file to the group dialout.
    assert {each.check for each in found if each.grade is not Grade.OK} <= {"permission", "flight controller"}
    text = " ".join(each.found for each in found)
    assert "/dev/serial0 is /dev/ttyAMA0" in text
    assert "wlan0 is 192.168.4.1; ground stations connect to port 14550" in text
    assert "Debian GNU/Linux 12" in text


# -- the port ------------------------------------------------------------------------------------------------


def test_a_missing_port_is_a_problem(pi: FaultyMachine) -> None:
    pi.path("/dev/serial0").unlink()
    pi.write("/proc/device-tree/model", "Raspberry Pi 4 Model B Rev 1.4\0")
    assert_problem(check_port(pi, PORT), "/dev/serial0 is missing", "sudo naze-bridge setup")
    pi.write("/dev/ttyUSB0")
    assert_problem(check_port(pi, PORT), "/dev/serial0 is missing", "set fc to a port that exists: /dev/ttyUSB0")
    assert_problem(check_port(pi, SerialFc("/dev/naze", None)), "/dev/naze is missing", "plug the flight controller in")
    # There are no further checks of a missing port.
    assert check_permission(pi, PORT) is check_console(pi, PORT) is check_holder(pi, PORT) is None


def test_setup_is_no_remedy_for_a_missing_uart_of_another_board(pi: FaultyMachine) -> None:
    pi.write("/proc/device-tree/model", "Orange Pi 5\0")
    found = check_port(pi, SerialFc("/dev/ttyS4", None))
    assert_problem(found, "/dev/ttyS4 is missing", "enable this UART in the board's own boot settings")
    assert "setup" not in found.remedy


def test_serial0_is_the_wrong_port_on_a_pi_5(pi: FaultyMachine) -> None:
    pi.write("/proc/device-tree/model", "Raspberry Pi 5 Model B Rev 1.0\0")
    pi.write("/dev/ttyAMA10")
    pi.path("/dev/serial0").unlink()
    pi.path("/dev/serial0").symlink_to("ttyAMA10")
    assert_problem(check_port(pi, PORT), "debug socket on a Raspberry Pi 5", 'fc = "/dev/ttyAMA0"')


def test_without_a_named_port_every_port_is_checked(pi: FaultyMachine, tmp_path: Path) -> None:
    def checked() -> dict[str, Checked]:
        return {each.check: each for each in examine(pi, Settings(AutoFc(), GCS, tmp_path), no_answer, lambda: STATUS)}

    assert_ok(checked()["flight controller"], "Harakiri")
    pi.runs(412, "/sbin/agetty", "ttyAMA0")
    assert_problem(checked()["console"], "serial-getty@ttyAMA0 runs there", "disable --now")
    pi.path("/dev/serial0").unlink()
    assert_problem(checked()["port"], "there is no serial port", "plug the flight controller")
    pi.write("/proc/device-tree/model", "Raspberry Pi 4 Model B Rev 1.4\0")
    assert_problem(checked()["port"], "/dev/serial0 is missing", "sudo naze-bridge setup")


def test_without_a_named_port_the_daemons_own_is_checked(pi: FaultyMachine, tmp_path: Path) -> None:
    """It runs on the port or simulator of its --fc."""
    pi.path("/dev/serial0").unlink()
    running = STATUS | {"where": "sim:"}
    found = {each.check: each for each in examine(pi, Settings(AutoFc(), GCS, tmp_path), lambda: running, no_answer)}
    assert_ok(found["port"], "sim:, no serial port")
    assert_ok(found["flight controller"], "Harakiri")
    searching = running | {"where": "the serial ports", "port": None, "ports_passed_over": []}
    found = {each.check: each for each in examine(pi, Settings(AutoFc(), GCS, tmp_path), lambda: searching, no_answer)}
    assert_problem(found["port"], "there is no serial port", "plug the flight controller")


def test_a_port_without_group_access_is_a_problem(pi: FaultyMachine) -> None:
    pi.path("/dev/ttyAMA0").chmod(0o600)
    assert_problem(check_permission(pi, PORT), "-rw-------", "sudo chmod g+rw /dev/ttyAMA0")


def test_a_running_login_console_is_reported_once(pi: FaultyMachine) -> None:
    pi.runs(412, "/sbin/agetty", "--keep-baud", "115200,57600", "ttyAMA0", "vt220", has_open="/dev/ttyAMA0")
    assert_problem(
        check_console(pi, PORT),
        "serial-getty@ttyAMA0 runs there",
        "sudo systemctl disable --now serial-getty@ttyAMA0.service",
    )
    # It is one fault and reported once.
    assert check_holder(pi, PORT) is None


def test_a_login_console_enabled_for_the_next_boot_is_found(pi: FaultyMachine) -> None:
    pi.write("/etc/systemd/system/getty.target.wants/serial-getty@ttyAMA0.service")
    assert_problem(check_console(pi, PORT), "is enabled", "disable --now serial-getty@ttyAMA0.service")


@pytest.mark.parametrize("word", ["console=serial0,115200", "console=ttyAMA0", "console=ttyAMA0,115200n8"])
def test_a_kernel_console_is_a_problem(pi: FaultyMachine, word: str) -> None:
    pi.write("/boot/firmware/cmdline.txt", f"{word} console=tty1 rootwait\n")
    name = word.removeprefix("console=").partition(",")[0]
    assert_problem(
        check_console(pi, PORT),
        f"{word} is in /boot/firmware/cmdline.txt",
        f"sudo sed -i 's/console={name}[^ ]* *//' /boot/firmware/cmdline.txt && sudo reboot",
    )


def test_a_kernel_console_outside_cmdline_txt_is_found(pi: FaultyMachine) -> None:
    pi.write("/proc/cmdline", "root=/dev/sda1 console=ttyAMA0,9600\n")
    # Setup has removed it from cmdline.txt already, or the firmware replaced "serial0".
    assert_problem(
        check_console(pi, PORT), "started with console=ttyAMA0,9600", "sudo naze-bridge setup && sudo reboot"
    )
    pi.path("/boot/firmware/cmdline.txt").unlink()
    assert_problem(check_console(pi, PORT), "started with console=ttyAMA0,9600", "boot loader's command line")


def test_a_console_on_another_port_is_fine(pi: FaultyMachine) -> None:
    pi.runs(412, "/sbin/agetty", "ttyAMA10")
    pi.write("/proc/cmdline", "console=ttyAMA10,115200 console=tty1")
    assert_ok(check_console(pi, PORT), "no login console on /dev/ttyAMA0")


def test_another_program_on_the_port_is_named(pi: FaultyMachine) -> None:
    pi.runs(99, "/usr/bin/gpsd", "/dev/ttyAMA0", has_open="/dev/ttyAMA0")
    assert_problem(check_holder(pi, PORT), "gpsd (pid 99) has /dev/ttyAMA0 open", "sudo kill 99")


def test_a_daemon_on_the_port_is_fine_and_left_alone(pi: FaultyMachine, tmp_path: Path) -> None:
    pi.runs(99, "/usr/lib/naze-bridge/bin/python3", "-I", "/usr/bin/naze-bridge", "run", has_open="/dev/ttyAMA0")
    assert_ok(check_holder(pi, PORT), "the daemon has /dev/ttyAMA0 open")

    def never() -> dict[str, object]:
        raise AssertionError("the port was opened although the daemon uses it")

    found = list(examine(pi, Settings(PORT, GCS, tmp_path), no_answer, never))
    assert [each.found for each in found if each.check == "flight controller"] == ["/dev/serial0 was not checked"]


def test_modem_manager_is_a_note_unless_it_ignores_the_port(pi: FaultyMachine) -> None:
    usb = SerialFc("/dev/ttyUSB0", None)
    pi.write("/dev/ttyUSB0")
    assert_ok(check_modem_manager(pi, usb), "does not run")
    pi.runs(77, "/usr/sbin/ModemManager")
    assert_note(check_modem_manager(pi, usb), "sends modem commands to /dev/ttyUSB0")
    assert_ok(check_modem_manager(pi, PORT), "probes USB only")
    pi.write("/usr/lib/udev/rules.d/60-naze-bridge.rules")
    assert_ok(check_modem_manager(pi, usb), "ignores it because of 60-naze-bridge.rules")


# -- the flight controller -----------------------------------------------------------------------------------


def test_a_silent_flight_controller_is_a_problem() -> None:
    assert_problem(check_flight_controller(PORT, None, no_answer), "no flight controller answers", "TX goes to RX")
    silent = STATUS | {"flight_controller": None, "state": "searching"}
    (_, found) = check_flight_controller(PORT, silent, None)
    assert_problem(found, "no reply on /dev/serial0: searching", "TX goes to RX")
    (_, found) = check_flight_controller(PORT, silent | {"state": "no port"}, None)
    assert_note(found, "/dev/serial0 cannot be opened yet")


def test_a_flight_controller_in_its_command_line_is_recognised() -> None:
    (_, found) = check_flight_controller(PORT, STATUS | {"flight_controller": None, "state": Cli.name}, None)
    assert_problem(found, Cli.trouble, "naze-bridge doctor` again")

    def listened() -> Json:
        raise ControlError(Cli.trouble)

    assert_problem(check_flight_controller(PORT, None, listened), Cli.trouble, "naze-bridge doctor` again")


def test_a_daemon_is_asked_and_the_port_left_alone() -> None:
    (daemon, found) = check_flight_controller(PORT, STATUS, no_answer)
    assert_ok(daemon, "running")
    assert_ok(found, "Harakiri, MSP at 115200 baud, disarmed")


# -- the network ---------------------------------------------------------------------------------------------


def test_a_wifi_without_address_or_switched_off_is_reported(pi: FaultyMachine) -> None:
    pi.addresses.clear()
    assert_note(check_wifi(pi, GCS), "wlan0 has no address")
    pi.write("/sys/class/rfkill/rfkill0/type", "wlan\n")
    pi.write("/sys/class/rfkill/rfkill0/soft", "1\n")
    assert_problem(check_wifi(pi, GCS), "switched off (rfkill)", "sudo rfkill unblock wlan")
    pi.write("/sys/class/rfkill/rfkill0/type", "bluetooth\n")
    pi.path("/sys/class/net/wlan0/wireless/x").unlink()
    pi.path("/sys/class/net/wlan0/wireless").rmdir()
    assert_note(check_wifi(pi, GCS), "no Wi-Fi card")


def test_an_occupied_network_port_is_a_problem(pi: FaultyMachine) -> None:
    pi.sockets(udp=UDP_14550)
    assert_problem(check_ports(pi, GCS), "UDP port 14550 is used by another program", "give gcs another port")
    pi.runs(55, "/usr/bin/python3", "/usr/local/bin/mavproxy.py", has_open="socket:[4711]")
    assert_problem(check_ports(pi, GCS), "python3 (pid 55)", "stop it")


def test_a_network_port_used_by_our_daemon_is_fine(pi: FaultyMachine) -> None:
    pi.sockets(udp=UDP_14550)
    pi.runs(55, "/usr/lib/naze-bridge/bin/python3", "-I", "/usr/bin/naze-bridge", "run", has_open="socket:[4711]")
    assert_ok(check_ports(pi, GCS), "the running daemon's")


def test_an_outgoing_connection_does_not_occupy_its_port(pi: FaultyMachine) -> None:
    pi.sockets(tcp=TCP_14550)
    assert_ok(check_ports(pi, [parse_gcs("tcpin:0.0.0.0:14550")]), "TCP port 14550 is free")
    pi.sockets(tcp=TCP_14550.replace(" 01 ", " 0A "))
    assert_problem(check_ports(pi, [parse_gcs("tcpin:0.0.0.0:14550")]), "TCP port 14550 is used", "stop it")


def test_zenoh_endpoints_and_files_are_checked(tmp_path: Path) -> None:
    assert_ok(check_zenoh(None), "off")
    assert_ok(check_zenoh(ZenohSettings(vehicle="naze-1")), "fleet/naze-1, opens no connections")
    nowhere = ZenohSettings(vehicle="naze-1", connect=("tcp/127.0.0.1:9",))
    assert_note(check_zenoh(nowhere), "tcp/127.0.0.1:9: no router is running there")
    (tmp_path / "zenoh.json5").write_text("{mode: ")
    broken = ZenohSettings(vehicle="naze-1", config_file=tmp_path / "zenoh.json5")
    assert_problem(check_zenoh(broken), "zenoh.json5", "config_file")


# -- the machine ---------------------------------------------------------------------------------------------


def test_a_wrong_clock_is_a_problem(pi: FaultyMachine) -> None:
    assert_ok(check_clock(pi, NOW), "set by the network")
    assert_problem(check_clock(pi, datetime(1970, 1, 1, tzinfo=UTC)), "1970-01-01", "sudo date --set")
    pi.path("/run/systemd/timesync/synchronized").unlink()
    assert_note(check_clock(pi, NOW), "not set by the network")
    pi.runs(12, "/usr/sbin/chronyd")
    assert_ok(check_clock(pi, NOW), "kept by chronyd")


def test_a_nearly_full_disk_is_a_problem(tmp_path: Path) -> None:
    state = tmp_path / "not made yet" / "state"
    assert_ok(check_disk(state, lambda _: 1 << 30), "1024 MB free")
    assert_problem(check_disk(state, lambda _: 10 << 20), "10 MB free", "remove unneeded files")


def test_an_unusable_state_directory_is_a_problem(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    assert_problem(check_disk(tmp_path / "file" / "state"), f"{tmp_path}/file is a file", "name another state_dir")
    monkeypatch.setattr(os, "access", lambda _path, _mode: False)
    assert_note(check_disk(tmp_path), "no permission to write to")
    monkeypatch.setattr(os, "statvfs", lambda _path: SimpleNamespace(f_flag=os.ST_RDONLY))
    assert_problem(check_disk(tmp_path, lambda _: 1 << 30), "on a disk that is read-only", "remount,rw")


def test_a_damaged_store_is_a_problem(tmp_path: Path) -> None:
    path = tmp_path / "missions.db"
    assert_ok(check_database(tmp_path), "none stored yet")
    open_store(path, 0).store.close()
    assert_ok(check_database(tmp_path), "0 stored")
    with closing(sqlite3.connect(path)) as database:
        database.execute("DROP TABLE missions")
    assert_problem(check_database(tmp_path), "is damaged: no such table", "restart the bridge")
    path.write_bytes(b"rubbish" * 1000)
    assert_problem(check_database(tmp_path), "is damaged: file is not a database", "restart the bridge")
    path.rename(tmp_path / "missions.db.corrupt-20261121-120000")
    none, aside = check_database(tmp_path)
    assert_ok(none, "none stored yet")
    assert_note(aside, "corrupt-20261121-120000")


def test_a_store_of_a_service_that_was_taken_over_does_no_harm(tmp_path: Path) -> None:
    """Its file names are part of a command for root, its contents of texts on root's terminal."""
    (tmp_path / "missions.db.corrupt-$(reboot)1").touch()
    assert_ok(check_database(tmp_path), "none stored yet")
    path = tmp_path / "missions.db"
    os.mkfifo(path)
    assert_problem(check_database(tmp_path), "not a regular file", "move it away")
    path.unlink()
    path.symlink_to("/etc/passwd")
    assert_problem(check_database(tmp_path), "not a regular file", "move it away")
    path.unlink()
    with closing(sqlite3.connect(path)) as database:
        database.execute('CREATE TABLE "a\x1b[2J" (a NOT NULL)')
        database.execute('CREATE VIEW missions AS SELECT 1 FROM "b\x1b[2J"')
    (found,) = check_database(tmp_path)
    assert_problem(found, "is damaged: ", "restart the bridge")
    assert found.found.isprintable()
