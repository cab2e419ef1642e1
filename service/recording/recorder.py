# SPDX-License-Identifier: GPL-3.0-or-later
"""What a daemon records of itself: telemetry logs always, the UART if it is asked to."""

from collections.abc import Awaitable, Callable

from bridge.gcs.ground import Tap
from service.links.fc_device import Device
from service.links.fc_port import FcPort
from service.recording.tlog_recorder import TlogRecorder
from service.recording.uart_recorder import RecordedPort, UartRecorder
from service.settings import Settings

#: Within the state directory.
TLOG_FOLDER = "logs"


class Recording:
    """Holds what `settings` ask for. UartFileError if the UART cannot be recorded. `tap` takes MAVLink frames."""

    def __init__(self, settings: Settings) -> None:
        self._uart = None if settings.record_uart is None else UartRecorder(settings.record_uart)
        self._tlog: TlogRecorder | None = None
        if settings.tlog is not None and settings.state_dir is not None:
            self._tlog = TlogRecorder(settings.state_dir / TLOG_FOLDER, settings.tlog)
        self.tap: Tap | None = None if self._tlog is None else self._tlog.tap

    def port(
        self,
        open_device: Callable[[], Awaitable[Device]],
        on_open: Callable[[], None],
        on_data: Callable[[bytes], None],
        on_close: Callable[[str], None],
    ) -> FcPort:
        """Return the flight controller's port, recorded if that is wanted."""
        if self._uart is None:
            return FcPort(open_device, on_open, on_data, on_close)
        return RecordedPort(open_device, on_open, on_data, on_close, self._uart)

    def flies(self, *, is_flying: bool) -> None:
        """The craft was armed, or disarmed: the log of a flight is kept longest."""
        if self._tlog is not None:
            self._tlog.flies(is_flying=is_flying)

    def describe(self) -> list[str]:
        """Tell what is recorded, and where; or why not any more."""
        told = [] if self._tlog is None else [f"telemetry log: {self._tlog.describe()}"]
        return told if self._uart is None else [*told, f"UART capture: {self._uart.describe()}"]

    def close(self) -> None:
        """Write what is left."""
        if self._uart is not None:
            self._uart.close()
        if self._tlog is not None:
            self._tlog.close()
