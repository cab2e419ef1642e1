# SPDX-License-Identifier: GPL-3.0-or-later
"""A client at the UART of an emulated board with a real image, and a clock that only the test moves."""

import struct
from collections.abc import Callable, Sequence

from protocols.mission_record import ListIdentity, identify, pack_records
from protocols.msp.frame import request
from protocols.wp_record import WpRecord
from simulator.emulated_naze.board import EmulatedNaze
from simulator.emulated_naze.image import Image
from simulator.msp_port import HarakiriCommand
from simulator.simulated_board import Power
from tests.support.naze_bench import WireBench

#: Puts a name and a value into the table at the end.
Figure = Callable[[str, object], None]
IDENT = request(HarakiriCommand.IDENT)
#: Reception begins before this, and what comes then waits for the end of the boot.
_DEAF_S = 0.6
_LONGEST_BOOT_S = 12.0
_CALIBRATION_S = 15.0
#: harakiri_mission.c's nm_t (a link-time optimizer appends to the name), and where it has the stored list's identity.
_CORE, _STORED_AT = "mission", 8
_CFG_SIZE = 3 * 1024
_WRITE_PENDING = "ScheduleEEPROMwriteMS"


class RealBench(WireBench):
    """The board has booted and answers."""

    def __init__(self, image: Image, flash: bytes | None = None, seed: int = 0) -> None:
        self.image = image
        self.flash = memoryview(bytearray(flash or b"\xff" * 0x2_0000))
        self.naze = EmulatedNaze(image, flash=self.flash, seed=seed)
        super().__init__(self.naze)
        self.naze.power_on(0.0)
        self.wait_for_boot()

    def wait_for_boot(self) -> float:
        """The seconds until the first answer."""
        begun = self.now
        self.run(_DEAF_S)
        assert self.ask(IDENT, _LONGEST_BOOT_S) is not None, "the board does not boot"
        return self.now - begun

    def power_cycle(self) -> float:
        """Switch off and on; the seconds until the first answer."""
        self.naze.power_off(self.now)
        self.naze.power_on(self.now)
        return self.wait_for_boot()

    @property
    def is_off(self) -> bool:
        return self.naze.power is Power.OFF

    def has_loaded(self, records: Sequence[WpRecord]) -> bool:
        """True if this is the list in the firmware's RAM: in its configuration, and in the core's nm_t.stored."""
        address = next(at for name, at in self.image.symbols.items() if name.split(".")[0] == _CORE)
        checksum, count = struct.unpack("<IH", self.naze.peek(address + _STORED_AT, 6))
        in_configuration = pack_records(records) in self.naze.peek(self.image.symbols["cfg"], _CFG_SIZE)
        return in_configuration and ListIdentity(count, checksum) == identify(records)

    def arm(self, armed: bool = True) -> None:
        """Let the pilot do it, with the sticks."""
        self.naze.faults.armed = armed
        for _ in range(50):
            self.run(0.1)
            if self.naze.armed is armed:
                return
        raise AssertionError("the firmware refuses it")

    def enter_cli(self) -> bytes:
        """Type three returns; return the output."""
        self.send(b"\r\r\r")
        return self.run(0.5)

    def type_line(self, line: str) -> str:
        """Type a line into the CLI; return the output within a second."""
        self.send(line.encode() + b"\r")
        return self.run(1.0).decode("latin-1")

    def set_tele_prot(self, value: int) -> None:
        """In the CLI, which is left by saving and restarting."""
        self.enter_cli()
        self.type_line(f"set tele_prot={value}")
        self.type_line("save")
        self.run(1.5)
        self.wait_for_boot()

    def hold_write(self, pending: bool) -> None:
        """Let a write of the configuration be scheduled for a time that does not come, or for none."""
        at_ms = int(self.now * 1000) + 10_000_000 if pending else 0
        self.naze.poke(self.image.symbols[_WRITE_PENDING], at_ms.to_bytes(4, "little"))


def calibrated_flash(image: Image) -> bytes:
    """Let a blank board calibrate its accelerometer, without which it does not arm."""
    bench = RealBench(image)
    bench.ask(request(HarakiriCommand.ACC_CALIBRATION))
    bench.run(_CALIBRATION_S)
    bench.wait_for_boot()
    bench.naze.power_off(bench.now)
    return bytes(bench.flash)
