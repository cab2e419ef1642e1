# SPDX-License-Identifier: GPL-3.0-or-later
"""A simulated MSP board other than Harakiri's: power, wires and EEPROM around a firmware, without a clock.

Simpler than SimulatedNaze: these boards speak only MSP, at one speed.
"""

from math import ceil, inf

from simulator.board.flight import Craft
from simulator.board.msp_firmware import Boot, BootFirmware, CrashError, MspFirmware
from simulator.board.msp_options import MspOptions
from simulator.board.msp_port import MspReceiver
from simulator.board.msp_v2 import MspReceiverV2
from simulator.board.options import Counters, Faults
from simulator.board.receive_ring import GATHER_SECONDS
from simulator.board.serial_ring import SerialRing
from simulator.board.simulated_board import Power, SimulatedBoard
from simulator.board.typed_line import TypedLine

_CLI_PROMPT = b"\r\n# "
_CLI_BANNER = b"\r\nEntering CLI Mode, type 'exit' to reboot" + _CLI_PROMPT
_UNKNOWN_COMMAND = b"### ERROR: Unknown command, try 'help'"
_CLI_LEFT = b"\r\nLeaving CLI mode, unsaved changes lost.\r\nRebooting"
_CLI_LINE_SIZE = 64
_NO_SPEED = 115200
#: Those that INAV obeys outside of frames.
_LETTERS = b"#R"
#: How often the pilot retries a refused arming.
_ARM_RETRY_S = 0.1


