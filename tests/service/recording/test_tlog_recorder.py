# SPDX-License-Identifier: GPL-3.0-or-later
"""The recorder and its clock: a Pi gets the time from the network, possibly during a recording."""

import time
from itertools import count
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from service.recording.tlog_recorder import TlogRecorder
from tests.support.programs import TIMEOUT_S
from tests.support.tlog import read_tlog

HOUR_NS = 3600 * 10**9


def frame(number: int) -> bytes:
    codec = messages.MAVLink(None, srcSystem=1, srcComponent=1)
    return bytes(messages.MAVLink_system_time_message(0, number).pack(codec))


@pytest.mark.parametrize("step_ns", [100 * HOUR_NS, -HOUR_NS])
def test_a_step_of_the_clock_begins_a_new_file(tmp_path: Path, step_ns: int) -> None:
    ahead_ns = 0
    recorder = TlogRecorder(tmp_path, 256 << 20, lambda: time.time_ns() + ahead_ns)
    deadline = time.monotonic() + TIMEOUT_S
    for number in count():
        recorder.record([frame(number)])
        files = set(tmp_path.iterdir())
        if files:
            # The first file exists; now the clock is set.
            ahead_ns = step_ns
        if len(files) == 2:
            break
        assert time.monotonic() < deadline
        time.sleep(0.01)
    recorder.close()
    earlier, later = sorted(tmp_path.iterdir(), key=lambda path: path.stat().st_mtime_ns)
    stamps = {path: [record.at_us * 1000 for record in read_tlog(path.read_bytes())] for path in (earlier, later)}
    assert len(stamps[earlier]) + len(stamps[later]) == number + 1
    for path, shift in ((earlier, 0), (later, step_ns)):
        assert stamps[path] == sorted(stamps[path])
        assert stamps[path][-1] - stamps[path][0] < TIMEOUT_S * 1e9
        assert abs(stamps[path][-1] - shift - time.time_ns()) < 60e9


def heartbeat(kind: int, sysid: int, *, version: int = 2) -> bytes:
    codec = messages.MAVLink(None, srcSystem=sysid, srcComponent=1)
    message = messages.MAVLink_heartbeat_message(kind, 3, 0, 0, 0, 3)
    return bytes(message.pack(codec, force_mavlink1=version == 1))


@pytest.mark.parametrize("version", [1, 2])
def test_the_first_heartbeat_in_a_file_is_the_vehicles(tmp_path: Path, version: int) -> None:
    """Mission Planner shows the craft whose heartbeat comes first. The next file begins the same way."""
    station = heartbeat(messages.MAV_TYPE_GCS, 245, version=version)
    vehicle = heartbeat(messages.MAV_TYPE_QUADROTOR, 1, version=version)
    ahead_ns = 0
    recorder = TlogRecorder(tmp_path, 256 << 20, lambda: time.time_ns() + ahead_ns)
    recorder.record([station, frame(1)])
    recorder.record([frame(2), station, vehicle, station])
    deadline = time.monotonic() + TIMEOUT_S
    while not (first := list(tmp_path.iterdir())):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    ahead_ns = HOUR_NS
    while len(later := set(tmp_path.iterdir()) - set(first)) == 0:
        recorder.record([station])
        recorder.record([frame(3)])
        assert time.monotonic() < deadline
        time.sleep(0.01)
    recorder.record([vehicle, station])
    recorder.close()
    begun = [record.frame.raw for record in read_tlog(first[0].read_bytes())]
    assert begun[:4] == [frame(1), frame(2), vehicle, station]
    heartbeats = [record.frame.raw for record in read_tlog(later.pop().read_bytes()) if record.frame.msgid == 0]
    assert heartbeats == [vehicle, station]


def test_a_small_clock_correction_is_ignored(tmp_path: Path) -> None:
    corrections = count(step=10**8)
    recorder = TlogRecorder(tmp_path, 256 << 20, lambda: time.time_ns() + next(corrections))
    deadline = time.monotonic() + TIMEOUT_S
    while not any(path.stat().st_size > 200 for path in tmp_path.iterdir()):
        recorder.record([frame(1)])
        assert time.monotonic() < deadline
        time.sleep(0.05)
    recorder.close()
    (path,) = tmp_path.iterdir()
    stamps = [record.at_us for record in read_tlog(path.read_bytes())]
    assert stamps == sorted(stamps)
