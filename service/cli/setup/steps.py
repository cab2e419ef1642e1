# SPDX-License-Identifier: GPL-3.0-or-later
"""The setup of a Raspberry Pi for the bridge: each function yields the missing steps of one part."""

import json
import re
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

from service.cli.setup.change import Change, Run, Step, WriteFile
from service.cli.setup.state_folder import other_devices
from service.machine.host import Host
from service.machine.raspberry_pi import boot_file, pi_model
from storage.bounded_file import read_untrusted

SETTINGS_FILE = "/etc/naze-bridge/conf.d/setup.toml"
KEY_FILE = "/etc/naze-bridge/gcs.key"
PAGE_PORT = 8080
GCS_PORT = 14550
_HOTSPOT_FILE = "/etc/NetworkManager/system-connections/naze-bridge-hotspot.nmconnection"
#: A file for each device, which names its active connection.
_NM_DEVICES = "/run/NetworkManager/devices"
_AVAHI_FILE = "/etc/avahi/services/naze-bridge.service"
_OTHERS_FILE = "/etc/udev/rules.d/59-naze-bridge-others.rules"
_MAX_KEY_FILE = 4096
_WANTED_BY = "/etc/systemd/system/multi-user.target.wants/naze-bridge.service"


@dataclass(frozen=True, slots=True)
class SetupChoices:
    """The pilot's choices.

    `hotspot`: its name and password; None keeps the network. `name`: the host name, for NAME.local.
    `key`: the passphrase of MAVLink signing; None keeps the current key, or leaves writing open to the whole network.
    """

    fc: str = "auto"
    page: bool = True
    hotspot: tuple[str, str] | None = None
    country: str | None = None
    name: str | None = None
    key: str | None = None


def missing_steps(host: Host, answers: SetupChoices) -> list[Step]:
    """The remaining steps on this machine, in order."""
    makers = (_console, _uart, _country, _name, _key, _settings, _others, _announcement, _service, _hotspot)
    return [step for make in makers for step in make(host, answers)]


def _console(host: Host, answers: SetupChoices) -> Iterator[Step]:
    consoles = _header_consoles(host)
    file = boot_file(host, "cmdline.txt")
    changes: list[Change] = []
    if file is not None:
        words = host.read(file).split()
        kept = [word for word in words if not re.fullmatch(rf"console=(?:{'|'.join(consoles)})(?:,\S*)?", word)]
        if kept != words:
            changes.append(WriteFile(file, " ".join(kept) + "\n"))
    in_cmdline = bool(changes)
    for console in consoles:
        wanted = f"serial-getty@{console}.service"
        if host.has_login(console) or host.path(f"/etc/systemd/system/getty.target.wants/{wanted}").is_symlink():
            changes.append(Run(("systemctl", "disable", *_now(host), wanted)))
    if changes:
        yield Step("free the UART on the header from the login console", changes, needs_reboot=in_cmdline)


def _header_consoles(host: Host) -> list[str]:
    """The console names that mean the UART on the header.

    On a Pi 5 serial0 is the debug socket, except with enable_uart=1 from the bootloader of 2025-02-12 on.
    """
    names = ["ttyAMA0", "ttyS0", "serial0"]
    model = pi_model(host)
    if model is None or model.header_uart != "/dev/ttyAMA0":
        return names
    config = host.read(boot_file(host, "config.txt") or "")
    is_header = _is_on(config, "enable_uart=1") or str(host.resolve("/dev/serial0")) == model.header_uart
    return names if is_header else names[:1]


def _uart(host: Host, answers: SetupChoices) -> Iterator[Step]:
    file = boot_file(host, "config.txt")
    if file is None:
        return
    model = pi_model(host)
    # An image may be set up elsewhere, and then start on any model.
    wanted = ["enable_uart=1", "dtparam=uart0=on"] if model is None else [model.config_line]
    text = host.read(file)
    lines = [line for line in wanted if not _is_on(text, line)]
    if lines:
        added = "\n[all]\n# naze-bridge: the UART on GPIO 14 and 15\n" + "".join(f"{line}\n" for line in lines)
        yield Step("enable the UART on the header", [WriteFile(file, text.rstrip("\n") + "\n" + added)], True)


