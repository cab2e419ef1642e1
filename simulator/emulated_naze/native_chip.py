# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiles and loads the C part of the chip, the files of `native/`.

The core and the peripherals that the firmware uses thousands of times a second are in C: in Python they took 0.8 of a
core for real time, which leaves nothing for tests of whole flights. The library is compiled once per version of its
sources and of Unicorn, and kept in the user's cache.
"""

import ctypes
import hashlib
import os
import shutil
import subprocess
import tempfile
from ctypes import CFUNCTYPE, POINTER, c_bool, c_char_p, c_int, c_int64, c_uint8, c_uint32, c_void_p
from functools import cache
from pathlib import Path
from typing import Any

_SOURCES = Path(__file__).parent / "native"
_COMPILERS = ("cc", "gcc", "clang")
_COMPILE_S = 120.0
_FLAGS = ("-O2", "-shared", "-fPIC", "-std=gnu11", "-Wl,-Bsymbolic")


class NativeChipError(Exception):
    """The C part cannot be made; one sentence."""


class ChipPins(ctypes.Structure):
    """The first fields of `Chip` in chip.h."""

    _fields_ = (
        ("core_hz", c_uint32),
        ("apb1_hz", c_uint32),
        ("apb2_hz", c_uint32),
        ("receiver_us", c_uint32 * 8),
        ("battery", c_uint32),
        ("wants_reset", c_uint32),
        ("wants_pause", c_uint32),
        ("is_in_boot_loader", c_uint32),
        ("pc", c_uint32),
    )


class Outside(ctypes.Structure):
    """`Outside` in chip.h."""

    _fields_ = (
        ("read", CFUNCTYPE(c_uint32, c_uint32, c_uint32)),
        ("write", CFUNCTYPE(None, c_uint32, c_uint32, c_uint32)),
        ("program", CFUNCTYPE(None, c_uint32, c_uint32, c_uint32)),
        ("i2c_begin", CFUNCTYPE(c_bool, c_uint32, c_bool)),
        ("i2c_read", CFUNCTYPE(c_uint32)),
        ("i2c_write", CFUNCTYPE(None, c_uint32)),
    )


_CHIP = POINTER(ChipPins)
_FUNCTIONS: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "chip_new": (_CHIP, (c_void_p, c_uint32, POINTER(Outside))),
    "chip_delete": (None, (_CHIP,)),
    "chip_power_on": (None, (_CHIP, c_char_p)),
    "chip_power_off": (None, (_CHIP,)),
    "chip_reset": (None, (_CHIP,)),
    "chip_run": (c_int, (_CHIP, c_int64)),
    "chip_advance": (None, (_CHIP, c_int64)),
    "chip_now_ns": (c_int64, (_CHIP,)),
    "chip_ram": (c_void_p, (_CHIP,)),
    "chip_error": (c_char_p, (_CHIP,)),
    "chip_receive": (None, (_CHIP, c_int, c_char_p, c_uint32)),
    "chip_take_sent": (c_uint32, (_CHIP, c_int, POINTER(c_uint8), c_uint32)),
    "chip_baud": (c_uint32, (_CHIP, c_int)),
    "chip_timer_register": (c_uint32, (_CHIP, c_int, c_uint32)),
}


@cache
def load_native_chip() -> ctypes.CDLL:
    """The compiled library. NativeChipError."""
    library = ctypes.CDLL(str(_compiled()))
    for name, (result, arguments) in _FUNCTIONS.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


def _compiled() -> Path:
    import unicorn  # an optional dependency

    package = Path(unicorn.__file__).parent
    sources = sorted(_SOURCES.glob("*.[ch]"))
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sources))
    digest.update(f"{package} {unicorn.__version__} {_FLAGS}".encode())
    name = f"naze-chip-{digest.hexdigest()[:16]}.so"
    for folder in (cache_folder(), Path(tempfile.gettempdir()) / f"naze-bridge-{os.getuid()}"):
        if (folder / name).exists():
            return folder / name
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        except OSError:
            continue
        if folder.stat().st_uid == os.getuid() and os.access(folder, os.W_OK):
            return _compile([path for path in sources if path.suffix == ".c"], package, folder / name)
    raise NativeChipError(f"the emulator cannot be compiled: no folder for it, {cache_folder()} is not writable")


def cache_folder() -> Path:
    """The folder of files that are compiled or prepared once."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "naze-bridge"


def _compile(sources: list[Path], package: Path, target: Path) -> Path:
    compiler = next(filter(None, map(shutil.which, _COMPILERS)), None)
    if compiler is None:
        raise NativeChipError("the emulator needs a C compiler: sudo apt install gcc")
    libraries = sorted((package / "lib").glob("libunicorn.so*"))
    if not libraries or not (package / "include").exists():
        raise NativeChipError(f"{package} has no C library: pip install --force-reinstall unicorn")
    part = target.with_suffix(f".{os.getpid()}")
    command = [compiler, *_FLAGS, f"-I{package / 'include'}", *map(str, sources), str(libraries[0])]
    result = subprocess.run(  # noqa: S603
        [*command, f"-Wl,-rpath,{package / 'lib'}", "-o", str(part)],
        capture_output=True,
        text=True,
        timeout=_COMPILE_S,
        check=False,
    )
    if result.returncode:
        raise NativeChipError(f"the emulator cannot be compiled by {compiler}: {result.stderr.strip()[:300]}")
    part.replace(target)
    return target
