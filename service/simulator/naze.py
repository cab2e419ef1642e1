"""The simulated board: CPU, UART, flash and firmware, without a clock of its own.

Time is passed in (seconds of any monotonic clock). Whatever happens between two calls is computed at its
nominal time, so that a caller who comes late changes nothing but the moment at which bytes are collected.
"""

import contextlib
import random
from enum import Enum, auto
from math import ceil, inf

from protocols.mavlink.frame import MavlinkSplitter
from protocols.msp.hazards import HAZARDS, RUN_LENGTH
from protocols.wp_record import RECORD_SIZE
from service.simulator import frsky
from service.simulator.flash import ERASED, FlashError, NorFlash, PowerCutError
from service.simulator.flight import FlightState, fly
from service.simulator.mavlink_port import MavlinkSchedule, MavlinkSender
from service.simulator.mission_commands import Board, MissionCommands
from service.simulator.mission_slots import MissionSlots, StoredConfig, flash_size
from service.simulator.msp_port import HarakiriCommand, MspAnswers, MspReceiver, reply
from service.simulator.options import Counters, Faults, SimOptions, TelemetryProtocol
from service.simulator.uart import GATHER_SECONDS, Uart

_AUTOSENSE_SECONDS = 4.0
_SINGLE_STEPS = 3
_LONG_LOOP = 1.05
_FRSKY_BAUD = 9600
_MINIMOSD_BAUD = 57600
_CARRIAGE_RETURN, _NUMBER_SIGN, _LETTER_R = 0x0D, 0x23, 0x52
_CLI_PROMPT = b"\r\n# "
_CLI_BANNER = b"\r\nSimulated Naze, command line" + _CLI_PROMPT


class Protocol(Enum):
    """What the firmware believes to be spoken on the UART."""

    AUTOSENSE = auto()
    MSP = auto()
    MAVLINK = auto()


class Power(Enum):
    """What the CPU is doing."""

    OFF = auto()
    BOOTING = auto()
    RUNNING = auto()
    CLI = auto()


