# SPDX-License-Identifier: GPL-3.0-or-later
"""The log names the reason for a missing zenoh session, but not one that the reconnection makes obsolete."""

import asyncio
import threading
from collections.abc import Sequence

import pytest
from structlog.testing import capture_logs

from service.zenoh_link.outage_log import OutageLog

DOWN, REJECTED, CONNECTED = "connection refused", "rejected the session", ""


async def diagnosed() -> None:
    for thread in threading.enumerate():
        if thread.name == "zenoh why":
            thread.join(30)
    await asyncio.sleep(0)


async def logged(looks: Sequence[str]) -> list[str]:
    """The reasons logged after these diagnoses, 5 s apart."""
    reasons = iter(filter(None, looks))
    now = asyncio.get_running_loop().time()
    with capture_logs() as entries:
        outage = OutageLog(lambda: next(reasons))
        for number, look in enumerate(looks, 1):
            outage.look(look is not CONNECTED, now + 6 * number)
            await diagnosed()
    return [entry["why"] for entry in entries if entry["event"] == "zenoh.alone"]


@pytest.mark.parametrize(
    ("looks", "reasons"),
    [
        ([DOWN], []),
        ([DOWN, DOWN, DOWN], [DOWN]),
        ([DOWN, DOWN, REJECTED, CONNECTED], [DOWN]),
        ([REJECTED, CONNECTED, REJECTED, CONNECTED], []),
        ([DOWN, DOWN, REJECTED, REJECTED, REJECTED], [DOWN, REJECTED]),
        ([CONNECTED, DOWN, DOWN, CONNECTED, DOWN, DOWN], [DOWN]),
    ],
)
def test_a_reason_is_logged_once_and_only_if_it_lasts(looks: list[str], reasons: list[str]) -> None:
    assert asyncio.run(logged(looks)) == reasons


def test_a_diagnosis_that_ends_after_the_reconnection_is_not_logged() -> None:
    async def main() -> None:
        router_is_back = threading.Event()
        waits_s = iter([0, 30])

        def diagnose() -> str:
            router_is_back.wait(next(waits_s))
            return DOWN

        now = asyncio.get_running_loop().time()
        outage = OutageLog(diagnose)
        outage.look(True, now + 6)
        await diagnosed()
        outage.look(True, now + 12)
        outage.look(True, now + 18)  # a slow diagnosis is not joined by another one
        outage.look(False, now + 19)
        router_is_back.set()
        await diagnosed()

    with capture_logs() as entries:
        asyncio.run(main())
    assert entries == []