def _is_on(text: str, line: str) -> bool:
    """True if the last setting of that key in config.txt, in a section for all models, is `line`."""
    key, _, _ = line.rpartition("=")
    parts = re.split(r"^[ \t]*\[(.*)\]", text, flags=re.MULTILINE)  # alternately a section's body and the next name
    for_all = "".join(body for name, body in zip(["all", *parts[1::2]], parts[::2], strict=True) if name == "all")
    given = re.findall(rf"^[ \t]*{re.escape(key)}(=\S*)?[ \t]*$", for_all, re.MULTILINE)
    return bool(given) and f"{key}{given[-1] or '=on'}" == line


def _country(host: Host, answers: SetupChoices) -> Iterator[Step]:
    if answers.country is not None and host.path("/usr/bin/raspi-config").exists():
        if f"cfg80211.ieee80211_regdom={answers.country}" in host.read(boot_file(host, "cmdline.txt") or ""):
            return
        command = ("raspi-config", "nonint", "do_wifi_country", answers.country)
        yield Step(f"set the Wi-Fi country to {answers.country}", [Run(command)])


def _name(host: Host, answers: SetupChoices) -> Iterator[Step]:
    if answers.name is None or host.read("/etc/hostname").strip() == answers.name:
        return
    old = host.read("/etc/hostname").strip()
    hosts = host.read("/etc/hosts")
    renamed = re.sub(rf"^(127\.0\.1\.1\s+){re.escape(old)}$", rf"\g<1>{answers.name}", hosts, flags=re.MULTILINE)
    changes: list[Change] = [WriteFile("/etc/hosts", renamed)] if old and renamed != hosts else []
    if _now(host):
        changes.append(Run(("hostnamectl", "set-hostname", answers.name)))
        # Avahi reads the name only when it starts.
        changes.append(Run(("systemctl", "try-restart", "avahi-daemon")))
    else:
        changes.append(WriteFile("/etc/hostname", f"{answers.name}\n"))
    yield Step(f"name this machine {answers.name}.local", changes)


def _key(host: Host, answers: SetupChoices) -> Iterator[Step]:
    if answers.key is None or current_key(host) == answers.key:
        return
    changes: list[Change] = [WriteFile(KEY_FILE, f"{answers.key}\n", True), Run(("chown", "naze-bridge:", KEY_FILE))]
    if host.path(KEY_FILE).exists():
        changes += _restart(host)  # the settings, which name it, do not change
    yield Step("set the key that is required for writing", changes)


def current_key(host: Host) -> str:
    """The passphrase in the service's key file, which the service could have replaced; empty if there is none."""
    try:
        return read_untrusted(host.path(KEY_FILE), _MAX_KEY_FILE).decode().strip()
    except (OSError, ValueError):
        return ""


def settings_text(host: Host, answers: SetupChoices) -> str:
    """The drop-in file with the choices."""
    fc = json.dumps(answers.fc, ensure_ascii=False)  # also valid TOML
    lines = ["# Written by `naze-bridge setup`, which can be run again.", f"fc = {fc}"]
    if answers.key is not None or host.path(KEY_FILE).exists():
        lines.append(f'gcs = [{{address = "udpin:0.0.0.0:{GCS_PORT}", key_file = "{KEY_FILE}"}}]')
    if answers.page:
        lines += ["", "[web]", f'listen = "0.0.0.0:{PAGE_PORT}"']
    return "\n".join(lines) + "\n"


def _settings(host: Host, answers: SetupChoices) -> Iterator[Step]:
    text = settings_text(host, answers)
    if host.read(SETTINGS_FILE) != text:
        what = f"fc = {answers.fc}, status page {'on' if answers.page else 'off'}"
        yield Step(f"save the settings: {what}", [WriteFile(SETTINGS_FILE, text), *_restart(host)])


