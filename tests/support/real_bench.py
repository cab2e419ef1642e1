# SPDX-License-Identifier: GPL-3.0-or-later
"""A client on the UART of an emulated board with a real image, and a clock moved only by the test."""

import struct
from collections.abc import Callable, Sequence

from protocols.mission_item import ListIdentity, identify, pack_records
from protocols.msp.frame import request
from protocols.msp.mission import WpRecord
from simulator.board.msp_sensors import MspCommand
from simulator.board.simulated_board import Power
from simulator.emulated_naze.board import EmulatedNaze
from simulator.emulated_naze.image import Image
from tests.support.naze_bench import WireBench

#: Adds a name and a value to the table printed at the end.
Figure = Callable[[str, object], None]
IDENT = request(MspCommand.IDENT)
#: Reception begins earlier, and bytes received then wait for the end of the boot.
_DEAF_S = 0.6
_LONGEST_BOOT_S = 12.0
_CALIBRATION_S = 15.0
#: nm_t in harakiri_mission.c (link-time optimisation extends the name), and the offset of the stored list's identity.
_CORE, _STORED_AT = "mission", 8
_CFG_SIZE = 3 * 1024
_WRITE_PENDING = "ScheduleEEPROMwriteMS"


class RealBench(WireBench):
    """A booted board that answers."""

    def __init__(self, image: Image, flash: bytes | None = None, seed: int = 0) -> None:
        self.image = image
        self.flash = memoryview(bytearray(flash or b"\xff" * 0x2_0000))
        self.naze = EmulatedNaze(image, flash=self.flash, seed=seed)
        super().__init__(self.naze)
        self.naze.power_on(0.0)
        self.wait_for_boot()

    def wait_for_boot(self) -> float:
        """The time until the first reply, s."""
        begun = self.now
        self.run(_DEAF_S)
        assert self.ask(IDENT, _LONGEST_BOOT_S) is not None, "the board does not boot"
        return self.now - begun

    def power_cycle(self) -> float:
        """Switch off and on; return the time until the first reply, s."""
        self.naze.power_off(self.now)
        self.naze.power_on(self.now)
        return self.wait_for_boot()

    @property
    def is_off(self) -> bool:
        return self.naze.power is Power.OFF

    def has_loaded(self, records: Sequence[WpRecord]) -> bool:
        """True if the firmware's RAM has this list, both in its configuration and in the core's nm_t.stored."""
        address = next(at for name, at in self.image.symbols.items() if name.split(".")[0] == _CORE)
        checksum, count = struct.unpack("<IH", self.naze.peek(address + _STORED_AT, 6))
        in_configuration = pack_records(records) in self.naze.peek(self.image.symbols["cfg"], _CFG_SIZE)
        return in_configuration and ListIdentity(count, checksum) == identify(records)

    def arm(self, armed: bool = True) -> None:
        """Arm or disarm with the sticks."""
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
        """Type a line into the CLI; return the output of the next second."""
        self.send(line.encode() + b"\r")
        return self.run(1.0).decode("latin-1")

    def configure(self, **settings: int) -> None:
        """Set these in the CLI, then save and restart."""
        self.enter_cli()
        for name, value in settings.items():
            self.type_line(f"set {name}={value}")
        self.type_line("save")
        self.run(1.5)
        self.wait_for_boot()

    def hold_write(self, pending: bool) -> None:
        """Schedule a write of the configuration for a time that is never reached, or cancel it."""
        at_ms = int(self.now * 1000) + 10_000_000 if pending else 0
        self.naze.poke(self.image.symbols[_WRITE_PENDING], at_ms.to_bytes(4, "little"))


def calibrated_flash(image: Image) -> bytes:
    """The flash of a board after calibrating its accelerometer, without which it does not arm."""
    bench = RealBench(image)
    bench.ask(request(MspCommand.ACC_CALIBRATION))
    bench.run(_CALIBRATION_S)
    bench.wait_for_boot()
    bench.naze.power_off(bench.now)
    return bytes(bench.flash)
