# SPDX-License-Identifier: GPL-3.0-or-later
"""The unchanged examples for a fleet behind a router: admitted and refused members, and their rights."""

import datetime
import json
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest
import trustme
import zenoh

from tests.support.programs import free_port, run_naze_bridge, until
from tests.support.secured_fleet import Fleet
from tests.support.zenoh_router import EXAMPLES, running_router

pytest_plugins = ("tests.support.secured_fixtures",)


def fake_bridge(stack: ExitStack, session: zenoh.Session, vehicle: str) -> None:
    """Declare a bridge's keys."""

    def answer(query: zenoh.Query) -> None:
        with query:
            query.reply(query.key_expr, "{}")

    def accept(query: zenoh.Query) -> None:
        with query:
            result = {"ack": "MAV_MISSION_ACCEPTED", "text": "Mission verified: 15 records", "findings": []}
            query.reply(query.key_expr, json.dumps({"result": result}))

    # Reply under the vehicle's own key, like a bridge; the query's key may have wildcards.
    def state(query: zenoh.Query) -> None:
        with query:
            query.reply(
                f"fleet/{vehicle}/v1/state", json.dumps({"link": {"state": "MSP"}}), encoding="application/json"
            )

    stack.enter_context(session.declare_queryable(f"fleet/{vehicle}/v1/state", state))
    stack.enter_context(session.declare_queryable(f"fleet/{vehicle}/@cmd/v1/status", answer))
    stack.enter_context(session.declare_queryable(f"fleet/{vehicle}/@cmd/v1/mission/upload", accept))
    stack.enter_context(session.liveliness().declare_token(f"fleet/{vehicle}/v1/alive/{session.zid()}"))


def replies(session: zenoh.Session, key: str) -> int:
    return sum(reply.ok is not None for reply in session.get(key, timeout=5.0))


def test_only_the_pilot_may_push(secured: Fleet) -> None:
    def push(name: str) -> subprocess.CompletedProcess[str]:
        file, config = EXAMPLES / "naze-field.waypoints", secured.config("pilot", name)
        return run_naze_bridge("fleet", "push", file, "--vehicle", "naze-1", "--zenoh-config", config)

    with ExitStack() as stack:
        fake_bridge(stack, stack.enter_context(secured.open("vehicle", "naze-1")), "naze-1")
        until(lambda: "naze-1" in secured.fleet_list(secured.config("pilot", "pilot")).stdout, "the vehicle")
        assert push("pilot").returncode == 0
        denied = push("guest")
    assert denied.returncode == 1, denied
    assert "access is denied" in " ".join(denied.stdout.split())


def test_a_stranger_with_a_certificate_has_no_rights(tls: Fleet) -> None:
    with ExitStack() as stack:
        vehicle = stack.enter_context(tls.open("vehicle", "naze-1"))
        fake_bridge(stack, vehicle, "naze-1")
        pilot, stranger = (stack.enter_context(tls.open("pilot", name)) for name in ("pilot", "stranger"))
        until(lambda: replies(pilot, "fleet/naze-1/v1/state") == 1, "the pilot's question")
        assert replies(stranger, "fleet/naze-1/v1/state") == replies(stranger, "fleet/naze-1/@cmd/v1/status") == 0


def make_certificates(folder: Path, name: str) -> None:
    script = [sys.executable, str(folder / "make_certificates.py"), str(folder), "localhost,127.0.0.1", name]
    subprocess.run(script, check=True, capture_output=True, text=True)


def move(fleet: Fleet, folder: Path, endpoint: str) -> None:
    """Let the configurations in a copy of the fleet's folder name the copy, and another endpoint."""
    port, new_port = (each.rpartition(":")[2] for each in (fleet.endpoint, endpoint))
    for path in folder.glob("*.json5"):
        path.write_text(path.read_text().replace(str(fleet.folder), str(folder)).replace(f":{port}", f":{new_port}"))


def refused(listed: subprocess.CompletedProcess[str]) -> str:
    assert (listed.returncode, listed.stdout) == (1, ""), listed
    (sentence,) = listed.stderr.splitlines()
    assert sentence.startswith("naze-bridge: cannot join the fleet: "), sentence
    return sentence


