# SPDX-License-Identifier: GPL-3.0-or-later
"""The requests for new firmware, as part of DaemonApi: the daemon lends the port to the flashing and takes it back.

Order: the image and the board are checked; the settings are printed by the board; the flash is read and stored, then
it is erased, written and read back; the firmware starts, and must be found by the bridge.
"""

import asyncio
import base64
import binascii
import time
from collections.abc import Callable
from pathlib import Path

import structlog

from bridge.controllers.harakiri.profile import PATCHED, UNPATCHED
from bridge.firmware.reflash import (
    CommandLineError,
    FlashingError,
    find_chip,
    read_dump,
    read_flash,
    rewrite_flash,
    settings_in,
    start_boot_loader,
)
from bridge.model.vehicle import STALE_S
from payloads.mission_data import Json
from protocols.firmware_image import FLASH_SIZE, PROGRAM_END, ImageError, check_backup, check_patched
from protocols.plain_text import file_text
from protocols.stm32_boot_loader import BootLoaderError, start_program
from service.daemon.client import ControlError
from service.daemon.daemon import Daemon
from service.daemon.settings_api import SettingsApi
from service.links.fc_device import PortError
from service.links.serial_dialogue import carry_out, use_parity
from service.settings import SettingsError, default_state_dir
from storage.os_error import reason
from storage.small_files import read_bounded, replace_file

FIRMWARE_FOLDER = "firmware"
#: USB, without a battery.
_USB_V = 5.5
#: For bridging the boot pads and switching the power off and on.
_BY_HAND_S = 90.0
#: After `flash`, or for a boot loader left by an interrupted flash.
_BOOT_LOADER_S = 5.0
#: A whole chip takes 60 s. The port comes back after this time in any case.
_LONGEST_S = 600.0
#: A Harakiri that looks for the GPS boots for 25 s, then it is identified.
_PROOF_S = 45.0
_LOOK_S = 0.1
#: A dump has three decimals.
_ROUNDED = 0.001
_MAX_DUMP = 1 << 20
#: States of the line (Link.state) without an answer.
_SEARCHES = ("no port", "searching", "identifying")
_AGAIN = (
    "The board stays in its boot loader: run the same command again, it resumes. If the board has lost its power, it"
    " needs its boot pads for that."
)
_PADS = "No boot loader answers. Bridge the boot pads, and switch the board off and on."

Progress = Callable[[Json], None]
_log = structlog.get_logger()


