# SPDX-License-Identifier: GPL-3.0-or-later
"""A fleet's address as options, and messages about invalid ones."""

from pathlib import Path

import pytest

from tests.fleet.test_session import sentence_of
from tests.support.zenoh_router import EXAMPLES


@pytest.mark.parametrize(
    ("endpoint", "reason"),
    [
        ("tcp/no-such-host.invalid:7447", "the host name 'no-such-host.invalid'"),
        ("smoke/127.0.0.1:7447", "smoke/127.0.0.1:7447"),
        ("tcp/127.0.0.1:99999", "99999"),
    ],
)
def test_an_invalid_endpoint_is_reported_in_one_sentence(endpoint: str, reason: str) -> None:
    assert reason in sentence_of("list", "--connect", endpoint)


@pytest.mark.parametrize("endpoint", ["192.168.4.1:7447", "tcp/127.0.0.1", "router", ""])
@pytest.mark.parametrize("arguments", [("list", "--connect"), ("enroll", "kite", "--router")])
def test_an_option_that_is_not_an_endpoint_is_a_usage_error(arguments: tuple[str, ...], endpoint: str) -> None:
    reason = f"Invalid value for '{arguments[-1]}': {endpoint!r} is not an endpoint: write one like tcp/localhost:7447"
    assert sentence_of(*arguments, endpoint, code=2) == f"naze-bridge: {reason}"


@pytest.mark.parametrize("prefix", ["fleet/*", "a/b", "@fleet", "fl eet", "fleet?x"])
def test_an_invalid_prefix_is_reported_in_one_sentence(prefix: str) -> None:
    assert f"--prefix is {prefix!r}" in sentence_of("list", "--prefix", prefix, code=2)


def test_an_unusable_zenoh_file_is_reported_in_one_sentence(tmp_path: Path) -> None:
    missing = tmp_path / "none.json5"
    assert f"{missing} cannot be read: No such file" in sentence_of("list", "--zenoh-config", missing)
    broken = tmp_path / "broken.json5"
    for text in ("{", '{mode: "aeroplane"}', '{no_such_key: 1, "', "\0\0"):
        broken.write_text(text)
        assert f"{broken} is not a zenoh configuration" in sentence_of("list", "--zenoh-config", broken)
    broken.write_text('{mode: "client"}')
    assert "lacks connect/endpoints" in sentence_of("list", "--zenoh-config", broken)


def test_vehicles_must_be_named() -> None:
    file = EXAMPLES / "naze-field.waypoints"
    assert "--vehicle NAME, or --all" in sentence_of("push", file, code=2)
    assert "--vehicle NAME, or --all" in sentence_of("push", file, "--all", "--vehicle", "a", code=2)
