# SPDX-License-Identifier: GPL-3.0-or-later
"""The firmware's own mission core, compiled for this machine (make -C firmware sim), on the simulated board.

firmware/naze_mission.h is the manual: the core calls only functions that its board provides, so the simulated board
provides its own, as firmware/harakiri_mission.c provides Harakiri's.
"""

import ctypes
from collections.abc import Callable, Mapping
from ctypes import CFUNCTYPE, POINTER, c_bool, c_int, c_uint8, c_uint16, c_uint32, c_void_p, py_object
from functools import partial
from pathlib import Path
from typing import Any

from protocols.msp.mission import RECORD_SIZE, ReplyStatus
from simulator.board.flash import FlashError, NorFlash, PowerCutError
from simulator.naze.mission_slots import flash_size, slot_pages
from simulator.naze.missions import Board, BootMissions

#: NM_CAPACITY: the core's capacity in records, independent of SimOptions.
CORE_CAPACITY = 146
# NM_BUFFER_SIZE is enough for the patched receiver. This holds any MSP payload.
_BUFFER = c_uint8 * 255


def open_library(path: Path, functions: Mapping[str, tuple[Any, Any]]) -> ctypes.CDLL:
    """Open a shared library and declare its functions (result, arguments). OSError if one is missing."""
    library = ctypes.CDLL(str(path.resolve()))
    for name, (result, arguments) in functions.items():
        try:
            function = getattr(library, name)
        except AttributeError as error:
            raise OSError(f"{path} has no function {name}") from error
        function.restype, function.argtypes = result, arguments
    return library


def load_core(path: Path) -> BootMissions:
    """Load the shared library with the core. OSError if there is none."""
    return partial(CompiledCore, open_library(path, _FUNCTIONS))


