# SPDX-License-Identifier: GPL-3.0-or-later
"""Arbitrary requests through a read-only share: no simulated board changes, and v2 is judged like v1."""

import random
from collections.abc import Callable
from functools import partial

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.msp.frame import Direction
from protocols.rights import Effect
from protocols.rights.msp import MSP_RIGHTS, Firmware, msp_right
from simulator.board.options import Faults
from simulator.commands.fc_kinds import make_board
from simulator.naze.board import SimulatedNaze
from tests.support.share_program import ShareProgram
from tests.support.world import World

BOARDS: dict[str, Callable[[], object]] = {
    "patched Harakiri": SimulatedNaze,
    "Harakiri": lambda: SimulatedNaze(faults=Faults(extension=False)),
    "INAV": partial(make_board, "inav"),
    "MultiWii": partial(make_board, "multiwii"),
}
COMMANDS = sorted({command for rights in MSP_RIGHTS.values() for command in rights} | set(range(256)))
#: What each board has of its settings, and some waypoints.
SETTINGS = [(command, b"") for command in (10, 111, 112, 113, 114, 122)] + [(118, bytes((at,))) for at in (0, 1, 16)]
AT_ONCE = 60


@pytest.mark.parametrize("name", BOARDS)
@settings(max_examples=4)
@given(seed=st.integers(0, (1 << 64) - 1))
def test_no_request_changes_a_board(name: str, seed: int) -> None:
    board = BOARDS[name]()
    world = World(speeds=(115200,), peer=board)
    world.wait_until(lambda w: w.bridge.vehicle.armed is False and not w.bridge.is_busy, 30)
    before, stored = present(world), world.naze.stored_records
    assert any(before)
    draw = random.Random(seed)
    for _ in range(AT_ONCE):
        answer(world, draw.choice(COMMANDS), fill(draw), is_v2=draw.random() < 0.3)
    assert present(world) == before
    assert world.naze.stored_records == stored
    assert not world.naze.armed
    assert not world.naze.counters.resets


def present(world: World) -> list[bytes | None]:
    """The second reading: MultiWii shows home with fields of the waypoint that was used last."""
    for _ in range(2):
        world.run(3)  # older replies are no longer current
        found = [answer(world, *setting) for setting in SETTINGS]
    return found


def fill(draw: random.Random) -> bytes:
    size = draw.choice((0, 0, 1, 2, 5, 7, draw.randrange(256)))
    return draw.choice((b"\0", b"\xff", draw.randbytes(1))) * size


def answer(world: World, command: int, payload: bytes, *, is_v2: bool = False) -> bytes | None:
    """The payload of the reply; None if the request is refused."""
    controller = world.inside.session.state.controller
    assert controller is not None
    replies = [ShareProgram(world).outcome(command, payload, is_v2=version) for version in (is_v2, not is_v2)]
    assert (replies[0] is None) == (replies[1] is None)
    if replies[0] is None or replies[0].direction is Direction.ERROR:
        return None
    assert len(replies[0].payload) <= msp_right(controller.firmware, command, payload).reply
    return replies[0].payload


@given(command=st.sampled_from(COMMANDS), payload=st.binary(max_size=255))
def test_a_permitted_read_reads_on_every_possible_firmware(command: int, payload: bytes) -> None:
    """Only what is known of the firmware adds to the rights of an unknown one."""
    unknown = MSP_RIGHTS[Firmware.UNKNOWN].get(command)
    if unknown is not None and unknown.effect_of(payload) is Effect.READ:
        known = [rights[command] for rights in MSP_RIGHTS.values() if command in rights]
        assert {right.effect_of(payload) for right in known} == {Effect.READ}
