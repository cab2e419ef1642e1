# SPDX-License-Identifier: GPL-3.0-or-later
"""The way from zenoh's threads to the event loop."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVarTuple

Arguments = TypeVarTuple("Arguments")


def post(loop: asyncio.AbstractEventLoop, callback: Callable[[*Arguments], object], *arguments: *Arguments) -> None:
    """Call back on the loop; ignored if the loop has ended, because zenoh may notice that a moment later."""
    with suppress(RuntimeError):
        loop.call_soon_threadsafe(callback, *arguments)
