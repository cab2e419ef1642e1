# SPDX-License-Identifier: GPL-3.0-or-later
"""A Raspberry Pi 3 in QEMU: its card, its UART on the header, its network, and the plug that can be pulled.

QEMU starts a kernel itself, so this program does what a Pi's boot loader does for `enable_uart=1` and
`dtoverlay=disable-bt`: the header has no UART, the mini-UART, or the PL011 that Bluetooth has otherwise. Kernel and
device tree are Debian's.
"""

import os
import re
import select
import shutil
import signal
import socket
import struct
import subprocess
import termios
import threading
import time
import tty
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from deb.build import build
from service.cli.helper.signature import SIGNERS
from tests.support.release_key import ReleaseKey

PROJECT = Path(__file__).resolve().parent.parent
CACHE = Path.home() / ".cache" / "naze-bridge-pi-trial"
_PACKAGES = (
    *("systemd", "systemd-sysv", "systemd-timesyncd", "dbus", "udev", "kmod", "iproute2", "procps", "initramfs-tools"),
    *("zstd", "python3", "openssh-client", "openssh-server", "network-manager", "libpam-systemd"),
    *("wpasupplicant", "dnsmasq-base", "iw", "udhcpc"),
)
NEWER = "99.0"
NEWER_PACKAGE = CACHE / "newer.deb"
_MIB = 1 << 20
#: A card's size must be a power of two for QEMU. FAT, then ext4, as on a card of Raspberry Pi OS.
_SIZE, _FAT_AT, _FAT_SIZE = 2048 * _MIB, _MIB, 128 * _MIB
_EXT4_AT = _FAT_AT + _FAT_SIZE
_PL011, _MINI_UART = "/soc/serial@7e201000", "/soc/serial@7e215040"
#: As Raspberry Pi Imager leaves them.
BOOT_FILES = {
    "config.txt": "[all]\n",
    "cmdline.txt": "console=serial0,115200 console=tty1 root=/dev/mmcblk0p2 rootfstype=ext4 fsck.repair=yes rootwait\n",
    "kernel8.img": "",
}
#: Makes the bare Debian a Pi: the modules of its devices, and the names of the UARTs (raspberrypi-sys-mods).
_FURNISH = r"""
echo pi >/etc/hostname
printf '127.0.0.1\tlocalhost\n127.0.1.1\tpi\n' >/etc/hosts
useradd --create-home --groups dialout pilot
printf '/dev/mmcblk0p2 / ext4 defaults,noatime 0 1\n/dev/mmcblk0p1 /boot/firmware vfat defaults 0 2\n' >/etc/fstab
mkdir -p /boot/firmware /var/log/journal
sed -i 's/^MODULES=.*/MODULES=list/' /etc/initramfs-tools/initramfs.conf
printf '%s\n' bcm2835 sdhci_iproc mmc_block ext4 crc32c_generic >>/etc/initramfs-tools/modules
apt-get install --yes --no-install-recommends linux-image-arm64 cloud-init
printf '%s\n' bcm2835_wdt dwc2 mac80211_hwsim >/etc/modules-load.d/pi.conf
# QEMU has no chips for these drivers, and emulates slowly.
printf 'blacklist %s\n' vc4 hci_uart brcmfmac snd_bcm2835 bcm2835_v4l2 >/etc/modprobe.d/pi.conf
# The Pi's Wi-Fi is wlan0, a phone's wlan1.
echo 'options mac80211_hwsim radios=2' >>/etc/modprobe.d/pi.conf
printf '[keyfile]\nunmanaged-devices=interface-name:wlan1\n' >/etc/NetworkManager/conf.d/phone.conf
printf 'UsePAM no\nUseDNS no\n' >/etc/ssh/sshd_config.d/pi.conf
cat >/usr/lib/udev/pi-serial <<'NAME'
#!/bin/sh
node=$(readlink -f "/sys/class/tty/$1/device/of_node")
for name in serial0 serial1; do
    [ "$(tr -d '\0' </proc/device-tree/aliases/$name)" != "${node#/sys/firmware/devicetree/base}" ] || echo $name
done
NAME
chmod +x /usr/lib/udev/pi-serial
echo 'SUBSYSTEM=="tty", KERNEL=="ttyAMA*|ttyS*", PROGRAM="/usr/lib/udev/pi-serial %k", SYMLINK+="%c"' \
    >/etc/udev/rules.d/99-com.rules
# As Raspberry Pi OS trixie has it. Bookworm has no cloud-init, so a card's writer removes the last file.
printf 'datasource_list: [NoCloud, None]\ndatasource: {NoCloud: {seedfrom: "file:///boot/firmware/"}}\n' \
    >/etc/cloud/cloud.cfg.d/99_raspberry-pi.cfg
mkdir -p /etc/systemd/system/cloud-init-local.service.d
printf '[Unit]\nRequiresMountsFor=/boot/firmware\n' >/etc/systemd/system/cloud-init-local.service.d/boot.conf
touch /etc/cloud/cloud-init.disabled
systemctl mask apt-daily.timer apt-daily-upgrade.timer e2scrub_all.timer fstrim.timer
apt-get clean
rm -rf /var/lib/apt/lists/*
"""
_INSTALL = """
dpkg --install /root/naze-bridge.deb
printf 'fc = "/dev/serial0"\\n[web]\\nlisten = "0.0.0.0:8080"\\n' >>/etc/naze-bridge/config.toml
systemctl enable naze-bridge
"""


