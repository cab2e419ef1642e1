# SPDX-License-Identifier: GPL-3.0-or-later
"""Capture files read back as written; damaged ones as far as possible."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.plain_text import plain_text
from protocols.uart_capture import UartAction, UartEvent, capture_header, capture_line, read_capture

HEADER = capture_header("2026-11-21T06:33:06Z")
SPEEDS = st.sampled_from([None, 1200, 57600, 115200])
ACTIONS = st.sampled_from([UartAction.READ, UartAction.WRITE])


def event(at: float, action: UartAction = UartAction.READ, data: bytes = b"$M", text: str = "") -> UartEvent:
    return UartEvent(at, 115200, action, data if action in (UartAction.READ, UartAction.WRITE) else b"", text)


@st.composite
def recordings(draw: st.DrawFn) -> list[UartEvent]:
    """Events of one run of a daemon: from the opening of the port, at 0, with times in microseconds."""
    at, speed = 0, draw(SPEEDS)
    found = [UartEvent(0.0, speed, UartAction.OPEN)]
    for _ in range(draw(st.integers(0, 20))):
        at += draw(st.integers(0, 10**7))
        found.append(UartEvent(at / 1e6, draw(SPEEDS), draw(ACTIONS), draw(st.binary(min_size=1, max_size=80))))
    return [*found, UartEvent(at / 1e6, speed, UartAction.CLOSE, text=plain_text(draw(st.text())))]


def written(events: list[UartEvent]) -> bytes:
    return HEADER + b"".join(map(capture_line, events))


@given(recordings())
def test_written_events_are_read(events: list[UartEvent]) -> None:
    assert read_capture(written(events)) == events


@given(recordings(), st.data())
def test_a_truncated_capture_is_read_up_to_the_last_complete_line(events: list[UartEvent], data: st.DataObject) -> None:
    whole = written(events)
    torn = whole[: data.draw(st.integers(0, len(whole)))]
    lines = torn.count(b"\n") - 1
    found = read_capture(torn)
    # The last line may be complete without its line feed.
    assert found in (events[: max(lines, 0)], events[: lines + 1])


@given(st.lists(st.one_of(st.binary(max_size=60), st.builds(lambda at: capture_line(event(at)), st.floats(0, 1e8)))))
def test_any_bytes_are_read(lines: list[bytes]) -> None:
    times = [found.at for found in read_capture(b"\n".join(lines))]
    assert times == sorted(times)
    assert times[:1] in ([], [0.0])


@pytest.mark.parametrize(
    "line",
    [
        "{}",
        "[1]",
        "7",
        '{"t":1,"baud":115200}',
        '{"t":"1","baud":115200,"read":"24"}',
        '{"t":1,"baud":"fast","read":"24"}',
        '{"t":1,"baud":115200,"read":"2"}',
        '{"t":1,"baud":115200,"read":24}',
        '{"t":1,"baud":115200,"read":null}',
        '{"t":Infinity,"baud":115200,"read":"24"}',
        '{"t":NaN,"baud":115200,"read":"24"}',
        '{"t":1e999,"baud":115200,"read":"24"}',
        '{"t":-1,"baud":115200,"read":"24"}',
        '{"t":1' + 400 * "0" + ',"baud":115200,"read":"24"}',
        '{"t":1,"baud":-5,"read":"24"}',
        "[" * 100_000,
    ],
)
def test_an_unknown_line_is_skipped(line: str) -> None:
    events = [event(0.0), event(1.0)]
    lines = [capture_line(events[0]), line.encode() + b"\n", capture_line(events[1])]
    assert read_capture(HEADER + b"".join(lines)) == events


def test_an_excerpt_begins_at_0() -> None:
    lines = written([event(float(second)) for second in range(100)]).splitlines(keepends=True)
    assert [found.at for found in read_capture(b"".join(lines[61:71]))] == [float(second) for second in range(10)]


def test_recordings_in_one_file_follow_each_other_after_a_pause() -> None:
    first = [event(0.0, UartAction.OPEN), event(2.0), event(3.0, UartAction.CLOSE, text="the daemon stops")]
    killed = [event(5.0, UartAction.OPEN), event(6.0)]
    found = read_capture(written(first) + written(killed) + written(first))
    assert [(entry.at, entry.action) for entry in found] == [
        (0.0, UartAction.OPEN), (2.0, UartAction.READ), (3.0, UartAction.CLOSE),
        (4.0, UartAction.OPEN), (5.0, UartAction.READ), (5.0, UartAction.CLOSE),
        (6.0, UartAction.OPEN), (8.0, UartAction.READ), (9.0, UartAction.CLOSE),
    ]  # fmt: skip