def _others(host: Host, answers: SetupChoices) -> Iterator[Step]:
    """Keep the name /dev/naze from USB devices that proved not to be a flight controller."""
    rules = [
        f'SUBSYSTEM=="tty", KERNELS=="{socket}", ATTRS{{idVendor}}=="{vendor}", ATTRS{{idProduct}}=="{product}",'
        ' ENV{NAZE_BRIDGE_OTHER}="1"\n'
        for socket, vendor, product in other_devices(host)
    ]
    text = "# Written by `naze-bridge setup`: not flight controllers, so not /dev/naze.\n" + "".join(rules)
    if rules and host.read(_OTHERS_FILE) != text:
        reload = [Run(("udevadm", "control", "--reload")), Run(("udevadm", "trigger", "--subsystem-match=tty"))]
        changes: list[Change] = [WriteFile(_OTHERS_FILE, text), *(reload if _now(host) else [])]
        yield Step("keep the name /dev/naze from radios and GPS receivers", changes)


def _announcement(host: Host, answers: SetupChoices) -> Iterator[Step]:
    if not host.path(Path(_AVAHI_FILE).parent).exists():
        return  # without Avahi there is no NAME.local either, as the closing message says
    services = [("_mavlink._udp", GCS_PORT)] + ([("_http._tcp", PAGE_PORT)] if answers.page else [])
    entries = "".join(
        f"  <service><type>{escape(kind)}</type><port>{port}</port></service>\n" for kind, port in services
    )
    text = (
        '<?xml version="1.0" standalone="no"?>\n<!DOCTYPE service-group SYSTEM "avahi-service.dtd">\n'
        f'<service-group>\n  <name replace-wildcards="yes">naze-bridge on %h</name>\n{entries}</service-group>\n'
    )
    if host.read(_AVAHI_FILE) != text:
        yield Step("announce the bridge on the network (zeroconf)", [WriteFile(_AVAHI_FILE, text)])


def _service(host: Host, answers: SetupChoices) -> Iterator[Step]:
    if not host.path(_WANTED_BY).is_symlink():
        yield Step("start the bridge with the machine", [Run(("systemctl", "enable", *_now(host), "naze-bridge"))])


def _hotspot(host: Host, answers: SetupChoices) -> Iterator[Step]:
    """The last step, because it may cut the connection over which setup is run."""
    if answers.hotspot is None:
        return
    ssid, password = answers.hotspot
    identity = uuid.uuid5(uuid.NAMESPACE_DNS, ssid)
    text = (
        "# Written by `naze-bridge setup`.\n"
        f"[connection]\nid=naze-bridge-hotspot\nuuid={identity}\ntype=wifi\n"
        "interface-name=wlan0\nautoconnect=true\nautoconnect-priority=100\n\n"
        f"[wifi]\nmode=ap\nband=bg\nssid={_keyfile(ssid)}\n\n[wifi-security]\nkey-mgmt=wpa-psk\n"
        f"psk={_keyfile(password)}\n\n"
        "[ipv4]\nmethod=shared\naddress1=10.42.0.1/24\n\n[ipv6]\nmethod=disabled\n"
    )
    changes: list[Change] = []
    if host.read(_HOTSPOT_FILE) != text:
        changes.append(WriteFile(_HOTSPOT_FILE, text, secret=True))
    devices = (host.read(f"{_NM_DEVICES}/{name}") for name in host.names(_NM_DEVICES))
    if _now(host) and (changes or not any(f"connection-uuid={identity}" in device for device in devices)):
        changes.append(Run(("nmcli", "connection", "reload")))
        changes.append(Run(("nmcli", "connection", "up", "naze-bridge-hotspot")))
    if changes:
        yield Step(f"open the Wi-Fi hotspot {ssid!r}", changes)


def _keyfile(text: str) -> str:
    """A value in the syntax of NetworkManager's key files (GKeyFile)."""
    escaped = text.replace("\\", "\\\\")
    return escaped.replace(" ", "\\s", 1) if escaped.startswith(" ") else escaped


def _restart(host: Host) -> list[Change]:
    """Restart the service if it is in use."""
    is_in_use = _now(host) and host.path(_WANTED_BY).is_symlink()
    return [Run(("systemctl", "restart", "naze-bridge.service"))] if is_in_use else []


def _now(host: Host) -> tuple[str, ...]:
    """`--now` if systemd runs; not while an image is being built."""
    return ("--now",) if host.path("/run/systemd/system").exists() else ()
