# SPDX-License-Identifier: GPL-3.0-or-later
"""Sessions: no router, a late router, a router that restarts; stalled receivers; duplicate names."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.support.benches import Bench, Starter
from tests.support.plan import judge, plain_plan, records_of
from tests.support.programs import until
from tests.support.zenoh_bench import (
    I_KNOW,
    Reader,
    ask,
    ask_surely,
    endpoint,
    key,
    session,
    zenoh_bench,
)
from tests.support.zenoh_router import Router, running_router

_SUBSCRIBER = """
import sys, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"peer"')
config.insert_json5("scouting/multicast/enabled", "false")
config.insert_json5("listen/endpoints", "[]")
config.insert_json5("connect/endpoints", f'["{sys.argv[1]}"]')
with zenoh.open(config) as session, session.declare_subscriber("fleet/**") as subscriber:
    print(subscriber.recv().key_expr, flush=True)
    for sample in subscriber:
        pass
"""


@contextmanager
def stalled_subscriber(where: str) -> Iterator[None]:
    """A subscriber to all keys, stopped (SIGSTOP) after its first sample; its kernel buffers still fill."""
    with subprocess.Popen([sys.executable, "-c", _SUBSCRIBER, where], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline().startswith("fleet/")
            process.send_signal(signal.SIGSTOP)
            yield
        finally:
            process.kill()


def neighbours(bench: Bench) -> Any:
    status = bench.daemon.status()
    return None if status is None else status["zenoh_neighbours"]


def test_the_daemon_joins_a_router_that_starts_late_or_restarts(start: Starter, tmp_path: Path) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'connect = ["{where}"]')
    with running_router(tmp_path, where) as router, session(connect=where) as opened:
        reader = Reader(opened)
        reader.wait("telemetry/attitude")
        ask_surely(opened, "state")
        router.stop()
        until(lambda: neighbours(bench) == 0, "the loss")
        bench.daemon.push(plain_plan(12))
        received = len(reader.samples)
        router.start_again()
        until(lambda: neighbours(bench) == 1, "the daemon's return")
        until(lambda: len(reader.samples) > received, "samples through the new router")
        (state,) = until(lambda: ask(opened, "state"), "a reply through the new router")
        assert state["mission"]["count"] == 12


def test_two_peers_do_not_need_a_router(start: Starter) -> None:
    """The later peer queries for earlier events."""
    where = endpoint()
    bench = zenoh_bench(start, f'connect = ["{where}"]')
    bench.daemon.push(plain_plan(12))
    with session(listen=where) as opened:
        (current,) = until(lambda: ask(opened, "mission/current"), "an answer")
        assert (current["count"], len(current["items"])) == (12, 12)
        reader = Reader(opened)
        numbers = [each["seq"] for each in until(lambda: reader.of("telemetry/attitude")[20:], "telemetry")]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        tokens = [str(reply.ok.key_expr) for reply in opened.liveliness().get("fleet/*/v1/alive/*") if reply.ok]
        assert [token.rpartition("/")[0] for token in tokens] == [key("alive")]


def upload_while(bench: Bench, router: Router, blow: signal.Signals) -> None:
    """Signal the router during Mission Planner's upload, which must succeed."""
    planner = bench.mission_planner()
    plan = plain_plan(146)
    planner._start_upload(len(plan))
    router.process.send_signal(blow)
    planner.write_rest(plan, 0)
    assert bench.board.records() == records_of(judge(plan))
    bench.board.assert_unharmed()


def test_an_upload_succeeds_although_the_router_hangs(start: Starter, tmp_path: Path) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'connect = ["{where}"]')
    with running_router(tmp_path, where) as router, session(connect=where) as opened:
        Reader(opened).wait("telemetry/attitude")
        upload_while(bench, router, signal.SIGSTOP)
        assert bench.daemon.end() == 0


def test_a_stalled_subscriber_does_not_delay_others(start: Starter) -> None:
    """Missions, other subscribers and the daemon's shutdown are unaffected."""
    where = endpoint()
    bench = zenoh_bench(start, f'listen = ["{where}"]\n{I_KNOW}')
    with stalled_subscriber(where), session(connect=where) as opened:
        reader = Reader(opened, "fleet/*/v1/telemetry/*")
        for number in range(6):
            bench.daemon.push(plain_plan(146, number))
        received = len(reader.samples)
        until(lambda: len(reader.samples) > received + 20, "telemetry for the other subscriber")
        until(lambda: len(ask(opened, "state")) == 1, "a reply to the other subscriber")
        bench.board.assert_unharmed()
        assert bench.daemon.end() == 0
    assert "Traceback" not in bench.daemon.printed


def test_a_failed_connection_is_reported_with_the_reason(start: Starter) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'connect = ["{where}"]')
    alone = until(lambda: bench.daemon.has_logged("zenoh.alone"), "a log entry about it")
    assert alone["why"] == f"{where}: no router is running there (connection refused)"
