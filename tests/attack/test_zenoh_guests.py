# SPDX-License-Identifier: GPL-3.0-or-later
"""A guest and another vehicle try to publish for a vehicle, through routers with the example configurations."""

import time

import zenoh

from tests.support.attack_pilot import Attack
from tests.support.benches import Starter
from tests.support.programs import run_naze_bridge
from tests.support.secured_fleet import Fleet
from tests.support.zenoh_bench import Reader, ask_surely, key, zenoh_bench
from tests.support.zenoh_router import EXAMPLES

pytest_plugins = ("tests.support.secured_fixtures",)


def test_other_members_cannot_publish_for_a_vehicle(start: Starter, secured: Fleet) -> None:
    bench = zenoh_bench(start, f'config_file = "{secured.config("vehicle", "naze-1")}"\ncommands = true')
    with (
        secured.open("pilot", "pilot") as pilot,
        secured.open("pilot", "guest") as guest,
        secured.open("vehicle", "naze-2") as other,
    ):
        # The guest only subscribes.
        assert Reader(guest, key("telemetry/*")).wait("telemetry/attitude")
        truth = ask_surely(pilot, "state")
        received = Reader(pilot)
        tokens: list[str] = []
        pilot.liveliness().declare_subscriber("fleet/**", lambda sample: tokens.append(str(sample.key_expr)))
        for liar in (guest, other):
            _send_forgeries(liar)
        time.sleep(2.0)  # time for forged samples to arrive
        received.wait("telemetry/attitude")
        assert [sample for sample in received.samples if sample.payload.to_bytes() == b"forged"] == []
        assert zenoh.SampleKind.DELETE not in [sample.kind for sample in received.samples]
        replies = [reply.ok.payload.to_bytes() for reply in pilot.get(key("state"), timeout=3.0) if reply.ok]
        assert b"forged" not in replies
        assert ask_surely(pilot, "state").keys() == truth.keys()
        assert [token for token in tokens if "forged" in token] == []
        with Attack(lambda: _flood(guest), per_s=200), Attack(lambda: _flood(other), per_s=200):
            pilots = ("--zenoh-config", secured.config("pilot", "pilot"))
            pushed = run_naze_bridge("fleet", "push", EXAMPLES / "naze-field.waypoints", "--vehicle", "naze-1", *pilots)
            assert pushed.returncode == 0, pushed
            pulled = run_naze_bridge("fleet", "pull", "--vehicle", "naze-1", *pilots)
            assert pulled.returncode == 0, pulled
        assert len(bench.board.records()) == len((EXAMPLES / "naze-field.waypoints").read_text().splitlines()) - 2
    bench.board.assert_unharmed()


def _send_forgeries(session: zenoh.Session) -> None:
    session.put(key("telemetry/position"), b"forged")
    session.delete(key("telemetry/position"))
    session.declare_queryable(key("state"), lambda query: query.reply(query.key_expr, b"forged"), complete=True)
    session.declare_queryable("fleet/naze-1/@cmd/v1/**", lambda query: query.reply(query.key_expr, b"forged"))
    session.liveliness().declare_token(key("forged"))


def _flood(session: zenoh.Session) -> None:
    session.put(key("telemetry/position"), b"forged" * 1000)
    session.put("fleet/naze-1/@cmd/v1/mission/upload", b"forged")
    session.get("fleet/naze-1/@cmd/v1/mission/clear", lambda _reply: None, payload=b"{}", timeout=1.0)
