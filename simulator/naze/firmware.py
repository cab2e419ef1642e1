# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri from one boot to the next: the main loop, and the serial port as in serialCom (serial.c, mw.c).

This object is the RAM, so a new object is a reset.
"""

import contextlib
from enum import Enum, auto
from math import ceil

from protocols.mavlink.codec import Packed
from protocols.mavlink.frame import MavlinkSplitter
from protocols.msp.command_line import PROMPT
from protocols.msp.mission import RECORD_SIZE, MissionCommand
from simulator.board.flash import FlashError, NorFlash
from simulator.board.flight import Craft, FlightState, fly
from simulator.board.msp_port import MspAnswers, MspReceiver, error, reply
from simulator.board.msp_sensors import MspCommand
from simulator.board.options import Counters, Faults, SimOptions, TelemetryProtocol
from simulator.board.transmitter import switch_positions
from simulator.board.traps import Trap, TrapCounters
from simulator.naze import frsky
from simulator.naze.cli import BANNER, LAST_REQUESTS, CliRequest, CommandLine
from simulator.naze.guard import accepts
from simulator.naze.mavlink_port import MavlinkSchedule, MavlinkSender, Stream
from simulator.naze.mission_flight import MissionFlight
from simulator.naze.mission_slots import StoredConfig
from simulator.naze.mission_store import OwnMissionStore
from simulator.naze.missions import Board, BootMissions
from simulator.naze.parameters import Parameters
from simulator.naze.settings_commands import STORED_SIZE, SettingsCommands
from simulator.naze.uart import Uart

_AUTOSENSE_SECONDS = 4.0
#: Calibration command -> the option with its duration.
_CALIBRATIONS: dict[int, str] = {
    MspCommand.ACC_CALIBRATION: "acc_calibration_ms",
    MspCommand.MAG_CALIBRATION: "mag_calibration_ms",
}
_FRSKY_BAUD = 9600
_MINIMOSD_BAUD = 57600
#: The delay in systemReset().
_CLI_REBOOT_S = 1.0
#: FDByteSize.
_FLOPPY_SIZE = 2340
# Tolerance for times, which are floats in seconds.
_EPSILON = 1e-9


class ResetError(Exception):
    """The firmware has reset the board, perhaps to start the chip's own boot loader."""

    def __init__(self, *, to_boot_loader: bool = False) -> None:
        super().__init__()
        self.to_boot_loader = to_boot_loader


class Protocol(Enum):
    """The firmware's current protocol on the UART."""

    AUTOSENSE = auto()
    MSP = auto()
    MAVLINK = auto()


# Looked up once: each byte is compared with them, and access through the enumeration takes several times as long.
_AUTOSENSE, _MSP, _MAVLINK = Protocol