class SimulatedNaze:
    """A Naze32 with Harakiri, made without power: see `power_on`.

    `faults` may be changed and `counters` read at any time. `memory` is the flash chip; without it the
    board has a blank one of its own. It must have `flash_size(options)` bytes.
    """

    def __init__(
        self,
        options: SimOptions | None = None,
        faults: Faults | None = None,
        memory: memoryview | None = None,
    ) -> None:
        self.options = options or SimOptions()
        self.faults = faults or Faults()
        self.counters = Counters()
        if memory is None:
            memory = memoryview(bytearray((ERASED,)) * flash_size(self.options))
        self._flash = NorFlash(memory, self.faults)
        self._random = random.Random(self.options.seed)
        self._uart = Uart(self.options.baud, self.counters)
        self._looptime = self.options.looptime_ms / 1000
        self._power = Power.OFF
        self._clock = 0.0
        self._flown = 0.0
        self._run_byte, self._run_length = -1, 0
        self._boot()
        self._power = Power.OFF

    # -- the world outside -----------------------------------------------------------------------------------

    @property
    def baud(self) -> int:
        """The speed of the UART at this moment."""
        return self._uart.baud

    @property
    def protocol(self) -> Protocol:
        """What the firmware believes to be spoken."""
        return self._protocol

    @property
    def armed(self) -> bool:
        """Whether the craft is armed, which `faults.armed` only wishes."""
        return self._board.armed

    @property
    def power(self) -> Power:
        """What the CPU is doing."""
        return self._power

    @property
    def stored(self) -> bytes:
        """The mission records that are valid in flash, without the UART's help."""
        return self._slots.read(0, self._slots.stored.count)

    @property
    def flash_operations(self) -> int:
        """Erases and programs so far, as `faults.power_cut_at_flash_operation` counts them."""
        return self._flash.operations

    def receive(self, data: bytes, now: float) -> None:
        """Put bytes on the wire to the RX pin; they arrive at line rate."""
        self._run_until(now)
        data = self._disturb(data)
        self._watch_for_hazards(data)
        if self._power is not Power.OFF:
            self._uart.receive(data, now)

    def advance(self, now: float) -> bytes:
        """Return the bytes that have left the TX pin until `now` and were not returned before."""
        self._run_until(now)
        return self._disturb(self._uart.transmitted(now))

    def next_wakeup(self, now: float) -> float:
        """Tell when it is next worth calling `advance`; infinity if nothing will happen by itself.

        Loops that run late are computed as if in time, so requests that follow each other closely are taken together.
        """
        work = self._next_loop()
        if work is None:
            work = inf
        elif self._uart.last_arrival() > work:
            work = min(self._loop_at(self._uart.last_arrival()), work + GATHER_SECONDS)
        return max(now, min(work, self._uart.next_departure() or inf))

    def power_on(self, now: float) -> None:
        """Supply the board; it boots."""
        if self._power is Power.OFF:
            self._clock = now
            self._boot()

    def power_on_booted(self, now: float) -> None:
        """Supply the board as if long enough ago that it has booted by `now`."""
        self.power_on(now - self.options.boot_ms / 1000)

    def power_off(self, now: float) -> None:
        """Cut the supply: RAM and everything under way is lost, flash stays as it is."""
        self._run_until(now)
        self._cut_power()

    # -- the board -------------------------------------------------------------------------------------------

    def _cut_power(self) -> None:
        self._power = Power.OFF
        self._flash.take_busy_seconds()
        self._uart.power_off()

    def _boot(self) -> None:
        """Start the firmware: everything that lives in RAM begins anew."""
        options = self.options
        self._power = Power.BOOTING
        self._next_tick = self._clock + options.boot_ms / 1000
        self._booted_at = self._next_tick
        self._uart.set_baud(options.baud)
        self._config = StoredConfig(self._flash, options)
        self._slots = MissionSlots(self._flash, options)
        self._board = Board(armed=False, wp_radius_cm=self._config.load())
        self._missions = MissionCommands(self._slots, self._board, options, self.faults)
        self._answers = MspAnswers(lambda: (self._flight(), self._board.armed))
        self._protocol = Protocol.AUTOSENSE
        self._extension = self.faults.extension
        # The extension brings a buffer for its longest CHUNK: mask, number, records.
        self._msp = MspReceiver(3 + options.chunk_records * RECORD_SIZE) if self._extension else MspReceiver()
        self._mavlink = MavlinkSplitter()
        self._sender = MavlinkSender()
        self._schedule = MavlinkSchedule()
        self._schedule.resume(self._booted_at)
        self._frsky_number, self._frsky_time = 0, 0.0
        self._last_valid = self._booted_at
        self._last_byte = self._booted_at
        self._returns = self._number_signs = self._letters_r = 0
        self._loop_was_long, self._single_steps = False, 0

    def _disturb(self, data: bytes) -> bytes:
        """Lose bytes and flip bits as the faults say."""
        lost, flipped = self.faults.lost_byte_rate, self.faults.bit_error_rate
        if not (data and (lost or flipped)):
            return data
        chance = self._random.random
        kept = (byte for byte in data if chance() >= lost) if lost else data
        if not flipped:
            return bytes(kept)
        return bytes(byte ^ sum((chance() < flipped) << bit for bit in range(8)) for byte in kept)

    def _watch_for_hazards(self, data: bytes) -> None:
        for byte in data:
            self._run_length = self._run_length + 1 if byte == self._run_byte else 1
            self._run_byte = byte
            if self._run_length == RUN_LENGTH and byte in HAZARDS:
                self.counters.hazard_runs += 1

    def _flight(self) -> FlightState:
        return fly(self._clock - self._booted_at, self._flown, self._board.armed)

    # -- the main loop ---------------------------------------------------------------------------------------

    def _run_until(self, now: float) -> None:
        while (at := self._next_loop()) is not None and at <= now:
            if self._power is Power.BOOTING:
                self._power = Power.RUNNING
                self._uart.discard_unread(at)
            if self._board.armed:
                self._flown += at - self._clock
            self._clock = at
            self._loop(at)
        if self.faults.hang and now > self._next_tick:
            self._next_tick = now
            self._schedule.resume(now)

    def _next_loop(self) -> float | None:
        """Tell when the next main loop runs that has anything to do; the others are left out."""
        if self._power is Power.OFF or self.faults.hang:
            return None
        if self._power is Power.BOOTING:
            return self._next_tick
        wanted = [self._uart.next_arrival()]
        if self._power is Power.RUNNING:
            if self.faults.armed != self._board.armed and self._board.config_write_due is None:
                return self._next_tick
            wanted += [self._board.config_write_due, self._telemetry_due()]
        earliest = min((at for at in wanted if at is not None), default=None)
        if earliest is None:
            return None
        return self._loop_at(earliest)

    def _loop_at(self, earliest: float) -> float:
        """Tell when the first main loop at or after `earliest` runs."""
        loops = ceil((earliest - self._next_tick) / self._looptime - 1e-6)
        return self._next_tick + max(loops, 0) * self._looptime

    def _telemetry_due(self) -> float | None:
        """Tell when the firmware next sends, or changes its protocol, by itself."""
        due = []
        if self._protocol is not Protocol.MSP:
            due.append(self._schedule.next_due(self._protocol is Protocol.AUTOSENSE))
        if not self._board.armed:
            if self._protocol is not Protocol.AUTOSENSE:
                due.append(self._last_valid + _AUTOSENSE_SECONDS)
        elif self.options.tele_prot is TelemetryProtocol.FRSKY_9600:
            due.append(self._frsky_time + frsky.PERIOD_SECONDS)
        return min(due, default=None)

    def _loop(self, at: float) -> None:
        try:
            if self._power is Power.CLI:
                self._serve_cli()
            else:
                self._follow_pilot()
                self._write_config_if_due()
                self._serve_uart()
        except PowerCutError:
            self._cut_power()
        if self._power in (Power.RUNNING, Power.CLI):
            self._loop_was_long = self._clock - at > self._looptime * _LONG_LOOP
            self._next_tick = max(at + self._looptime, self._clock)

    def _follow_pilot(self) -> None:
        """Arm or disarm; the UART's speed follows (initFRSKYTelemetry, initMinimOSDTelemetry)."""
        armed = self.faults.armed
        if armed == self._board.armed or (armed and self._board.config_write_due is not None):
            return
        self._board.armed = armed
        match self.options.tele_prot:
            case TelemetryProtocol.FRSKY_9600:
                self._uart.set_baud(_FRSKY_BAUD if armed else self.options.baud)
            case TelemetryProtocol.MAVLINK_57600:
                self._uart.set_baud(_MINIMOSD_BAUD if armed else self.options.baud)

    def _write_config_if_due(self) -> None:
        due = self._board.config_write_due
        if due is not None and not self._board.armed and self._clock >= due:
            self._write_config()

    def _write_config(self) -> None:
        """Write the whole configuration; the firmware does not look whether it took (writeParams)."""
        self._board.config_write_due = None
        with contextlib.suppress(FlashError):
            self._config.save(self._board.wp_radius_cm)
        self._stall()

    def _stall(self) -> None:
        """Let the time pass for which flash held the CPU."""
        seconds = self._flash.take_busy_seconds()
        if seconds:
            self._clock += seconds
            self._schedule.resume(self._clock)

    # -- the serial port, as serialCom has it ----------------------------------------------------------------

    def _serve_uart(self) -> None:
        one_packet = self._must_single_step()
        self._choose_protocol()
        self._send_telemetry()
        quiet = self._clock - self._last_byte
        if self._extension and quiet > self.options.inter_byte_timeout_ms / 1000:
            self._msp.forget()
        while (byte := self._uart.read(self._clock)) is not None:
            self._last_byte = self._clock
            if self._springs_trap(byte):
                return
            if self._take(byte):
                self._last_valid = self._clock
                if one_packet:
                    return

    def _must_single_step(self) -> bool:
        """After a long loop only one packet is taken, in three loops running at most."""
        self._single_steps = min(self._single_steps + 1, _SINGLE_STEPS + 1) if self._loop_was_long else 0
        return 0 < self._single_steps <= _SINGLE_STEPS

    def _choose_protocol(self) -> None:
        if not self._board.armed:
            if self._clock - self._last_valid >= _AUTOSENSE_SECONDS:
                self._switch(Protocol.AUTOSENSE)
            return
        match self.options.tele_prot:
            case TelemetryProtocol.MSP:
                self._switch(Protocol.MSP)
            case TelemetryProtocol.FRSKY_9600:
                self._send_frsky()
            case TelemetryProtocol.MAVLINK | TelemetryProtocol.MAVLINK_57600:
                self._switch(Protocol.MAVLINK)

    def _switch(self, protocol: Protocol) -> None:
        if self._protocol is Protocol.MSP and protocol is not Protocol.MSP:
            self._schedule.resume(self._clock)
        self._protocol = protocol

    def _send_telemetry(self) -> None:
        if self._protocol is Protocol.MSP:
            return
        for message in self._schedule.take_due(self._clock, self._protocol is Protocol.AUTOSENSE):
            uptime = self._clock - self._booted_at
            frame = self._sender.pack(message, self._flight(), self._board.armed, uptime)
            self._uart.write(frame, self._clock)

    def _send_frsky(self) -> None:
        if self._clock - self._frsky_time >= frsky.PERIOD_SECONDS - 1e-9:
            self._frsky_time = self._clock
            self._frsky_number += 1
            self._uart.write(frsky.frame(self._flight(), self._frsky_number), self._clock)

    def _springs_trap(self, byte: int) -> bool:
        """Count the bytes that act outside of any protocol; True if the firmware has left the main loop.

        Two of the three counters stand still outside of AUTOSENSE, as in the original: they are not cleared.
        """
        if self._protocol is Protocol.AUTOSENSE:
            self._number_signs = self._number_signs + 1 if byte == _NUMBER_SIGN else 0
            if self._number_signs == RUN_LENGTH:
                self._enter_cli()
                return True
            self._letters_r = self._letters_r + 1 if byte == _LETTER_R else 0
            if self._letters_r == RUN_LENGTH:
                self.counters.resets += 1
                self._boot()
                return True
        self._returns = self._returns + 1 if byte == _CARRIAGE_RETURN and not self._board.armed else 0
        if self._returns == RUN_LENGTH:
            self._enter_cli()
            return True
        return False

    def _take(self, byte: int) -> bool:
        """Give a byte to the receivers that listen; True if it completed a packet."""
        if self._protocol is not Protocol.MSP and self._completes_mavlink(byte):
            self._switch(Protocol.MAVLINK)
            return True
        if self._protocol is not Protocol.MAVLINK and (request := self._msp.push(byte)):
            self._switch(Protocol.MSP)
            self._answer(*request)
            return True
        return False

    def _completes_mavlink(self, byte: int) -> bool:
        """The firmware knows MAVLink 1 only; what a frame says is not simulated."""
        return any(frame.version == 1 for frame in self._mavlink.feed(bytes((byte,))))

    def _answer(self, command: int, payload: bytes) -> None:
        answer = self._missions.answer(command, payload, self._clock) if self._extension else None
        if answer is not None:
            frame = reply(command, answer)
            self.counters.flash_writes = self._slots.writes
        else:
            if command == HarakiriCommand.EEPROM_WRITE:
                self._write_config()
            frame = self._answers.answer(command, payload)
        self._stall()
        self._uart.write(frame, self._clock)

    # -- the CLI, from which no way leads back but a reset ---------------------------------------------------

    def _enter_cli(self) -> None:
        self._power = Power.CLI
        self.counters.cli_entered = True
        self._uart.write(_CLI_BANNER, self._clock)

    def _serve_cli(self) -> None:
        while (byte := self._uart.read(self._clock)) is not None:
            if byte == _CARRIAGE_RETURN:
                self._uart.write(_CLI_PROMPT, self._clock)
            elif chr(byte).isprintable() and byte < 0x7F:
                self._uart.write(bytes((byte,)), self._clock)
