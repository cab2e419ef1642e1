# SPDX-License-Identifier: GPL-3.0-or-later
"""`missions` and `pull N`: the store, read without a daemon."""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import pytest

from storage.mission_store import open_store
from tests.service.cli.test_mission_commands import ask, assert_one_sentence, strict, write_plan
from tests.support.benches import Starter
from tests.support.plan import plain_plan, waypoint
from tests.support.programs import Daemon, run_naze_bridge
from tests.support.sample_missions import mission as sample_mission


@pytest.fixture
def start_in(tmp_path: Path) -> Iterator[Starter]:
    with ExitStack() as stack:
        yield Starter(tmp_path, stack)


_READING = (("list",), ("show", "2"))


def test_stored_missions_are_read_without_a_daemon(start_in: Starter, tmp_path: Path) -> None:
    daemon = start_in.daemon("sim:")
    daemon.wait()
    first, second = plain_plan(5), [*plain_plan(4), waypoint(9)]
    for plan in (first, second):
        assert ask(daemon, "push", write_plan(tmp_path / "plan", plan)).returncode == 0
    with_daemon = {words: ask(daemon, "missions", *words).stdout for words in _READING}
    daemon.end()
    assert {words: ask(daemon, "missions", *words).stdout for words in _READING} == with_daemon
    assert "no daemon answers" in ask(daemon, "missions", "restore", "1").stderr
    restored = ask(daemon, "missions", "restore", "1", "--fc", "sim")
    assert "ACCEPTED: 5 of 5 stored: " in restored.stdout, restored
    assert_one_sentence(
        run_naze_bridge("missions", "list", "--state-dir", tmp_path), 1, "no missions or settings are stored"
    )


def test_a_file_name_cannot_act_on_the_terminal(daemon: Daemon, tmp_path: Path) -> None:
    file = write_plan(tmp_path / "Süd\x1b[2J\x9b2J\u202e\nwest", plain_plan(3))
    assert ask(daemon, "push", file, "--json").returncode == 0
    number = strict(ask(daemon, "missions", "list", "--json").stdout)[0]["number"]
    for words in (("list",), ("show", str(number))):
        shown = ask(daemon, "missions", *words).stdout
        assert "push of Süd[2J2J west" in " ".join(shown.split())
        assert shown.replace("\n", "").isprintable()
    file.write_text("no plan")
    refused = ask(daemon, "push", file)
    assert refused.stderr.rstrip("\n").isprintable()


def test_a_store_of_a_service_that_was_taken_over_cannot_act_on_the_terminal(tmp_path: Path) -> None:
    with open_store(tmp_path / "missions.db", 0.0).store as store:
        number = store.add(replace(sample_mission(1), source="\x1b[2J\x9b2Jpush"))
        store.conclude(number, "VERIFIED\x1b[2J", "\u202edetail", 0.0)
    for words in (("list",), ("show", str(number))):
        shown = run_naze_bridge("missions", *words, "--state-dir", tmp_path)
        assert shown.stdout.replace("\n", "").isprintable(), shown


def test_missions_needs_a_daemon() -> None:
    ended = run_naze_bridge("missions", "list", "--fc", "sim:")
    assert ended.returncode == 2
    assert "No such option" in ended.stderr


def test_a_missing_mission_is_one_sentence(daemon: Daemon) -> None:
    for wrong in (["show", "99999999999999999999"], ["list", "--limit", "99999999999999999999"], ["show", "-1"]):
        ended = ask(daemon, "missions", *wrong)
        assert ended.returncode == 2, ended
        assert "Traceback" not in ended.stderr
    assert_one_sentence(ask(daemon, "missions", "show", "2147483647"), 1, "there is no mission 2147483647")


def test_an_empty_store_is_said_to_be_empty(tmp_path: Path) -> None:
    with ExitStack() as stack:
        daemon = Starter(tmp_path, stack).daemon("sim:")
        daemon.wait_up()
        assert ask(daemon, "missions", "list").stdout == "No mission has been received yet.\n"
        assert strict(ask(daemon, "missions", "list", "--json").stdout) == []
