# SPDX-License-Identifier: GPL-3.0-or-later
"""The flash of a board as a pilot would prepare it: features and switches set, accelerometer and compass calibrated.

It is done on the emulated board itself, once per image, and kept in the user's cache.
"""

import hashlib
from collections.abc import Callable

from protocols.firmware_image import FLASH_SIZE
from simulator.emulated_naze.console import Console, ConsoleError
from simulator.emulated_naze.flying_naze import FlyingNaze
from simulator.emulated_naze.image import Image
from simulator.emulated_naze.native_chip import cache_folder

#: Box numbers (mw.h) and the switch that turns each on: AUX1 high level flight, AUX2 middle height hold, AUX2 high
#: position hold too, AUX3 high the way home, AUX4 high the mission.
ANGLE, BARO, MAG, GPS_HOME, GPS_HOLD, GPS_AUTO = 0, 2, 3, 6, 7, 8
_SETUP = (
    "feature GPS",
    "feature VBAT",
    "feature FAILSAFE",
    f"auxset {ANGLE} 1 h",
    f"auxset {BARO} 2 m",
    f"auxset {BARO} 2 h",
    f"auxset {MAG} 2 m",
    f"auxset {MAG} 2 h",
    f"auxset {GPS_HOLD} 2 h",
    f"auxset {GPS_HOME} 3 h",
    f"auxset {GPS_AUTO} 4 h",
)
_ACC_CALIBRATION, _MAG_CALIBRATION = 205, 206
_BOOT_S = 40.0
_ACC_S, _MAG_S = 18.0, 72.0


def prepared_flash(image: Image, say: Callable[[str], None] = lambda _: None, lines: tuple[str, ...] = ()) -> bytes:
    """The flash's contents, see `prepare`. `say` gets a sentence if it takes a while. ConsoleError."""
    recipe = repr((_SETUP, lines, _ACC_S, _MAG_S)).encode()
    path = cache_folder() / f"flash-{hashlib.sha256(image.program + recipe).hexdigest()[:16]}.img"
    if path.exists():
        return path.read_bytes()
    say("Preparing the board once for this image: features, switches, accelerometer, compass (about half a minute).")
    flash = prepare(image, lines)
    part = path.with_suffix(".part")
    part.write_bytes(flash)
    part.replace(path)
    return flash


def prepare(image: Image, lines: tuple[str, ...] = ()) -> bytes:
    """A blank board with this image after the usual preparation and `lines` for the command line. ConsoleError.

    Lines that the firmware does not know are ignored.
    """
    naze = FlyingNaze(image)
    console = Console(naze)
    naze.power_on(0.0)
    console.wait_for_boot(_BOOT_S)
    output = console.type_lines([*_SETUP, *lines])
    if "Invalid feature" in output:
        raise ConsoleError("it has no GPS, no failsafe or no battery monitor: only TestCode3 has all of them")
    console.wait_for_boot(_BOOT_S)
    console.ask(_ACC_CALIBRATION)
    console.run(_ACC_S)
    console.wait_for_boot(_BOOT_S)
    console.ask(_MAG_CALIBRATION)
    naze.sky.is_held = True
    console.run(_MAG_S)
    console.wait_for_boot(_BOOT_S)
    naze.power_off(console.now)
    flash = bytes(naze.flash)
    assert len(flash) == FLASH_SIZE
    return flash
