# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands over zenoh: the same rules, lock and reasons as elsewhere; errors go to the caller."""

import json
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from threading import Thread
from typing import Any

import pytest
import zenoh

from payloads.keys import COMMANDS
from tests.support.benches import Bench, Starter
from tests.support.plan import judge, plain_plan, plan_text, records_of
from tests.support.programs import until
from tests.support.zenoh_bench import I_KNOW, ask, ask_surely, endpoint, key, session, zenoh_bench, zenoh_config

UPLOAD, CHECK, CLEAR, STATUS = (
    f"{COMMANDS}/{each}" for each in ("mission/upload", "mission/check", "mission/clear", "status")
)


def mission_file(count: int, start: int = 0) -> bytes:
    return plan_text(plain_plan(count, start)).encode()


@pytest.fixture(scope="module")
def commanded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Bench, zenoh.Session]]:
    where = endpoint()
    with ExitStack() as stack:
        start = Starter(tmp_path_factory.mktemp("commanded"), stack)
        bench = zenoh_bench(start, f'listen = ["{where}"]\n{I_KNOW}')
        opened = stack.enter_context(session(connect=where))
        ask_surely(opened, STATUS)
        yield bench, opened
        bench.board.assert_unharmed()


def error(answers: list[Any]) -> str:
    (answer,) = [each for each in answers if "error" in each]
    assert "\n" not in answer["error"]
    assert "\n" not in answer["error"]
    reason: str = answer["error"]
    return reason


def test_an_upload_reports_the_progress_and_result(commanded: tuple[Bench, zenoh.Session]) -> None:
    bench, opened = commanded
    *progress, last = ask(opened, UPLOAD, mission_file(60), consolidation=zenoh.ConsolidationMode.NONE)
    assert [each["of"] for each in progress] == [60] * len(progress)
    assert [each["progress"] for each in progress] == sorted(each["progress"] for each in progress)
    assert last["result"]["ack"] == "MAV_MISSION_ACCEPTED"
    assert bench.board.records() == records_of(judge(plain_plan(60)))
    assert bench.daemon.missions()[0]["source"] == "zenoh upload"


def test_by_default_a_caller_gets_only_the_result(commanded: tuple[Bench, zenoh.Session]) -> None:
    _, opened = commanded
    (answer,) = ask(opened, UPLOAD, mission_file(40, start=50))
    assert answer["result"]["text"].startswith("40 of 40 stored: ")


def test_a_check_is_read_only(commanded: tuple[Bench, zenoh.Session]) -> None:
    bench, opened = commanded
    before, missions = bench.board.records(), len(bench.daemon.missions())
    (answer,) = ask(opened, CHECK, mission_file(12, start=7))
    assert answer["result"]["records"] == records_of(judge(plain_plan(12, 7)))
    (too_long,) = ask(opened, CHECK, mission_file(200))
    assert too_long["result"]["ack"] == "MAV_MISSION_NO_SPACE"
    assert (bench.board.records(), len(bench.daemon.missions())) == (before, missions)


def test_a_list_is_cleared_and_restored(commanded: tuple[Bench, zenoh.Session]) -> None:
    bench, opened = commanded
    ask(opened, UPLOAD, mission_file(9))
    (cleared,) = ask(opened, CLEAR)
    assert cleared["result"]["verdict"] == "CLEARED"
    assert bench.board.records() == []


def test_the_state_and_the_list_of_missions_are_reported(commanded: tuple[Bench, zenoh.Session]) -> None:
    bench, opened = commanded
    ask(opened, UPLOAD, mission_file(9))
    (state,) = ask(opened, "state")
    assert state["mission"] == {
        "count": 9,
        "checksum": bench.daemon.pull()["checksum"],
        "state": None,
        "item": None,
        "why": None,
    }
    assert (state["link"]["state"], state["status"]["armed"]) == ("MSP", False)
    (listed,) = ask(opened, "mission/list")
    assert listed["missions"][0]["number"] == bench.daemon.missions()[0]["number"]


BAD_PAYLOADS = {
    "nothing": (b"", "the file has no items"),
    "no mission": (b"<html/>", "this file contains a web page"),
    "no text": (b"\xfd\xfe\x00\x01", "a binary file"),
    "half a plan": (b'{"fileType": "Plan", "mission": {', "JSON"),
    "a place in words": (mission_file(5).replace(b"45.384", b"nowhere"), "line 3"),
    "10 MB": (b"x" * 10_000_000, "larger than 256 KiB"),
    "a book": (mission_file(1200), "1200 items"),
    "a home alone": (mission_file(1), "only home, without a command"),
    "too many": (mission_file(200), "146 fit"),
}


