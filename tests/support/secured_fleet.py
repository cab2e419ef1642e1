# SPDX-License-Identifier: GPL-3.0-or-later
"""The examples for a fleet behind a router, copied for a test, and the router itself."""

import shutil
import socket
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import zenoh

from tests.support.programs import free_port, run_naze_bridge
from tests.support.zenoh_router import EXAMPLES, running_router

_ELSEWHERE = "/etc/naze-bridge"


@dataclass(frozen=True)
class Fleet:
    """A router and the folder with all files. `endpoint` replaces router.local in the examples."""

    folder: Path
    endpoint: str

    def config(self, of: str, name: str) -> Path:
        """The example `of` (vehicle or pilot) with the files of `name`."""
        path = self.folder / f"{name}-{of}.json5"
        text = (self.folder / f"{of}.json5").read_text()
        # The folder's own path may have the same word.
        replaced = {"vehicle": "naze-1", "pilot": "pilot"}[of]
        path.write_text(str(self.folder).join(part.replace(replaced, name) for part in text.split(str(self.folder))))
        return path

    def open(self, of: str, name: str) -> zenoh.Session:
        return zenoh.open(zenoh.Config.from_file(self.config(of, name)))

    def fleet_list(self, config: Path) -> subprocess.CompletedProcess[str]:
        return run_naze_bridge("fleet", "list", "--zenoh-config", config)


def example(folder: Path, of: str, endpoint: str) -> None:
    """Copy an example; only paths and addresses are changed."""
    shutil.copytree(EXAMPLES / of, folder, dirs_exist_ok=True)
    scheme, _, port = endpoint.partition("/")[0], None, endpoint.rpartition(":")[2]
    for path in folder.glob("*.json5"):
        text = path.read_text().replace(f"{_ELSEWHERE}/tls", str(folder)).replace(_ELSEWHERE, str(folder))
        text = text.replace(f"{scheme}/router.local:7447", endpoint).replace("/0.0.0.0:7447", f"/127.0.0.1:{port}")
        path.write_text(text)


def tls_fleet(folder: Path, stack: ExitStack) -> Fleet:
    endpoint = f"tls/localhost:{free_port(socket.SOCK_STREAM)}"
    example(folder, "zenoh-tls", endpoint)
    script = [sys.executable, str(folder / "make_certificates.py"), str(folder), "localhost,127.0.0.1"]
    subprocess.run([*script, "naze-1", "naze-2", "pilot"], check=True)
    before = (folder / "pilot.pem").read_bytes()
    subprocess.run([*script, "pilot", "guest", "stranger"], check=True)
    assert (folder / "pilot.pem").read_bytes() == before
    stack.enter_context(running_router(folder, endpoint, folder / "router.json5"))
    return Fleet(folder, endpoint)


def password_fleet(folder: Path, stack: ExitStack) -> Fleet:
    endpoint = f"tcp/127.0.0.1:{free_port(socket.SOCK_STREAM)}"
    example(folder, "zenoh-password", endpoint)
    stack.enter_context(running_router(folder, endpoint, folder / "router.json5"))
    return Fleet(folder, endpoint)
