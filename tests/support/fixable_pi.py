# SPDX-License-Identifier: GPL-3.0-or-later
"""A machine with faults whose programs have their effect on its files, for the helper's actions."""

import shutil
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest

from payloads.mission_data import Json, to_json
from service.cli.helper import actions
from service.cli.helper.action import ThisPi, parse_action
from service.cli.setup.change import Machine
from service.daemon.client import ControlError
from service.daemon.store_worker import DATABASE_NAME
from service.settings.load import SERVICE_CONFIG, SERVICE_STATE
from tests.support.doctor import STATUS
from tests.support.faulty_machine import FaultyMachine

_WANTED_BY = "/etc/systemd/system/multi-user.target.wants/naze-bridge.service"


class FixablePi(FaultyMachine):
    """`status`: of the running daemon; None: it does not run. `ran`: the programs that were run."""

    def __init__(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        super().__init__(root)
        if self.path("/dev/ttyAMA0").group() != "dialout":
            pytest.skip("only root and members of the group dialout can give a file to it")
        self.status: Json | None = {**STATUS, "port": {}, "where": "/dev/serial0"}
        self.ran: list[str] = []
        self.write("/proc/device-tree/model", "Raspberry Pi 4 Model B\0")
        self.write("/boot/firmware/config.txt", "enable_uart=1\n")
        self.write("/run/systemd/system/.keep")
        self.write("/etc/hostname", "kite\n")
        self.write(str(SERVICE_CONFIG))
        self.path(SERVICE_STATE).mkdir(parents=True)
        self.path(_WANTED_BY).parent.mkdir(parents=True)
        self.path(_WANTED_BY).symlink_to("x")
        monkeypatch.setattr(Machine, "run", lambda _, words, *_args: self._run(words))
        monkeypatch.setattr(actions, "ask_daemon", lambda *_: self._ask())

    def ask(self, action: str, **arguments: Any) -> Json:
        """The reply to a request."""
        line = to_json({"action": action, **arguments}).encode()
        return parse_action(line, actions.ACTIONS)(ThisPi(self, BytesIO()))

    def checked(self, check: str) -> list[Json]:
        """Doctor's findings of a check."""
        return [found for found in self.ask("doctor")["checks"] if found["check"] == check]

    def _ask(self) -> Json:
        if self.status is None:
            raise ControlError("no daemon answers")
        return self.status

    def _run(self, command: Sequence[str]) -> str:
        self.ran.append(" ".join(command))
        words = [word for word in command if not word.startswith("--")]
        match words:
            case ["udevadm", "trigger"]:
                self.path("/dev/ttyAMA0").chmod(0o660)
            case ["systemctl", "disable", unit]:
                self._stop(unit)
            case ["rfkill", "unblock", "wlan"]:
                self.write("/sys/class/rfkill/rfkill0/soft", "0\n")
            case ["systemd-run", "systemctl", "restart", "naze-bridge.service"]:
                # At its start the daemon sets a damaged store aside.
                self.path(f"{SERVICE_STATE}/{DATABASE_NAME}").unlink(missing_ok=True)
                if self.status is not None:
                    self.status = self.status | {"store_trouble": None}
        return ""

    def reboot(self) -> None:
        self.write("/proc/cmdline", self.read("/boot/firmware/cmdline.txt"))
        self.write("/dev/ttyAMA0").chmod(0o660)
        self.owned_by("/dev/ttyAMA0", "dialout")

    def _stop(self, unit: str) -> None:
        name = "agetty" if "getty" in unit else unit.removesuffix(".service")
        for process in list(self.processes()):
            if process.name == name:
                shutil.rmtree(self.path(f"/proc/{process.pid}"))
        self.path(f"/etc/systemd/system/getty.target.wants/{unit}").unlink(missing_ok=True)
