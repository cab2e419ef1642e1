# SPDX-License-Identifier: GPL-3.0-or-later
"""Data on its way to a disk stays complete and ordered, and the queue is bounded."""

import threading

from structlog.testing import capture_logs

from service.recording.disk_writer import DiskWriter
from tests.support.programs import until

ROOM = 1 << 20


def put(writer: DiskWriter[bytes], data: bytes) -> None:
    writer.put(data, len(data))


def test_everything_is_written_in_order_before_the_end() -> None:
    written: list[bytes] = []
    ended: list[bool] = []
    writer = DiskWriter[bytes]("test", written.extend, lambda: ended.append(True))
    pieces = [bytes((number,)) * number for number in range(100)]
    for piece in pieces:
        put(writer, piece)
    writer.close()
    assert b"".join(written) == b"".join(pieces)
    assert ended == [True]


def test_a_hung_disk_blocks_nothing_and_is_reported_once() -> None:
    hangs, goes_on = threading.Event(), threading.Event()
    written: list[bytes] = []

    def write(records: list[bytes]) -> None:
        written.extend(records)
        hangs.set()
        assert goes_on.wait(30)

    writer = DiskWriter[bytes]("test", write, lambda: None)
    put(writer, b"first")
    assert hangs.wait(30)
    with capture_logs() as events:
        for _ in range(3 * ROOM // 1024):
            put(writer, bytes(1024))
    assert [event["event"] for event in events] == ["disk.too_slow"]
    assert writer.dropped == 2 * ROOM
    goes_on.set()
    writer.close()
    assert b"".join(written).endswith(bytes(ROOM))
    assert len(b"".join(written)) < ROOM + 10


def test_a_record_that_cannot_be_written_is_logged_and_does_not_end_recording() -> None:
    written: list[bytes] = []

    def write(records: list[bytes]) -> None:
        if records == [b"bad"]:
            raise ValueError("bad")
        written.extend(records)

    writer = DiskWriter[bytes]("test", write, lambda: None)
    with capture_logs() as events:
        put(writer, b"bad")
        until(lambda: events, "the log entry")
        put(writer, b"good")
        until(lambda: written, "the next record")
    assert [event["event"] for event in events] == ["daemon.fault"]
    writer.close()