class Firmware:
    """Runs one main loop at a time. Idle loops may be skipped."""

    def __init__(
        self,
        options: SimOptions,
        faults: Faults,
        counters: Counters,
        uart: Uart,
        flash: NorFlash,
        boot_missions: BootMissions,
        now: float,
    ) -> None:
        self._options = options
        self._faults = faults
        self._counters = counters
        self._uart = uart
        self._flash = flash
        self.protocol = Protocol.AUTOSENSE
        self.in_cli = False

        self._booted_at = self._clock = self._next_loop = now
        self._looptime = options.looptime_ms / 1000
        self._flown = 0.0
        self._home: tuple[int, int] | None = None
        # A calibration, and leaving the CLI, block everything until the board restarts.
        self._resets_at: float | None = None
        self._resets_to_boot_loader = False

        self._config = StoredConfig(flash, options)
        if faults.extension:
            with contextlib.suppress(FlashError):
                self._config.finish()
        self._board = Board(options, faults, self._config.load())
        self._missions = boot_missions(flash, self._board) if faults.extension else None
        spend_write = self._missions.spend_write if self._missions else lambda: True
        stored, has_flight = self._config.load_settings(STORED_SIZE), faults.flight is not None
        self._settings = SettingsCommands(self._board, stored, spend_write, has_flight=has_flight)
        # The extension enlarges the buffer for its longest CHUNK: mask, number, records.
        self._msp = MspReceiver(3 + options.chunk_records * RECORD_SIZE) if faults.extension else MspReceiver()
        self._answers = MspAnswers(lambda: self.craft_at(self._clock), options.tree)
        self._mavlink = MavlinkSplitter()
        self._sender = MavlinkSender()
        # Harakiri's own list and MAVLink upload, even alongside the extension.
        self._parameters = Parameters(self._board, self._settings, self._can_set_parameter, self._send_message)
        self._own_missions = OwnMissionStore(
            flash, self._board, self._missions, self._send_message, self._parameters.reset
        )
        if not (self._missions or self._config.is_valid):
            self._own_missions.clear()
        self._cli = CommandLine(options.tree, self._cli_status, self._dump)
        self._flight_reports = MissionFlight(faults)
        self._schedule = MavlinkSchedule(now, self._flight_reports.message)
        self._frsky_number, self._frsky_time = 0, now
        self._traps = TrapCounters()
        self._last_valid = self._last_byte = now

    @property
    def armed(self) -> bool:
        return self._board.armed

    def craft_at(self, now: float) -> Craft:
        """The sensor values at `now`, which must not be before the last loop."""
        since = now - self._clock
        flight = fly(now - self._booted_at, self._flown + (since if self.armed else 0.0), self.armed)
        return Craft(flight, self.armed, self._faults.boxes, self._home, self._faults.acc)

    # -- the main loop ---------------------------------------------------------------------------------------

    def next_loop(self) -> float | None:
        """The time of the next main loop with work to do, or None if it waits for a byte or the pilot."""
        if self._resets_at is not None:
            return self._resets_at
        earliest = self._uart.next_arrival()
        if not self.in_cli:
            if self._pilot_is_obeyed():
                return self._next_loop
            for due in (self._board.config_write_due, self._telemetry_due()):
                if due is not None and (earliest is None or due < earliest):
                    earliest = due
        return None if earliest is None else self.loop_at(earliest)

    def loop_at(self, earliest: float) -> float:
        """The time of the first main loop at or after `earliest`."""
        loops = ceil((earliest - self._next_loop) / self._looptime - 1e-6)
        return self._next_loop + max(loops, 0) * self._looptime

    def run_loop(self, at: float) -> None:
        """Run the main loop that begins at `at`. PowerCutError, ResetError."""
        if self.armed:
            self._flown += at - self._clock
        self._clock = at
        if self._resets_at is not None:
            if not self.in_cli:
                self._write_config()
            raise ResetError(to_boot_loader=self._resets_to_boot_loader)
        if self.in_cli:
            self._serve_cli()
        else:
            self._follow_pilot()
            self._own_missions.drop_stale(at)
            self._write_config_if_due()
            self._serve_uart()
        self._next_loop = max(at + self._looptime, self._clock)

    def hold(self, now: float) -> None:
        if now > self._next_loop:
            self._next_loop = now
            self._schedule.resume(now)

    def _flight(self) -> FlightState:
        return self.craft_at(self._clock).flight

    def _pilot_is_obeyed(self) -> bool:
        """Arming is refused while a configuration write is scheduled."""
        switches = switch_positions(self._faults.armed, self._faults.boxes)
        arm_is_on, armed = bool(self._answers.arm_switches & switches), self._board.armed
        return arm_is_on != armed and (armed or self._board.config_write_due is None)

    def _follow_pilot(self) -> None:
        """Arm or disarm. The UART's speed follows (initFRSKYTelemetry, initMinimOSDTelemetry)."""
        if not self._pilot_is_obeyed():
            return
        self._board.armed = not self.armed
        here = self._flight()
        self._home = (here.lat_e7, here.lon_e7) if self.armed else None
        if self._missions:
            self._missions.drop_stale(self._clock)
        bauds = {TelemetryProtocol.FRSKY_9600: _FRSKY_BAUD, TelemetryProtocol.MAVLINK_57600: _MINIMOSD_BAUD}
        if (armed_baud := bauds.get(self._options.tele_prot)) is not None:
            self._uart.set_baud(armed_baud if self.armed else self._options.baud, self._clock)
            self._parameters.reset()

    def _write_config_if_due(self) -> None:
        due = self._board.config_write_due
        if due is not None and self._clock >= due - _EPSILON:
            self._write_config()

    def _write_config(self) -> None:
        """Write the whole configuration. The firmware does not verify it (writeParams)."""
        self._board.config_write_due = None
        settings = self._settings.encode()
        with contextlib.suppress(FlashError):
            # With the extension the list has flash of its own. Without it, it is part of the configuration.
            if self._missions:
                self._own_missions.save()
                self._config.stage(self._board.wp_radius_cm, settings)
            self._config.erase()
            if not self._missions:
                self._own_missions.save()
            self._config.program(self._board.wp_radius_cm, settings, sealed=self._missions is not None)
        self._stall()

    def _stall(self) -> None:
        """Let the time of the flash operations pass."""
        seconds = self._flash.take_busy_seconds()
        if seconds:
            self._clock += seconds
            self._schedule.resume(self._clock)

    # -- the serial port -------------------------------------------------------------------------------------

    def _serve_uart(self) -> None:
        self._choose_protocol()
        self._send_telemetry()
        if self._missions and self._clock - self._last_byte > self._options.inter_byte_timeout_ms / 1000:
            self._msp.forget()
        while self._resets_at is None and (byte := self._uart.read(self._clock)) is not None:
            self._last_byte = self._clock
            if trap := self._trap(byte):
                if trap is Trap.RESET:
                    raise ResetError(to_boot_loader=True)
                self._enter_cli()
                return
            if self._completes_packet(byte):
                self._last_valid = self._clock

    def _trap(self, byte: int) -> Trap | None:
        """The effect of a byte outside of any protocol. With the extension, bytes of an MSP frame have none."""
        if self._missions and self._msp.is_past_header and self.protocol is not _MAVLINK:
            self._traps.clear()
            return None
        return self._traps.count(byte, self.protocol is _AUTOSENSE, self.armed)

    def _choose_protocol(self) -> None:
        if not self.armed:
            is_silent = self._clock - self._last_valid >= _AUTOSENSE_SECONDS - _EPSILON
            if is_silent and not self._parameters.is_listing:
                self._switch(Protocol.AUTOSENSE)
            return
        match self._options.tele_prot:
            case TelemetryProtocol.MSP:
                self._switch(Protocol.MSP)
            case TelemetryProtocol.FRSKY_9600:
                self._send_frsky()
            case TelemetryProtocol.MAVLINK | TelemetryProtocol.MAVLINK_57600:
                self._switch(Protocol.MAVLINK)

    def _switch(self, protocol: Protocol) -> None:
        if self.protocol is Protocol.MSP and protocol is not Protocol.MSP:
            self._schedule.resume(self._clock)
        self.protocol = protocol

    def _telemetry_due(self) -> float | None:
        """The next time that the firmware sends, or changes its protocol, by itself."""
        stream = change = None
        if self.protocol is not _MSP:
            stream = self._schedule.next_due(self.protocol is _AUTOSENSE)
        if not self.armed:
            if self.protocol is not _AUTOSENSE and not self._parameters.is_listing:
                change = self._last_valid + _AUTOSENSE_SECONDS
        elif self._options.tele_prot is TelemetryProtocol.FRSKY_9600:
            change = self._frsky_time + frsky.PERIOD_SECONDS
        return change if stream is None else stream if change is None else min(stream, change)

    def _send_telemetry(self) -> None:
        if self.protocol is Protocol.MSP:
            return
        is_sensing = self.protocol is Protocol.AUTOSENSE
        for message in self._schedule.take_due(self._clock, is_sensing, self._parameters.is_listing):
            if message is Stream.PARAM_VALUE:
                self._parameters.send_next()
                continue
            if isinstance(message, Packed):
                self._send_message(message)
                continue
            uptime = self._clock - self._booted_at
            frame = self._sender.telemetry(message, self.craft_at(self._clock), uptime)
            self._uart.write(frame, self._clock)

    def _send_message(self, packed: Packed) -> None:
        self._uart.write(self._sender.frame(packed), self._clock)

    def _send_frsky(self) -> None:
        if self._clock - self._frsky_time >= frsky.PERIOD_SECONDS - _EPSILON:
            self._frsky_time = self._clock
            self._frsky_number += 1
            uptime = self._clock - self._booted_at
            self._uart.write(frsky.frames(self._flight(), self._frsky_number, uptime), self._clock)

    def _completes_packet(self, byte: int) -> bool:
        """Pass a byte to the active receivers."""
        if self.protocol is not _MSP:
            for frame in self._mavlink.feed(bytes((byte,))):
                if frame.version == 1:
                    self._switch(Protocol.MAVLINK)
                    self._own_missions.take(frame, self._clock)
                    self._parameters.take(frame, self._clock)
                    return True
        if self.protocol is not _MAVLINK and self._faults.msp and (request := self._msp.push(byte)):
            self._switch(Protocol.MSP)
            self._answer(*request)
            return True
        return False

    def _can_set_parameter(self) -> bool:
        """While armed, or with the write budget spent, the patch ignores a PARAM_SET."""
        if not self._missions:
            return True
        return not self.armed and (self._board.config_write_due is not None or self._missions.spend_write())

    def _answer(self, command: int, payload: bytes) -> None:
        if (answer := self._extension_answer(command, payload)) is not None:
            frame = reply(command, answer)
            self._msp.overwrite(answer)
            if command == MissionCommand.COMMIT:
                self._own_missions.load()
        elif self._missions and not accepts(command, len(payload), box_size=self._answers.box_size, armed=self.armed):
            frame = error(command)
        else:
            if command == MspCommand.EEPROM_WRITE:
                self._write_config()
            elif command in _CALIBRATIONS:
                seconds = getattr(self._options, _CALIBRATIONS[command]) / 1000
                self._resets_at = self._clock + seconds
            frame = self._answers.answer(command, self._msp.buffer)
        self._stall()
        self._uart.write(frame, self._clock)

    def _extension_answer(self, command: int, payload: bytes) -> bytes | None:
        if self._missions is None:
            return None
        if (report := self._flight_reports.answer(command, payload)) is not None:
            return report
        answer = self._missions.answer(command, payload, self._clock)
        self._counters.flash_writes = self._missions.writes
        return self._settings.answer(command, payload, self._clock) if answer is None else answer

    # -- the CLI, which only a reset leaves ------------------------------------------------------------------

    def _enter_cli(self) -> None:
        self.in_cli = True
        self._counters.cli_entered = True
        self._uart.write(BANNER, self._clock)

    def _serve_cli(self) -> None:
        while (byte := self._uart.read(self._clock)) is not None:
            printed, asked = self._cli.type(byte)
            if asked is CliRequest.FLUSH:
                self._own_missions.clear()
                printed = printed.removesuffix(PROMPT) + self._cli_status().encode() + PROMPT
            elif asked is CliRequest.SAVE:
                self._write_config()
            self._uart.write(printed, self._clock)
            if asked in LAST_REQUESTS:
                self._resets_to_boot_loader = asked is CliRequest.FLASH_FIRMWARE
                self._resets_at = self._clock + _CLI_REBOOT_S
                return

    def _cli_status(self) -> str:
        count, capacity = self._own_missions.count, self._options.capacity
        return f"Floppy: {_FLOPPY_SIZE} B, {count} Datasets of {capacity} possible\r\n\r\n"

    def _dump(self) -> str:
        """The setting that this model has with and without the extension."""
        return f"Config:\r\nFW: simulated\r\nCurrent settings: \r\ngps_wp_radius = {self._board.wp_radius_cm}\r\n"
