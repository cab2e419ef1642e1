# SPDX-License-Identifier: GPL-3.0-or-later
"""Notifications to systemd, and stopping during a mission transfer."""

import asyncio
import json
import signal
import socket
from dataclasses import asdict
from pathlib import Path
from typing import TextIO

import pytest

from protocols.mission_item import MissionResult
from service.daemon.daemon import Daemon
from service.daemon.lifecycle import run_until_signal
from service.machine.notify import Notifier
from service.settings import Settings
from service.settings.addresses import parse_fc
from tests.support.benches import Starter
from tests.support.plain_station import udp_station
from tests.support.plan import PlanRow, as_items, judge, plain_plan, records_of
from tests.support.programs import TIMEOUT_S, until
from tests.support.programs import Daemon as DaemonProgram

_LONG = plain_plan(146)
#: 146 records take four seconds then: the push has not ended when a test interferes.
_SLOWLY = ("--baud", "9600")


class BugError(Exception):
    """A bug in the bridge itself."""


async def test_a_bug_does_not_prevent_a_stop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    daemon = Daemon(Settings(parse_fc("sim:"), [], tmp_path / "state"))
    running = asyncio.create_task(run_until_signal(daemon, Notifier({})))
    await daemon.started.wait()

    def bug(_now: float) -> None:
        raise BugError

    monkeypatch.setattr(daemon.bridge, "stop_missions", bug)
    signal.raise_signal(signal.SIGTERM)
    async with asyncio.timeout(TIMEOUT_S):
        await asyncio.wait([running])
    assert running.exception() is None


def push_begun(daemon: DaemonProgram, plan: list[PlanRow] = _LONG, confirmed: int = 1) -> TextIO:
    """Push a list like the command line; return the further answers once the board has so many records of it."""
    items = [asdict(item) for item in as_items(plan)]
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(TIMEOUT_S)
        connection.connect(str(daemon.state_dir / "control.sock"))
        connection.sendall(json.dumps({"do": "push", "source": "test", "items": items}).encode() + b"\n")
        answers = connection.makefile()  # which keeps it open
    while json.loads(answers.readline()).get("progress", 0) < confirmed:
        pass
    return answers


def last_answer(answers: TextIO) -> dict[str, dict[str, object]]:
    with answers:
        answer: dict[str, dict[str, object]] = json.loads(list(answers)[-1])
        return answer


def outcomes(start: Starter, daemon: DaemonProgram) -> list[str]:
    """The stored outcomes, read by another daemon on the same store."""
    after = start.daemon("sim:", state_dir=daemon.state_dir)
    after.wait_up()
    return [mission["outcome"] for mission in after.missions()]


def test_a_push_close_to_the_end_is_finished(start: Starter) -> None:
    bench = start.bench()
    answers = push_begun(bench.daemon, confirmed=120)
    assert bench.daemon.end() == 0
    assert last_answer(answers)["result"]["ack"] == "MAV_MISSION_ACCEPTED"
    assert bench.board.records() == records_of(judge(_LONG))
    assert outcomes(start, bench.daemon) == ["VERIFIED"]


@pytest.mark.parametrize("trouble", ["slow", "deaf"])
def test_a_push_that_would_take_long_is_aborted(start: Starter, trouble: str) -> None:
    """The old list is kept, the sender is told, the outcome is stored, and systemd waits at most 2 s."""
    bench = start.bench(*_SLOWLY, *(("--capacity", "500") if trouble == "slow" else ()))
    bench.daemon.push(plain_plan(5))
    old = bench.board.records()
    answers = push_begun(bench.daemon, plain_plan(490) if trouble == "slow" else _LONG)
    if trouble == "deaf":
        bench.board.set("hang 10")
    # Neither push can finish within 2 s, so the result shows that the daemon did not wait.
    assert bench.daemon.end() == 0
    answer = last_answer(answers)["result"]
    assert answer["ack"] == "MAV_MISSION_DENIED"
    assert "old one kept" in str(answer["text"]) or trouble == "deaf"
    assert outcomes(start, bench.daemon) == ["FAILED", "VERIFIED"]
    if trouble == "slow":
        assert bench.board.records() == old
    assert "Traceback" not in bench.daemon.printed


def test_a_second_signal_does_not_wait(start: Starter) -> None:
    bench = start.bench(*_SLOWLY)
    answers = push_begun(bench.daemon)
    bench.board.set("hang 10")
    bench.daemon.process.send_signal(signal.SIGINT)
    until(lambda: bench.daemon.has_logged("daemon.stopping"), "the first signal")
    assert bench.daemon.end(signal.SIGINT) == 0
    answers.close()
    assert "Traceback" not in bench.daemon.printed


def test_a_ground_station_is_informed_of_the_stop(start: Starter) -> None:
    """Its upload is refused with the reason."""
    bench = start.bench()
    with udp_station(bench.daemon.address) as station:
        station.send_heartbeat()
        station.send_count(20)
        station.wait_for("MISSION_REQUEST")
        bench.daemon.process.send_signal(signal.SIGTERM)
        assert station.wait_for("MISSION_ACK").type == MissionResult.OPERATION_CANCELLED
        assert "Upload ended: naze-bridge stops" in " ".join(
            message.text for message in station.received if message.get_type() == "STATUSTEXT"
        )
