# SPDX-License-Identifier: GPL-3.0-or-later
"""Endpoints of a zenoh configuration, and why one rejects a session."""

import pytest

from payloads.endpoints import TlsFiles, all_endpoints, endpoint_trouble, in_short
from tests.support.programs import free_port


@pytest.mark.parametrize(
    ("setting", "endpoints"),
    [
        (None, []),
        (["tcp/a:1", {"endpoint": "tls/b:2"}], ["tcp/a:1", "tls/b:2"]),
        ({"peer": ["tcp/a:1"], "client": ["tcp/b:2"], "router": None}, ["tcp/a:1", "tcp/b:2"]),
    ],
)
def test_endpoints_are_found_in_every_notation(setting: object, endpoints: list[str]) -> None:
    assert all_endpoints(setting) == endpoints


def test_the_trouble_of_each_endpoint_is_named() -> None:
    refused, wrong = f"tcp/127.0.0.1:{free_port()}", "192.168.4.1"
    first, second = endpoint_trouble([refused, wrong], TlsFiles()).split("; ")
    assert first.startswith(refused)
    assert "connection refused" in first
    assert second.startswith(f"{wrong}: this is not an endpoint")


def test_an_error_of_zenoh_is_one_line_without_the_source() -> None:
    assert in_short(ValueError("no\n such  key at /home/x/zenoh/lib.rs:12.")) == "no such key"
