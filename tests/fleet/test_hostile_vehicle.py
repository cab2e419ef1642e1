# SPDX-License-Identifier: GPL-3.0-or-later
"""One vehicle of the fleet was taken over: whatever it replies, the operator's commands end with sentences."""

import json
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from threading import Thread
from typing import Any

import cbor2
import pytest
import zenoh

from fleet.roll_call import replies_of
from fleet.vehicle import BridgeId
from payloads import keys
from payloads.keys import OVERVIEW, ZenohKey, full
from payloads.payload import encoding_of
from tests.service.cli.test_vehicle_relay import relay
from tests.support.fleet_bench import Fleet
from tests.support.programs import free_port, until

HUGE = 10**400
ODD: tuple[Any, ...] = (HUGE, -1, 1e308, True, None, "\u00e9" * 9000, [], [1], [HUGE], {}, {"a": [1]})
PLAN = Path("examples/naze-field.waypoints").resolve()


class Hostile:
    """A session that is alive as `evil`, and answers the keys in `replies`."""

    def __init__(self, fleet: Fleet) -> None:
        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("connect/endpoints", json.dumps([fleet.router.endpoint]))
        self.session = zenoh.open(config)
        self.replies: dict[ZenohKey, bytes] = {}
        self.asked: set[ZenohKey] = set()
        self.bridge = BridgeId("evil", str(self.session.zid()))
        self._held: list[object] = [
            self.session.liveliness().declare_token(f"fleet/evil/v1/alive/{self.session.zid()}")
        ]
        self._held += [self.session.declare_queryable(full("fleet", "evil", key.suffix), self._answer(key))
                       for key in (*keys.COMMAND_KEYS, OVERVIEW, keys.MISSION_CURRENT)]  # fmt: skip

    def _answer(self, key: ZenohKey) -> Any:
        def answer(query: zenoh.Query) -> None:
            self.asked.add(key)
            if key in self.replies:
                query.reply(full("fleet", "evil", key.suffix), self.replies[key], encoding=encoding_of(key))

        return answer

    def result(self, key: ZenohKey, value: object) -> None:
        self.replies[key] = json.dumps({"result": value}).encode()


@pytest.fixture(scope="module")
def evil(fleet: Fleet) -> Iterator[Hostile]:
    hostile = Hostile(fleet)
    hostile.replies[OVERVIEW] = cbor2.dumps({0: 1, 3: "MSP"})
    yield hostile
    hostile.session.close()  # type: ignore[no-untyped-call]


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    with ExitStack() as stack:
        yield Fleet(tmp_path_factory.mktemp("fleet"), stack)


def said(fleet: Fleet, *words: str | Path) -> str:
    ended = fleet.ask(*words)
    assert ended.returncode in (0, 1), ended
    assert "Traceback" not in ended.stderr, ended.stderr
    return ended.stdout + ended.stderr


def test_the_list_shows_the_fleet(fleet: Fleet, evil: Hostile) -> None:
    evil.replies[OVERVIEW] = cbor2.dumps(dict.fromkeys(range(20), 2**20000))
    for words in (("list",), ("list", "--json")):
        assert "evil" in said(fleet, *words)
    evil.replies[OVERVIEW] = cbor2.dumps({0: 1, 3: "MSP"})


@pytest.mark.parametrize("value", ODD, ids=lambda value: str(value)[:9])
def test_odd_values_are_refused_or_unknown(fleet: Fleet, evil: Hostile, tmp_path: Path, value: Any) -> None:
    names = ("result", "count", "checksum", "items", "findings", "assumed", "flight", "values", "board", "changes",
             "left_out", "notice", "logs", "text", "ack", "stored", "data", "size", "start")  # fmt: skip
    every = dict.fromkeys(names, value)
    finding = {"seq": 1, "field": "lat_e7", "was": value, "becomes": value, "why": value, "command": value}
    evil.result(
        keys.CHECK, {"result": "ACCEPTED", "count": 1, "checksum": "0", "findings": [finding], "assumed": value}
    )
    evil.result(keys.LOG_LIST, {"logs": [{"name": "a.tlog", "size": value}, {"name": value, "size": 5}, value]})
    evil.result(keys.SETTINGS_PLAN, {"changes": value, "left_out": value, "notice": value})
    evil.result(keys.SETTINGS_LIST, {"values": {"A": value}, "board": value})
    evil.replies[keys.MISSION_CURRENT] = json.dumps(every | {"count": 1, "checksum": value, "items": [value]}).encode()
    settings = tmp_path / "a.param"
    settings.write_text("A,1\n")
    where = ("--vehicle", "evil")
    for words in (
        ("push", PLAN, "--dry-run", *where),
        ("logs", *where),
        ("settings", "restore", settings, "--dry-run", *where),
        ("settings", "diff", *where),
        ("pull", tmp_path),
        ("verify", PLAN, *where),
    ):
        said(fleet, *words)


@pytest.mark.parametrize("data", ["\u00e9", "AAAA", HUGE, None], ids=lambda data: str(data)[:9])
def test_a_damaged_log_is_refused(fleet: Fleet, evil: Hostile, tmp_path: Path, data: Any) -> None:
    evil.result(keys.LOG_LIST, {"logs": [{"name": "a.tlog", "size": 100}, {"name": "b.tlog", "size": 10**15}]})
    evil.result(keys.LOG_READ, {"start": 1, "data": data})
    assert "does not understand" in said(fleet, "logs", "--vehicle", "evil", "a.tlog", "--folder", tmp_path)
    assert "no log 'b.tlog'" in said(fleet, "logs", "--vehicle", "evil", "b.tlog", "--folder", tmp_path)


def test_the_relay_of_its_mission_goes_on(fleet: Fleet, evil: Hostile, tmp_path: Path) -> None:
    evil.result(keys.STATUS, {})
    evil.replies[keys.MISSION_CURRENT] = json.dumps({"count": 1, "checksum": "not hex", "items": []}).encode()
    evil.asked.clear()
    with relay(tmp_path, fleet, "evil", f"udpin:127.0.0.1:{free_port()}"):
        evil.session.put(full("fleet", "evil", keys.MAVLINK_OUT.suffix), b"\xfd" * 3_000_000)
        until(lambda: keys.MISSION_CURRENT in evil.asked, "the question for the mission")


def test_a_dripping_vehicle_does_not_delay_the_others(fleet: Fleet, evil: Hostile) -> None:
    """Only a bridge that has not replied yet makes the list wait longer."""
    over: list[bool] = []

    def drip(query: zenoh.Query) -> None:
        while not over:
            query.reply("fleet/drip/v1/overview", cbor2.dumps({0: 1}), encoding=encoding_of(OVERVIEW))
            time.sleep(0.05)
        query.drop()  # type: ignore[no-untyped-call]

    def dripping(query: zenoh.Query) -> None:
        Thread(target=drip, args=(query,), daemon=True).start()

    held = evil.session.declare_queryable("fleet/drip/v1/overview", dripping)
    mine, silent = BridgeId("drip", evil.bridge.session_id), BridgeId("silent", "0")
    # Until the router knows who answers there is no reply.
    replies = until(lambda: replies_of(fleet.session, "fleet/drip/v1/overview", {mine, silent}, 0.5), "its reply")
    over.append(True)
    held.undeclare()  # type: ignore[no-untyped-call]
    assert set(replies) == {mine}
