# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the frames to and from ground stations into telemetry logs."""

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from protocols.mavlink.dialect import messages
from protocols.tlog import heartbeat_type, tlog_records
from service.recording.disk_writer import DiskWriter
from service.recording.tlog_folder import TlogFolder
from service.settings import TlogLimits

#: Within the state directory.
TLOG_FOLDER = "logs"
#: A larger jump means that the clock was set: a Pi gets the time only from the network.
_CLOCK_STEP_US = 10_000_000
#: When frames were sent or received, monotonic nanoseconds; True if they belong to a flight; and the frames.
_Taken = tuple[int, bool, Sequence[bytes]]


class TlogRecorder:
    """Takes whole frames that were received or sent.

    Within a file time advances evenly; when the clock is set a new file begins.

    A file begins without ground stations' heartbeats: Mission Planner shows the system whose HEARTBEAT comes first in a
    log, and recognises only the systems 255 and 253 as ground stations. They are left out until a vehicle's HEARTBEAT.

    `read_clock`: the system's time, nanoseconds since the Unix epoch.
    """

    def __init__(self, folder: Path, limits: TlogLimits, read_clock: Callable[[], int] = time.time_ns) -> None:
        self._folder = TlogFolder(folder, limits)
        self._read_clock = read_clock
        self._epoch_us = self._present_epoch_us()
        self._is_flying = False
        self._awaits_vehicle = True
        self._writer = DiskWriter("telemetry log", self._write, self._folder.close)

    def record(self, frames: Sequence[bytes]) -> None:
        self._writer.put((time.monotonic_ns(), self._is_flying, frames), sum(map(len, frames)))

    def flies(self, *, is_flying: bool) -> None:
        """Mark the following frames as part of a flight, or not."""
        self._is_flying = is_flying

    def describe(self) -> str:
        """The file in use, or the reason why there is none, for the status."""
        dropped = f", {self._writer.dropped} bytes dropped" if self._writer.dropped else ""
        return f"telemetry log: {self._folder.describe()}{dropped}"

    def close(self) -> None:
        self._writer.close()

    def _write(self, taken: list[_Taken]) -> None:
        """Runs on the writer's thread, as do all methods from here on. A time step needs a new file."""
        epoch_us = self._present_epoch_us()
        stepped = abs(epoch_us - self._epoch_us) > _CLOCK_STEP_US
        file_is_over = stepped or self._folder.is_full
        is_flight = any(is_flying for _, is_flying, _ in taken)
        self._folder.write(b"".join(self._records(taken)), time.monotonic(), is_flight=is_flight)
        if file_is_over:
            self._folder.close()
            self._epoch_us = epoch_us
            self._awaits_vehicle = True

    def _records(self, taken: list[_Taken]) -> Iterator[bytes]:
        for at_ns, _, frames in taken:
            logged = self._from_vehicle_on(frames) if self._awaits_vehicle else frames
            yield tlog_records(logged, self._epoch_us + at_ns // 1000)

    def _from_vehicle_on(self, frames: Sequence[bytes]) -> Sequence[bytes]:
        found: list[bytes] = []
        for frame in frames:
            announced = heartbeat_type(frame)
            if announced == messages.MAV_TYPE_GCS and self._awaits_vehicle:
                continue
            if announced is not None:
                self._awaits_vehicle = False
            found.append(frame)
        return found

    def _present_epoch_us(self) -> int:
        """When the monotonic clock was 0, microseconds since the Unix epoch."""
        return (self._read_clock() - time.monotonic_ns()) // 1000
