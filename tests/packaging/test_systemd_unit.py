# SPDX-License-Identifier: GPL-3.0-or-later
"""The unit's exposure, and its comments on each remaining permission."""

import shutil
import subprocess
from pathlib import Path

import pytest

from service.machine.helper_socket import UNITS

_SYSTEMD = Path(__file__).resolve().parents[2] / "systemd"
_UNIT = _SYSTEMD / "naze-bridge.service"
#: Maximum exposure found by `systemd-analyze security`, in tenths.
_BAR = 15
#: A root helper cannot be as closed as the daemon.
_HELPERS_BAR = 30
#: Of each unit of the helper.
_CAPABILITIES = {
    "look": "CAP_DAC_READ_SEARCH CAP_SYS_PTRACE",
    "change": "CAP_CHOWN CAP_DAC_READ_SEARCH CAP_NET_ADMIN",
    "update": "",
}
#: The settings needed for it, which are also checked without systemd-analyze.
_SHUT = """DynamicUser=yes
CapabilityBoundingSet=
AmbientCapabilities=
NoNewPrivileges=yes
ProtectSystem=strict
ProtectHome=yes
PrivateMounts=yes
PrivateTmp=yes
PrivateUsers=yes
ProtectClock=yes
ProtectControlGroups=yes
ProtectHostname=yes
ProtectKernelLogs=yes
ProtectKernelModules=yes
ProtectKernelTunables=yes
LockPersonality=yes
MemoryDenyWriteExecute=yes
RemoveIPC=yes
RestrictNamespaces=yes
RestrictRealtime=yes
RestrictSUIDSGID=yes
SystemCallArchitectures=native
SystemCallFilter=@system-service
DevicePolicy=closed
UMask=0077
"""
_SERIAL = {"char-ttyAMA rw", "char-ttyS rw", "char-ttyUSB rw", "char-ttyACM rw"}


def settings() -> list[str]:
    return [line for line in _UNIT.read_text().splitlines() if "=" in line and not line.startswith("#")]


def test_the_units_exposure_is_low() -> None:
    if shutil.which("systemd-analyze"):
        command = ("systemd-analyze", "security", "--offline=true", f"--threshold={_BAR}", "--no-pager", str(_UNIT))
        judged = subprocess.run(command, capture_output=True, text=True, check=False)
        assert judged.returncode == 0, judged.stdout + judged.stderr
    assert [word for word in _SHUT.splitlines() if word not in settings()] == []


def test_it_may_open_only_serial_ports() -> None:
    assert {line.removeprefix("DeviceAllow=") for line in settings() if line.startswith("DeviceAllow=")} == _SERIAL


@pytest.mark.parametrize("driver", ["usbserial", "cdc_acm"])
def test_a_board_may_be_plugged_in_after_the_start(driver: str) -> None:
    """systemd looks up the DeviceAllow= names in /proc/devices at the start: the USB drivers must be loaded by then."""
    for order in ("Wants=", "After="):
        assert any(line.startswith(order) and f"modprobe@{driver}.service" in line for line in settings())


def test_each_permission_has_a_reason() -> None:
    """The comments name every permission that systemd-analyze finds open."""
    comments = " ".join(line[1:] for line in _UNIT.read_text().splitlines() if line.startswith("#"))
    for door in (
        "PrivateDevices=",
        "PrivateNetwork=",
        "IPAddressDeny=",
        "AF_UNIX",
        "ProtectProc=",
        "ProcSubset=",
        "RootDirectory=",
    ):
        assert door in comments


def test_readiness_and_watchdog_are_configured() -> None:
    assert {"Type=notify", "WatchdogSec=10", "Restart=always", "StartLimitIntervalSec=0"} <= set(settings())


@pytest.mark.parametrize(("unit", "capabilities"), _CAPABILITIES.items())
def test_the_helpers_exposure_is_bounded(unit: str, capabilities: str) -> None:
    file = _SYSTEMD / f"naze-bridge-helper-{unit}@.service"
    if shutil.which("systemd-analyze"):
        command = ("systemd-analyze", "security", "--offline=true", f"--threshold={_HELPERS_BAR}", "--no-pager")
        judged = subprocess.run([*command, file], capture_output=True, text=True, check=False)
        assert judged.returncode == 0, judged.stdout + judged.stderr
    lines = file.read_text().splitlines()
    assert {"NoNewPrivileges=yes", "ProtectSystem=strict", "StandardOutput=journal"} <= {*lines}
    assert f"CapabilityBoundingSet={capabilities}" in lines
    assert f"ExecStart=/usr/lib/naze-bridge/bin/python3 -I -m service.cli.helper.serve {unit}" in lines


@pytest.mark.parametrize("unit", UNITS)
def test_only_the_daemon_may_ask_the_helper(unit: str) -> None:
    lines = {*(_SYSTEMD / f"naze-bridge-helper-{unit}.socket").read_text().splitlines()}
    assert {"SocketUser=naze-bridge", "SocketMode=0600", "Accept=yes"} <= lines
    assert f"ListenStream=/run/naze-bridge-helper-{unit}.sock" in lines
    # Started with the service, never by itself.
    assert "[Install]" not in lines
    for order in ("Wants=", "After="):
        assert any(line.startswith(order) and f"naze-bridge-helper-{unit}.socket" in line for line in settings())
