# SPDX-License-Identifier: GPL-3.0-or-later
"""`make pi-trial`: the package on a whole emulated Raspberry Pi 3, with systemd, a real device tree and its UARTs.

    python -m deb.pi_trial [--pulls 100] [--boots 10] [PART ...]

The board on the header's pins is the simulated Naze with the patch's compiled core, at the speed that the Pi sets; the
ground station is pymavlink, outside. The Pi is far slower than a real one, so nothing here measures time.

A pull of the plug is a copy of the card, taken while QEMU is stopped at a random moment. QEMU writes a sector when the
Pi does and keeps none back, so the copy is what killing QEMU at that moment leaves: all that was in the Pi's memory is
lost (the page cache, what the journal and SQLite have not written yet). The copy is examined here: journal replay, a
check of the file system, the mission store, the settings and dpkg, against what the Pi had acknowledged before the
moment. Some copies are then started. So one boot is enough for a hundred pulls.

What QEMU cannot show: a card that confirms writes and loses, reorders or tears them, or wears out; radio (Wi-Fi chips,
phones: mac80211_hwsim plays both; Bluetooth); the ACT LED, a real UART's timing, levels and noise, undervoltage, heat,
and the boot loader (deb/pi_machine.py plays it).
"""

import argparse
import json
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import tomllib
import urllib.request
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, replace
from functools import partial
from http.client import HTTPException
from importlib.metadata import version
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Event, Thread
from typing import Any
from urllib.error import HTTPError

from deb.build import target
from deb.pi_machine import BOOT_FILES, CACHE, NEWER, NEWER_PACKAGE, PROJECT, Card, Pi, TrialError, make_roots, run
from payloads.mission_data import mission_items
from protocols.mission_item import MissionItem, MissionResult
from service.cli.card import FOLDER, RESULT
from service.cli.demo import ClientError, MissionClient, connect
from storage.mission_store import VERIFIED, open_store
from terminal.files import load_mission

#: Debian's packages, and a program or file of each. The last is there once the kernel runs arm64's programs with it; in
#: a container first: mount -t binfmt_misc binfmt_misc /proc/sys/fs/binfmt_misc.
_NEEDED = {
    "qemu-system-arm": "qemu-system-aarch64",
    "debootstrap": "debootstrap",
    "dosfstools": "mkfs.vfat",
    "mtools": "mcopy",
    "e2fsprogs": "mke2fs",
    "device-tree-compiler": "fdtput",
    "--reinstall qemu-user-static": "/proc/sys/fs/binfmt_misc/qemu-aarch64",
}
_PROGRAM = Path(sys.executable).parent / "naze-bridge"
_MISSION = PROJECT / "examples" / "naze-field.waypoints"
_HAS_BOARD = "naze-bridge status | grep -q ' MSP'"
_SSID, _PASSWORD = "kite", "long-enough"
_SETUP = f"naze-bridge setup --yes --keep-hotspot --hotspot {_SSID} --password-file /root/password --country DE"
_HAS_HOTSPOT = "nmcli --get-values GENERAL.STATE connection show naze-bridge-hotspot | grep activated"
_FIRST_MARK = 31.0
#: Of the pilot's acts, every tenth is a save, which restarts the bridge.
_SAVED = 10


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
        core = PROJECT / "firmware/build/libnaze_mission.so"
        words = ("sim", "--core", core, "--tele-prot", "3", "--link", self.link, "--control", self._control)
        self._process = subprocess.Popen([_PROGRAM, *words, "--state", folder / "flash"], stdout=subprocess.DEVNULL)
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


def mission(mark: float) -> list[MissionItem]:
    """The example, recognisable by the altitude of its first waypoint."""
    return [replace(item, alt_m=mark) if item.seq == 2 else item for item in load_mission(_MISSION)]


def mark_of(items: list[MissionItem]) -> float:
    return next(item.alt_m for item in items if item.seq == 2)


def boots(pi: Pi, _naze: Naze) -> None:
    """It boots as a Pi 3, the hardened unit is ready, udev names a flight controller on USB and the header."""
    pl011 = {"config.txt": "[all]\nenable_uart=1\ndtoverlay=disable-bt\n"}
    words = BOOT_FILES["cmdline.txt"].replace("console=serial0,115200 ", "")
    pi.start(Card.written(CACHE / "work" / "pi.img", CACHE / "ready", BOOT_FILES | pl011 | {"cmdline.txt": words}))
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
        check(gcs.write(mission(_FIRST_MARK), lambda _: None) is MissionResult.ACCEPTED, f"not accepted: {gcs.texts}")
        check(mark_of(gcs.read()) == _FIRST_MARK, "another mission was read back")
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
        check(mark_of(gcs.read()) == _FIRST_MARK, "the mission is lost after the flight")


