# SPDX-License-Identifier: GPL-3.0-or-later
# A lambda with several steps is a tuple of them.
# mypy: disable-error-code="func-returns-value"
"""Faults of a machine made of files, and the effect of doctor's actions, for tests/service/cli/test_remedies.py.

A cable or a switch is not a file: there the action sets what the board or the daemon reports afterwards.
"""

import os
import re
import shutil
import sqlite3
import subprocess
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from bridge.controllers.harakiri.profile import UNPATCHED
from bridge.fc.states.base import Closed
from bridge.fc.states.msp import Cli
from protocols.remedies import Fault
from service.cli.doctor.checked import Checked, Grade
from service.cli.doctor.command import examined
from service.cli.doctor.examination import examine
from service.cli.doctor.flight_controller import check_flight_controller
from service.cli.doctor.machine import check_clock, check_database, check_disk, check_power, check_root
from service.cli.doctor.network import check_keys, check_ports, check_wifi, check_zenoh
from service.cli.doctor.port import check_console, check_holder, check_no_port, check_permission, check_port
from service.machine.raspberry_pi import clock_trouble
from service.settings import Settings, load_settings
from service.settings.addresses import FcAddress, SerialFc, parse_fc
from service.settings.zenoh import ZenohSettings
from storage.mission_store import open_store
from tests.support.doctor import GCS, STATUS, no_answer
from tests.support.faulty_machine import PORT, FaultyMachine
from tests.support.setup_pi import Pi

NOW = datetime(2026, 11, 28, tzinfo=UTC)
UDP_14550 = "   1: 00000000:38D6 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000        0 4711 2 0 0\n"
_CLOSED = "table {} input {{\n\tchain input {{\n\t\ttype filter hook input priority filter; policy drop;\n\t}}\n}}\n"
_PI_4, _PI_5 = "Raspberry Pi 4 Model B Rev 1.4", "Raspberry Pi 5 Model B Rev 1.0"


@dataclass(slots=True)
class Faulty:
    """The place of a fault. `fc` and `status`: of the daemon, `known`: of the fault itself."""

    folder: Path
    monkeypatch: pytest.MonkeyPatch
    pi: FaultyMachine
    fc: FcAddress = PORT
    source: str = ""
    status: dict[str, Any] | None = field(default_factory=lambda: dict(STATUS))
    known: Any = None

    def reports(self, **values: Any) -> None:
        self.status = STATUS | values

    def setup(self, *words: str) -> None:
        done = Pi(self.pi.root, self.monkeypatch).setup("--yes", *words)
        assert done.exit_code == 0, done.output


@dataclass(frozen=True, slots=True)
class Trial:
    """`says`: the present text of the program. `obey`: carries out the action that the text names."""

    says: Callable[[], str]
    obey: Callable[[str], object]


Make = Callable[[Faulty], Trial]


def machine(
    make_faulty: Callable[[Faulty], object],
    check: Callable[[Faulty], Checked | Iterable[Checked] | None],
    obey: Callable[[Faulty, str], object],
) -> Make:
    def make(faulty: Faulty) -> Trial:
        assert findings(check(faulty)) == "", "the machine was faulty before"
        make_faulty(faulty)
        return Trial(lambda: findings(check(faulty)), lambda said: obey(faulty, said))

    return make


def findings(found: Checked | Iterable[Checked] | None) -> str:
    each = [] if found is None else [found] if isinstance(found, Checked) else found
    return " | ".join(f"{one.found}; {one.remedy}" for one in each if one.grade is not Grade.OK)


def reported(obey: Callable[[Faulty, str], object] = lambda faulty, _: faulty.reports(), **values: Any) -> Make:
    """A fault that a daemon's status shows."""
    return machine(lambda faulty: faulty.reports(**values), board, obey)


def board(faulty: Faulty) -> list[Checked]:
    return check_flight_controller(faulty.fc, faulty.status, None, faulty.source)


def line(faulty: Faulty) -> list[Checked]:
    """All checks of the board, with the wires and ports in front of it."""

    def running() -> dict[str, Any]:
        return no_answer() if faulty.status is None else faulty.status

    found = examine(faulty.pi, Settings(PORT, GCS, faulty.pi.root), running, no_answer)
    return [each for each in found if each.check == "flight controller"]


def port(faulty: Faulty) -> Checked:
    return check_port(faulty.pi, faulty.fc, faulty.source)