def test_a_wrong_password_is_reported_in_one_sentence(passwords: Fleet) -> None:
    config = passwords.config("pilot", "pilot")
    config.write_text(config.read_text().replace("change-me", "guessed"))
    assert "check user, password" in refused(passwords.fleet_list(config))


Issue = Callable[[trustme.CA, trustme.CA], trustme.LeafCert]
_PAST = {"not_before": datetime.datetime(2020, 1, 1), "not_after": datetime.datetime(2021, 1, 1)}


def write(folder: Path, name: str, issued: trustme.LeafCert) -> None:
    issued.private_key_pem.write_to_path(str(folder / f"{name}.key"))
    (folder / f"{name}.pem").write_bytes(b"".join(pem.bytes() for pem in issued.cert_chain_pems))


@pytest.mark.parametrize(
    ("name", "issue", "reason"),
    [
        ("foreign", lambda _, other: other.issue_cert("pilot", common_name="pilot"), "refuses our certificate"),
        ("old", lambda own, _: own.issue_cert("pilot", common_name="pilot", **_PAST), "certificate expired"),
    ],
)
def test_an_invalid_certificate_of_a_pilot_is_explained(tls: Fleet, name: str, issue: Issue, reason: str) -> None:
    own = trustme.CA.from_pem((tls.folder / "ca.pem").read_bytes(), (tls.folder / "ca.key").read_bytes())
    write(tls.folder, name, issue(own, trustme.CA()))
    assert reason in refused(tls.fleet_list(tls.config("pilot", name)))


def test_a_members_certificate_cannot_pass_for_the_routers(tls: Fleet, tmp_path: Path) -> None:
    """Its member may have been named after the router's host."""
    endpoint = f"tls/localhost:{free_port(socket.SOCK_STREAM)}"
    shutil.copytree(tls.folder, tmp_path, dirs_exist_ok=True)
    make_certificates(tmp_path, "localhost")
    for kind in ("pem", "key"):
        shutil.copy(tmp_path / f"localhost.{kind}", tmp_path / f"router.{kind}")
    move(tls, tmp_path, endpoint)
    with running_router(tmp_path, endpoint, tmp_path / "router.json5"):
        refused(run_naze_bridge("fleet", "list", "--zenoh-config", tmp_path / "pilot.json5"))


@pytest.mark.parametrize("name", ["ca", "router", "../kite", "ki\x1bte"])
def test_reserved_names_do_not_get_certificates(tls: Fleet, name: str) -> None:
    before = sorted(tls.folder.parent.rglob("*.key"))
    with pytest.raises(subprocess.CalledProcessError) as failed:
        make_certificates(tls.folder, name)
    assert "cannot be a member's name" in failed.value.stderr
    assert sorted(tls.folder.parent.rglob("*.key")) == before


def test_a_missing_certificate_is_named(tls: Fleet) -> None:
    config = tls.config("pilot", "nobody")
    assert f"there is no file {tls.folder / 'nobody.pem'}" in refused(tls.fleet_list(config))


@pytest.mark.parametrize(
    ("issue", "reason"),
    [
        (lambda own, _: own.issue_cert("localhost", **_PAST), "certificate has expired; check our clock, too"),
        (lambda own, _: own.issue_cert("elsewhere.example"), "Hostname mismatch"),
        (lambda _, other: other.issue_cert("localhost"), "unable to get local issuer certificate"),
    ],
    ids=["expired", "another name", "not ours"],
)
def test_an_invalid_certificate_of_the_router_is_explained(
    tls: Fleet, tmp_path: Path, issue: Issue, reason: str
) -> None:
    endpoint = f"tls/localhost:{free_port(socket.SOCK_STREAM)}"
    shutil.copytree(tls.folder, tmp_path, dirs_exist_ok=True)
    own = trustme.CA.from_pem((tmp_path / "ca.pem").read_bytes(), (tmp_path / "ca.key").read_bytes())
    write(tmp_path, "router", issue(own, trustme.CA()))
    move(tls, tmp_path, endpoint)
    with running_router(tmp_path, endpoint, tmp_path / "router.json5"):
        assert reason in refused(run_naze_bridge("fleet", "list", "--zenoh-config", tmp_path / "pilot.json5"))
