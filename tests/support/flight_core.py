# SPDX-License-Identifier: GPL-3.0-or-later
"""The firmware's flight core, compiled for this machine, asked about whole lists."""

import ctypes
import subprocess
from collections.abc import Sequence
from ctypes import c_char_p, c_int, c_int32, c_uint16
from pathlib import Path

from bridge.controllers.harakiri.check import FlightLimits
from protocols.mission_item import pack_records
from protocols.msp.mission import WpRecord
from protocols.msp.mission_flight import FlightReason
from simulator.naze.compiled_core import open_library
from tests.support.c_core import FIRMWARE

_ARGUMENTS = [c_char_p, c_uint16, c_int32, c_int32, c_uint16, c_uint16, c_uint16]


class FlightCore:
    """Built in `folder`."""

    def __init__(self, folder: Path) -> None:
        library = folder / "libflight_check.so"
        sources = sorted(map(str, FIRMWARE.glob("naze_*.c")))
        command = ["cc", "-std=c99", "-O1", "-fPIC", "-shared", "-I", str(FIRMWARE)]
        subprocess.run(
            [*command, *sources, str(Path(__file__).with_name("flight_check.c")), "-lm", "-o", str(library)], check=True
        )
        self._library: ctypes.CDLL = open_library(library, {"check_list": (c_int, _ARGUMENTS)})

    def refusal(self, records: Sequence[WpRecord], place: tuple[int, int], limits: FlightLimits) -> FlightReason | None:
        """Why the core does not fly this list from a place (lat_e7, lon_e7); None if it does."""
        settings = limits.mission_first, limits.mission_height, limits.mission_radius
        reason = self._library.check_list(pack_records(records), len(records), *place, *settings)
        return FlightReason(reason) if reason else None
