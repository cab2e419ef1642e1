# SPDX-License-Identifier: GPL-3.0-or-later
"""`make pi-trial`: the package on a whole emulated Raspberry Pi 3, with systemd, a real device tree and its UART.

    python -m deb.pi_trial [--cuts 100] [--keep]

The board on the header's pins is the simulated Naze with the patch's compiled core, at the speed that the Pi sets; the
ground station is pymavlink, outside. The Pi is far slower than a real one, so nothing here measures time.

What QEMU cannot show: the ACT LED, radio (Wi-Fi chips, phones, Bluetooth), a real UART's timing, levels and noise, a
card that tears or forgets writes, undervoltage, heat, and the boot loader (deb/pi_machine.py plays it).
"""

import argparse
import json
import os
import random
import re
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from contextlib import AbstractContextManager, suppress
from dataclasses import replace
from http.client import HTTPException
from pathlib import Path
from threading import Event, Thread
from typing import Any

from deb.pi_machine import CACHE, PROJECT, Pi, TrialError, make_card, run
from protocols.mission_item import MissionItem, MissionResult
from service.cli.demo import ClientError, MissionClient, connect
from terminal.files import load_mission

#: Debian's packages, and a program or file of each. The last is there once the kernel runs arm64's programs with it.
_NEEDED = {
    "qemu-system-arm": "qemu-system-aarch64",
    "debootstrap": "debootstrap",
    "dosfstools": "mkfs.vfat",
    "mtools": "mcopy",
    "e2fsprogs": "mke2fs",
    "device-tree-compiler": "fdtput",
    "qemu-user-static": "/proc/sys/fs/binfmt_misc/qemu-aarch64",
}
_MISSION = PROJECT / "examples" / "naze-field.waypoints"
_HAS_BOARD = "naze-bridge status | grep -q ' MSP'"


def say(text: str) -> None:
    sys.stdout.write(f"-- {time.strftime('%H:%M:%S')} {text}\n")
    sys.stdout.flush()


def check(is_so: object, text: str) -> None:
    if not is_so:
        raise TrialError(text)


class Naze:
    """The simulated board, which keeps its power while the Pi loses it."""

    def __init__(self, folder: Path) -> None:
        self.link, self._control = folder / "naze", folder / "control"
        program, core = Path(sys.executable).parent / "naze-bridge", PROJECT / "firmware/build/libnaze_mission.so"
        words = ("sim", "--core", core, "--tele-prot", "3", "--link", self.link, "--control", self._control)
        self._process = subprocess.Popen([program, *words, "--state", folder / "flash"], stdout=subprocess.DEVNULL)
        while not self._control.exists():
            check(self._process.poll() is None, "the simulated board did not start")
            time.sleep(0.1)

    def control(self, line: str) -> str:
        with socket.socket(socket.AF_UNIX) as asking:
            asking.connect(str(self._control))
            asking.sendall(f"{line}\n".encode())
            return asking.makefile().readline()

    def stop(self) -> None:
        self._process.terminate()
        self._process.wait()


def station(pi: Pi) -> AbstractContextManager[MissionClient]:
    """A ground station, once the vehicle with its flight controller is there."""
    return connect("127.0.0.1", pi.ports["gcs"], 900)


def mission(mark: int) -> list[MissionItem]:
    """The example, recognisable by the altitude of its first waypoint."""
    return [replace(item, alt_m=mark) if item.seq == 2 else item for item in load_mission(_MISSION)]


def mark_of(items: list[MissionItem]) -> float:
    return next(item.alt_m for item in items if item.seq == 2)


def boots(pi: Pi, _naze: Naze) -> None:
    """It boots as a Pi 3, the hardened unit is ready, udev names a flight controller on USB and the header."""
    pi.start()
    check("Raspberry Pi 3 Model B" in pi.run("cat /proc/device-tree/model"), "the device tree is not a Pi 3's")
    pi.until("systemctl is-active naze-bridge")
    status = pi.run("cat /proc/$(systemctl show --property MainPID --value naze-bridge)/status")
    for line in ("NoNewPrivs:\t1", "Seccomp:\t2", "CapEff:\t0000000000000000", "CapBnd:\t0000000000000000"):
        check(line in status, f"the service is not hardened: no {line}")
    check(not re.search(r"^Uid:\s0\b", status, re.MULTILINE), "the service runs as root")
    check(pi.until("readlink /dev/naze") == "ttyUSB0\n", "udev gave the FTDI adapter no name")
    check("ID_MM_DEVICE_IGNORE=1" in pi.run("udevadm info /dev/ttyUSB0"), "ModemManager would probe the board")
    check(pi.run("readlink /dev/serial0") == "ttyAMA0\n", "the header is not the PL011's")


def is_examined(pi: Pi, _naze: Naze) -> None:
    """Doctor finds the Pi's port, and no fault from the port to the flight controller."""
    pi.until(_HAS_BOARD)
    found = {each["check"]: each for each in map(json.loads, pi.run("naze-bridge doctor --json || true").splitlines())}
    for name in ("port", "permission", "console", "other programs", "daemon", "flight controller"):
        check(name in found and found[name]["grade"] == "ok", f"doctor says of {name}: {found.get(name)}")
    off = pi.run("naze-bridge doctor --json --fc /dev/ttyAMA1 || true")
    check("enable the UART on the header" in off, f"doctor does not know the Pi: {off}")


