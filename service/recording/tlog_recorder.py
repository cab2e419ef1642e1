# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the frames to and from ground stations into telemetry logs, on a thread: the event loop never waits."""

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import structlog

from protocols.mavlink.dialect import messages
from protocols.tlog import heartbeat_type, tlog_records
from service.recording.tlog_folder import TlogFolder

#: Within the state directory.
TLOG_FOLDER = "logs"
#: A larger jump means that the clock was set: a Pi gets the time only from the network.
_CLOCK_STEP_US = 10_000_000
#: The maximum loss if the process is killed.
_FLUSH_S = 1.0
#: For the last write: a hanging disk must not keep the daemon from ending.
_CLOSE_TIMEOUT_S = 1.0
#: Bytes beyond this are dropped while an SD card stalls: minutes of telemetry, which takes six times as much memory.
_MAX_WAITING = 1 << 20
#: When frames were sent or received, monotonic nanoseconds, or True if they belong to a flight, and the frames.
_Taken = tuple[int, bool, Sequence[bytes]]

_log = structlog.get_logger()


class TlogRecorder:
    """Takes whole frames that were received or sent.

    Within a file time advances evenly; when the clock is set a new file begins.

    A file begins without ground stations' heartbeats: Mission Planner shows the system whose HEARTBEAT comes first in a
    log, and recognises only the systems 255 and 253 as ground stations. They are left out until a vehicle's HEARTBEAT.

    `most`: the bytes of all files together. `read_clock`: the system's time, nanoseconds since the Unix epoch.
    """

    def __init__(self, folder: Path, most: int, read_clock: Callable[[], int] = time.time_ns) -> None:
        self._folder = TlogFolder(folder, most)
        self._read_clock = read_clock
        self._epoch_us = self._present_epoch_us()
        self._is_flying = False
        self._awaits_vehicle = True
        # Without a lock: `record` only appends and adds, the thread only removes.
        self._waiting: deque[_Taken] = deque()
        self._size_put = self._size_taken = self._dropped = 0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="telemetry log", daemon=True)
        self._thread.start()

    def record(self, frames: Sequence[bytes]) -> None:
        """Queue frames, or drop them if too many are waiting."""
        size = sum(map(len, frames))
        if self._size_put - self._size_taken + size <= _MAX_WAITING:
            self._waiting.append((time.monotonic_ns(), self._is_flying, frames))
            self._size_put += size
            return
        if not self._dropped:
            _log.warning("disk.too_slow", writing="telemetry log", why="the disk does not keep up; data is dropped")
        self._dropped += size

    def flies(self, *, is_flying: bool) -> None:
        """Mark the following frames as part of a flight, or not."""
        self._is_flying = is_flying

    def describe(self) -> str:
        """The file in use, or the reason why there is none, for the status."""
        dropped = f", {self._dropped} bytes dropped" if self._dropped else ""
        return f"telemetry log: {self._folder.describe()}{dropped}"

    def close(self) -> None:
        """Write the rest, then end the thread."""
        self._ending.set()
        self._thread.join(_CLOSE_TIMEOUT_S)

    # On the thread.

    def _run(self) -> None:
        while not self._ending.wait(_FLUSH_S):
            self._flush()
        self._flush()
        self._folder.close()

    def _flush(self) -> None:
        taken = [self._waiting.popleft() for _ in range(len(self._waiting))]
        self._size_taken += sum(len(frame) for _, _, frames in taken for frame in frames)
        try:
            self._write(taken)
        except Exception:  # a bug must not end the recording
            _log.exception("daemon.fault", what="writing the telemetry log")

    def _write(self, taken: list[_Taken]) -> None:
        """A time step needs a new file."""
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