def console(faulty: Faulty) -> Checked | None:
    return check_console(faulty.pi, PORT)


def holder(faulty: Faulty) -> Checked | None:
    return check_holder(faulty.pi, faulty.fc)


def ports(faulty: Faulty) -> list[Checked]:
    rules = faulty.pi.read("/rules")
    return list(check_ports(faulty.pi, Settings(PORT, GCS), is_running=bool(faulty.known), ask=lambda *_: rules))


def disk(faulty: Faulty) -> Checked:
    return check_disk(faulty.folder / (faulty.known or "state"), lambda _: 1 << 30)


def store(faulty: Faulty) -> list[Checked]:
    return check_database(faulty.folder)


def runs(pi: FaultyMachine, unit: str, *arguments: str, has_open: str = "/dev/ttyAMA0") -> None:
    pi.runs(99, *arguments, has_open=has_open)
    pi.write("/proc/99/cgroup", f"0::{unit}\n")


def stop(faulty: Faulty, said: str) -> None:
    """The effect of a printed command. systemd starts a service again whose process was killed."""
    pi, cgroup = faulty.pi, faulty.pi.read("/proc/99/cgroup")
    if stopped := re.search(r"sudo systemctl disable --now ([\w@.-]+(?: [\w@.-]+)*)", said):
        units = {unit if "." in unit else f"{unit}.service" for unit in stopped[1].split()}
        is_started_again = pi.path("/usr/lib/systemd/system/gpsd.socket").exists() and "gpsd.socket" not in units
        if cgroup.rstrip("\n").rpartition("/")[2] in units and not is_started_again:
            shutil.rmtree(pi.path("/proc/99"))
            pi.sockets()
    elif "sudo kill 99" in said and ".service" not in cgroup:
        shutil.rmtree(pi.path("/proc/99"))


def in_a_service(faulty: Faulty) -> None:
    runs(faulty.pi, "/system.slice/mavlink-router.service", "/usr/bin/mavlink-routerd")


def by_a_socket(faulty: Faulty) -> None:
    runs(faulty.pi, "/system.slice/gpsd.service", "/usr/sbin/gpsd")
    faulty.pi.write("/usr/lib/systemd/system/gpsd.socket")


def by_hand(faulty: Faulty) -> None:
    runs(faulty.pi, "/user.slice/user-1000.slice/session-3.scope", "/usr/bin/python3", "/home/pi/my_logger.py")


def set_in_a_file(faulty: Faulty) -> None:
    faulty.pi.write("/dev/ttyUSB0")
    config = faulty.folder / "config.toml"
    config.write_text('sysid = 2\nfc = "/dev/ttyUSB7"\n')
    faulty.fc, faulty.source = SerialFc("/dev/ttyUSB7", None), f"{config}:2"


def set_in_the_file(faulty: Faulty, said: str) -> None:
    """Write the line that the action names."""
    words, file, number = re.findall(r"write (.*) in (.*):(\d+) ", said)[0]
    lines = Path(file).read_text().splitlines()
    lines[int(number) - 1] = words
    Path(file).write_text("\n".join(lines))
    faulty.fc = load_settings(Path(file), state_dir=faulty.folder).fc


def on_our_port(faulty: Faulty) -> None:
    faulty.pi.sockets(udp=UDP_14550)
    unit = "/system.slice/system-mavproxy.slice/mavproxy@1.service"
    runs(faulty.pi, unit, "/usr/bin/python3", "-m", "mavproxy", has_open="socket:[4711]")


def shell(faulty: Faulty, said: str) -> None:
    """Run the printed command on the files of the machine."""
    words = re.findall(r"; (sudo (?:sed|printf).*?) && sudo reboot|(printf .*?) && sudo reboot", said)
    command = next(filter(None, words[0])).replace("sudo ", "")
    root = faulty.pi.root
    subprocess.run(re.sub(r" (/boot\S+)", rf" {root}\1", command), shell=True, check=True)  # noqa: S602


def unlinked(faulty: Faulty, model: str = _PI_4) -> None:
    faulty.pi.path("/dev/serial0").unlink()
    faulty.pi.write("/proc/device-tree/model", f"{model}\0")


def linked(faulty: Faulty, target: str) -> None:
    faulty.pi.path("/dev/serial0").unlink(missing_ok=True)
    faulty.pi.path("/dev/serial0").symlink_to(target)


