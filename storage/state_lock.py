# SPDX-License-Identifier: GPL-3.0-or-later
"""One daemon on one state directory."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from storage.os_error import reason
from storage.store_error import StoreError

_NAME = "lock"


class StateUnusableError(StoreError):
    """The directory cannot be created or written."""


@contextmanager
def state_lock(directory: Path) -> Iterator[None]:
    """Create the directory if necessary and lock it without waiting. The kernel releases it when the process dies.

    StoreError if another process holds it. Raises StateUnusableError if it cannot be created or written.

    The lock file holds the holder's process id. It is never removed: a second process could hold the removed
    file and a third one a new file.
    """
    try:
        directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        descriptor = os.open(directory / _NAME, os.O_RDWR | os.O_CREAT, 0o600)
    except OSError as error:
        raise StateUnusableError(
            f"cannot use the state directory {directory}: {reason(error)}; use another with --state-dir"
        ) from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            holder = os.read(descriptor, 20).decode(errors="replace").strip()
            owner = f"process {holder}" if holder else "another process"
            raise StoreError(
                f"the state directory {directory} is in use by {owner}; "
                f"stop it, or use another directory with --state-dir"
            ) from error
        with suppress(OSError):  # the id is only for the message: a full disk must not stop us
            os.ftruncate(descriptor, 0)
            os.write(descriptor, f"{os.getpid()}\n".encode())
        yield
    finally:
        os.close(descriptor)