class MspBoard(SimulatedBoard):
    """`eeprom` outlives resets and power cuts."""

    faults: Faults
    counters: Counters

    def __init__(
        self, boot: BootFirmware, eeprom: memoryview, options: MspOptions | None = None, faults: Faults | None = None
    ) -> None:
        self.options = options or MspOptions()
        super().__init__(self.options.boot_ms / 1000, self.options.seed)
        self.faults = faults or Faults()
        self.counters = Counters()
        self._boot_firmware = boot
        self._eeprom = eeprom
        self._ring = SerialRing(self.options.baud, self.options.ring_size, self.counters)
        self._firmware: MspFirmware | None = None
        self._receiver = MspReceiver()
        self._boots_at = self._next_task = self._next_look = 0.0
        # The extra time of the current run of the task.
        self._busy = 0.0
        # An unserved '#' or 'R', and when the last byte was read.
        self._pending: str | None = None
        self._typed = TypedLine(_CLI_LINE_SIZE)
        self._last_byte = 0.0

    @property
    def baud(self) -> int:
        """The speed of the port. Any value for a socket, which has none."""
        return self.options.baud or _NO_SPEED

    @property
    def armed(self) -> bool:
        return self._firmware is not None and self._firmware.armed

    @property
    def is_alive(self) -> bool:
        """False if INAV's simulator, a program, would have ended in this state."""
        return self.power not in (Power.OFF, Power.CRASHED, Power.BOOTLOADER)

    @property
    def stored_records(self) -> list[bytes]:
        """The waypoints that the next boot would load."""
        return self._boot_firmware(self._boot_at(self._next_task)).stored

    def truth(self, now: float) -> Craft | None:
        self._run_until(now)
        try:
            return self._firmware.craft_at(now) if self._firmware else None
        except CrashError:
            self._crash()
            return None

    def next_wakeup(self, now: float) -> float:
        due = self._next_event()
        departure = self._ring.next_departure()
        if due is not None and self._firmware:
            due = max(due, min(self._ring.last_arrival(), due + GATHER_SECONDS))
        return max(now, min(inf if due is None else due, inf if departure is None else departure))

    # -- time ------------------------------------------------------------------------------------------------

    def _next_event(self) -> float | None:
        if self.power is Power.BOOTING:
            return self._boots_at
        firmware = self._firmware
        if firmware is None or self.faults.hang:
            return None
        arrival = self._ring.next_arrival()
        earliest = inf if arrival is None else arrival
        if self.faults.armed != firmware.armed:
            earliest = min(earliest, self._next_look)
        if self._pending and self.power is Power.RUNNING:
            earliest = min(earliest, self._last_byte + (firmware.habits.cli_guard_s or 0.0))
        return None if earliest == inf else self._task_at(earliest)

    def _task_at(self, earliest: float) -> float:
        period = self.options.serial_task_ms / 1000
        return self._next_task + max(ceil((earliest - self._next_task) / period - 1e-6), 0) * period

    def _run_until(self, now: float) -> None:
        while (at := self._next_event()) is not None and at <= now:
            if self.power is Power.BOOTING:
                self._start(at)
            else:
                self._run_task(at)
        if self._firmware and self._next_task <= now:
            # Nothing is pending: skip the runs until then.
            self._next_task = self._task_at(now) + self.options.serial_task_ms / 1000

    def _start(self, at: float) -> None:
        self._ring.discard_arrived(at)
        self.power = Power.RUNNING
        self._firmware = self._boot_firmware(self._boot_at(at))
        habits = self._firmware.habits
        self._receiver = (MspReceiverV2 if habits.speaks_v2 else MspReceiver)(habits.buffer_size)
        self._pending = None
        self._next_task = self._next_look = self._last_byte = at

    def _boot(self, now: float) -> None:
        self._stop(Power.BOOTING)
        self._boots_at = now + self._boot_s

    def _boot_at(self, at: float) -> Boot:
        return Boot(self.options, self.faults, self.counters, self._eeprom, at)

    def _crash(self) -> None:
        self.counters.crashes += 1
        self._stop(Power.CRASHED)

    def _cut_power(self) -> None:
        self._ring.power_off()
        self._stop(Power.OFF)

    def _stop(self, power: Power) -> None:
        self._firmware = None
        self.power = power

    def _hear(self, data: bytes, now: float) -> None:
        self._ring.receive(data, now)

    def _take_sent(self, now: float) -> bytes:
        return self._ring.sent(now)

    # -- one run of the serial task --------------------------------------------------------------------------

    def _run_task(self, at: float) -> None:
        firmware = self._firmware
        assert firmware is not None
        self._busy = 0.0
        try:
            firmware.follow_pilot(at)
            if self.power is Power.CLI:
                self._serve_cli(at)
            elif self._ring.arrive(at):
                self._last_byte = at
                self._pending = None
                self._serve_msp(firmware, at)
                firmware.follow_pilot(at)
            elif self._pending:
                self._serve_letter(at)
        except CrashError:
            self._crash()
        self._next_look = at + _ARM_RETRY_S
        self._next_task = at + self.options.serial_task_ms / 1000 + self._busy

    def _serve_msp(self, firmware: MspFirmware, at: float) -> None:
        """Read until a request is complete: one each time."""
        while (byte := self._ring.read(at)) is not None:
            is_letter = byte in _LETTERS and not self._receiver.in_frame
            request = self._receiver.push(byte)
            if request:
                command, payload = request
                answer = firmware.answer(
                    command, self._receiver.buffer if firmware.habits.reads_buffer else payload, at
                )
                self._busy = firmware.take_busy_seconds()
                if answer is not None:
                    self._ring.write(answer, at + (self._busy if command in firmware.habits.writes_first else 0.0))
                return
            if is_letter and not firmware.armed:
                self._hear_letter(firmware, chr(byte))

    def _hear_letter(self, firmware: MspFirmware, letter: str) -> None:
        habits = firmware.habits
        if (letter == "#" and habits.cli_guard_s is not None) or (letter == "R" and habits.obeys_r):
            self._pending = letter

    def _serve_letter(self, at: float) -> None:
        if self._pending == "#":
            self.power = Power.CLI
            self._typed = TypedLine(_CLI_LINE_SIZE)
            self.counters.cli_entered = True
            self._ring.write(_CLI_BANNER, at)
        else:
            self.counters.bootloader_entered = True
            self._stop(Power.BOOTLOADER)

    def _serve_cli(self, at: float) -> None:
        while (byte := self._ring.read(at)) is not None:
            echo, line = self._typed.type(byte)
            self._ring.write(echo, at)
            if line == "exit":
                self._ring.write(_CLI_LEFT, at)
                self._reset(at)
                return
            if line is not None:
                self._ring.write(_UNKNOWN_COMMAND + _CLI_PROMPT, at)
