"""The recorder and its clock: a Pi learns the time when there is a network, in the middle of a recording."""

import time
from itertools import count
from pathlib import Path

import pytest

from protocols.mavlink.dialect import messages
from protocols.tlog import read_tlog
from service.settings import TlogLimits
from service.tlog_recorder import TlogRecorder

HOUR_NS = 3600 * 10**9
PATIENCE_S = 20.0


def frame(number: int) -> bytes:
    codec = messages.MAVLink(None, srcSystem=1, srcComponent=1)
    return bytes(messages.MAVLink_system_time_message(0, number).pack(codec))


@pytest.mark.parametrize("step_ns", [1000 * HOUR_NS, -HOUR_NS])
def test_a_step_of_the_clock_begins_a_new_file(tmp_path: Path, step_ns: int) -> None:
    ahead_ns = 0
    recorder = TlogRecorder(tmp_path, TlogLimits(), lambda: time.time_ns() + ahead_ns)
    deadline = time.monotonic() + PATIENCE_S
    for number in count():
        recorder.tap([frame(number)])
        files = set(tmp_path.iterdir())
        if files:
            # The first file is there: now the time comes.
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
        assert stamps[path][-1] - stamps[path][0] < PATIENCE_S * 1e9
        assert abs(stamps[path][-1] - shift - time.time_ns()) < 60e9


def test_a_clock_that_is_only_corrected_changes_nothing(tmp_path: Path) -> None:
    corrections = count(step=10**8)
    recorder = TlogRecorder(tmp_path, TlogLimits(), lambda: time.time_ns() + next(corrections))
    deadline = time.monotonic() + PATIENCE_S
    while not any(path.stat().st_size > 200 for path in tmp_path.iterdir()):
        recorder.tap([frame(1)])
        assert time.monotonic() < deadline
        time.sleep(0.05)
    recorder.close()
    (path,) = tmp_path.iterdir()
    stamps = [record.at_us for record in read_tlog(path.read_bytes())]
    assert stamps == sorted(stamps)
