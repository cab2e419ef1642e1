# SPDX-License-Identifier: GPL-3.0-or-later
"""A Debian root to install into: this machine's root under a temporary overlay, whose changes are below /mnt.

It has its own namespaces, so it cannot change the machine, and only a loopback network.
"""

import os
import subprocess
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Self

import pytest

#: For one command that hangs. dpkg compiles all libraries, which takes minutes on a busy machine.
_TIMEOUT_S = 900
#: On a separate tmpfs, because an overlay cannot be on an overlay. /run is empty: no systemd runs here. The index of
#: manual pages would be made again by each dpkg.
_MAKE = """
set -e
mount -t tmpfs none "$0"; cd "$0"; mkdir upper work root
mount -t overlay overlay -o lowerdir=/,upperdir=upper,workdir=work root
rm -f root/var/lib/man-db/auto-update
mount -t proc proc root/proc; mount --rbind /dev root/dev; mount --bind upper root/mnt
mount -t tmpfs none root/run; mount -t tmpfs none root/tmp
ip link set lo up
exec chroot root sh -c 'echo ready; exec cat'
"""


class BareRoot:
    """A context for running commands in the root."""

    def __init__(self, directory: Path) -> None:
        self._directory = directory

    def __enter__(self) -> Self:
        # Other users become root in a user namespace.
        maps = () if os.geteuid() == 0 else ("--map-root-user",)
        command = ("unshare", "--mount", "--net", "--pid", "--fork", "--kill-child", *maps, "sh", "-c", _MAKE)
        self._process = subprocess.Popen([*command, self._directory], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._process.stdout is not None
        if self._process.stdout.readline() != b"ready\n":
            self._process.communicate()
            pytest.skip("no namespaces can be made here")
        children = Path(f"/proc/{self._process.pid}/task/{self._process.pid}/children").read_text().split()
        self._inside = ("nsenter", "--target", children[0], "--all", "--root", "--wd")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.communicate()

    def put(self, source: Path | bytes, path: str) -> None:
        self.run(f"cat > {path}", stdin=source if isinstance(source, bytes) else source.read_bytes())

    def run(self, script: str, status: int = 0, stdin: bytes = b"") -> str:
        """Run a shell script; return its output."""
        command = (*self._inside, "env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "HOME=/root", "sh", "-c", script)
        ended = subprocess.run(command, input=stdin, capture_output=True, timeout=_TIMEOUT_S, check=False)
        printed = ended.stdout.decode() + ended.stderr.decode()
        assert ended.returncode == status, f"{script}: {ended.returncode}\n{printed}"
        return printed


if __name__ == "__main__":
    # The Makefile checks whether a root can be created here.
    with tempfile.TemporaryDirectory() as folder, BareRoot(Path(folder)) as bare:
        bare.run("true")
