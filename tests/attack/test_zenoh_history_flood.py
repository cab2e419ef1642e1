# SPDX-License-Identifier: GPL-3.0-or-later
"""Queries that search 60 MB of telemetry logs, and the pilot's commands meanwhile."""

import os
import threading
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import zenoh
from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.tlog import tlog_records
from service.recording.tlog_recorder import TLOG_FOLDER
from tests.support.benches import Starter
from tests.support.programs import TIMEOUT_S, until
from tests.support.zenoh_bench import I_KNOW, ask, ask_surely, body, endpoint, key, session, zenoh_bench
from tests.support.zenoh_router import EXAMPLES

LOGS, LOG_BYTES = 4, 15_000_000
QUERIES = 20


def write_logs(folder: Path) -> None:
    """Logs of the last hour; to be quick, each repeats some seconds."""
    folder.mkdir(parents=True)
    codec = messages.MAVLink(None, srcSystem=1, srcComponent=1)
    frames = [
        bytes(messages.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3).pack(codec)),
        *[bytes(messages.MAVLink_attitude_message(0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6).pack(codec))] * 20,
        *[bytes(messages.MAVLink_statustext_message(6, b"a text").pack(codec))] * 2,
    ]
    for number in range(LOGS):
        begun_s = time.time() - 3000 + 60 * number
        records = tlog_records(frames, round(begun_s * 1e6))
        path = folder / f"{datetime.fromtimestamp(begun_s, UTC):%Y-%m-%d %H-%M-%S}.tlog"
        path.write_bytes(records * (LOG_BYTES // len(records)))
        os.utime(path, (begun_s + 50, begun_s + 50))


def test_a_flood_of_history_queries_refuses_no_upload_and_blames_no_disk(start: Starter) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'listen = ["{where}"]\n{I_KNOW}')
    write_logs(bench.daemon.state_dir / TLOG_FOLDER)
    answers: list[Any] = []
    ended = threading.Semaphore(0)

    def take(reply: zenoh.Reply) -> None:
        data = reply.ok or reply.err
        assert data is not None
        answers.append(body(data))

    with session(connect=where) as guest, session(connect=where) as pilot:
        ask_surely(pilot, "state")
        for number in range(QUERIES):
            handler = zenoh.handlers.Callback(take, ended.release)
            guest.get(key(f"history?_time=[now(-{3000 + number}s)..]"), handler, timeout=TIMEOUT_S)
        until(lambda: answers, "a refusal, or an answer")
        mission = (EXAMPLES / "naze-field.waypoints").read_bytes()
        results = [ask(pilot, "@cmd/v1/mission/upload", mission)[-1] for _ in range(6)]
        for _ in range(QUERIES):
            assert ended.acquire(timeout=TIMEOUT_S)
    assert [each.get("result", each).get("ack") for each in results] == ["MAV_MISSION_ACCEPTED"] * 6
    refusals = {each["error"] for each in answers if "error" in each}
    assert not [each for each in refusals if "disk" in each], refusals
    assert [each for each in answers if "error" not in each]
    bench.board.assert_unharmed()
