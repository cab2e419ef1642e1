# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests to the helper: only known actions, with arguments of the right names and types."""

import pytest

from service.cli.helper.action import HelperRefusal, parse_action
from service.cli.helper.actions import ACTIONS


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"\xff\n",
        b"[]",
        b"7",
        b"{}",
        b'{"action": 7}',
        b'{"action": ["fix"]}',
        b'{"action": "shell", "command": "id"}',
        b"[" * 50_000,
        b'{"action": "fix", "fix": "\\ud800"}',
        b'{"action": "overview", "\\udfff": 1}',
    ],
)
def test_an_unknown_action_is_refused(line: bytes) -> None:
    with pytest.raises(HelperRefusal, match="This is not an action; the actions are overview, doctor, fix"):
        parse_action(line, ACTIONS)


@pytest.mark.parametrize(
    "arguments", ['"fix": 7', '"fix": null', '"fix": ["a"]', '"fix": "a", "more": 1', '"other": "a"', '"fix": true']
)
def test_arguments_have_names_and_types(arguments: str) -> None:
    with pytest.raises(HelperRefusal, match=r"The arguments of this action are: fix \(str\)"):
        parse_action(f'{{"action": "fix", {arguments}}}'.encode(), ACTIONS)


def test_a_number_is_not_a_truth_value() -> None:
    with pytest.raises(HelperRefusal, match=r"is_trial \(bool\)"):
        parse_action(b'{"action": "answer", "is_trial": 1}', ACTIONS)


@pytest.mark.parametrize(
    ("line", "name", "arguments"),
    [
        (b'{"action": "overview"}', "overview", {}),
        (b'{"action": "fix", "fix": "restart the bridge"}\n', "fix", {"fix": "restart the bridge"}),
        (b'{"action": "answer", "fc": "sim"}', "answer", {"fc": "sim"}),
    ],
)
def test_requests_that_fit(line: bytes, name: str, arguments: dict[str, str]) -> None:
    action = parse_action(line, ACTIONS)
    assert (action.func, action.args, action.keywords) == (ACTIONS[name], (), arguments)
