# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet enroll`: the router allows each member only the actions of its role."""

import json
import shutil
import socket
import stat
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
import zenoh

from tests.support.programs import free_port, run_naze_bridge, until
from tests.support.zenoh_router import EXAMPLES, running_router


class Enrolled:
    """A router and the members' sessions."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self.folder = folder / "fleet"
        self.endpoint = f"tcp/127.0.0.1:{free_port(socket.SOCK_STREAM)}"
        self._stack = stack
        for name, role in {"kite": "vehicle", "owl": "vehicle", "pilot": "pilot", "guest": "guest"}.items():
            assert self.enroll(name, "--role", role).returncode == 0
        router = json.loads((self.folder / "router.json5").read_text())
        assert router["transport"]["unicast"]["max_sessions"] > 1000
        stack.enter_context(running_router(folder, self.endpoint, self.folder / "router.json5"))

    def enroll(self, *arguments: str) -> Any:
        return run_naze_bridge("fleet", "enroll", *arguments, "--folder", self.folder, "--router", self.endpoint)

    def open(self, name: str) -> zenoh.Session:
        return self._stack.enter_context(zenoh.open(zenoh.Config.from_file(str(self.folder / f"{name}.json5"))))


@pytest.fixture(scope="module")
def enrolled(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Enrolled]:
    with ExitStack() as stack:
        yield Enrolled(tmp_path_factory.mktemp("enrolled"), stack)


def replies_with(text: str) -> Any:
    def reply(query: zenoh.Query) -> None:
        with query:
            query.reply(query.key_expr, text)

    return reply


def replies(session: zenoh.Session, key: str) -> list[str]:
    return [each.ok.payload.to_string() for each in session.get(key, timeout=5.0) if each.ok]


def test_a_vehicle_publishes_only_under_its_own_name(enrolled: Enrolled) -> None:
    owl, pilot = enrolled.open("owl"), enrolled.open("pilot")
    queryables = [
        owl.declare_queryable(key, replies_with("owl"))
        for key in ("fleet/kite/v1/state", "fleet/kite/@cmd/v1/mission/upload", "fleet/owl/v1/state")
    ]
    until(lambda: replies(pilot, "fleet/owl/v1/state") == ["owl"], "its own state")
    assert replies(pilot, "fleet/kite/v1/state") == replies(pilot, "fleet/kite/@cmd/v1/mission/upload") == []
    received: list[str] = []
    with pilot.declare_subscriber("fleet/**", lambda sample: received.append(str(sample.key_expr))):
        until(lambda: (owl.put("fleet/owl/v1/event", "{}"), received)[1], "its own event")
        owl.put("fleet/kite/v1/telemetry/position", "{}")
        owl.put("fleet/owl/v1/telemetry/gps", "{}")
        until(lambda: "fleet/owl/v1/telemetry/gps" in received, "the last one")
    assert not [key for key in received if "kite" in key]
    del queryables


def test_a_guest_may_only_read(enrolled: Enrolled) -> None:
    kite, guest, pilot = enrolled.open("kite"), enrolled.open("guest"), enrolled.open("pilot")
    taken: list[tuple[str, str]] = []
    inputs = [
        kite.declare_subscriber(key, lambda sample: taken.append((str(sample.key_expr), sample.payload.to_string())))
        for key in ("fleet/kite/@mavlink/v1/in", "fleet/kite/v1/event")
    ]
    queryables = [
        kite.declare_queryable(key, replies_with("kite"))
        for key in ("fleet/kite/v1/state", "fleet/kite/@cmd/v1/mission/clear")
    ]
    received: list[str] = []
    looks = guest.declare_subscriber("fleet/*/v1/**", lambda sample: received.append(str(sample.key_expr)))
    until(lambda: replies(guest, "fleet/kite/v1/state") == ["kite"], "the state")
    until(lambda: (kite.put("fleet/kite/v1/telemetry/position", "{}"), received)[1], "telemetry")
    assert replies(guest, "fleet/kite/@cmd/v1/mission/clear") == []
    forged = guest.declare_queryable("fleet/kite/v1/mission/current", replies_with("forged"))
    token = guest.liveliness().declare_token("fleet/ghost/v1/alive/1")
    guest.put("fleet/kite/@mavlink/v1/in", "disarm")
    guest.put("fleet/kite/v1/event", "{}")
    # The answer to a question after them shows that the router has handled them.
    assert replies(guest, "fleet/kite/v1/state") == ["kite"]
    until(lambda: (pilot.put("fleet/kite/@mavlink/v1/in", "hello"), taken)[1], "the pilot's frame")
    assert set(taken) == {("fleet/kite/@mavlink/v1/in", "hello")}
    assert replies(pilot, "fleet/kite/v1/mission/current") == []
    assert not [each for each in pilot.liveliness().get("fleet/ghost/**") if each.ok]
    del inputs, queryables, looks, forged, token


@pytest.mark.parametrize("scheme", ["tls", "tcp"])
def test_the_printed_files_are_enough_on_other_machines(scheme: str, tmp_path: Path) -> None:
    host = "localhost" if scheme == "tls" else "127.0.0.1"
    made, endpoint = tmp_path / "made", f"{scheme}/{host}:{free_port(socket.SOCK_STREAM)}"
    enrolled = run_naze_bridge("fleet", "enroll", "anna", "--role", "pilot", "--folder", made, "--router", endpoint)
    if scheme == "tls":
        script = EXAMPLES / "zenoh-tls" / "make_certificates.py"
        subprocess.run([sys.executable, script, made, "localhost", "anna"], check=True)
    (line,) = (line for line in enrolled.stdout.splitlines() if line.startswith("Copy into one folder of anna: "))
    own = [Path(name) for name in line.partition(": ")[2].split(", ")]
    routers = ["router.json5", *(["ca.pem", "router.pem", "router.key"] if scheme == "tls" else ["passwords.txt"])]
    for folder, files in {"anna": own, "router": [made / name for name in routers]}.items():
        (tmp_path / folder).mkdir()
        for file in files:
            shutil.copy(file, tmp_path / folder)
    shutil.rmtree(made)
    config = tmp_path / "router" / "router.json5"
    config.write_text(config.read_text().replace("/0.0.0.0:", "/127.0.0.1:"))
    with running_router(tmp_path, endpoint, config):
        listed = run_naze_bridge("fleet", "list", "--zenoh-config", tmp_path / "anna" / "anna.json5")
    assert (listed.returncode, "No vehicle is alive" in listed.stdout) == (0, True), listed


def test_logins_are_secret_and_kept(enrolled: Enrolled) -> None:
    for name in ("passwords.txt", "kite.json5"):
        assert stat.S_IMODE((enrolled.folder / name).stat().st_mode) == 0o600
    before = (enrolled.folder / "kite.json5").read_text()
    assert enrolled.enroll("kite").returncode == 0
    assert (enrolled.folder / "kite.json5").read_text() == before
    assert "kite is a vehicle already" in enrolled.enroll("kite", "--role", "pilot").stderr
    assert "naze-bridge: the name is 'my plane'" in enrolled.enroll("my plane").stderr
    assert "--prefix is 'a/b'" in enrolled.enroll("crow", "--prefix", "a/b").stderr


@pytest.mark.parametrize(
    "name",
    ["ca", "router", "Router", "../kite", "/kite", ".", ".kite", "-kite", "kite:x", "ki\x1bte", "ki\nte", ""],
)
def test_an_unknown_member_is_refused_without_changes(enrolled: Enrolled, name: str) -> None:
    def files() -> dict[Path, bytes]:
        return {
            path: path.read_bytes()
            for path in enrolled.folder.parent.rglob("*")
            if path.is_file() and path.suffix != ".log"
        }

    before = files()
    refused = enrolled.enroll("--role", "guest", "--", name)
    assert refused.returncode in (1, 2), refused
    assert sum("naze-bridge: " in line for line in refused.stderr.splitlines()) == 1
    assert "\x1b" not in refused.stderr
    assert files() == before


def test_a_wrong_and_a_missing_login_are_distinguished(enrolled: Enrolled, tmp_path: Path) -> None:
    config = json.loads((enrolled.folder / "pilot.json5").read_text())
    config["transport"]["auth"]["usrpwd"]["password"] += "?"
    wrong = tmp_path / "wrong.json5"
    wrong.write_text(json.dumps(config))
    refused = run_naze_bridge("fleet", "list", "--zenoh-config", wrong)
    assert (refused.returncode, "check user, password" in refused.stderr) == (1, True), refused
    nobody = run_naze_bridge("fleet", "list", "--connect", enrolled.endpoint)
    assert "check user, password" in nobody.stderr, nobody
