# SPDX-License-Identifier: GPL-3.0-or-later
"""Recovery after damaged frames: intact frames lost by a forwarder, and damaged ones that it passes on.

1,500 frames, one in twenty damaged, for each kind of damage (benchmarks.damage), at a pace that every forwarder can
keep.
"""

import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from random import Random

from benchmarks.damage import Damage, damaged_stream
from benchmarks.figure import Figure
from benchmarks.forwarders import OURS, Forwarder, usable_forwarders
from benchmarks.line import Line
from protocols.mavlink.dialect import messages

_FRAMES = 1500
_DAMAGED_SHARE = 0.05
_RATE = 1000.0
_SEED = 1
_PAYLOAD_SIZE = 29


def measure() -> list[Figure]:
    """Send the same streams through all forwarders on this machine."""
    return [figure for forwarder in usable_forwarders() for figure in _figures(forwarder)]


def _figures(forwarder: Forwarder) -> Iterator[Figure]:
    limit = 0 if forwarder.name == OURS else None
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        line = stack.enter_context(closing(Line()))
        stack.enter_context(forwarder.start(folder, line))
        line.warm_up()
        for damage in Damage:
            stream = damaged_stream(_frames(line), damage, _DAMAGED_SHARE, Random(_SEED))
            passed_on = Counter(line.send(stream.pieces, _RATE))
            intact = Counter(stream.intact)
            name = f"resync after {damage.value}, {forwarder.name}"
            yield Figure(
                f"{name}, lost of {len(stream.intact)} whole frames", (intact - passed_on).total(), "", None, limit
            )
            yield Figure(f"{name}, damaged ones passed on", (passed_on - intact).total(), "", None, limit)


def _frames(line: Line) -> list[bytes]:
    chance = Random(_SEED)
    return [line.frame(messages.MAVLINK_MSG_ID_RAW_IMU, chance.randbytes(_PAYLOAD_SIZE)) for _ in range(_FRAMES)]
