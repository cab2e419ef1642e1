# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon's recordings: telemetry logs by default, the UART on request."""

from collections.abc import Awaitable, Callable
from pathlib import Path

from bridge.gcs.ground import FrameListener
from service.links.fc_device import Device
from service.links.fc_port import FcPort
from service.recording.tlog_recorder import TlogRecorder
from service.recording.uart_recorder import RecordedPort, UartRecorder
from service.settings import TlogLimits

#: Within the state directory.
TLOG_FOLDER = "logs"


class Recording:
    """The recordings that are set up. Raises UartFileError if the UART cannot be recorded."""

    def __init__(self, state_dir: Path | None, tlog: TlogLimits | None, uart_file: Path | None) -> None:
        self._uart = None if uart_file is None else UartRecorder(uart_file)
        self._tlog: TlogRecorder | None = None
        if tlog is not None and state_dir is not None:
            self._tlog = TlogRecorder(state_dir / TLOG_FOLDER, tlog)
        self.on_frames: FrameListener | None = None if self._tlog is None else self._tlog.on_frames

    def port(
        self,
        open_device: Callable[[], Awaitable[Device]],
        on_open: Callable[[], None],
        on_data: Callable[[bytes], None],
        on_close: Callable[[str], None],
    ) -> FcPort:
        """The flight controller's port, recorded if set up so."""
        if self._uart is None:
            return FcPort(open_device, on_open, on_data, on_close)
        return RecordedPort(open_device, on_open, on_data, on_close, self._uart)

    def flies(self, *, is_flying: bool) -> None:
        """The craft was armed or disarmed: the logs of flights are kept longest."""
        if self._tlog is not None:
            self._tlog.flies(is_flying=is_flying)

    def describe(self) -> list[str]:
        """The files in use, or the reasons why recording stopped, for the status."""
        told = [] if self._tlog is None else [f"telemetry log: {self._tlog.describe()}"]
        return told if self._uart is None else [*told, f"UART capture: {self._uart.describe()}"]

    def close(self) -> None:
        """Write the unsaved rest."""
        if self._uart is not None:
            self._uart.close()
        if self._tlog is not None:
            self._tlog.close()
