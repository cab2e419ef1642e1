# SPDX-License-Identifier: GPL-3.0-or-later
"""`history?_time=[..]` from telemetry logs."""

import errno
import os
from datetime import UTC, datetime
from functools import partial
from itertools import pairwise
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from payloads.mission_data import Json
from protocols.mavlink.dialect import Message
from protocols.tlog import tlog_records
from service.daemon.api import DaemonApi
from service.daemon.daemon import Daemon
from service.settings import Settings
from service.settings.addresses import SimulatedFc
from service.zenoh_link.history import History
from service.zenoh_link.logged_past import log_stamps, read_logged_past
from service.zenoh_link.time_range import TimeRange

NOON_S = datetime(2026, 5, 1, 12, tzinfo=UTC).timestamp()
EVER = TimeRange()
ARMED = messages.MAV_MODE_FLAG_SAFETY_ARMED


def heartbeat(*, armed: bool) -> Message:
    return messages.MAVLink_heartbeat_message(2, 3, ARMED if armed else 0, 0, 4, 3)


def text(words: str) -> Message:
    return messages.MAVLink_statustext_message(6, words.encode())


def position(number: int) -> Message:
    return messages.MAVLink_global_position_int_message(0, 453838000 + number, 84733000, 152000, 20000, 0, 0, 0, 0)


def write(folder: Path, begun_s: float, *records: tuple[float, Message], compid: int = 1, flight: bool = False) -> Path:
    """A log as written by the recorder: named after its beginning, modified at its end."""
    folder.mkdir(exist_ok=True)
    name = datetime.fromtimestamp(begun_s, UTC).strftime("%Y-%m-%d %H-%M-%S") + " flight" * flight + ".tlog"
    codec = messages.MAVLink(None, srcSystem=1, srcComponent=compid)
    path = folder / name
    path.write_bytes(b"".join(tlog_records([bytes(each.pack(codec))], round(at_s * 1e6)) for at_s, each in records))
    ended_s = max(at_s for at_s, _ in records)
    os.utime(path, (ended_s, ended_s))
    return path


def test_texts_and_arming_are_in_order(tmp_path: Path) -> None:
    """The log continues in another file during the flight; arming is reported once."""
    write(tmp_path, NOON_S, (NOON_S, heartbeat(armed=True)), (NOON_S + 5, text("Mission: 12 items")), flight=True)
    write(tmp_path, NOON_S + 6, (NOON_S + 6, heartbeat(armed=True)), (NOON_S + 9, heartbeat(armed=False)))
    write(tmp_path, NOON_S + 600, (NOON_S + 600, heartbeat(armed=True)))
    past = read_logged_past(tmp_path, EVER, 0)
    assert [(each["time_s"] - NOON_S, each["event"], each["facts"]) for each in past.events] == [
        (0, "vehicle.armed", {}),
        (5, "gcs.text", {"text": "Mission: 12 items"}),
        (9, "vehicle.disarmed", {}),
        (600, "vehicle.armed", {}),
    ]
    assert (past.from_s, past.positions) == (NOON_S, [])


def test_only_the_requested_range_is_returned(tmp_path: Path) -> None:
    for hour in range(4):
        at_s = NOON_S + 3600 * hour
        write(tmp_path, at_s, *((at_s + n, text(f"{hour}.{n}")) for n in range(3)))
    past = read_logged_past(tmp_path, TimeRange(NOON_S + 3601, NOON_S + 7200), 0)
    assert [each["facts"]["text"] for each in past.events] == ["1.1", "1.2", "2.0"]
    assert past.from_s == NOON_S + 3600


def test_runs_may_overlap_because_the_clock_resumes_at_the_last_shutdown(tmp_path: Path) -> None:
    """Only of the present run's logs the later part is left out: its events are in memory."""
    write(tmp_path, NOON_S, (NOON_S, heartbeat(armed=False)), (NOON_S + 900, text("flown")))
    earlier = log_stamps(tmp_path)
    write(tmp_path, NOON_S + 60, (NOON_S + 60, heartbeat(armed=False)), (NOON_S + 70, text("in memory")))
    write(tmp_path, NOON_S, (NOON_S, heartbeat(armed=False)), (NOON_S + 900, text("flown")), flight=True)
    (tmp_path / "2026-05-01 12-00-00.tlog").unlink()
    for start_s in (NOON_S, NOON_S + 600):
        past = read_logged_past(tmp_path, TimeRange(start_s), 0, earlier, kept_from_s=NOON_S + 62)
        assert [each["facts"]["text"] for each in past.events] == ["flown"]


