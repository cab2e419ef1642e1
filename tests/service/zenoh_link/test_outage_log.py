# SPDX-License-Identifier: GPL-3.0-or-later
"""The log names the reason for a missing zenoh session, but not one that the reconnection makes obsolete."""

import asyncio
from collections.abc import Iterable

import pytest
from structlog.testing import capture_logs

from service.zenoh_link.session import log_outages

DOWN, REJECTED, CONNECTED = "connection refused", "rejected the session", ""
#: The router is back before the diagnosis ends.
TOO_LATE = "too late"


async def logged(looks: Iterable[str], monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The reasons logged after these diagnoses."""
    rest = iter(looks)
    now = CONNECTED

    async def wait(_interval_s: float) -> None:
        nonlocal now
        try:
            now = next(rest)
        except StopIteration:
            raise asyncio.CancelledError from None

    def diagnose() -> str:
        nonlocal now
        if now is not TOO_LATE:
            return now
        now = CONNECTED
        return DOWN

    monkeypatch.setattr(asyncio, "sleep", wait)
    with capture_logs() as entries, pytest.raises(asyncio.CancelledError):
        await log_outages(diagnose, lambda: now is not CONNECTED)
    return [entry["why"] for entry in entries if entry["event"] == "zenoh.alone"]


@pytest.mark.parametrize(
    ("looks", "reasons"),
    [
        ([DOWN], []),
        ([DOWN, DOWN, DOWN], [DOWN]),
        ([DOWN, TOO_LATE], []),
        ([DOWN, DOWN, REJECTED, CONNECTED], [DOWN]),
        ([REJECTED, CONNECTED, REJECTED, CONNECTED], []),
        ([DOWN, DOWN, REJECTED, REJECTED, REJECTED], [DOWN, REJECTED]),
        ([CONNECTED, DOWN, DOWN, CONNECTED, DOWN, DOWN], [DOWN]),
    ],
)
async def test_a_reason_is_logged_once_and_only_if_it_lasts(
    looks: list[str], reasons: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert await logged(looks, monkeypatch) == reasons
