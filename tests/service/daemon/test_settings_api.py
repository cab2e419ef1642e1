# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests about settings on the control socket: bad ones get one sentence and change nothing."""

import json

from tests.service.daemon.test_control_server import send
from tests.support.benches import Starter
from tests.support.programs import until

BAD_REQUESTS = {
    "no name": {"do": "setting"},
    "a long name": {"do": "setting", "name": "x" * 1000},
    "no value": {"do": "set-setting", "name": "p_roll"},
    "a list as a value": {"do": "set-setting", "name": "p_roll", "value": [1]},
    "not a number": {"do": "set-setting", "name": "p_roll", "value": "nan"},
    "no settings": {"do": "restore-settings"},
    "settings as a list": {"do": "plan-settings", "values": [1]},
    "a text for a list": {"do": "plan-settings", "values": {"p_roll": [44]}},
    "nothing to restore": {"do": "restore-settings", "values": {}},
    "another firmware": {"do": "restore-settings", "values": {"p_roll": 44}, "board": "INAV 8"},
    "no limit": {"do": "backups"},
    "no number": {"do": "backup", "number": "1"},
    "no such backup": {"do": "backup", "number": 99},
}


def test_bad_requests_are_answered_without_effect(start: Starter) -> None:
    daemon = start.daemon("sim:")
    daemon.wait()
    until(lambda: daemon.ask({"do": "backups", "limit": 5})["backups"], "the first backup")
    before = daemon.ask({"do": "settings"})
    for name, request in BAD_REQUESTS.items():
        answer = send(daemon, json.dumps(request).encode())
        assert list(answer) == ["error"], name
        assert "\n" not in str(answer["error"]), name
    assert daemon.ask({"do": "settings"}) == before
    assert daemon.end() == 0
    assert "Traceback" not in daemon.printed


def test_a_backup_has_the_difference_from_the_previous_backup(start: Starter) -> None:
    daemon = start.daemon("sim:")
    daemon.wait()
    until(lambda: daemon.ask({"do": "backups", "limit": 5})["backups"], "the first backup")
    result = daemon.ask({"do": "restore-settings", "values": {"p_roll": 44, "i_roll": 31}, "board": ""})
    assert (result["is_saved"], result["changed"]) == (True, ["p_roll", "i_roll"])
    until(lambda: len(daemon.ask({"do": "backups", "limit": 5})["backups"]) == 2, "the second backup")
    backup = daemon.ask({"do": "backup", "number": 2})
    assert (backup["before"], backup["occasion"]) == (1, "saved")
    assert {each["name"]: (each["left"], each["right"]) for each in backup["changes"]} == {
        "p_roll": (35, 44),
        "i_roll": (30, 31),
    }


def test_an_emptied_mode_range_reads_none(start: Starter) -> None:
    link = start.directory / "port"
    start.program("inav", "sim", "--kind", "inav", "--link", str(link))
    daemon = start.daemon(str(link))
    daemon.wait()
    texts = [
        daemon.ask({"do": "set-setting", "name": "MODE_HORIZON", "value": value})["text"]
        for value in ("AUX2 1300-1700", "")
    ]
    assert texts[1] == "MODE_HORIZON changed from AUX2 1300-1700 to none; not saved yet"
