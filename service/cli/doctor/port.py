# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of the flight controller's serial port: it exists, the bridge may use it, and other programs do not."""

import grp
import re
import stat
from pathlib import Path

from protocols.remedies import Fault
from service.cli.doctor.checked import Checked, ok, problem
from service.cli.doctor.fixes import ENABLE_UART, FIND_FC, FREE_UART, OPEN_PORTS
from service.cli.setup.steps import header_consoles
from service.links.serial_ports import serial_ports
from service.machine.host import LOGIN_PROGRAMS, Host, Process
from service.machine.package import page
from service.machine.raspberry_pi import boot_file, pi_model
from service.settings.addresses import FcAddress, SerialFc
from service.settings.config_files import PAGE_FILE, SETUP_FILE

_PORTS = ("serial0", "naze", "ttyUSB*", "ttyACM*")
_GROUP = "dialout"
_BLUETOOTH = ("hciattach", "btattach")


def fc_remedy(port: str, source: str) -> str:
    """The way to set `fc` so that it takes effect. `source`: where it is set now: "FILE:LINE", "--fc" or ""."""
    if source == "--fc":
        return f"omit --fc, or give it {port}"
    if not source or SETUP_FILE in source or PAGE_FILE in source:
        return f"sudo naze-bridge setup --fc {port}"
    return f'write fc = "{port}" in {source} (the line decides), then: sudo systemctl restart naze-bridge'


def fc_fix(source: str) -> str:
    """The page's remedy for a wrong `fc`, unless it was set by hand in `source`."""
    return FIND_FC if SETUP_FILE in source else ""


def check_port(host: Host, fc: FcAddress, source: str = "") -> Checked:
    """Check that the port exists. `source`: where `fc` is set, as in `Settings.sources`."""
    if not isinstance(fc, SerialFc):
        return ok("port", f"{fc}, not a serial port")
    device = host.resolve(fc.path)
    model = pi_model(host)
    if model is not None and fc.path == "/dev/serial0" and str(device) == "/dev/ttyAMA10":
        header = model.header_uart
        found = Fault.DEBUG_SOCKET(model=model.name, header=header, set_fc=fc_remedy(header, source))
        return problem("port", *found, fc_fix(source))
    if host.is_tty(device):
        return ok("port", fc.path if str(device) == fc.path else f"{fc.path} is {device}")
    there = [f"/dev/{name}" for pattern in _PORTS for name in host.names("/dev", pattern)]
    if not fc.path.startswith(("/dev/serial0", "/dev/ttyAMA", "/dev/ttyS")):
        fault, fix = Fault.PORT_UNPLUGGED, ""
    elif model is None:
        fault, fix = Fault.PORT_OFF_ELSEWHERE, ""
    else:
        fault, fix = Fault.PORT_OFF, ENABLE_UART
    other = ""
    if there:
        other = f"; or use {' or '.join(there)}: {fc_remedy(there[0], source)}"
        fix = fix or fc_fix(source)
    return problem("port", *fault(path=fc.path, other=other), fix)


def check_candidates(host: Host) -> list[SerialFc]:
    """The ports tried by `fc = "auto"`. On a Pi without a USB port the UART on the header, even if it is off."""
    ports = [SerialFc(port.path, None) for port in serial_ports(host)]
    model = pi_model(host)
    return ports or ([SerialFc(model.header_uart, None)] if model else [])


def check_no_port() -> Checked:
    return problem("port", *Fault.NO_PORTS())


def check_permission(host: Host, fc: FcAddress) -> Checked | None:
    """Check that the service's group, dialout, may use the port."""
    device = _device(host, fc)
    if device is None:
        return None
    found = host.path(device).stat()
    try:
        group = grp.getgrgid(found.st_gid).gr_name
    except KeyError:
        group = str(found.st_gid)
    if found.st_mode & stat.S_IRGRP and found.st_mode & stat.S_IWGRP and group == _GROUP:
        return ok("permission", f"{device} is open to the group {_GROUP}")
    mode = stat.filemode(found.st_mode)
    fault = Fault.PORT_CLOSED_TO_US(device=device, group=group, mode=mode, page=page("docs/install.md"))
    return problem("permission", *fault, OPEN_PORTS)


def check_console(host: Host, fc: FcAddress) -> Checked | None:
    """Check for a login console on the port: both programs would read, and each lose half of the input."""
    device = _device(host, fc)
    if device is None:
        return None
    names = {device.name, Path(fc.path).name if isinstance(fc, SerialFc) else device.name}
    # The firmware's name for the header's UART.
    names |= {"serial0"} if host.resolve("/dev/serial0") == device else set()
    found: list[tuple[str, str]] = []
    getty = f"serial-getty@{device.name}"
    is_running = host.has_login(device.name)
    if is_running or host.names("/etc/systemd/system/getty.target.wants", f"{getty}.service"):
        found.append(Fault.CONSOLE_RUNS(getty=getty, state="runs there" if is_running else "is enabled"))
    words = re.compile(rf"\bconsole=({'|'.join(map(re.escape, sorted(names)))})(?:,\S*)?(?=\s|$)")
    file = boot_file(host, "cmdline.txt")
    if file is not None and (named := words.search(host.read(file))):
        found.append(Fault.CONSOLE_IN_FILE(word=named[0], file=file, name=named[1]))
    elif named := words.search(host.read("/proc/cmdline")):
        found.append((Fault.CONSOLE_ELSEWHERE if file is None else Fault.CONSOLE_OF_KERNEL)(word=named[0]))
    fix = FREE_UART if names & {*header_consoles(host)} else ""
    if not found:
        return ok("console", f"no login console on {device}")
    sentences, remedies = zip(*found, strict=True)
    return problem("console", f"a login console uses {device}: {'; '.join(sentences)}", "; then ".join(remedies), fix)


def check_holder(host: Host, fc: FcAddress, source: str = "") -> Checked | None:
    device = _device(host, fc)
    if device is None:
        return None
    holder = holder_of_port(host, fc)
    if holder is None:
        return ok("other programs", f"no program has {device} open")
    if holder.name in LOGIN_PROGRAMS:
        return None  # reported by the console's check
    if holder.is_naze_bridge:
        return ok("other programs", f"the daemon has {device} open, pid {holder.pid}")
    if holder.name in _BLUETOOTH and (header := host.resolve("/dev/serial0")) != device and host.is_tty(header):
        found = Fault.BLUETOOTH_PORT(program=holder, device=device, set_fc=fc_remedy("/dev/serial0", source))
        return problem("other programs", *found, fc_fix(source))
    found = Fault.PORT_IN_USE(program=holder, device=device, command=host.stop_command(holder))
    return problem("other programs", *found)


def holder_of_port(host: Host, fc: FcAddress) -> Process | None:
    """The program that has the port open, as far as permissions show it."""
    device = _device(host, fc)
    return None if device is None else host.holder(str(device))


def _device(host: Host, fc: FcAddress) -> Path | None:
    """The device behind symbolic links, or None if it is not a serial port, which the first check reports."""
    if not isinstance(fc, SerialFc):
        return None
    device = host.resolve(fc.path)
    return device if host.is_tty(device) else None
