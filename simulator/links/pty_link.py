# SPDX-License-Identifier: GPL-3.0-or-later
"""A simulated board on a pseudo-terminal, which behaves like a serial port, speed included."""

import asyncio
import fcntl
import os
import re
import struct
import termios
import tty
from pathlib import Path

from simulator.board.far_end import FarEnd
from simulator.links.pump import Pump

_BAUD_BY_CODE = {getattr(termios, name): int(name[1:]) for name in dir(termios) if re.fullmatch(r"B\d+", name)}
_CODE_BY_BAUD = {baud: code for code, baud in _BAUD_BY_CODE.items()}
_INPUT_SPEED, _OUTPUT_SPEED = 4, 5
_TERMINALS = Path("/dev/pts")
#: struct flock: the whole file, for writing. Not flock(2), which clients use to lock the port.
_WHOLE_FILE = struct.pack("hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)


class PlugError(Exception):
    """The link cannot be created; one sentence."""


class PtyLink:
    """The board's USB plug: `path` is a symbolic link to the terminal while it is plugged in.

    If a client sets a speed different from the board's, both receive garbled bytes as on a real wire.
    """

    def __init__(self, board: FarEnd, path: Path, loop: asyncio.AbstractEventLoop) -> None:
        self._board = board
        self._path = path
        self._loop = loop
        self._pump: Pump | None = None
        self._near = self._far = -1

    def plug(self) -> None:
        """Create the terminal and the link. PlugError if the path is taken or the link cannot be created.

        Only a stale link is replaced, which a killed simulator left behind.
        """
        if self._pump:
            return
        if self._is_anothers():
            raise PlugError(f"{self._path} belongs to a running simulator: stop it, or use another --link")
        self._near, self._far = os.openpty()
        tty.setraw(self._far)
        self._set_speed(self._board.baud)
        os.set_blocking(self._near, False)
        try:
            if self._leads_to().parent == _TERMINALS:
                self._path.unlink()
            _lock(self._far)
            self._path.symlink_to(os.ttyname(self._far))
        except OSError as error:
            self._close()
            if isinstance(error, FileExistsError):
                raise PlugError(f"{self._path} already exists: use another --link, or remove it") from error
            raise PlugError(f"{self._path} cannot be created: {error.strerror}") from error
        # Our own copy of the far end stays open, so the terminal keeps the settings between clients.
        self._pump = Pump(self._board, self._near, self._loop, far_baud=self._far_baud)
        self._pump.start()

    def unplug(self) -> None:
        """Remove the terminal: a client that has it open sees a hang-up. The board keeps the power."""
        if self._pump:
            self._pump.stop()
            self._pump = None
            # Another simulator may have taken the path over.
            if self._leads_to() == Path(os.ttyname(self._far)):
                self._path.unlink()
            self._close()

    def poke(self) -> None:
        if self._pump:
            self._pump.poke()

    def _leads_to(self) -> Path:
        return self._path.readlink() if self._path.is_symlink() else self._path

    def _is_anothers(self) -> bool:
        """True if a running simulator owns the link. Terminal numbers are reused: an older link led to another."""
        try:
            if self._leads_to().parent != _TERMINALS:
                return False
            terminal = os.open(self._path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError:
            return False
        try:
            _lock(terminal)
        except BlockingIOError:
            return os.fstat(terminal).st_ctime_ns <= self._path.lstat().st_mtime_ns
        finally:
            os.close(terminal)
        return False

    def _close(self) -> None:
        os.close(self._near)
        os.close(self._far)

    def _set_speed(self, baud: int) -> None:
        attributes = termios.tcgetattr(self._far)
        attributes[_INPUT_SPEED] = attributes[_OUTPUT_SPEED] = _CODE_BY_BAUD[baud]
        termios.tcsetattr(self._far, termios.TCSANOW, attributes)

    def _far_baud(self) -> int:
        return _BAUD_BY_CODE.get(termios.tcgetattr(self._near)[_OUTPUT_SPEED], 0)


def _lock(terminal: int) -> None:
    """Mark a terminal as a simulator's while it is open. BlockingIOError if another simulator owns it."""
    fcntl.fcntl(terminal, fcntl.F_OFD_SETLK, _WHOLE_FILE)