def writes(pi: Pi, naze: Naze) -> None:
    """An upload is verified on the board, read back from it, and stored."""
    with station(pi) as gcs:
        check(gcs.write(mission(31), lambda _: None) is MissionResult.ACCEPTED, f"not accepted: {gcs.texts}")
        check(mark_of(gcs.read()) == 31, "another mission was read back")
    check("VERIFIED" in pi.run("su pilot -c 'naze-bridge missions list'"), "the stored mission is not verified")
    check(json.loads(naze.control("stats"))["records"], "the board stored nothing")


def arms(pi: Pi, naze: Naze) -> None:
    """The board arms and changes to MAVLink at 57600 baud: the Pi follows, and returns."""
    naze.control("armed 1")
    pi.until("naze-bridge status | grep -q ARMED")
    check(pi.speeds[-1] == 57600, f"the Pi's UART is at {pi.speeds[-5:]} baud")
    naze.control("armed 0")
    pi.until(_HAS_BOARD)
    check(pi.speeds[-1] == 115200, f"the Pi's UART is at {pi.speeds[-5:]} baud")
    with station(pi) as gcs:
        check(mark_of(gcs.read()) == 31, "the mission is lost after the flight")


def survives(pi: Pi, cuts: int, seed: int) -> None:
    """The plug is pulled during and after uploads, and after saves of settings: it boots, with all acknowledged."""
    chance = random.Random(seed)
    marks, sysid, lasted = [31.0], 0, {upload: 20.0, save: 20.0}
    for turn in range(cuts):
        act, mark, is_during = (upload, save)[turn % 2], 40 + turn % 200, turn % 4 == 2
        acknowledged = Event()
        work = Thread(target=act, args=(pi, mark, acknowledged), daemon=True)
        begun = time.monotonic()
        work.start()
        work.join(chance.uniform(0, lasted[act]) if is_during else None)
        lasted[act] = lasted[act] if is_during else time.monotonic() - begun
        pi.cut()
        is_kept = acknowledged.is_set()
        work.join()
        say(f"cut {turn + 1} of {cuts}: {act.__name__}, {'' if is_kept else 'not '}acknowledged")
        check(is_kept or is_during, f"{act.__name__} {mark} was not acknowledged")
        pi.start()
        pi.until(_HAS_BOARD)
        failed = pi.run("systemctl --failed --plain --no-legend")
        check(not failed, f"after cut {turn + 1} failed: {failed}")
        found = int(re.sub(r"\D", "", pi.run("grep ^sysid /etc/naze-bridge/page.toml || true")) or 0)
        if act is upload:
            marks += [mark] if is_kept else []
        else:
            sysid = mark
        check(found == sysid, f"after cut {turn + 1} the system id is {found}, not {sysid}")
        lost = {*marks[-20:]} - marks_on_pi(pi)  # the page lists the newest 50
        check(not lost, f"after cut {turn + 1} missions {lost} are lost")


def upload(pi: Pi, mark: int, acknowledged: Event) -> None:
    with suppress(ClientError, OSError), station(pi) as gcs:
        if gcs.write(mission(mark), lambda _: None) is MissionResult.ACCEPTED:
            acknowledged.set()


def save(pi: Pi, mark: int, acknowledged: Event) -> None:
    """A setting from the status page."""
    with suppress(OSError, HTTPException, TrialError):
        token = pi.run("cat /var/lib/naze-bridge/web-token").strip()
        fetch(pi, "/api/pi", token, {"action": "settings", "values": {"sysid": mark}})
        while not (job := fetch(pi, "/api/pi", token))["done"]:
            time.sleep(0.2)
        if "reply" in job:
            acknowledged.set()


def fetch(pi: Pi, path: str, token: str = "", data: object = None) -> Any:
    """A request to the status page's API, from outside."""
    headers = {"Authorization": f"Bearer {token}", "Content-Type": "application/json"}
    body = None if data is None else json.dumps(data).encode()
    request = urllib.request.Request(f"http://127.0.0.1:{pi.ports['page']}{path}", body, headers)
    with urllib.request.urlopen(request, timeout=60) as reply:  # noqa: S310  # our own address
        return json.load(reply)


def marks_on_pi(pi: Pi) -> set[float]:
    """The marks of the missions that the Pi has stored and the board has verified."""
    listed = [each["number"] for each in fetch(pi, "/api/missions")["missions"] if each["outcome"] == "VERIFIED"]
    rows = [row["left"] for number in listed for row in fetch(pi, f"/api/missions/{number}")["rows"] if row["left"]]
    return {row["alt_m"] for row in rows if row["seq"] == 2}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cuts", type=int, default=8, help="how often the plug is pulled")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true", help="use the card of the last trial")
    given = parser.parse_args()
    missing = [package for package, path in _NEEDED.items() if not (shutil.which(path) or Path(path).exists())]
    if missing or os.geteuid() != 0:
        sys.exit(f"it needs root, and: sudo apt-get install {' '.join(missing)}" if missing else "it needs root (sudo)")
    CACHE.mkdir(parents=True, exist_ok=True)
    work, image = CACHE / "work", CACHE / "pi.img"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    if not given.keep:
        say("the Pi's card, with the package")
        make_card(image)
    run("cp", "--sparse=always", image, work / "pi.img")
    run("make", "-C", PROJECT / "firmware", "sim", "APT=no")
    naze = Naze(work)
    pi = Pi(work / "pi.img", work, naze.link)
    try:
        for part in (boots, is_examined, writes, arms):
            say(str(part.__doc__))
            part(pi, naze)
        say(str(survives.__doc__))
        survives(pi, given.cuts, given.seed)
        say("passed")
    except TrialError as error:
        sys.exit(f"FAILED: {error}")
    finally:
        pi.cut()
        naze.stop()


if __name__ == "__main__":
    main()
