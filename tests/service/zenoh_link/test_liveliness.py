# SPDX-License-Identifier: GPL-3.0-or-later
"""Two vehicles with one name both report it."""

import signal
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import pytest

from payloads.keys import COMMANDS
from tests.support.benches import Starter
from tests.support.plan import plain_plan, plan_text
from tests.support.programs import until
from tests.support.zenoh_bench import I_KNOW, VEHICLE, Reader, ask, endpoint, session, zenoh_bench, zenoh_config
from tests.support.zenoh_router import running_router


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
        second = Starter(second_directory, stack).daemon("sim:", config=zenoh_config(f'connect = ["{where}"]'))
        for daemon in (first.daemon, second):
            taken = until(partial(daemon.has_logged, "zenoh.name_taken"), "a log entry about the other vehicle")
            assert taken["vehicle"] == VEHICLE
        reader.wait("state", lambda state: state["others_of_this_name"] == 1)
        until(lambda: reader.events("zenoh.name_taken"), "the event")
        status = first.daemon.status()
        assert status is not None
        assert status["zenoh_others_of_this_name"] == 1
        for command in ("mission/upload", "mission/clear"):  # both would obey it
            payload = plan_text(plain_plan(7)).encode() if command == "mission/upload" else None
            (refused,) = ask(opened, f"{COMMANDS}/{command}", payload)
            assert "another bridge has the same vehicle name" in refused["error"]
        assert first.board.records() == before
        second.end(signal.SIGKILL)
        reader.samples.clear()
        reader.wait("state", lambda state: state["others_of_this_name"] == 0)