class TrialError(Exception):
    """The trial failed; one sentence."""


def run(*command: str | Path, **options: object) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)  # type: ignore[call-overload]
    if done.returncode:
        raise TrialError(f"{' '.join(map(str, command))}: {done.returncode}\n{done.stdout}{done.stderr}")
    return str(done.stdout)


def make_roots() -> None:
    """Make the folders of a bare Debian for the Pi, once, and of a copy with this project's package."""
    bare, ready = CACHE / "bare", CACHE / "ready"
    run(PROJECT / "deb" / "bare", "bookworm", bare, ",".join(_PACKAGES), "arm64")
    if not (bare / "boot" / "firmware").exists():
        key = CACHE / "key"
        key.unlink(missing_ok=True)
        run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", key)
        (bare / "root" / ".ssh").mkdir(exist_ok=True)
        shutil.copy(key.with_suffix(".pub"), bare / "root" / ".ssh" / "authorized_keys")
        _inside(bare, _FURNISH)
    shutil.rmtree(ready, ignore_errors=True)
    run("cp", "-a", bare, ready)
    with TemporaryDirectory(dir=CACHE) as folder:
        package = build("arm64", ("3.11",), Path(folder), compression="none").rename(CACHE / "naze-bridge.deb")
    shutil.copy(package, ready / "root" / "naze-bridge.deb")
    _inside(ready, _INSTALL)
    with TemporaryDirectory(dir=CACHE) as folder:
        release = ReleaseKey(Path(folder, "key"))
        shutil.copy(release.signers, ready / SIGNERS[1:])
        release.sign(_repacked(package, release.signers))


def _repacked(package: Path, signers: Path) -> Path:
    """Pack the package again with a higher version, which differs in many modules, and with a key for updates."""
    with TemporaryDirectory(dir=CACHE) as folder:
        tree = Path(folder, "tree")
        run("dpkg-deb", "--raw-extract", package, tree)
        control = tree / "DEBIAN" / "control"
        control.write_text(re.sub("^Version: .*", f"Version: {NEWER}", control.read_text(), flags=re.MULTILINE))
        for module in tree.glob("usr/lib/naze-bridge/**/service/**/*.py"):
            module.write_text(f"{module.read_text()}# {NEWER}\n")
        shutil.copy(signers, tree / SIGNERS[1:])
        run("dpkg-deb", "--root-owner-group", "-Zzstd", "-z10", "--build", tree, NEWER_PACKAGE)
    return NEWER_PACKAGE


def _inside(root: Path, script: str) -> None:
    """Run a script in a root for arm64, by QEMU's user mode."""
    run("chroot", root, "sh", "-eu", "-c", script, env={"PATH": os.defpath + ":/usr/sbin:/sbin", "LC_ALL": "C"})


