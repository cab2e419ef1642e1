# SPDX-License-Identifier: GPL-3.0-or-later
"""One daemon on one state directory."""

import contextlib
import fcntl
import os
from pathlib import Path
from typing import Self

from storage.store_error import StoreError

_NAME = "lock"


class StateUnusableError(StoreError):
    """The directory cannot be created or written."""


class StateLock:
    """Locks the directory while it is entered; the kernel releases the lock when the process dies.

    The lock file holds the holder's process id. It is never removed: a second process could hold the removed
    file and a third one a new file.
    """

    def __init__(self, directory: Path) -> None:
        self._directory = directory
        self._descriptor: int | None = None

    def __enter__(self) -> Self:
        self.acquire()
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def acquire(self) -> None:
        """Create the directory if necessary and lock it without waiting.

        StoreError if another process holds it; StateUnusableError if it cannot be created or written.
        """
        path = self._directory / _NAME
        try:
            self._directory.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise StateUnusableError(
                f"cannot use the state directory {self._directory}: {error.strerror}; use another with --state-dir"
            ) from error
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            holder = os.read(descriptor, 20).decode(errors="replace").strip()
            os.close(descriptor)
            owner = f"process {holder}" if holder else "another process"
            raise StoreError(
                f"the state directory {self._directory} is in use by {owner}; "
                f"stop it, or use another directory with --state-dir"
            ) from error
        self._descriptor = descriptor
        with contextlib.suppress(OSError):  # the id is only for the message: a full disk must not stop us
            os.ftruncate(descriptor, 0)
            os.write(descriptor, f"{os.getpid()}\n".encode())

    def release(self) -> None:
        """Release the lock, if held."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None
