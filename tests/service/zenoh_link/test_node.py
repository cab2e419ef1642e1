# SPDX-License-Identifier: GPL-3.0-or-later
"""Sessions: no router, a late router, a router that restarts; stalled receivers; duplicate names."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from payloads.keys import COMMANDS
from protocols.mavlink.codec import MavlinkDecoder
from protocols.mavlink.frame import MavlinkSplitter
from tests.support.benches import Bench, Starter
from tests.support.plan import judge, plain_plan, plan_text, records_of
from tests.support.programs import until
from tests.support.zenoh_bench import (
    I_KNOW,
    VEHICLE,
    Reader,
    ask,
    ask_surely,
    endpoint,
    key,
    session,
    write_config,
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


def count(bench: Bench, event: str) -> int:
    return sum(entry["event"] == event for entry in bench.daemon.events())


def test_the_daemon_joins_a_router_that_starts_late_or_restarts(start: Starter, tmp_path: Path) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'connect = ["{where}"]')
    with running_router(tmp_path, where) as router, session(connect=where) as opened:
        reader = Reader(opened)
        reader.wait("telemetry/attitude")
        ask_surely(opened, "state")
        router.stop()
        until(lambda: count(bench, "zenoh.left") == 1, "the loss")
        bench.daemon.push(plain_plan(12))
        received = len(reader.samples)
        router.start_again()
        until(lambda: count(bench, "zenoh.joined") == 2, "the daemon's return")
        until(lambda: len(reader.samples) > received, "samples through the new router")
        (state,) = until(lambda: ask(opened, "state"), "a reply through the new router")
        assert state["mission"]["count"] == 12


def test_two_peers_need_no_router(start: Starter) -> None:
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


def test_an_upload_succeeds_although_the_router_dies(start: Starter, tmp_path: Path) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'connect = ["{where}"]')
    with running_router(tmp_path, where) as router, session(connect=where) as opened:
        Reader(opened).wait("telemetry/attitude")
        upload_while(bench, router, signal.SIGKILL)


def test_an_upload_succeeds_although_the_router_hangs(start: Starter, tmp_path: Path) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'connect = ["{where}"]')
    with running_router(tmp_path, where) as router, session(connect=where) as opened:
        Reader(opened).wait("telemetry/attitude")
        upload_while(bench, router, signal.SIGSTOP)
        assert bench.daemon.end() == 0


def test_a_stalled_subscriber_delays_nothing(start: Starter) -> None:
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


@pytest.mark.parametrize("behind_a_router", [False, True])
def test_two_vehicles_with_one_name_both_report_it(start: Starter, tmp_path: Path, *, behind_a_router: bool) -> None:
    where = endpoint()
    with ExitStack() as stack:
        if behind_a_router:
            stack.enter_context(running_router(tmp_path, where))
        first = zenoh_bench(start, f'{"connect" if behind_a_router else "listen"} = ["{where}"]\n{I_KNOW}')
        opened = stack.enter_context(session(connect=where))
        reader = Reader(opened)
        reader.wait("state", lambda state: state["others_of_this_name"] == 0)
        first.daemon.push(plain_plan(5))
        before = first.board.records()
        second_directory = tmp_path / "second"
        second_directory.mkdir()
        config = write_config(second_directory, f'connect = ["{where}"]')
        second = Starter(second_directory, stack).daemon("sim:", options=("--config", str(config)))
        for daemon in (first.daemon, second):
            taken = until(partial(daemon.has_logged, "zenoh.name_taken"), "a log entry about the other vehicle")
            assert taken["vehicle"] == VEHICLE
        reader.wait("state", lambda state: state["others_of_this_name"] == 1)
        until(lambda: reader.events("zenoh.name_taken"), "the event")
        status = first.daemon.status()
        assert status is not None
        assert status["zenoh_others_of_this_name"] == 1
        for command in ("mission/upload", "mission/clear", "mission/restore?number=1"):  # both would obey it
            payload = plan_text(plain_plan(7)).encode() if command == "mission/upload" else None
            (refused,) = ask(opened, f"{COMMANDS}/{command}", payload)
            assert "another bridge has the same vehicle name" in refused["error"]
        assert first.board.records() == before
        second.end(signal.SIGKILL)
        until(lambda: first.daemon.has_logged("zenoh.name_free"), "the end of that")


def test_mavlink_is_published_while_subscribed_and_received(start: Starter) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'listen = ["{where}"]\nmavlink_in = true\ncommands_without_authentication = "I know"')
    decoder = MavlinkDecoder()
    with session(connect=where) as opened:
        reader = Reader(opened, key("@mavlink/v1/out"))
        until(lambda: len(reader.samples) > 30, "frames")
        frames = [frame for each in reader.samples for frame in MavlinkSplitter().feed(each.payload.to_bytes())]
        numbers = [frame.seq for frame in frames]
        assert numbers == [(numbers[0] + place) % 256 for place in range(len(numbers))]
        assert all(decoder.decode(frame) for frame in frames)
        speaker = mavlink.MAVLink(None, srcSystem=254, srcComponent=190)
        opened.put(key("@mavlink/v1/in"), b"\xfd\xff no MAVLink" * 9)
        opened.put(key("@mavlink/v1/in"), bytes(mavlink.MAVLink_mission_request_list_message(1, 1, 0).pack(speaker)))

        def answered() -> bool:
            return any(
                frame.msgid == mavlink.MAVLINK_MSG_ID_MISSION_COUNT
                for each in reader.samples[:]
                for frame in MavlinkSplitter().feed(each.payload.to_bytes())
            )

        until(answered, "the answer")
        status = bench.daemon.status()
        assert status is not None
        assert status["ground_stations"] == ["zenoh @mavlink/v1/out"]


def test_incoming_mavlink_is_off_by_default(start: Starter) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'listen = ["{where}"]\n{I_KNOW}')
    with session(connect=where) as opened:
        reader = Reader(opened, key("@mavlink/v1/out"))
        until(lambda: reader.samples, "a frame")
        speaker = mavlink.MAVLink(None, srcSystem=254, srcComponent=190)
        opened.put(key("@mavlink/v1/in"), bytes(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(speaker)))
        seen = len(reader.samples)
        until(lambda: len(reader.samples) > seen + 20, "more frames")
        status = bench.daemon.status()
        assert status is not None
        assert status["ground_stations"] == []


def test_a_failed_connection_is_reported_with_its_reason(start: Starter) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'connect = ["{where}"]')
    alone = until(lambda: bench.daemon.has_logged("zenoh.alone"), "a log entry about it")
    assert alone["why"] == f"{where}: no router is running there (connection refused)"
