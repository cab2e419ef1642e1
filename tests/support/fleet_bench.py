# SPDX-License-Identifier: GPL-3.0-or-later
"""A fleet of real daemons behind a real router, all separate processes."""

import json
import signal
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from fleet.roll_call import roll_call
from fleet.session import open_session
from tests.support.programs import Board, Daemon, run_naze_bridge, until
from tests.support.zenoh_bench import I_KNOW, zenoh_config
from tests.support.zenoh_router import Router, running_router

Vehicle = dict[str, Any]


class Fleet:
    """A router and the started vehicles, by folder name."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self.folder = folder
        self._stack = stack
        self.router: Router = stack.enter_context(running_router(folder))
        #: For waiting in tests: `fleet list` would start a process for each look.
        self.session = stack.enter_context(open_session((self.router.endpoint,)))
        self.daemons: dict[str, Daemon] = {}
        self.boards: dict[str, Board] = {}

    def start(
        self,
        folder: str,
        *,
        name: str = "",
        fc: str = "sim:",
        commands: str = I_KNOW,
        sysid: int = 1,
    ) -> Daemon:
        """Start a vehicle; `name` if it differs from its folder's."""
        own = self.folder / folder
        own.mkdir(exist_ok=True)
        table = zenoh_config(f'connect = ["{self.router.endpoint}"]\n{commands}', name or folder)
        daemon = Daemon(own, fc, config=f"sysid = {sysid}\n{table}")
        self._stack.callback(daemon.end, signal.SIGKILL)
        self.daemons[folder] = daemon
        return daemon

    def board(self, folder: str, *options: str) -> Board:
        """Start a simulated Naze as a separate process, so that it can be armed."""
        own = self.folder / folder
        own.mkdir(exist_ok=True)
        board = Board(own, *options)
        self._stack.callback(board.end, signal.SIGKILL)
        board.wait()
        self.boards[folder] = board
        return board

    def ask(self, *arguments: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
        """Run a `fleet` command to its end."""
        return run_naze_bridge("fleet", *arguments, "--connect", self.router.endpoint, **options)

    def listed(self) -> dict[str, Vehicle]:
        """The vehicles that `fleet list` would show, by name."""
        return {vehicle.name: asdict(vehicle) for vehicle in roll_call(self.session, "fleet")}

    def wait(self, *names: str) -> None:
        """Wait until vehicles are seen and have read their flight controllers' missions."""

        def ready() -> bool:
            vehicles = self.listed()
            return all(vehicles.get(name, {}).get("mission_count") is not None for name in names)

        until(ready, f"{names} in the fleet")

    def pushed(self, *arguments: str | Path, code: int) -> dict[str, Vehicle]:
        """The result of a push, by vehicle."""
        ended = self.ask("push", *arguments, "--json")
        assert ended.returncode == code, ended
        return {vehicle["vehicle"]: vehicle for vehicle in json.loads(ended.stdout)["vehicles"]}


@contextmanager
def running_fleet(folder: Path, *names: str) -> Iterator[Fleet]:
    """A fleet whose vehicles, each with a simulated board, are all ready."""
    with ExitStack() as stack:
        fleet = Fleet(folder, stack)
        for name in names:
            fleet.start(name)
        fleet.wait(*names)
        yield fleet
