# SPDX-License-Identifier: GPL-3.0-or-later
"""The requests for new firmware, as far as they are refused; tests/e2e/test_firmware.py carries them out."""

import base64
from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from bridge.controllers.harakiri.profile import PATCHED as HARAKIRI
from reports.vehicle_groups import Battery
from service.daemon.client import ControlError, ask_daemon
from service.daemon.firmware_api import FirmwareApi
from simulator.naze.whole_flash import stand_in
from tests.support.programs import Daemon

PATCHED = stand_in(patched=True)


@pytest.mark.parametrize(
    ("what", "image", "why"),
    [
        ("flash-firmware", b"", "does not begin with the vectors"),
        ("flash-firmware", PATCHED[8:], "does not begin with the vectors"),
        ("flash-firmware", stand_in(patched=False), "without the mission patch"),
        ("flash-firmware", PATCHED.ljust(0x1_D800 + 1, b"\0"), "too large"),
        ("restore-firmware", PATCHED, "a backup has 131072 bytes"),
        ("restore-firmware", bytes(0x2_0000), "does not begin with the vectors"),
    ],
)
def test_a_wrong_image_is_refused_first(daemon: Daemon, what: str, image: bytes, why: str) -> None:
    request = {"do": what, "image": base64.b64encode(image).decode(), "battery": True}
    with pytest.raises(ControlError, match=f"Nothing was changed: .*{why}"):
        ask_daemon(daemon.state_dir, request)


def test_a_board_without_a_serial_port_is_refused(daemon: Daemon) -> None:
    request = {"do": "flash-firmware", "image": base64.b64encode(PATCHED).decode(), "battery": True}
    with pytest.raises(ControlError, match="Nothing was changed: sim: is not a serial port"):
        ask_daemon(daemon.state_dir, request)


@pytest.mark.parametrize("age_s", [None, 2.0])
async def test_a_battery_that_is_not_known_is_refused(age_s: float | None) -> None:
    link, status = SimpleNamespace(flight_controller=HARAKIRI.name, state="MSP"), SimpleNamespace(armed=False)
    report = SimpleNamespace(link=link, status=status, battery=Battery(age_s=age_s))
    bridge, fc = SimpleNamespace(fc_trouble=""), SimpleNamespace(is_lent=False)
    api = FirmwareApi(Mock(bridge=bridge, fc=fc, report=lambda: report), Mock(), None)
    with pytest.raises(ControlError, match="not known whether a battery is connected"):
        await api.flash(PATCHED, lambda _: None)


def test_invalid_base64_is_refused(daemon: Daemon) -> None:
    with pytest.raises(ControlError, match="not base64"):
        ask_daemon(daemon.state_dir, {"do": "flash-firmware", "image": "?"})