def set_fc(faulty: Faulty, said: str) -> None:
    """`sudo naze-bridge setup --fc PORT`, which writes the answer that the daemon reads."""
    (words,) = re.findall(r"sudo naze-bridge setup --fc (\S+)", said)
    faulty.setup("--fc", words)
    config = faulty.pi.root / "etc/naze-bridge/config.toml"
    config.touch()
    faulty.fc = load_settings(config, state_dir=faulty.folder).fc


def wrong_speed(faulty: Faulty) -> None:
    faulty.fc = SerialFc("/dev/ttyUSB0", 9600)
    faulty.reports(flight_controller=None, state="searching", fc_bytes_received=5000)


def right_speed(faulty: Faulty, said: str) -> None:
    set_fc(faulty, said)
    assert faulty.fc == SerialFc("/dev/ttyUSB0", None)
    faulty.reports()


def better_uart(faulty: Faulty, said: str) -> None:
    shell(faulty, said)
    if faulty.pi.read("/boot/firmware/config.txt").endswith("\n[all]\ndtoverlay=disable-bt\n"):
        linked(faulty, "ttyAMA0")
        faulty.reports()


def on_the_mini_uart(faulty: Faulty) -> None:
    faulty.pi.is_a("Raspberry Pi Zero W Rev 1.1", header="ttyS0")
    faulty.reports(flight_controller=None, state="searching")


def mounted(options: str) -> Callable[[Faulty], object]:
    return lambda faulty: faulty.pi.write("/proc/self/mountinfo", f"27 1 179:2 / / {options}\n")


def remounted(command: str) -> Callable[[Faulty, str], None]:
    def obey(faulty: Faulty, said: str) -> None:
        if command in said:
            mounted("rw,noatime - ext4 /dev/mmcblk0p2 rw")(faulty)

    return obey


def set_clock(faulty: Faulty, said: str) -> None:
    (moved,) = re.findall(r"sudo date --set '([+-]\d+) seconds'", said)
    faulty.known -= float(moved)


def clock(faulty: Faulty) -> Checked:
    return check_clock(faulty.pi, NOW, clock_trouble(faulty.known or 0.0, "the flight controller"))


def damaged_store(faulty: Faulty) -> None:
    open_store(faulty.folder / "missions.db", 0).store.close()
    with closing(sqlite3.connect(faulty.folder / "missions.db")) as database:
        database.execute("DROP TABLE missions")


def restart(faulty: Faulty, _said: str) -> None:
    """The bridge sets a damaged store aside."""
    open_store(faulty.folder / "missions.db", 0).store.close()
    for aside in faulty.folder.glob("missions.db.corrupt*"):
        aside.rename(aside.with_suffix(".seen"))


def named(faulty: Faulty, name: str) -> None:
    faulty.known = name


def forbidden(faulty: Faulty) -> None:
    faulty.monkeypatch.setattr(os, "access", lambda _path, _mode: False)
    faulty.monkeypatch.setattr(os, "geteuid", lambda: 1000)


def on_a_read_only_disk(faulty: Faulty) -> None:
    found = SimpleNamespace(f_flag=os.ST_RDONLY, f_blocks=1)
    faulty.monkeypatch.setattr(os, "statvfs", lambda _path: found)


def undone(faulty: Faulty, _said: str) -> None:
    faulty.monkeypatch.undo()


def keys(faulty: Faulty) -> list[Checked]:
    """Of a link whose daemon reads what setup wrote."""
    if faulty.known is None:
        return []
    answers = faulty.pi.root / "etc/naze-bridge/setup.toml"
    answers.write_text(answers.read_text().replace('"/etc', f'"{faulty.pi.root}/etc'))
    config = answers.with_name("config.toml")
    config.touch()
    settings = load_settings(config, state_dir=faulty.folder)
    return list(check_keys(settings.gcs, settings.access))


def set_up(faulty: Faulty, key: str = "") -> None:
    faulty.known = key
    file = faulty.folder / "key"
    file.write_text(f"{key}\n")
    faulty.setup(*(["--key-file", str(file)] if key else []))


def new_key(faulty: Faulty, said: str) -> None:
    assert "sudo naze-bridge setup --new-key" in said
    faulty.setup("--new-key")


