# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge firmware`: build a patched Harakiri, flash it, and go back to a backup."""

import base64
import shutil
import subprocess
import sys
from pathlib import Path

import click

from payloads.mission_data import Json
from protocols.firmware_image import ImageError, check_backup, check_patched, parse_image
from protocols.plain_text import FileError
from service.cli.daemon_client import BridgeClient, bridge_options
from service.machine.package import shipped
from terminal.command_group import PATH, CommandGroup
from terminal.files import read_file, shown_path
from terminal.sentences import UNREADABLE, fail, say

#: The image that both trees' Makefiles build.
_BUILT = "obj/baseflight_NAZE.hex"
_COMPILER = "arm-none-eabi-gcc"
_TOOLS = {_COMPILER: "gcc-arm-none-eabi", "make": "make"}
_C_LIBRARY = "libnewlib-arm-none-eabi"


class FirmwareFileError(FileError):
    """An image cannot be read."""


@click.group(cls=CommandGroup)
def firmware() -> None:
    """Build a Harakiri with the mission patch, and flash it through the port that the bridge uses.

    Propellers off, battery disconnected. The board's settings and missions are kept.
    """


@firmware.command()
@click.argument("image", type=PATH)
@click.option("--battery", is_flag=True, help="Flash even if a battery is connected.")
@bridge_options
def flash(client: BridgeClient, image: Path, battery: bool) -> None:
    """Flash IMAGE (.hex or .bin): a Harakiri with the mission patch, for a Naze32.

    The previous flash is stored as a backup first. Everything written is read back, and the new firmware must answer.
    After an interruption run the same command again.
    """
    try:
        program = parse_image(read_file(image, FirmwareFileError), shown_path(image))
    except FirmwareFileError as error:
        fail(error, UNREADABLE)
    except ImageError as error:
        fail(f"{error}; use the {_BUILT} that `naze-bridge firmware build` makes", UNREADABLE)
    try:
        check_patched(program)
    except ImageError as error:
        fail(f"{shown_path(image)}: {error}")
    _flash(client, {"do": "flash-firmware", "image": _as_text(program), "battery": battery})


@firmware.command()
@click.argument("backup", type=PATH)
@click.option("--battery", is_flag=True, help="Write even if a battery is connected.")
@bridge_options
def restore(client: BridgeClient, backup: Path, battery: bool) -> None:
    """Write BACKUP, the whole flash as `flash` stored it: firmware, settings and missions."""
    try:
        contents = read_file(backup, FirmwareFileError)
        check_backup(contents)
    except (FirmwareFileError, ImageError) as error:
        remedy = "give a backup that `naze-bridge firmware flash` stored"
        fail(error if isinstance(error, FirmwareFileError) else f"{shown_path(backup)}: {error}; {remedy}", UNREADABLE)
    _flash(client, {"do": "restore-firmware", "image": _as_text(contents), "battery": battery})


@firmware.command()
@click.argument("checkout", type=PATH)
def build(checkout: Path) -> None:
    """Patch Harakiri's sources in the folder CHECKOUT, and build them.

    Exit code 1: something is missing, or the build failed, else that of firmware/apply.
    """
    missing = [package for tool, package in _TOOLS.items() if shutil.which(tool) is None]
    if _TOOLS[_COMPILER] in missing or not _has_c_library():
        missing.append(_C_LIBRARY)
    if missing:
        fail(f"the compiler is incomplete: sudo apt install {' '.join(sorted(missing))}")
    patch = shipped("firmware/apply")
    if not patch.exists():
        fail(f"{patch} is missing: install the Debian package, or use a clone of the repository")
    _run(sys.executable, str(patch), str(checkout))
    # Everything: the Makefile does not know which files include a changed header.
    _run("make", "--always-make", "-C", str(checkout))
    image = checkout / _BUILT
    try:
        check_patched(parse_image(read_file(image, FirmwareFileError), shown_path(image)))
    except (FirmwareFileError, ImageError) as error:
        fail(f"the build has no usable result: {error}")
    say(f"{shown_path(image)} is ready: naze-bridge firmware flash {shown_path(image)}")


def _flash(client: BridgeClient, request: Json) -> None:
    if not client.as_json and sys.stdin.isatty():
        click.confirm("Are the propellers off?", abort=True, err=True)
    result = client.ask_with_progress(request)
    client.show(result, lambda: say(result["text"]))


def _as_text(image: bytes) -> str:
    return base64.b64encode(image).decode()


def _has_c_library() -> bool:
    """True if the compiler finds newlib: it prints a path, and without it only the name."""
    command = (_COMPILER, "-print-file-name=libc.a")
    found = subprocess.run(command, capture_output=True, text=True, check=False, timeout=10)  # noqa: S603  # our own words
    return "/" in found.stdout


def _run(*command: str) -> None:
    """Run a program in this terminal. Its failure is ours."""
    done = subprocess.run(command, check=False)  # noqa: S603  # the user's own folder
    if done.returncode:
        raise SystemExit(done.returncode)
