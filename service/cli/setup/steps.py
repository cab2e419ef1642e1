# SPDX-License-Identifier: GPL-3.0-or-later
"""The setup of a Raspberry Pi for the bridge: each function yields the missing steps of one part."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.sax.saxutils import escape

from service.cli.setup.answers import (
    GCS_PORT,
    KEY_FILE,
    PAGE_PORT,
    SETTINGS_FILE,
    SetupChoices,
    current_key,
    settings_text,
)
from service.cli.setup.change import Change, Run, Step, WriteFile
from service.cli.setup.hotspot import captive_steps, hotspot_steps
from service.machine.host import Host
from service.machine.raspberry_pi import boot_file, pi_model, wifi_country

_AVAHI_FILE = "/etc/avahi/services/naze-bridge.service"
_WANTED_BY = "/etc/systemd/system/multi-user.target.wants/naze-bridge.service"


def missing_steps(host: Host, answers: SetupChoices) -> list[Step]:
    """The remaining steps on this machine, in order."""
    makers = (uart_steps, _country, _name, _key, settings_steps, _announcement, _service)
    steps = [*console_steps(host, header_consoles(host)), *(step for make in makers for step in make(host, answers))]
    steps += captive_steps(host, answers.hotspot, has_page=answers.page)
    return [*steps, *hotspot_steps(host, answers.hotspot, is_kept=answers.keeps_hotspot)]


def console_steps(host: Host, consoles: Sequence[str]) -> Iterator[Step]:
    """Remove the login console from a port, given by all its names ("ttyS0")."""
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
        yield Step("free the UART from the login console", changes, needs_reboot=in_cmdline)


def header_consoles(host: Host) -> list[str]:
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


def uart_steps(host: Host, answers: SetupChoices) -> Iterator[Step]:
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
        if wifi_country(host) == answers.country:
            return
        command = ("raspi-config", "nonint", "do_wifi_country", answers.country)
        yield Step(f"set the Wi-Fi country to {answers.country}", [Run(command)])


def _name(host: Host, answers: SetupChoices) -> Iterator[Step]:
    if answers.name is None or host.read("/etc/hostname").strip() == answers.name:
        return
    old, hosts = host.read("/etc/hostname").strip(), host.read("/etc/hosts")
    renamed = re.sub(rf"^(127\.0\.1\.1\s+){re.escape(old)}$", rf"\g<1>{answers.name}", hosts, flags=re.MULTILINE)
    changes: list[Change] = [WriteFile("/etc/hosts", renamed)] if old and renamed != hosts else []
    if (file := boot_file(host, "user-data")) is not None and (text := host.read(file)):
        changes.append(WriteFile(file, renamed_user_data(text, answers.name)))
    if _now(host):
        changes.append(Run(("hostnamectl", "set-hostname", answers.name)))
        if host.path("/etc/avahi").exists():
            # Avahi reads the name only when it starts.
            changes.append(Run(("systemctl", "try-restart", "avahi-daemon")))
    else:
        changes.append(WriteFile("/etc/hostname", f"{answers.name}\n"))
    yield Step(f"name this machine {answers.name}.local", changes)


def renamed_user_data(text: str, name: str) -> str:
    """Cloud-init's user-data with another host name, to which it returns at each start."""
    return re.sub("^hostname:.*", f"hostname: '{name}'", text, flags=re.MULTILINE)


def _key(host: Host, answers: SetupChoices) -> Iterator[Step]:
    if answers.key is None or current_key(host) == answers.key:
        return
    is_new = not host.path(KEY_FILE).exists()
    changes: list[Change] = [WriteFile(KEY_FILE, f"{answers.key}\n", True), Run(("chown", "naze-bridge:", KEY_FILE))]
    if not is_new:
        changes += restart_changes(host)  # the settings, which name it, do not change
    yield Step("set the key that is required for writing", changes)


def settings_steps(host: Host, answers: SetupChoices) -> Iterator[Step]:
    text = settings_text(host, answers)
    if host.read(SETTINGS_FILE) != text:
        yield Step("save the settings", [WriteFile(SETTINGS_FILE, text), *restart_changes(host)])


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
        command = ("systemctl", "enable", *_now(host), "naze-bridge")
        yield Step("start the bridge with the machine", [Run(command)])


def restart_changes(host: Host) -> list[Change]:
    """Restart the service if it is in use."""
    is_in_use = _now(host) and host.path(_WANTED_BY).is_symlink()
    return [Run(("systemctl", "restart", "naze-bridge.service"))] if is_in_use else []


def _now(host: Host) -> tuple[str, ...]:
    """`--now` if systemd runs; not while an image is being built."""
    return ("--now",) if host.path("/run/systemd/system").exists() else ()
