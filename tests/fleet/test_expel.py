# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet expel`: after a restart of the router the member has no rights, with its certificate or its password."""

import json
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
import zenoh

from payloads.endpoints import read_zenoh_file
from tests.support.programs import TIMEOUT_S, free_port, run_naze_bridge, until
from tests.support.zenoh_router import EXAMPLES, Router, running_router

MEMBERS = {"kite": "vehicle", "owl": "vehicle", "anna": "pilot", "bert": "pilot"}
#: Everything that a session can declare, under the key of each vehicle.
KEYS = [f"fleet/{vehicle}/{suffix}" for vehicle in ("kite", "owl") for suffix in ("v1/state", "@cmd/v1/mission/upload")]


class Members:
    """A fleet made by `fleet enroll`, and its router."""

    def __init__(self, folder: Path, stack: ExitStack, scheme: str) -> None:
        self.folder = folder / "fleet"
        self.is_tls = scheme == "tls"
        host = "localhost" if self.is_tls else "127.0.0.1"
        self.endpoint = f"{scheme}/{host}:{free_port(socket.SOCK_STREAM)}"
        self._stack = stack
        for name, role in MEMBERS.items():
            assert self.enroll(name, "--role", role).returncode == 0
        if self.is_tls:
            script = EXAMPLES / "zenoh-tls" / "make_certificates.py"
            subprocess.run([sys.executable, script, self.folder, "localhost", *MEMBERS], check=True)
        config = self.folder / "router.json5"
        config.write_text(config.read_text().replace("/0.0.0.0:", "/127.0.0.1:"))
        self.router: Router = stack.enter_context(running_router(folder, self.endpoint, config))

    def enroll(self, *arguments: str) -> Any:
        return run_naze_bridge("fleet", "enroll", *arguments, "--folder", self.folder, "--router", self.endpoint)

    def expel(self, name: str) -> Any:
        return run_naze_bridge("fleet", "expel", name, "--folder", self.folder)

    def config(self, name: str) -> str:
        return (self.folder / f"{name}.json5").read_text()

    def restart_router(self) -> None:
        self.router.stop()
        self.router.start_again()

    def open(self, config: str) -> zenoh.Session:
        path = self.folder / "opened.json5"
        path.write_text(config)
        return self._stack.enter_context(zenoh.open(read_zenoh_file(path)))


@pytest.fixture(params=["tls", "tcp"])
def fleet(tmp_path: Path, stack: ExitStack, request: pytest.FixtureRequest) -> Members:
    return Members(tmp_path, stack, request.param)


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def answer(query: zenoh.Query) -> None:
    with query:
        query.reply(query.key_expr, "owl")


def replies(session: zenoh.Session, key: str, seconds: float = TIMEOUT_S) -> list[str]:
    return [each.ok.payload.to_string() for each in session.get(key, timeout=seconds) if each.ok]


def tokens(session: zenoh.Session, seconds: float = TIMEOUT_S) -> list[str]:
    return [str(each.ok.key_expr) for each in session.liveliness().get("fleet/**", timeout=seconds) if each.ok]


def test_an_expelled_member_loses_all_rights_when_the_router_restarts(fleet: Members) -> None:
    expelled = "kite" if fleet.is_tls else "bert"
    old_login = fleet.config(expelled)
    done = fleet.expel(expelled)
    assert done.returncode == 0, done
    assert "estart the router" in done.stdout
    assert expelled not in (fleet.folder / "router.json5").read_text()
    fleet.restart_router()
    owl, anna = fleet.open(fleet.config("owl")), fleet.open(fleet.config("anna"))
    token = owl.liveliness().declare_token("fleet/owl/v1/alive/1")
    queryables = [owl.declare_queryable(key, answer) for key in KEYS if "owl" in key]
    until(lambda: replies(anna, "fleet/owl/v1/state") == ["owl"], "the other members")
    if not fleet.is_tls:
        with pytest.raises(zenoh.ZError):
            fleet.open(old_login)
        return
    taken: list[str] = []
    listeners = [owl.declare_subscriber(key, lambda sample: taken.append(str(sample.key_expr))) for key in KEYS]
    received: list[str] = []
    anna_listens = anna.declare_subscriber("fleet/**", lambda sample: received.append(str(sample.key_expr)))
    # A session would also hear and answer itself.
    speaking, hearing, asking = (fleet.open(old_login) for _ in range(3))
    heard: list[str] = []
    declared = [
        hearing.declare_subscriber("fleet/**", lambda sample: heard.append(str(sample.key_expr))),
        hearing.liveliness().declare_subscriber(
            "fleet/**", lambda sample: heard.append(str(sample.key_expr)), history=True
        ),
        speaking.liveliness().declare_token(f"fleet/{expelled}/v1/alive/1"),
        *(speaking.declare_queryable(key, lambda query: query.reply(query.key_expr, "forged")) for key in KEYS),
    ]
    for key in KEYS:
        speaking.put(key, "forged")
        speaking.delete(key)
    assert [replies(asking, key, 3.0) for key in KEYS] == [[]] * len(KEYS)
    assert tokens(asking, 3.0) == []
    owl.put("fleet/owl/v1/event", "{}")
    until(lambda: "fleet/owl/v1/event" in received, "the event at another member")
    time.sleep(1.0)  # forged and overheard samples would arrive
    assert received == ["fleet/owl/v1/event"]
    assert taken == heard == []
    assert tokens(anna) == ["fleet/owl/v1/alive/1"]
    assert [replies(anna, key) for key in KEYS] == [["owl"] if "owl" in key else [] for key in KEYS]
    del token, queryables, listeners, anna_listens, declared


def test_an_expelled_member_stays_out_when_another_is_enrolled(fleet: Members) -> None:
    before = fleet.config("kite")
    assert fleet.expel("kite").returncode == 0
    assert fleet.enroll("crow").returncode == 0
    assert "kite" not in (fleet.folder / "router.json5").read_text()
    assert not (fleet.folder / "kite.json5").exists()
    again = fleet.enroll("kite")
    if fleet.is_tls:
        assert "its certificate is still valid" in again.stderr
        assert "kite" not in (fleet.folder / "router.json5").read_text()
    else:
        assert again.returncode == 0
        old, new = (json.loads(text)["transport"]["auth"]["usrpwd"] for text in (before, fleet.config("kite")))
        assert old["password"] != new["password"]
        assert old["password"] not in (fleet.folder / "passwords.txt").read_text()


def test_expelling_twice_is_harmless_and_a_stranger_is_named(fleet: Members) -> None:
    assert [fleet.expel("kite").returncode for _ in range(2)] == [0, 0]
    stranger = fleet.expel("hawk")
    assert (stranger.returncode, stranger.stderr) == (
        1,
        "naze-bridge: hawk is not a member; the members are: anna, bert, owl\n",
    )