@dataclass(frozen=True)
class Done:
    """What the pilot was told: missions that the vehicle has accepted, and the system ids that may be saved."""

    marks: frozenset[float] = frozenset({_FIRST_MARK})
    sysids: frozenset[int] = frozenset({1})
    #: What goes on now.
    act: str = "nothing"


class Pilot(Thread):
    """Sends missions and saves settings, one after the other, until `is_over` is set."""

    def __init__(self, pi: Pi, done: Done) -> None:
        super().__init__(daemon=True)
        self._pi, self.done = pi, done
        self.is_over = Event()

    def run(self) -> None:
        for turn in count(1):
            if self.is_over.is_set():
                break
            with suppress(ClientError, OSError, HTTPException, TrialError):
                if turn % _SAVED:
                    self._upload(_FIRST_MARK + turn / 4)
                else:
                    self._save(2 + turn // _SAVED)

    def _upload(self, mark: float) -> None:
        with station(self._pi) as gcs:
            self.done = replace(self.done, act=f"upload of {mark}")
            result = gcs.write(mission(mark), lambda _: None)
        marks = {mark} if result is MissionResult.ACCEPTED else set()
        self.done = replace(self.done, marks=self.done.marks | marks, act="connecting")

    def _save(self, sysid: int) -> None:
        """A setting from the status page."""
        token = token_of(self._pi)
        self.done = replace(self.done, sysids=self.done.sysids | {sysid}, act=f"save of {sysid}")
        ask_page(self._pi, token, {"action": "settings", "values": {"sysid": sysid}})
        self.done = replace(self.done, sysids=frozenset({sysid}), act="connecting")


class Plug:
    """Pulls the plug: copies of the card at random moments, each checked. Some are kept, to be started from later."""

    def __init__(self, pi: Pi, seed: int, kept: int) -> None:
        self._pi, self._kept = pi, kept
        self.chance = random.Random(seed)
        self.done = Done()
        self.pulls = 0
        self.cards: list[tuple[Card, Done]] = []

    def pull(self, told: Callable[[], Done]) -> None:
        self.pulls += 1
        done, card = told(), Card(CACHE / "work" / f"pulled-{self.pulls}.img")
        self._pi.copy_card(card.image)
        say(f"pull {self.pulls}, {done.act}: {check_card(card, done)}")
        if self.pulls % self._kept:
            card.image.unlink()
        else:
            self.cards.append((card, done))


def check_card(card: Card, done: Done) -> str:
    """Compare a card with what was acknowledged before the plug was pulled; TrialError if something is lost."""
    with card.mounted() as root:
        opened = open_store(root / "var/lib/private/naze-bridge/missions.db", time.time())
        with opened.store as store:
            check(opened.set_aside is None, f"the mission store is damaged: {opened.set_aside}")
            found = store.list(10_000)
            kept = [store.get(each.number) for each in found if each.outcome == VERIFIED]
        lost = done.marks - {mark_of(mission_items(each.received.items)) for each in kept if each is not None}
        check(not lost, f"{done.act}: missions {lost} are lost: {found}")
        page = root / "etc/naze-bridge/page.toml"
        sysid = tomllib.loads(page.read_text())["sysid"] if page.exists() else 1
        check(sysid in done.sysids, f"{done.act}: the system id is {sysid}, not of {done.sysids}")
        run(_PROGRAM, "run", "--check-config", "--config", page.with_name("config.toml"))
        status = ("--showformat", "${db:Status-Status} ${Package}\n", "--show")
        packages = run("dpkg-query", "--admindir", root / "var/lib/dpkg", *status).splitlines()
        odd = [line for line in packages if not line.startswith("installed ")]
        check(not odd or "update" in done.act, f"{done.act}: {odd}")
    rest = [each.outcome for each in found if each.outcome != VERIFIED]
    return f"{len(done.marks)} acknowledged, {len(kept)} verified, others {rest}, id {sysid}, {odd or 'dpkg in order'}"


def survives(pi: Pi, plug: Plug, pulls: int) -> None:
    """The plug is pulled during uploads and saves of settings: the card has all that was acknowledged."""
    pilot = Pilot(pi, plug.done)
    pilot.start()
    for turn in range(pulls):
        if turn % 3:
            while "upload" not in pilot.done.act:  # the shortest of the acts
                time.sleep(0.01)
        time.sleep(plug.chance.uniform(0, 1.5 if turn % 3 else 6))
        plug.pull(lambda: pilot.done)
    pilot.is_over.set()
    pilot.join()
    plug.done = pilot.done


_IS_UPDATED = "[ ! -e /var/lib/naze-bridge-helper/installing.deb ]"
_PIECE = 256 << 10


def updates(pi: Pi, plug: Plug, pulls: int) -> None:
    """The plug is pulled during the page's update and the way back: missions and settings are kept."""
    token = token_of(pi)
    try:
        send_package(pi, token)
    except HTTPError:  # the bridge has restarted for the last save: it asks for the first piece again
        send_package(pi, token)
    for action, wanted in (("install", NEWER), ("downgrade", "0.")):
        said = ask_page(pi, token, {"action": action})
        check(said["version"].startswith(wanted), f"the page announces another version: {said}")
        for _ in range(pulls // 2):
            time.sleep(plug.chance.uniform(0, 40))
            plug.pull(partial(replace, plug.done, act=f"update to {wanted}"))
        pi.until(f"grep '^Version {wanted}.* was installed' /var/lib/naze-bridge-helper/outcome", 3600)
        found = pi.run("dpkg-query --showformat '${Version}' --show naze-bridge")
        check(found.startswith(wanted), f"version {found} instead of {wanted}")
        pi.until(_HAS_BOARD)
        mark = max(plug.done.marks) + 1
        with station(pi) as gcs:
            check(gcs.write(mission(mark), lambda _: None) is MissionResult.ACCEPTED, f"not accepted: {gcs.texts}")
        plug.done = replace(plug.done, marks=plug.done.marks | {mark})
        plug.pull(lambda: plug.done)


def send_package(pi: Pi, token: str) -> None:
    package = NEWER_PACKAGE.read_bytes()
    for start in range(0, len(package), _PIECE):
        fetch(pi, f"/api/pi/package?start={start}", token, package[start : start + _PIECE])


def start_again(pi: Pi, plug: Plug) -> None:
    """The kept cards boot, and still have all that was acknowledged."""
    pi.cut()
    for card, done in plug.cards:
        pi.start(card)
        pi.until(f"{_IS_UPDATED} && {_HAS_BOARD} && {_HAS_HOTSPOT}", 3600)
        failed = pi.run("systemctl --failed --plain --no-legend; dpkg --audit")
        check(not failed, f"{card.image.stem}: failed: {failed}")
        pi.cut()
        say(f"{card.image.stem}, {done.act}, boots: {check_card(card, done)}")
        card.image.unlink()


#: What Raspberry Pi Imager leaves on the boot partition for the first start: of bookworm, and of trixie.
_SYSTEMD_RUN = "systemd.run=/boot/firmware/firstrun.sh systemd.run_success_action=reboot"
_FIRST_START = {
    "firstrun": {
        "cmdline.txt": f"{BOOT_FILES['cmdline.txt'].strip()} {_SYSTEMD_RUN} systemd.unit=kernel-command-line.target\n",
        "firstrun.sh": "#!/bin/bash\n\nset +e\n\nrm -f /boot/firmware/firstrun.sh\n"
        "sed -i 's| systemd.run.*||g' /boot/firmware/cmdline.txt\nexit 0\n",
    },
    "cloud-init": {
        "meta-data": "instance-id: rpi-imager-1764288000000\n",
        "user-data": "#cloud-config\nhostname: pi\nmanage_etc_hosts: true\n"
        "users:\n- name: kim\n  groups: users,dialout,netdev\n  shell: /bin/bash\n  lock_passwd: true\n"
        "runcmd:\n- [touch, /root/by-imager]\n",
    },
}
_NO_HOTSPOT = "opening the hotspot failed"
_IS_SET_UP = "naze-bridge is set up."
#: At most; an emulated Pi takes about 15 minutes.
_FIRST_START_S = 5400


def starts_by_firstrun(pi: Pi, _naze: Naze) -> None:
    """A card of Imager and `naze-bridge card` sets itself up by firstrun.sh, once the hotspot can be opened."""
    sets_itself_up(pi, prepared_card("firstrun", has_radio=False), has_radio=False)


def starts_by_cloud_init(pi: Pi, _naze: Naze) -> None:
    """The same by cloud-init, where the Imager's own commands run, too. A name given later is kept, too."""
    card = prepared_card("cloud-init", has_radio=False)
    sets_itself_up(pi, card, has_radio=False)
    check("by-imager" in pi.run("ls /root"), "the Imager's own commands did not run")
    pi.run("naze-bridge setup --yes --name heron || true; sync")  # 1: doctor's, for the open link
    pi.cut()
    pi.start(card)
    pi.until("[ -e /run/cloud-init/result.json ]")
    named = pi.run("cat /etc/hostname; hostname; grep -c heron /etc/hosts")
    check(named == "heron\nheron\n1\n", f"cloud-init took back the name: {named}")


def repeats_a_cut_start(pi: Pi, plug: Plug) -> None:
    """The plug is pulled while the first start installs the package: the next start repeats it."""
    pi.cut()
    card = prepared_card("firstrun", has_radio=True)
    until_told(pi, card, "Now: installing the package")
    pi.until("grep '^Unpacking naze-bridge' /var/log/naze-bridge-card.log")
    time.sleep(plug.chance.uniform(0, 20))
    pi.cut()
    with card.mounted() as root:
        cut = run("dpkg-query", "--admindir", root / "var/lib/dpkg", "--show", "--showformat", "${Package} ${Status}\n")
        said = [line for line in cut.splitlines() if not line.endswith(" ok installed")]
    check("Now: installing the package" in card.read(RESULT), f"the plug was pulled too late: {card.read(RESULT)}")
    say(f"pulled in the first start; dpkg: {said or 'in order'}")
    sets_itself_up(pi, card, has_radio=True)


def sets_itself_up(pi: Pi, card: Card, *, has_radio: bool) -> None:
    """Start a prepared card until it is set up, and once more. A missing radio is switched on when it is waited for."""
    pi.cut()
    if not has_radio:
        told = until_told(pi, card, _IS_SET_UP, _NO_HOTSPOT)
        check(_NO_HOTSPOT in told, "the first start succeeded without a hotspot")
        check(card.read(f"{FOLDER}/password"), "the card cannot try again: its password is gone")
        pi.until("nmcli radio wifi on")
    until_told(pi, card, _IS_SET_UP)
    until_off(pi)
    said = card.read(RESULT)
    say(f"{card.image.stem}: {said.splitlines()[0]}")
    check(_SSID in said and "http://10.42.0.1:8080/" in said, f"the result does not say what to do: {said}")
    for folder in (FOLDER, f"{FOLDER}.done"):
        check(not card.read(f"{folder}/password"), "the hotspot's password is left on the boot partition")
    pi.start(card)
    pi.until(f"{_HAS_HOTSPOT} && {_HAS_BOARD}", 1800)
    check(pi.run("cat /etc/hostname") == "kite\n", "the Pi has another name")
    check(pi.run("readlink /dev/serial0") == "ttyS0\n", "the header is not the mini-UART's")
    left = pi.run("ls /etc/systemd/system; dpkg --audit; systemctl --failed --plain --no-legend")
    check("naze-bridge-card" not in left and "failed" not in left, f"not set up, or not cleaned up: {left}")


def prepared_card(system: str, *, has_radio: bool) -> Card:
    """A card as Raspberry Pi Imager and `naze-bridge card` leave it."""
    card = Card.written(CACHE / "work" / f"{system}.img", CACHE / "bare", BOOT_FILES | _FIRST_START[system])
    with TemporaryDirectory() as folder, TemporaryDirectory() as secret:
        run("mcopy", "-s", "-n", "-i", card.fat, "::/*", folder)
        password = Path(secret, "password")
        password.write_text(f"{_PASSWORD}\n")
        options = ("--hotspot", _SSID, "--password-file", password, "--country", "DE", "--name", "kite")
        run(_PROGRAM, "card", folder, "--package", CACHE / "naze-bridge.deb", *options)
        run("mcopy", "-s", "-o", "-i", card.fat, *Path(folder).iterdir(), "::/")
    with card.mounted() as root:
        # As the images: until raspi-config has set the country, the radio is off. This Debian has no raspi-config.
        state = root / "var/lib/NetworkManager/NetworkManager.state"
        state.parent.mkdir(exist_ok=True)
        state.write_text(f"[main]\nWirelessEnabled={str(has_radio).lower()}\n")
        if system == "cloud-init":
            (root / "etc/cloud/cloud-init.disabled").unlink()
    return card


def until_told(pi: Pi, card: Card, *texts: str) -> str:
    """Keep the Pi on until the card's result has one of the texts. Returns the result."""
    end = time.monotonic() + _FIRST_START_S
    while not any(text in (said := card.read(RESULT)) for text in texts):
        check(time.monotonic() < end, f"not told after {_FIRST_START_S} s: {texts}; the card says: {said}")
        if pi.is_stuck():  # QEMU's Pi sometimes hangs in its restart
            say("the Pi hangs: the plug is pulled")
            pi.cut()
        if pi.is_off():
            pi.power(card)
        time.sleep(1)
    return said


def until_off(pi: Pi) -> None:
    end = time.monotonic() + 900
    while not pi.is_off():
        check(time.monotonic() < end, "the Pi does not restart")
        time.sleep(1)


def leaves_the_mini_uart(pi: Pi, naze: Naze) -> None:
    """Doctor names the mini-UART of a silent board, and the command that it gives moves the header to the PL011."""
    pi.cut()
    words = BOOT_FILES["cmdline.txt"].replace("console=serial0,115200 ", "")
    on = {"config.txt": "[all]\nenable_uart=1\n", "cmdline.txt": words}
    card = Card.written(CACHE / "work" / "mini.img", CACHE / "ready", BOOT_FILES | on)
    pi.start(card)
    pi.until(_HAS_BOARD)
    check(pi.run("readlink /dev/serial0") == "ttyS0\n", "the header is not the mini-UART's")
    naze.control("power off")
    said = pi.until("naze-bridge doctor --json | grep 'the port is the mini-UART'")
    command = "printf" + json.loads(said)["remedy"].partition(": printf")[2]
    say(f"doctor: {command}")
    # Debian's bare root has no sudo. The connection may end before the command does.
    with suppress(TrialError):
        pi.run(f'sudo() {{ "$@"; }}; {command}')
    until_off(pi)
    naze.control("power on")
    pi.start(card)
    check(pi.run("readlink /dev/serial0") == "ttyAMA0\n", "the header is not the PL011's")
    pi.until(_HAS_BOARD)


#: Fetched for the Pi, in the versions that run here. The package has what they need besides.
_TEST_LIBRARIES = (
    *("pytest", "pytest-asyncio", "pytest-timeout", "iniconfig", "packaging", "pluggy"),
    *("hypothesis", "sortedcontainers", "pymavlink"),
)
#: Without the flight's: they compile C.
_TESTS = "tests/storage tests/bridge --ignore tests/bridge/controllers/harakiri/test_flight.py"
_PYTHON = "/usr/lib/naze-bridge/bin/python3"


def runs_the_tests(pi: Pi, _naze: Naze) -> None:
    """The demo, and the tests of the store and the bridge, pass on arm64 as a normal user."""
    pi.cut()
    card = Card.written(CACHE / "work" / "tests.img", CACHE / "ready", BOOT_FILES)
    with card.mounted() as root:
        home = root / "home/pilot"
        run("git", "clone", "--quiet", "--depth=1", f"file://{PROJECT}", home / "naze-bridge")
        pinned = [f"{name}=={version(name)}" for name in _TEST_LIBRARIES]
        pip = (sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-compile")
        run(*pip, *target("3.11", "aarch64"), "--target", home / "libraries", *pinned)
        run("chroot", root, "chown", "-R", "pilot:", "/home/pilot")
    pi.start(card)
    pi.run("systemctl stop naze-bridge")
    say(pi.run("su - pilot -c 'naze-bridge demo --once'").splitlines()[-1])
    with_libraries = f"cd naze-bridge && PYTHONPATH=~/libraries {_PYTHON} -m pytest"
    said = pi.run(f"su - pilot -c '{with_libraries} -q -p no:cacheprovider --timeout 0 {_TESTS}'")
    say(said.splitlines()[-1])


def opens_a_hotspot(pi: Pi, _naze: Naze) -> None:
    """Setup opens a hotspot. A phone joins it by another radio, and is led to the status page."""
    pi.run(f"echo {_PASSWORD} >/root/password")
    pi.run(f"{_SETUP} || true")  # 1: doctor found something, such as an open link
    pi.until(_HAS_HOTSPOT)
    said = pi.run(_PHONE)
    check("302 http://10.42.0.1:8080/" in said, f"the phone is not led to the page: {said}")
    check("200 " in said.splitlines()[-1], f"the phone does not get the page: {said}")


#: A phone, in a network namespace of its own, with wlan1.
_PHONE = f"""
set -eu
ip netns add phone
mkdir -p /etc/netns/phone
echo nameserver 10.42.0.1 >/etc/netns/phone/resolv.conf
iw phy "$(cat /sys/class/net/wlan1/phy80211/name)" set netns name phone
phone() {{ ip netns exec phone "$@"; }}
phone ip link set lo up
wpa_passphrase {_SSID} {_PASSWORD} >/root/phone.conf
phone wpa_supplicant -B -i wlan1 -c /root/phone.conf >/dev/null
printf '#!/bin/sh\n[ "$1" != bound ] || ip address add $ip/$mask dev $interface\n' >/root/bound
chmod +x /root/bound
phone udhcpc -i wlan1 -n -q -t 30 -s /root/bound >/dev/null 2>&1
phone ip -4 address show wlan1 | grep -q 10.42.0.
phone python3 - <<'GET'
import http.client
for host, port, path in (("connectivitycheck.gstatic.com", 80, "/generate_204"), ("10.42.0.1", 8080, "/")):
    phone = http.client.HTTPConnection(host, port, timeout=120)
    phone.request("GET", path)
    reply = phone.getresponse()
    print(reply.status, reply.headers["Location"])
GET
"""


def token_of(pi: Pi) -> str:
    return pi.run("cat /var/lib/naze-bridge/web-token").strip()


def ask_page(pi: Pi, token: str, request: object) -> Any:
    """The reply to a request about the Pi itself."""
    fetch(pi, "/api/pi", token, json.dumps(request).encode(), "application/json")
    while not (job := fetch(pi, "/api/pi", token))["done"]:
        time.sleep(0.2)
    check("reply" in job, f"{request}: {job}")
    return job["reply"]


def fetch(pi: Pi, path: str, token: str, body: bytes | None = None, kind: str = "application/octet-stream") -> Any:
    """A request to the status page's API, from outside. Repeated while the daemon restarts for a saved setting."""
    headers = {"Authorization": f"Bearer {token}", "Content-Type": kind}
    request = urllib.request.Request(f"http://127.0.0.1:{pi.ports['page']}{path}", body, headers)
    end = time.monotonic() + 60
    while True:
        try:
            with urllib.request.urlopen(request, timeout=60) as reply:  # noqa: S310  # our own address
                return json.load(reply)
        except (OSError, HTTPException) as error:
            if isinstance(error, HTTPError) or time.monotonic() > end:
                raise
        time.sleep(1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pulls", type=int, default=100, help="how often the plug is pulled")
    parser.add_argument("--boots", type=int, default=10, help="how many of those cards are started again")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true", help="use the Pi's files of the last trial")
    parser.add_argument("parts", nargs="*", help="functions of this program; without them all")
    given = parser.parse_args()
    missing = [package for package, path in _NEEDED.items() if not (shutil.which(path) or Path(path).exists())]
    if missing or os.geteuid() != 0:
        sys.exit(f"it needs root, and: sudo apt-get install {' '.join(missing)}" if missing else "it needs root (sudo)")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    work = CACHE / "work"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    if not given.keep:
        say("the Pi's files, with the package")
        make_roots()
    run("make", "-C", PROJECT / "firmware", "sim", "APT=no")
    naze = Naze(work)
    pi = Pi(work, naze.link)
    plug = Plug(pi, given.seed, max(given.pulls // max(given.boots, 1), 1))
    parts: list[tuple[Callable[..., None], tuple[object, ...]]] = [
        *((part, (pi, naze)) for part in (boots, is_examined, writes, arms, opens_a_hotspot)),
        (survives, (pi, plug, given.pulls * 7 // 10)),
        (updates, (pi, plug, given.pulls * 3 // 10)),
        (start_again, (pi, plug)),
        *((part, (pi, naze)) for part in (starts_by_firstrun, starts_by_cloud_init)),
        (repeats_a_cut_start, (pi, plug)),
        *((part, (pi, naze)) for part in (leaves_the_mini_uart, runs_the_tests)),
    ]
    try:
        for part, words in parts:
            if not given.parts or part.__name__ in given.parts:
                say(str(part.__doc__))
                part(*words)
        say("passed")
    except TrialError as error:
        sys.exit(f"FAILED: {error}")
    finally:
        pi.cut()
        naze.stop()


if __name__ == "__main__":
    main()
