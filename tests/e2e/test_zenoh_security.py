# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon in a fleet with authentication, using the unchanged examples, and attempts of strangers."""

import datetime
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import trustme

from payloads.keys import COMMANDS
from tests.support.benches import Bench, Starter
from tests.support.plan import judge, plain_plan, plan_text, records_of
from tests.support.programs import until
from tests.support.secured_fleet import Fleet
from tests.support.zenoh_bench import Reader, ask, ask_surely, body, key, zenoh_bench, zenoh_config

pytest_plugins = ("tests.support.secured_fixtures",)

UPLOAD = f"{COMMANDS}/mission/upload"
EXPIRED: dict[str, Any] = {"not_before": datetime.datetime(2020, 1, 1), "not_after": datetime.datetime(2021, 1, 1)}
MISSION = plan_text(plain_plan(12)).encode()


def secured_bench(start: Starter, config: Path) -> Bench:
    return zenoh_bench(start, f'config_file = "{config}"\ncommands = true')


def test_the_pilot_commands_and_a_guest_only_reads(start: Starter, secured: Fleet) -> None:
    bench = secured_bench(start, secured.config("vehicle", "naze-1"))
    with secured.open("pilot", "pilot") as pilot, secured.open("pilot", "guest") as guest:
        ask_surely(pilot, UPLOAD, MISSION)
        assert bench.board.records() == records_of(judge(plain_plan(12)))
        reader = Reader(guest, key("telemetry/*"))
        reader.wait("telemetry/attitude")
        assert ask_surely(guest, "state")["mission"]["count"] == 12
        for suffix in (UPLOAD, f"{COMMANDS}/mission/clear", f"{COMMANDS}/status"):
            refused = guest.get(key(suffix), timeout=3.0)
            assert [body(reply.ok) for reply in refused if reply.ok] == []
        assert len(bench.board.records()) == 12
        guest.put(key("@mavlink/v1/in"), b"anything")
        bench.daemon.push(plain_plan(9))
    bench.board.assert_unharmed()


def test_a_vehicle_that_may_not_publish_keeps_working(start: Starter, secured: Fleet) -> None:
    """It has another vehicle's name, so the router denies it every key. The ground station notices nothing."""
    bench = secured_bench(start, secured.config("vehicle", "naze-2"))
    with secured.open("pilot", "pilot") as pilot:
        reader = Reader(pilot)
        until(lambda: (bench.daemon.status() or {}).get("zenoh_neighbours"), "the daemon in the fleet")
        planner = bench.mission_planner()
        planner.write(plain_plan(60))
        assert bench.board.records() == records_of(judge(plain_plan(60)))
        assert reader.samples == []
        assert ask(pilot, "state") == []
    bench.board.assert_unharmed()


def test_vehicles_with_invalid_certificates_report_it(tls: Fleet, fleet_stack: ExitStack, tmp_path: Path) -> None:
    own = trustme.CA.from_pem((tls.folder / "ca.pem").read_bytes(), (tls.folder / "ca.key").read_bytes())
    for name, issued in {
        "old": own.issue_cert("naze-1", common_name="naze-1", **EXPIRED),
        "foreign": trustme.CA().issue_cert("naze-1", common_name="naze-1"),
    }.items():
        issued.private_key_pem.write_to_path(str(tls.folder / f"{name}.key"))
        issued.cert_chain_pems[0].write_to_path(str(tls.folder / f"{name}.pem"))
    refused = "the router refuses our certificate"
    wrong = {"old": refused, "foreign": refused, "nobody": f"there is no file {tls.folder / 'nobody.pem'}"}
    daemons = {}
    for name in wrong:
        (tmp_path / name).mkdir()
        config = zenoh_config(f'config_file = "{tls.config("vehicle", name)}"')
        daemons[name] = Starter(tmp_path / name, fleet_stack).daemon("sim:", config=config)
    for name, reason in wrong.items():
        alone = until(partial(daemons[name].has_logged, "zenoh.alone"), "a log entry about the certificate")
        assert reason in alone["why"]
        daemons[name].wait()
        daemons[name].push(plain_plan(9))
        assert daemons[name].end() == 0
