# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge missions`."""

from contextlib import ExitStack
from pathlib import Path

from tests.service.cli.test_mission_commands import ask, assert_one_sentence, strict, write_plan
from tests.support.benches import Starter
from tests.support.plan import plain_plan
from tests.support.programs import Daemon, run_naze_bridge


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


def test_missions_needs_a_daemon() -> None:
    ended = run_naze_bridge("missions", "list", "--fc", "sim:")
    assert ended.returncode == 2
    assert "No such option" in ended.stderr


def test_a_missing_mission_is_reported_in_one_sentence(daemon: Daemon) -> None:
    for wrong in (["show", "99999999999999999999"], ["list", "--limit", "99999999999999999999"], ["show", "-1"]):
        ended = ask(daemon, "missions", *wrong)
        assert ended.returncode == 2, ended
        assert "Traceback" not in ended.stderr
    assert_one_sentence(ask(daemon, "missions", "show", "2147483647"), 1, "there is no mission 2147483647")


def test_an_empty_store_is_reported_as_empty(tmp_path: Path) -> None:
    with ExitStack() as stack:
        daemon = Starter(tmp_path, stack).daemon("sim:")
        daemon.wait_up()
        assert ask(daemon, "missions", "list").stdout == "No mission has been received yet.\n"
        assert strict(ask(daemon, "missions", "list", "--json").stdout) == []