def test_part_of_a_long_log_is_read(tmp_path: Path) -> None:
    """It is not read from its beginning, but the armed state at the start of the range is known."""
    flight = [(NOON_S + second, heartbeat(armed=1000 <= second < 2000)) for second in range(3600)]
    path = write(tmp_path, NOON_S, *flight)
    with path.open("ab") as file:
        file.write(bytes(9000))  # a power cut
    for start, end, expected in (
        (999.5, 1500, [1000]),
        (1000.5, 2100, [2000]),
        (1500, 1600, []),
        (-9, 9999, [1000, 2000]),
    ):
        past = read_logged_past(tmp_path, TimeRange(NOON_S + start, NOON_S + end), 0)
        assert [each["time_s"] - NOON_S for each in past.events] == expected


def test_an_interrupted_search_has_all_events_of_the_time_that_it_covers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flight = [
        (NOON_S + second, text(f"at {second}") if second % 2 else heartbeat(armed=100 <= second < 500))
        for second in range(600)
    ]
    write(tmp_path, NOON_S, *flight)
    whole = read_logged_past(tmp_path, EVER, 0)
    assert len(whole.events) == 302
    monkeypatch.setattr("service.zenoh_link.logged_past._PIECE", 1000)
    assert read_logged_past(tmp_path, EVER, 0) == whole
    for most in range(9):
        looks = iter([*[False] * most, True])
        part = read_logged_past(tmp_path, EVER, 0, is_enough=partial(next, looks))
        assert part.from_s is not None
        assert part.from_s > NOON_S
        assert part.events == [event for event in whole.events if event["time_s"] >= part.from_s]


@pytest.mark.parametrize("most", [1, 7, 100, 1000])
def test_positions_are_thinned_evenly(tmp_path: Path, most: int) -> None:
    """To at most one a second."""
    flown = [(NOON_S + 0.2 * number, position(number)) for number in range(900)]
    write(tmp_path, NOON_S, *flown[:600])
    write(tmp_path, NOON_S + 120, *flown[600:])
    found = read_logged_past(tmp_path, EVER, most).positions
    assert min(most, 180) / 2 < len(found) <= most
    assert found[-1] == {
        "time_s": NOON_S + 179,
        "lat_deg": 45.3838895,
        "lon_deg": 8.4733,
        "altitude_m": 152.0,
        "height_m": 20.0,
    }
    gaps = [round(later["time_s"] - each["time_s"], 3) for each, later in pairwise(found)]
    assert max(gaps, default=0) <= 2 * max(180 / most, 1) + 0.5


def test_other_senders_other_files_and_damage_are_skipped(tmp_path: Path) -> None:
    assert read_logged_past(tmp_path / "none", EVER, 9).from_s is None
    write(tmp_path, NOON_S, (NOON_S, text("of a station")), (NOON_S, heartbeat(armed=True)), compid=190)
    path = write(tmp_path, NOON_S + 60, (NOON_S + 60, text("whole")), (NOON_S + 61, text("cut off")))
    os.truncate(path, path.stat().st_size - 3)
    (tmp_path / "2026-99-99 99-99-99.tlog").write_bytes(b"no date")
    (tmp_path / "notes.txt").write_bytes(b"no log")
    assert [each["facts"]["text"] for each in read_logged_past(tmp_path, EVER, 9).events] == ["whole"]


async def test_a_failing_disk_is_reported_by_the_query_and_does_not_prevent_the_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(path: Path) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO), path)

    async def none_stored(*_range: float) -> Json:
        return {"missions": []}

    monkeypatch.setattr("service.zenoh_link.logged_past.os.scandir", fail)
    monkeypatch.setattr(DaemonApi, "missions_between", none_stored)
    history = History(DaemonApi(Daemon(Settings(SimulatedFc()))), tmp_path, lambda: NOON_S)
    with pytest.raises(OSError, match="Input/output error"):
        await history.answer(None, 0)


async def test_a_clock_that_was_ahead_doubles_no_event(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The events after the correction are in a telemetry log of this run, too."""

    async def none_stored(*_range: float) -> Json:
        return {"missions": []}

    monkeypatch.setattr(DaemonApi, "missions_between", none_stored)
    history = History(DaemonApi(Daemon(Settings(SimulatedFc()))), tmp_path, lambda: NOON_S)
    for number, at_s in enumerate((NOON_S + 86400, NOON_S)):
        history.add({"v": 1, "seq": number, "time_s": at_s, "level": "info", "event": "vehicle.armed", "facts": {}})
    write(tmp_path, NOON_S, (NOON_S, heartbeat(armed=True)))
    found = await history.answer("[..]", 0)
    assert [each["seq"] for each in found["events"]] == [1, 0]