class FirmwareApi:
    """The requests, as coroutines with plain data. Raises ControlError if one fails. `state_dir`: for backups."""

    def __init__(self, daemon: Daemon, settings: SettingsApi, state_dir: Path | None) -> None:
        self._daemon = daemon
        self._settings = settings
        self._state_dir = state_dir
        self._loop = asyncio.get_running_loop()

    async def do(self, request: Json, progress: Progress) -> Json:
        try:
            image = base64.b64decode(str(request.get("image")), validate=True)
        except binascii.Error as error:
            raise ValueError("the image is not base64") from error
        is_restore = request["do"] == "restore-firmware"
        return await self.flash(image, progress, with_battery=request.get("battery") is True, is_backup=is_restore)

    async def flash(
        self, image: bytes, progress: Progress, *, with_battery: bool = False, is_backup: bool = False
    ) -> Json:
        """Flash a program, or a backup of the whole flash. `with_battery`: even with a battery connected."""
        try:
            (check_backup if is_backup else check_patched)(image)
        except ImageError as error:
            raise ControlError(f"Nothing was changed: {error}") from error
        if self._daemon.fc.is_lent:
            raise ControlError("Nothing was changed: new firmware is being flashed already")
        is_running = self._check_board(with_battery)
        began = self._loop.time()
        backup = await self._flash(image, is_running, progress)
        proof = await self._proof(None if is_backup else PATCHED.name)
        restored = "" if is_backup else await self._restore_settings(backup.with_suffix(".txt"))
        text = f"{proof}; the flash was verified. {restored}Backup of the previous flash: {backup}"
        return {"text": text, "backup": str(backup), "seconds": round(self._loop.time() - began, 1)}

    def _check_board(self, with_battery: bool) -> bool:
        """True if a disarmed Harakiri answers, False if no board does. ControlError if it must not be touched."""
        daemon, report = self._daemon, self._daemon.report()
        link, why = report.link, ""
        voltage, age_s = report.battery.voltage_v, report.battery.age_s
        if report.status.armed:
            why = "the craft is armed"
        elif daemon.bridge.fc_trouble:
            why = daemon.bridge.fc_trouble
        elif link.flight_controller is None and link.state in _SEARCHES:
            return False
        elif link.flight_controller not in (PATCHED.name, UNPATCHED.name):
            why = f"this flight controller is not a Harakiri ({link.flight_controller})"
        elif link.state != "MSP" or report.status.armed is None:
            why = "it is not known whether the craft is disarmed: wait until its status is shown, and try again"
        elif voltage is None and (age_s is None or age_s > STALE_S) and not with_battery:
            why = "it is not known whether a battery is connected: wait until its voltage is shown, and try again"
        elif voltage is not None and voltage > _USB_V and not with_battery:
            why = f"a battery is connected ({voltage:.1f} V): unplug it, or use --battery with the propellers off"
        if why:
            raise ControlError(f"Nothing was changed: {why}")
        return True

    async def _flash(self, image: bytes, is_running: bool, progress: Progress) -> Path:
        """Rewrite the flash. Returns the path of the backup."""
        is_changed = False

        def step(name: str, done: int, total: int) -> None:
            progress({"progress": {"step": name, "done": done, "total": total}})

        def wait_for_pads() -> None:
            if not is_running:
                step(_PADS, 0, 0)

        _log.info("firmware.begins", where=self._daemon.fc.where)
        try:
            async with asyncio.timeout(_LONGEST_S), self._daemon.fc.lend() as port:
                dump = ""
                if is_running:
                    dump = await carry_out(read_dump(), port)
                    await carry_out(start_boot_loader(), port)
                use_parity(port)
                await carry_out(find_chip(_BOOT_LOADER_S if is_running else _BY_HAND_S, wait_for_pads), port)
                try:
                    present = await carry_out(read_flash(step), port)
                    backup = await self._store(present, dump)
                except (FlashingError, ControlError):
                    if is_running:
                        await carry_out(start_program(), port)
                    raise
                wanted = image
                if len(image) < FLASH_SIZE:
                    wanted = image.ljust(PROGRAM_END, b"\xff") + present[PROGRAM_END:]
                is_changed = True
                await carry_out(rewrite_flash(present, wanted, step), port)
                await carry_out(start_program(), port)
        except TimeoutError as error:
            raise ControlError(f"The flash took too long. {_AGAIN}") from error
        except (BootLoaderError, CommandLineError, FlashingError, PortError) as error:
            _log.warning("firmware.failed", why=str(error))
            if is_changed:
                raise ControlError(f"Flashing was interrupted: {error}. {_AGAIN}") from error
            raise ControlError(f"Nothing was changed: {error}") from error
        _log.info("firmware.written", backup=str(backup))
        return backup

    async def _store(self, contents: bytes, dump: str) -> Path:
        """Store the flash before it is changed, and the settings as text. ControlError."""
        try:
            folder = (self._state_dir or default_state_dir()) / FIRMWARE_FOLDER
            path = folder / time.strftime("%Y-%m-%d-%H%M%S.bin")

            def write() -> None:
                folder.mkdir(parents=True, exist_ok=True, mode=0o700)
                replace_file(path, contents)
                if dump:
                    replace_file(path.with_suffix(".txt"), dump.encode())

            await asyncio.to_thread(write)
        except (OSError, SettingsError) as error:
            why = reason(error) if isinstance(error, OSError) else error
            raise ControlError(f"Nothing was changed: the backup cannot be stored: {why}") from error
        return path

    async def _restore_settings(self, path: Path) -> str:
        """Restore the settings printed before, if the new firmware has begun with the defaults."""
        try:
            before = settings_in(file_text(await asyncio.to_thread(read_bounded, path, _MAX_DUMP)))
            plan = await self._settings.plan(before, "")
            changed = {
                each["name"]: each["becomes"]
                for each in plan["changes"]
                if abs(each["was"] - each["becomes"]) > _ROUNDED
            }
            if not changed:
                return ""
            result = await self._settings.restore(changed, "", "new firmware", lambda _: None)
        except FileNotFoundError:
            return ""
        except (OSError, ControlError) as error:
            return f"Its settings could not be compared ({error}): they were {path}. "
        left_out = ", ".join(each["name"] for each in (*plan["left_out"], *result["left_out"]))
        kept = f" Not restored: {left_out}." if left_out else ""
        return (
            f"It began with its default settings. {result['text']}.{kept} Features, switches and mixer are not restored"
            f" (see {path}), nor the calibrations. "
        )

    async def _proof(self, wanted: str | None) -> str:
        """The running firmware. Raises ControlError if it is not `wanted`, or does not answer."""
        for _ in range(int(_PROOF_S / _LOOK_S)):
            if (found := self._daemon.report().link.flight_controller) is not None:
                if wanted in (None, found):
                    return f"{found} runs"
                raise ControlError(f"The flash was verified, but the board runs {found}")
            await asyncio.sleep(_LOOK_S)
        raise ControlError("The flash was verified, but the board does not answer: switch it off and on")