def configuration(faulty: Faulty) -> list[Checked]:
    file = faulty.folder / "config.toml"
    if not file.exists():
        return []
    return [each for each in examined(file, "sim:", faulty.folder, no_answer) if each.check == "configuration"]


def zenoh(faulty: Faulty) -> Checked:
    return check_zenoh(ZenohSettings(vehicle="kite", config_file=faulty.known))


_SILENT: dict[str, Any] = {"flight_controller": None, "state": "searching"}
MACHINE: dict[Fault, Make] = {
    Fault.BAD_CONFIGURATION: machine(
        lambda faulty: (faulty.folder / "config.toml").write_text('sysid = "x"\n'),
        configuration,
        lambda faulty, _: (faulty.folder / "config.toml").write_text("sysid = 2\n"),
    ),
    Fault.DEBUG_SOCKET: machine(
        lambda faulty: (unlinked(faulty, _PI_5), faulty.pi.write("/dev/ttyAMA10"), linked(faulty, "ttyAMA10")),
        port,
        set_fc,
    ),
    Fault.PORT_UNPLUGGED: machine(
        lambda faulty: setattr(faulty, "fc", SerialFc("/dev/ttyUSB7", None)),
        port,
        lambda faulty, _: faulty.pi.write("/dev/ttyUSB7"),
    ),
    Fault.PORT_OFF: machine(unlinked, port, lambda faulty, _: (faulty.setup(), linked(faulty, "ttyAMA0"))),
    Fault.PORT_OFF_ELSEWHERE: machine(
        lambda faulty: (unlinked(faulty, "Orange Pi 5"), setattr(faulty, "fc", SerialFc("/dev/ttyS4", None))),
        port,
        lambda faulty, _: faulty.pi.write("/dev/ttyS4"),
    ),
    Fault.NO_PORTS: machine(
        lambda faulty: setattr(faulty, "known", True),
        lambda faulty: check_no_port() if faulty.known else port(faulty),
        lambda faulty, said: (set_fc(faulty, said.replace("NAME", "ttyAMA0")), setattr(faulty, "known", False)),
    ),
    Fault.PORT_CLOSED_TO_US: machine(
        lambda faulty: faulty.pi.path("/dev/ttyAMA0").chmod(0o600),
        lambda faulty: check_permission(faulty.pi, PORT),
        lambda faulty, said: faulty.pi.path("/dev/ttyAMA0").chmod(0o660 if "sudo udevadm trigger" in said else 0),
    ),
    Fault.CONSOLE_RUNS: machine(
        lambda faulty: runs(
            faulty.pi, "/system.slice/system-getty.slice/serial-getty@ttyAMA0.service", "/sbin/agetty", "ttyAMA0"
        ),
        console,
        stop,
    ),
    Fault.CONSOLE_IN_FILE: machine(
        lambda faulty: faulty.pi.write("/boot/firmware/cmdline.txt", "console=serial0,115200 console=tty1 rootwait\n"),
        console,
        shell,
    ),
    Fault.CONSOLE_OF_KERNEL: machine(
        lambda faulty: faulty.pi.write("/proc/cmdline", "root=/dev/sda1 console=ttyAMA0,9600\n"),
        console,
        lambda faulty, _: (
            faulty.setup(),
            faulty.pi.write("/proc/cmdline", faulty.pi.read("/boot/firmware/cmdline.txt")),
        ),
    ),
    Fault.CONSOLE_ELSEWHERE: machine(
        lambda faulty: (
            faulty.pi.path("/boot/firmware/cmdline.txt").unlink(),
            faulty.pi.write("/proc/cmdline", "root=/dev/sda1 console=ttyAMA0,9600\n"),
        ),
        console,
        lambda faulty, _: faulty.pi.write("/proc/cmdline", "root=/dev/sda1\n"),
    ),
    Fault.BLUETOOTH_PORT: machine(
        lambda faulty: (
            faulty.pi.write("/dev/ttyS0"),
            linked(faulty, "ttyS0"),
            setattr(faulty, "fc", SerialFc("/dev/ttyAMA0", None)),
            runs(faulty.pi, "/system.slice/hciuart.service", "/usr/bin/hciattach", "/dev/ttyAMA0"),
        ),
        holder,
        set_fc,
    ),
    Fault.PORT_IN_USE: machine(in_a_service, holder, stop),
    Fault.NOT_CHECKED: machine(
        lambda faulty: (in_a_service(faulty), setattr(faulty, "status", None)),
        line,
        lambda faulty, _: stop(faulty, findings(holder(faulty))),
    ),
    Fault.PORT_NOT_OPEN: reported(flight_controller=None, state=Closed.name),
    Fault.BOARD_IN_CLI: reported(flight_controller=None, state=Cli.name),
    Fault.SILENT_LINE: reported(**_SILENT),
    Fault.SILENT_NETWORK: machine(
        lambda faulty: (setattr(faulty, "fc", parse_fc("udp:10.0.0.7:14550")), faulty.reports(**_SILENT)),
        board,
        lambda faulty, said: faulty.reports() if "ping 10.0.0.7" in said and "TX" not in said else None,
    ),
    Fault.WRONG_SPEED: machine(wrong_speed, board, right_speed),
    Fault.NO_FRAMES: reported(**_SILENT, fc_bytes_received=5000),
    Fault.MINI_UART: machine(on_the_mini_uart, line, better_uart),
    Fault.UNPATCHED_BOARD: reported(flight_controller=UNPATCHED.name),
    Fault.BAD_LINE: reported(bad_checksums=5000, found_s=3600.0),
    Fault.UNSIGNED_STATION: reported(refused=["7 x not signed (udpin:0.0.0.0:14550)"]),
    Fault.LATE_STATION: reported(refused=["7 x signed over a minute behind our clock (udpin:0.0.0.0:14550)"]),
    Fault.WRONG_IDS: reported(refused=["7 x addressed to component 190 (udpin:0.0.0.0:14550)"]),
    Fault.STORE_FAILS: reported(store_trouble="disk full"),
    Fault.LATE_CLOCK: machine(lambda faulty: setattr(faulty, "known", 259200.0), clock, set_clock),
    Fault.OLD_CLOCK: machine(
        lambda faulty: setattr(faulty, "known", datetime(1970, 1, 1, tzinfo=UTC)),
        lambda faulty: check_clock(faulty.pi, faulty.known or NOW),
        lambda faulty, said: setattr(faulty, "known", NOW if "sudo date --set" in said else faulty.known),
    ),
    Fault.UNSET_CLOCK: machine(
        lambda faulty: faulty.pi.path("/run/systemd/timesync/synchronized").unlink(),
        lambda faulty: check_clock(faulty.pi, NOW),
        lambda faulty, _: faulty.pi.write("/run/systemd/timesync/synchronized"),
    ),
    Fault.ROOT_IN_MEMORY: machine(
        mounted("rw - overlay overlayroot rw,upperdir=/media/root-rw/overlay"),
        lambda faulty: check_root(faulty.pi),
        remounted("sudo raspi-config nonint disable_overlayfs && sudo reboot"),
    ),
    Fault.READ_ONLY_ROOT: machine(
        mounted("ro,noatime - ext4 /dev/mmcblk0p2 ro"),
        lambda faulty: check_root(faulty.pi),
        remounted("sudo mount -o remount,rw /"),
    ),
    Fault.STATE_DIR_IS_FILE: machine(
        lambda faulty: ((faulty.folder / "state").touch(), named(faulty, "state/bridge")),
        disk,
        lambda faulty, _: (faulty.folder / "state").rename(faulty.folder / "away"),
    ),
    Fault.STATE_DIR_NOT_KEPT: machine(
        lambda faulty: named(faulty, "/proc/naze/state"), disk, lambda faulty, _: named(faulty, "state")
    ),
    Fault.NOT_ALLOWED: machine(forbidden, disk, undone),
    Fault.READ_ONLY_DISK: machine(on_a_read_only_disk, disk, undone),
    Fault.DISK_NEARLY_FULL: machine(
        lambda faulty: setattr(faulty, "known", 10 << 20),
        lambda faulty: check_disk(faulty.folder, lambda _: faulty.known or 1 << 30),
        lambda faulty, _: setattr(faulty, "known", None),
    ),
    Fault.STORE_UNUSABLE: machine(
        lambda faulty: os.mkfifo(faulty.folder / "missions.db"),
        store,
        lambda faulty, _: ((faulty.folder / "missions.db").rename(faulty.folder / "away"), restart(faulty, "")),
    ),
    Fault.STORE_DAMAGED: machine(damaged_store, store, restart),
    Fault.STORE_KEPT_ASIDE: machine(
        lambda faulty: (faulty.folder / "missions.db.corrupt-20261121-120000").touch(),
        store,
        lambda faulty, said: Path(re.findall(r"sqlite3 (\S+) \.recover", said)[0]).rename(faulty.folder / "away"),
    ),
    Fault.LOW_VOLTAGE: machine(
        lambda faulty: setattr(faulty, "known", "throttled=0x50005\n"),
        lambda faulty: check_power(lambda *_: faulty.known or "throttled=0x0\n"),
        lambda faulty, _: setattr(faulty, "known", None),
    ),
    Fault.WIFI_BLOCKED: machine(
        lambda faulty: (
            faulty.pi.write("/sys/class/rfkill/rfkill0/type", "wlan"),
            faulty.pi.write("/sys/class/rfkill/rfkill0/soft", "1"),
        ),
        lambda faulty: check_wifi(faulty.pi, GCS),
        lambda faulty, said: faulty.pi.write(
            "/sys/class/rfkill/rfkill0/soft", str(int("sudo rfkill unblock wlan" not in said))
        ),
    ),
    Fault.NO_WIFI: machine(
        lambda faulty: shutil.rmtree(faulty.pi.path("/sys/class/net/wlan0")),
        lambda faulty: check_wifi(faulty.pi, GCS),
        lambda faulty, _: faulty.pi.write("/sys/class/net/wlan0/wireless/x"),
    ),
    Fault.NO_ADDRESS: machine(
        lambda faulty: faulty.pi.addresses.clear(),
        lambda faulty: check_wifi(faulty.pi, GCS),
        lambda faulty, _: faulty.pi.addresses.update(wlan0="192.168.4.1"),
    ),
    Fault.FIREWALL: machine(
        lambda faulty: faulty.pi.write("/rules", _CLOSED.format("inet")),
        ports,
        lambda faulty, said: faulty.pi.write(
            "/rules",
            _CLOSED.format("inet").replace(
                "drop;", "drop;\n\t\t" + re.findall(r"sudo nft insert rule inet input input (.*?);", said)[0]
            ),
        ),
    ),
    Fault.FIREWALL_UFW: machine(
        lambda faulty: faulty.pi.write("/rules", _CLOSED.format("ufw")),
        ports,
        lambda faulty, said: faulty.pi.write(
            "/rules",
            _CLOSED.format("ufw").replace(
                "drop;", "drop;\n\t\t{1} dport {0} accept".format(*re.findall(r"sudo ufw allow (\d+)/(\w+)", said)[0])
            ),
        ),
    ),
    Fault.NOT_LISTENING: machine(
        lambda faulty: setattr(faulty, "known", True),
        ports,
        lambda faulty, _: (
            faulty.pi.sockets(udp=UDP_14550),
            faulty.pi.runs(55, "/usr/bin/python3", "/usr/bin/naze-bridge", "run", has_open="socket:[4711]"),
        ),
    ),
    Fault.HIDDEN_LISTENER: machine(
        lambda faulty: (faulty.pi.sockets(udp=UDP_14550), faulty.monkeypatch.setattr(os, "geteuid", lambda: 1000)),
        ports,
        lambda faulty, _: faulty.monkeypatch.setattr(os, "geteuid", lambda: 0),
    ),
    Fault.OTHER_LISTENER: machine(on_our_port, ports, stop),
    Fault.LOST_LISTENER: machine(
        lambda faulty: (faulty.pi.sockets(udp=UDP_14550), faulty.monkeypatch.setattr(os, "geteuid", lambda: 0)),
        ports,
        lambda faulty, _: faulty.pi.sockets(),
    ),
    Fault.NO_KEY: machine(set_up, keys, new_key),
    Fault.WEAK_KEY: machine(lambda faulty: set_up(faulty, "x"), keys, new_key),
    Fault.BAD_ZENOH: machine(
        lambda faulty: setattr(faulty, "known", faulty.folder / "missing.json5"),
        zenoh,
        lambda faulty, _: setattr(faulty, "known", None),
    ),
}
#: Further causes of some faults.
OTHERS: tuple[tuple[Fault, Make], ...] = (
    (Fault.PORT_IN_USE, machine(by_a_socket, holder, stop)),
    (Fault.PORT_IN_USE, machine(by_hand, holder, stop)),
    (Fault.PORT_UNPLUGGED, machine(set_in_a_file, port, set_in_the_file)),
)