@pytest.mark.parametrize("name", BAD_PAYLOADS)
def test_an_invalid_mission_is_refused_with_a_reason(commanded: tuple[Bench, zenoh.Session], name: str) -> None:
    bench, opened = commanded
    before = bench.board.records()
    payload, reason = BAD_PAYLOADS[name]
    assert reason in error(ask(opened, UPLOAD, payload))
    assert bench.board.records() == before


@pytest.mark.parametrize("payload", [b"", b"[]", b'{"name": "x"}', b"[" * 100_000, b" " * 10_000_000])
def test_an_invalid_request_for_a_log_is_refused_with_the_form(
    commanded: tuple[Bench, zenoh.Session], payload: bytes
) -> None:
    bench, opened = commanded
    assert "the payload must be" in error(ask(opened, f"{COMMANDS}/log/read", payload))
    unknown = json.dumps({"name": "../../etc/passwd", "start": 0}).encode()
    assert error(ask(opened, f"{COMMANDS}/log/read", unknown)) == "there is no such log; log/list names them"
    assert "daemon.fault" not in bench.daemon.printed


def test_wildcards_cannot_send_commands(commanded: tuple[Bench, zenoh.Session]) -> None:
    bench, opened = commanded
    ask(opened, UPLOAD, mission_file(9))
    for expression in ("fleet/**", "**", "*/*/*/*/*/clear", "**/@cmd/**", "fleet/*/@cmd/v1/mission/clear"):
        found = [str(each.ok.key_expr) for each in opened.get(expression, timeout=3.0) if each.ok]
        assert not any("@cmd" in each for each in found), expression
    assert len(bench.board.records()) == 9


def test_only_one_transfer_runs_at_a_time(commanded: tuple[Bench, zenoh.Session]) -> None:
    """Of simultaneous requests, those not served get the reason."""
    bench, opened = commanded
    answers: list[Any] = []
    askers = [
        Thread(target=lambda number=number: answers.extend(ask(opened, UPLOAD, mission_file(30, start=number))))
        for number in range(6)
    ]
    for asker in askers:
        asker.start()
    for asker in askers:
        asker.join()
    results = [each["result"] for each in answers if "error" not in each and "result" in each]
    errors = [each["error"] for each in answers if "error" in each]
    assert len(results) >= 1
    assert len(results) + len(errors) == 6
    assert set(errors) <= {"Another mission transfer is running: try again"}
    verified = [each for each in bench.daemon.missions() if each["outcome"] == "VERIFIED"]
    assert f"{verified[0]['checksum']}" == bench.daemon.pull()["checksum"]


def test_refuses_writes_while_armed(start: Starter) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'listen = ["{where}"]\n{I_KNOW}')
    with session(connect=where) as opened:
        ask_surely(opened, UPLOAD, mission_file(9))
        before = bench.board.records()
        bench.board.set("armed 1")
        for suffix in (UPLOAD, CLEAR):
            payload = mission_file(5) if suffix == UPLOAD else None
            reason = error(ask(opened, suffix, payload))
            assert "rmed" in reason or "No link" in reason, suffix
        until(lambda: bench.daemon.has_logged("zenoh.refused"), "a log entry")
        assert bench.board.records() == before
    bench.board.assert_unharmed()


def test_commands_are_off_by_default(start: Starter) -> None:
    where = endpoint()
    zenoh_bench(start, f'listen = ["{where}"]')
    with session(connect=where) as opened:
        ask_surely(opened, "state")
        for suffix in (UPLOAD, CHECK, CLEAR, STATUS):
            assert list(opened.get(key(suffix), timeout=2.0)) == []


def test_a_command_without_a_flight_controller_is_an_error(start: Starter, tmp_path: Path) -> None:
    where = endpoint()
    daemon = start.daemon(str(tmp_path / "nothing"), config=zenoh_config(f'listen = ["{where}"]\n{I_KNOW}'))
    daemon.wait_up()
    with session(connect=where) as opened:
        state = ask_surely(opened, "state")
        assert (state["link"]["state"], state["mission"]) == ("no port", None)
        for suffix in (UPLOAD, CHECK, CLEAR):
            assert "No link to the flight controller" in error(ask(opened, suffix, mission_file(5)))
        (current,) = ask(opened, "mission/current")
        assert (current["count"], current["items"]) == (None, None)


def test_the_status_equals_the_command_lines(commanded: tuple[Bench, zenoh.Session]) -> None:
    bench, opened = commanded
    (answer,) = ask(opened, STATUS)
    shown = bench.daemon.status()
    assert shown is not None
    assert json.loads(json.dumps(answer["result"])).keys() == shown.keys()
    assert (answer["result"]["zenoh"], answer["result"]["zenoh_neighbours"]) == ("open", 1)
