# SPDX-License-Identifier: GPL-3.0-or-later
"""With a storage on `fleet/**`, stored samples never stand in for a live vehicle."""

import json
import signal
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import zenoh

from tests.support.fleet_bench import Fleet
from tests.support.plan import plain_plan, plan_text
from tests.support.programs import until
from tests.support.zenoh_storage import storage


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Fleet, zenoh.Session]]:
    """`kite` is alive, `owl` is gone; the storage has samples of both."""
    folder = tmp_path_factory.mktemp("fleet")
    with ExitStack() as stack:
        fleet = Fleet(folder, stack)
        looking = stack.enter_context(storage(folder, fleet.router.endpoint))
        for name in ("kite", "owl"):
            fleet.start(name)
        fleet.wait("kite", "owl")
        until(lambda: {"kite", "owl"} <= stored_names(looking, "state"), "both in the storage")
        fleet.daemons["owl"].end(signal.SIGKILL)
        until(lambda: list(fleet.listed()) == ["kite"], "the end of one")
        yield fleet, looking


def stored_names(looking: zenoh.Session, suffix: str) -> set[str]:
    replies = looking.get(f"fleet/*/v1/{suffix}", timeout=3.0)
    return {str(reply.ok.key_expr).split("/")[1] for reply in replies if reply.ok}


def test_dead_vehicles_are_stored_but_not_listed(stored: tuple[Fleet, zenoh.Session]) -> None:
    fleet, looking = stored
    assert stored_names(looking, "state") == {"kite", "owl"}
    assert list(fleet.listed()) == ["kite"]
    until(lambda: fleet.listed()["kite"]["answers"], "the live one's answer")
    assert fleet.listed()["kite"]["bridges"] == 1


def test_pull_and_push_ignore_the_storage(stored: tuple[Fleet, zenoh.Session], tmp_path: Path) -> None:
    fleet, looking = stored
    file = tmp_path / "plan.waypoints"
    file.write_text(plan_text(plain_plan(7)))
    assert list(fleet.pushed(file, "--all", code=0)) == ["kite"]
    until(lambda: "kite" in stored_names(looking, "mission/current"), "the mission in the storage")
    pulled = json.loads(fleet.ask("pull", "--json").stdout)["vehicles"]
    assert [(each["vehicle"], each["error"], each["count"]) for each in pulled] == [("kite", None, 7)]
    dead = fleet.ask("push", file, "--vehicle", "owl")
    assert (dead.returncode, "no vehicle 'owl' is alive" in dead.stderr) == (1, True)


def test_a_storage_does_not_answer_for_a_silent_vehicle(stored: tuple[Fleet, zenoh.Session]) -> None:
    """Its bridge hangs while its token is alive; the stored state is not shown as current."""
    fleet, _ = stored
    kite = fleet.daemons["kite"].process
    kite.send_signal(signal.SIGSTOP)
    try:
        until(lambda: not fleet.listed()["kite"]["answers"], "its silence")
    finally:
        kite.send_signal(signal.SIGCONT)
    until(lambda: fleet.listed()["kite"]["answers"], "its return")
