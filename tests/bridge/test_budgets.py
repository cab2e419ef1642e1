# SPDX-License-Identifier: GPL-3.0-or-later
"""The limits on a ground station's requests over a long time, in simulated time."""

from protocols.mavlink.dialect import messages as m
from tests.support.world import GroundStation, World

_SAVE = b"$M<\x00\xfa"


def test_texts() -> None:
    world = World(speeds=(115200,))
    world.wait_ready()
    station = GroundStation(world)
    banner = m.MAVLink_command_long_message(1, 1, 42428, 0, 0, 0, 0, 0, 0, 0, 0)
    for number in range(1000):
        world.after(number / 100, lambda: station.send(banner))
    world.run(10)
    assert 200 < len(station.texts()) <= 200 + 5 * 10 + 5


def test_flash_writes() -> None:
    """A page lasts 10,000."""
    world = World(speeds=(115200,))
    world.wait_ready()
    station = GroundStation(world)
    save = m.MAVLink_command_long_message(1, 1, 245, 0, 1, 0, 0, 0, 0, 0, 0)
    for number in range(200):
        world.after(number / 2, lambda: station.send(save))
    world.run(100)
    assert 30 < sum(data.count(_SAVE) for _, _, data in world.written) <= 30 + 100 / 20 + 1