class Card:
    """An SD card's image: FAT, then ext4."""

    def __init__(self, image: Path) -> None:
        self.image = image

    @classmethod
    def written(cls, image: Path, root: Path, boot_files: Mapping[str, str]) -> "Card":
        """Write a root's files and those of the boot partition."""
        image.unlink(missing_ok=True)
        with image.open("wb") as file:
            file.truncate(_SIZE)
            file.seek(440)
            file.write(struct.pack("<IH", 0x6E617A65, 0))
            for kind, at, size in ((0x0C, _FAT_AT, _FAT_SIZE), (0x83, _EXT4_AT, _SIZE - _EXT4_AT)):
                file.write(struct.pack("<B3xB3xII", 0, kind, at // 512, size // 512))
            file.seek(510)
            file.write(b"\x55\xaa")
        run("mkfs.vfat", "-F", "32", "-s", "1", "--offset", str(_FAT_AT // 512), image, str(_FAT_SIZE // 1024))
        card = cls(image)
        for name, text in boot_files.items():
            subprocess.run(("mcopy", "-o", "-i", card.fat, "-", f"::/{name}"), input=text.encode(), check=True)
        place = f"offset={_EXT4_AT}"
        run("mke2fs", "-q", "-F", "-t", "ext4", "-d", root, "-E", place, image, f"{(_SIZE - _EXT4_AT) // 1024}k")
        return card

    @property
    def fat(self) -> str:
        """The boot partition, for mtools."""
        return f"{self.image}@@{_FAT_AT}"

    def read(self, name: str) -> str:
        """A file of the boot partition; empty if there is none."""
        command = ("mtype", "-i", self.fat, f"::/{name}")
        return subprocess.run(command, capture_output=True, check=False).stdout.decode()

    @contextmanager
    def mounted(self) -> Iterator[Path]:
        """The files of the ext4, as a Pi finds them at its next start: the kernel replays the journal.

        TrialError if the file system then has a fault.
        """
        with TemporaryDirectory() as folder:
            run("mount", "-o", f"loop,offset={_EXT4_AT}", self.image, folder)
            try:
                yield Path(folder)
            finally:
                run("umount", folder)
        run("e2fsck", "-fn", f"{self.image}?offset={_EXT4_AT}")


class _Wire(threading.Thread):
    """The wire from the Pi's header to a simulated board's terminal, at the speed that the Pi has set.

    QEMU's UARTs carry bytes without a speed, but its trace has the speeds of the PL011.
    """

    def __init__(self, pins: socket.socket, board: Path, trace: Path, speeds: list[int]) -> None:
        super().__init__(daemon=True)
        self._board = os.open(board, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self._board)
        self._pi = pins
        self._trace = trace.open("rb")
        self._speeds = speeds

    def run(self) -> None:
        with suppress(OSError):
            while True:
                ready, _, _ = select.select([self._pi.fileno(), self._board], [], [], 0.05)
                self._follow_speed()
                if self._pi.fileno() in ready:
                    if not (data := self._pi.recv(4096)):
                        break
                    os.write(self._board, data)
                if self._board in ready:
                    self._pi.sendall(os.read(self._board, 4096))
        os.close(self._board)

    def _follow_speed(self) -> None:
        for line in self._trace.readlines():
            if (found := re.search(rb"new baudrate ([1-9]\d*)", line)) is not None:
                speed = min((9600, 19200, 38400, 57600, 115200), key=lambda each: abs(each - int(found[1])))
                self._speeds.append(speed)
                attributes = termios.tcgetattr(self._board)
                attributes[4] = attributes[5] = getattr(termios, f"B{speed}")
                termios.tcsetattr(self._board, termios.TCSANOW, attributes)


class Pi:
    """A Pi. `folder` has its files; `board` is the terminal of the flight controller on its header.

    `speeds`: those that the Pi has set on the header's UART since it was plugged in. The mini-UART's are not known.
    """

    def __init__(self, folder: Path, board: Path) -> None:
        self._folder, self._board = folder, board
        self._qemu: subprocess.Popen[bytes] | None = None
        self._card: Card
        self._plugged_in_at = 0.0
        self.ports = {"ssh": 0, "gcs": 0, "page": 0}
        self.speeds: list[int] = []
        files = CACHE / "bare"
        self._kernel, self._initrd = next(files.glob("boot/vmlinuz-*")), next(files.glob("boot/initrd.img-*"))
        self._dtb = next(files.glob("usr/lib/linux-image-*/broadcom/bcm2837-rpi-3-b.dtb"))

    def _load(self, card: Card) -> tuple[Path, str, bool]:
        """What a boot loader reads from the card: the device tree, the kernel's words, and who has the header."""
        config = re.findall(r"^[^#\[\s].*", card.read("config.txt"), re.MULTILINE)
        is_mini = "dtoverlay=disable-bt" not in config
        tree = self._folder / "pi.dtb"
        shutil.copy(self._dtb, tree)
        for alias, uart in zip(("serial0", "serial1"), sorted((_PL011, _MINI_UART), reverse=is_mini), strict=True):
            run("fdtput", "-t", "s", tree, "/aliases", alias, uart)
        if not is_mini:
            run("fdtput", "-r", tree, f"{_PL011}/bluetooth")
        elif "enable_uart=1" not in config:
            run("fdtput", "-t", "s", tree, _MINI_UART, "status", "disabled")
        words = card.read("cmdline.txt").strip().replace("serial0", "ttyS0" if is_mini else "ttyAMA0")
        return tree, words, is_mini

    def start(self, card: Card) -> None:
        """Plug the Pi in, and wait until it answers over its network."""
        self.power(card)
        self.until("true", 1800)

    def power(self, card: Card) -> None:
        """Plug the Pi in. Its first restart ends it, as a pull of the plug does."""
        self._card, self._plugged_in_at = card, time.time()
        tree, words, is_mini = self._load(card)
        pins, trace = self._folder / "header", self._folder / "trace"
        trace.write_bytes(b"")
        for path in (pins, self._folder / "ssh"):
            path.unlink(missing_ok=True)
        self.ports = {name: _free_port() for name in self.ports}
        forwarded = (("tcp", "ssh", 22), ("udp", "gcs", 14550), ("tcp", "page", 8080))
        net = ",".join(f"hostfwd={kind}:127.0.0.1:{self.ports[name]}-:{port}" for kind, name, port in forwarded)
        serials = ("chardev:header", f"file:{self._folder}/other-uart")
        log = (self._folder / "qemu.log").open("ab")
        self._qemu = subprocess.Popen(
            [
                *("qemu-system-aarch64", "-M", "raspi3b", "-display", "none", "-no-reboot", "-monitor", "none"),
                # The Pi's time follows its instructions: on a busy machine it becomes slow, but no timeout comes early.
                *("-icount", "shift=1"),
                *("-kernel", self._kernel, "-initrd", self._initrd, "-dtb", tree, "-append", words),
                *("-drive", f"if=sd,format=raw,file={card.image}"),
                *("-chardev", f"socket,id=header,path={pins},server=on,wait=off"),
                # The PL011, and the mini-UART.
                *(word for each in (serials[::-1] if is_mini else serials) for word in ("-serial", each)),
                *("-device", "usb-net,netdev=n0", "-netdev", f"user,id=n0,{net}"),
                # An FTDI adapter.
                *("-chardev", "null,id=usb", "-device", "usb-serial,chardev=usb,always-plugged=on"),
                *("-trace", "pl011_baudrate_change", "-D", trace),
            ],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
        with suppress(OSError):  # of Linux's automatic groups of processes, where `nice` has no effect between sessions
            Path(f"/proc/{self._qemu.pid}/autogroup").write_text("10")
        wire = socket.socket(socket.AF_UNIX)
        while wire.connect_ex(str(pins)):
            if self._qemu.poll() is not None:
                raise TrialError(f"QEMU did not start: see {log.name}")
            time.sleep(0.05)
        self.speeds = []
        _Wire(wire, self._board, trace, self.speeds).start()

    def is_off(self) -> bool:
        return self._qemu is None or self._qemu.poll() is not None

    def is_stuck(self) -> bool:
        """Whether it is on, and has written nothing to its card for ten minutes."""
        if self.is_off():
            return False
        written_at = max(self._plugged_in_at, self._card.image.stat().st_mtime)
        return time.time() - written_at > 600

    def run(self, script: str) -> str:
        """Run a shell script on the Pi; returns its output."""
        options = {"StrictHostKeyChecking": "no", "UserKnownHostsFile": "/dev/null", "LogLevel": "ERROR"}
        options |= {"ControlMaster": "auto", "ControlPath": f"{self._folder}/ssh", "ControlPersist": "yes"}
        options |= {"ConnectTimeout": "300"}
        words = [word for each in options.items() for word in ("-o", "=".join(each))]
        login = ("-p", str(self.ports["ssh"]), "-i", CACHE / "key", "root@127.0.0.1")
        return run("ssh", *words, *login, script, stdin=subprocess.DEVNULL)

    def until(self, script: str, seconds: float = 900) -> str:
        """Wait until a script succeeds; returns its output."""
        end = time.monotonic() + seconds
        while True:
            try:
                return self.run(script)
            except TrialError as error:
                if time.monotonic() > end:
                    raise TrialError(f"still after {seconds:.0f} s: {error}") from None
            time.sleep(1)

    def copy_card(self, copy: Path) -> None:
        """Copy the card as it would be if the plug were pulled now: QEMU stops for that long, and writes no sector."""
        assert self._qemu is not None
        self._qemu.send_signal(signal.SIGSTOP)
        try:
            run("cp", "--sparse=always", self._card.image, copy)
        finally:
            self._qemu.send_signal(signal.SIGCONT)

    def cut(self) -> None:
        """Pull the plug."""
        if self._qemu is not None:
            self._qemu.kill()
            self._qemu.wait()
            self._qemu = None


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
