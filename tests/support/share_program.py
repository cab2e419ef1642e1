# SPDX-License-Identifier: GPL-3.0-or-later
"""Other programs on a share, in the world's simulated time."""

from collections.abc import Sequence

from bridge.sharing.msp_sharing import Program
from protocols.msp.frame import Direction, MspFrame, MspParser
from tests.support.world import World

_LONGEST_WAIT_S = 5.0


class ShareProgram:
    """A program on a share. `replies`: with the time of their arrival."""

    def __init__(self, world: World, name: str = "192.0.2.7:5000", *, may_write: bool = False) -> None:
        self.world = world
        self.replies: list[tuple[float, MspFrame]] = []
        self.arrived = 0
        self.closed_at: float | None = None
        self._parser = MspParser(takes_low_v2=True)
        self.program = Program(name, name.partition(":")[0], self._arrived, self._close, may_write=may_write)
        world.bridge.program_joined(self.program)

    def ask(self, command: int, payload: bytes = b"", *, is_v2: bool = False, wait_s: float = 0.0) -> None:
        frame = MspFrame(Direction.REQUEST, command, payload, is_v2=is_v2)
        self.world.receive_from_program(self.program, frame.encode())
        self.world.run(wait_s)

    def wait_for(self, command: int, payload: bytes = b"", seconds: float = 4.0, *, is_v2: bool = False) -> MspFrame:
        """Ask, and wait for the reply."""
        before = self.arrived
        self.ask(command, payload, is_v2=is_v2)
        self.world.wait_until(lambda _: self.arrived > before, seconds)
        return self.replies[-1][1]

    def outcome(self, command: int, payload: bytes = b"", *, is_v2: bool = False) -> MspFrame | None:
        """Ask, and wait for the reply or the end of the connection, which is left then; None if there is no reply."""
        self.ask(command, payload, is_v2=is_v2)
        self.world.run_until(lambda _: bool(self.replies) or self.closed_at is not None, _LONGEST_WAIT_S)
        self.world.bridge.program_left(self.program)
        return self.replies[0][1] if self.replies else None

    def ask_every(self, interval_s: float, *requests: tuple[int, bytes]) -> None:
        """Send one request each interval, in turn, replies or not, until the connection is closed."""

        def ask(index: int) -> None:
            if self.closed_at is None:
                self.ask(*requests[index % len(requests)])
                self.world.after(interval_s, lambda: ask(index + 1))

        ask(0)

    def ask_in_turn(self, interval_s: float, commands: Sequence[int]) -> None:
        """Ask like mwp: the next request follows a reply after this interval."""

        def ask(index: int) -> None:
            before = self.arrived
            command = commands[index % len(commands)]
            self.ask(command, b"\0" if command == 118 else b"", is_v2=True)

            def look() -> None:
                if self.arrived > before:
                    ask(index + 1)
                elif self.closed_at is None:
                    self.world.after(interval_s, look)

            self.world.after(interval_s, look)

        ask(0)

    def _arrived(self, data: bytes) -> None:
        frames = self._parser.feed(data)
        self.arrived += len(frames)
        self.replies += [(self.world.now, frame) for frame in frames]

    def _close(self) -> None:
        self.closed_at = self.world.now
