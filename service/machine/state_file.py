# SPDX-License-Identifier: GPL-3.0-or-later
"""A small JSON file that survives restarts and power cuts."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import structlog

from service.machine.threads import BackgroundThread
from storage.os_error import reason
from storage.small_files import read_bounded, replace_file

_MAX_BYTES = 1 << 20
_CLOSE_TIMEOUT_S = 1.0

T = TypeVar("T")
_log = structlog.get_logger()


class StateFile:
    """Written by a separate thread, because an SD card may take a second. `without`: the effect of losing it.

    Without a `folder` it does not store anything.
    """

    def __init__(self, folder: Path | None, name: str, without: str) -> None:
        self._path = (folder or Path()) / name
        self._without = without
        self._latest = b""
        self._thread = None if folder is None else BackgroundThread(name)

    def load(self, read: Callable[[Any], T]) -> T | None:
        """The contents, converted by `read`, or None if there are none, or they are damaged, which is logged."""
        if self._thread is None:
            return None
        try:
            return read(json.loads(read_bounded(self._path, _MAX_BYTES)))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError, LookupError, ArithmeticError, AttributeError, RecursionError) as error:
            _log.warning("state.lost", file=str(self._path), why=str(error), what=self._without)
            return None

    def save(self, contents: object) -> None:
        """Replace the contents. A failure is logged."""
        if self._thread is not None:
            self._latest = json.dumps(contents).encode()
            self._thread.submit(partial(self._write, self._latest))

    def close(self) -> None:
        """Finish writing, unless the disk hangs."""
        if self._thread is not None:
            self._thread.close(_CLOSE_TIMEOUT_S)

    def _write(self, data: bytes) -> None:
        if data is not self._latest:
            return  # newer contents wait already
        try:
            replace_file(self._path, data)
        except OSError as error:
            _log.warning("state.not_stored", file=str(self._path), why=reason(error))
