# SPDX-License-Identifier: GPL-3.0-or-later
"""Events and reports survive outages; late subscribers and recorders get them; storages answer for absent vehicles."""

import signal
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
import zenoh
from zenoh import ext

from tests.support.benches import Starter
from tests.support.plan import plain_plan
from tests.support.programs import until
from tests.support.zenoh_bench import Reader, ask_surely, body, endpoint, key, session, zenoh_bench
from tests.support.zenoh_router import running_router

DAY = timedelta(days=1)


def recovering(opened: zenoh.Session, suffix: str, received: list[Any]) -> ext.AdvancedSubscriber[None]:
    return ext.declare_advanced_subscriber(
        opened,
        key(suffix),
        lambda sample: received.append(body(sample)),
        history=ext.HistoryConfig(detect_late_publishers=True),
        recovery=ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
    )


def test_events_and_reports_survive_a_router_that_hangs_and_dies(start: Starter, tmp_path: Path) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'connect = ["{where}"]')
    events: list[Any] = []
    reports: list[Any] = []
    with running_router(tmp_path, where) as router, session(connect=where) as opened:
        subscribers = [recovering(opened, "event", events), recovering(opened, "mission/report", reports)]
        until(lambda: any(each["event"] == "fc.found" for each in events), "earlier events")
        router.process.send_signal(signal.SIGSTOP)
        for count in range(4, 10):
            bench.daemon.push(plain_plan(count))
        router.end(signal.SIGKILL)
        router.start_again()
        until(lambda: len(reports) >= 6, "all reports")
        assert [len(each["sent"]) for each in reports] == list(range(4, 10))
        assert [each["seq"] for each in reports] == list(range(6))
        until(lambda: sum(each["event"] == "mission.push_ended" for each in events) == 6, "all events")
        numbers = [each["seq"] for each in events]  # others may follow
        assert numbers == list(range(len(numbers)))
        del subscribers
    status = bench.daemon.status()
    assert status is not None
    assert status["zenoh_dropped"] == 0


def test_a_late_subscriber_gets_earlier_events(start: Starter) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'listen = ["{where}"]')
    bench.daemon.push(plain_plan(7))
    received: dict[str, list[Any]] = {name: [] for name in ("event", "mission/report", "mission/current", "state")}
    with session(connect=where) as opened:
        subscribers = [recovering(opened, name, found) for name, found in received.items()]
        until(lambda: all(received.values()), "the past")
        assert len(received["mission/report"][0]["stored"]) == 7
        assert received["mission/current"][-1]["count"] == 7
        del subscribers


def test_a_recorder_of_everything_is_not_a_ground_station(start: Starter) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'listen = ["{where}"]')
    with session(connect=where) as opened:
        reader = Reader(opened, "fleet/**")
        until(lambda: len(reader.of("telemetry/attitude")) > 10, "telemetry")
        status = bench.daemon.status()
        assert status is not None
        assert status["ground_stations"] == []
        overview = reader.wait("overview", lambda each: each["mission_count"] is not None)
        state = reader.of("state")[-1]
        assert (overview["link"], overview["armed"], overview["mission_count"]) == ("MSP", False, 0)
        assert overview["lat_e7"] == pytest.approx(state["position"]["lat_deg"] * 1e7, abs=100)
        assert ask_surely(opened, "overview")["mission_checksum"] == int(state["mission"]["checksum"], 16)
        assert all(len(each.payload) <= 60 for each in reader.samples if str(each.key_expr) == key("overview"))
        assert not [each for each in reader.samples if "@" in str(each.key_expr)]


def test_replies_and_samples_have_a_time(start: Starter) -> None:
    where = endpoint()
    zenoh_bench(start, f'listen = ["{where}"]')
    with session(connect=where) as opened:
        reader = Reader(opened)
        reader.wait("telemetry/attitude")
        assert all(sample.timestamp is not None for sample in reader.samples)
        ask_surely(opened, "state")
        (reply,) = opened.get(key("state"))
        assert reply.ok is not None
        assert reply.ok.timestamp is not None
        assert body(reply.ok)["time_source"] in {"ntp", "pi"}