class CompiledCore:
    """The core as of one boot; see Missions.

    The limits are compiled in: only the flash times come from SimOptions, and the capacity must be CORE_CAPACITY.
    """

    def __init__(self, library: ctypes.CDLL, flash: NorFlash, board: Board) -> None:
        if board.options.capacity != CORE_CAPACITY:
            raise ValueError(f"the compiled core holds {CORE_CAPACITY} records, not {board.options.capacity}")
        self._library = library
        self._board = _BoardFunctions(flash, board)
        self._core = _Core()
        library.nm_start(self._core, _BOARD, self._board)

    def answer(self, command: int, payload: bytes, now: float) -> bytes | None:
        """The reply's payload, or None if it is not one of the core's commands. PowerCutError."""
        self._board.now = now
        buffer = _BUFFER(*payload)
        length = self._library.nm_handle(self._core, command, buffer, len(payload))
        if self._board.power_is_cut:
            raise PowerCutError
        return None if length < 0 else bytes(buffer[:length])

    def drop_stale(self, now: float) -> None:
        self._board.now = now
        self._library.nm_poll(self._core)

    @property
    def stored(self) -> bytes:
        records = self._library.nm_records(self._core)
        return ctypes.string_at(records, self._core.stored.count * RECORD_SIZE) if records else b""

    def store(self, records: bytes) -> None:
        status = self._library.nm_store(self._core, records, len(records) // RECORD_SIZE)
        if self._board.power_is_cut:
            raise PowerCutError
        if status == ReplyStatus.FLASH:
            raise FlashError

    def spend_write(self) -> bool:
        return bool(self._library.nm_spend_write(self._core))

    @property
    def writes(self) -> int:
        """The number of lists ever made valid in this flash."""
        return int(self._core.sequence)


class _BoardFunctions:
    """The core's callbacks. Exceptions cannot pass C: without power, flash fails until `power_is_cut` is seen."""

    def __init__(self, flash: NorFlash, board: Board) -> None:
        self.now = 0.0
        self.power_is_cut = False
        self._nor = flash
        self._board = board
        self._chip = (c_uint8 * flash_size(board.options)).from_buffer(flash.memory)
        self._erase_seconds = board.options.flash_erase_ms / 1000 / slot_pages(board.options.capacity)
        self._program_seconds = board.options.record_program_ms / 1000

    def erase(self, page: int) -> bool:
        return self._succeeds(self._nor.erase, page, self._erase_seconds)

    def program(self, offset: int, data: int, length: int) -> bool:
        # Record by record, as in the model, so that both count the same time and flash operations.
        contents = ctypes.string_at(data, length)
        return all(
            self._succeeds(self._nor.program, offset + at, contents[at : at + RECORD_SIZE], self._program_seconds)
            for at in range(0, length, RECORD_SIZE)
        )

    def flash(self) -> int:
        return ctypes.addressof(self._chip)

    def millis(self) -> int:
        return int(self.now * 1000) & 0xFFFF_FFFF

    def armed(self) -> bool:
        return self._board.armed

    def write_pending(self) -> bool:
        return self._board.write_pending

    def radius(self) -> int:
        return self._board.wp_radius_cm

    def set_radius(self, radius_cm: int) -> None:
        self._board.set_wp_radius(radius_cm, self.now)

    def list_changed(self, records: int, count: int) -> None:
        """Ignored: the simulated firmware does not fly the list."""

    def _succeeds(self, operation: Callable[..., None], *arguments: object) -> bool:
        if not self.power_is_cut:
            try:
                operation(*arguments)
            except FlashError:
                return False
            except PowerCutError:
                self.power_is_cut = True
        return not self.power_is_cut


# Each is called with the `self` given to nm_start(), which is the object of the methods.
_CALLBACKS = {
    "erase": CFUNCTYPE(c_bool, py_object, c_uint8)(_BoardFunctions.erase),
    "program": CFUNCTYPE(c_bool, py_object, c_uint16, c_void_p, c_uint16)(_BoardFunctions.program),
    "flash": CFUNCTYPE(c_void_p, py_object)(_BoardFunctions.flash),
    "millis": CFUNCTYPE(c_uint32, py_object)(_BoardFunctions.millis),
    "armed": CFUNCTYPE(c_bool, py_object)(_BoardFunctions.armed),
    "write_pending": CFUNCTYPE(c_bool, py_object)(_BoardFunctions.write_pending),
    "radius": CFUNCTYPE(c_uint16, py_object)(_BoardFunctions.radius),
    "set_radius": CFUNCTYPE(None, py_object, c_uint16)(_BoardFunctions.set_radius),
    "list_changed": CFUNCTYPE(None, py_object, c_void_p, c_uint16)(_BoardFunctions.list_changed),
}


class _List(ctypes.Structure):
    """nm_list_t."""

    _fields_ = (("checksum", c_uint32), ("count", c_uint16))


class _Core(ctypes.Structure):
    """nm_t."""

    _fields_ = (
        ("board", c_void_p),
        ("self", c_void_p),
        ("stored", _List),
        ("wanted", _List),
        ("staged", _List),
        ("heard_ms", c_uint32),
        ("sequence", c_uint32),
        ("credited_ms", c_uint32),
        ("slot", c_uint8),
        ("writes_left", c_uint8),
        ("open", c_bool),
    )


class _Board(ctypes.Structure):
    """nm_board_t."""

    _fields_ = tuple((name, type(function)) for name, function in _CALLBACKS.items())


_BOARD = _Board(**_CALLBACKS)

_FUNCTIONS = {
    "nm_start": (None, [POINTER(_Core), POINTER(_Board), py_object]),
    "nm_poll": (None, [POINTER(_Core)]),
    "nm_handle": (c_int, [POINTER(_Core), c_uint8, POINTER(c_uint8), c_uint8]),
    "nm_store": (c_int, [POINTER(_Core), ctypes.c_char_p, c_uint16]),
    "nm_spend_write": (c_bool, [POINTER(_Core)]),
    "nm_records": (c_void_p, [POINTER(_Core)]),
}
