# SPDX-License-Identifier: GPL-3.0-or-later
"""A bad radio link between a UDP client and the daemon: loses, duplicates, delays and reorders datagrams."""

import heapq
import random
import selectors
import socket
import threading
import time
from collections.abc import Callable
from enum import Enum, auto
from itertools import count
from types import TracebackType
from typing import Self

_DATAGRAM_SIZE = 65535
_LONGEST_SLEEP_S = 0.2


class Direction(Enum):
    """The direction of a datagram."""

    TO_DAEMON = auto()
    TO_CLIENT = auto()


class LossyUdp:
    """Clients send to `address`; the daemon sees each as a separate client.

    loss, repeats: probability that a datagram is lost or duplicated. delay_s, jitter_s: each datagram (and each copy)
    takes delay_s and up to jitter_s more, which reorders them. `swallow` may be set to a function that selects further
    datagrams to lose.
    """

    def __init__(
        self,
        daemon: tuple[str, int],
        *,
        loss: float = 0.0,
        repeats: float = 0.0,
        delay_s: float = 0.0,
        jitter_s: float = 0.0,
        seed: float = 0,
    ) -> None:
        self._daemon = daemon
        self._loss, self._repeats = loss, repeats
        self._delay_s, self._jitter_s = delay_s, jitter_s
        self._random = random.Random(seed)
        self.swallow: Callable[[Direction, bytes], bool] = lambda way, data: False
        self.passed = 0
        self.lost = 0
        self._numbers = count()
        self._under_way: list[tuple[float, int, Callable[[], object]]] = []
        self._far: dict[tuple[str, int], socket.socket] = {}
        self._selector = selectors.DefaultSelector()
        self._near = self._socket()
        self.address: tuple[str, int] = self._near.getsockname()
        self._selector.register(self._near, selectors.EVENT_READ, self._from_client)
        self._running = True
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._running = False
        self._thread.join()
        for each in (self._near, *self._far.values()):
            each.close()
        self._selector.close()

    @staticmethod
    def _socket() -> socket.socket:
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        made.bind(("127.0.0.1", 0))
        made.setblocking(False)
        return made

    def _run(self) -> None:
        while self._running:
            now = time.monotonic()
            wait = min(self._under_way[0][0] - now, _LONGEST_SLEEP_S) if self._under_way else _LONGEST_SLEEP_S
            for key, _ in self._selector.select(max(wait, 0)):
                key.data()
            while self._under_way and self._under_way[0][0] <= time.monotonic():
                heapq.heappop(self._under_way)[2]()

    def _from_client(self) -> None:
        data, client = self._near.recvfrom(_DATAGRAM_SIZE)
        far = self._far_side(client)
        self._carry(Direction.TO_DAEMON, data, lambda: far.sendto(data, self._daemon))

    def _far_side(self, client: tuple[str, int]) -> socket.socket:
        known = self._far.get(client)
        if known is not None:
            return known
        far = self._far[client] = self._socket()
        self._selector.register(far, selectors.EVENT_READ, lambda: self._from_daemon(far, client))
        return far

    def _from_daemon(self, far: socket.socket, client: tuple[str, int]) -> None:
        data = far.recv(_DATAGRAM_SIZE)
        self._carry(Direction.TO_CLIENT, data, lambda: self._near.sendto(data, client))

    def _carry(self, way: Direction, data: bytes, deliver: Callable[[], object]) -> None:
        chance = self._random
        if self.swallow(way, data) or chance.random() < self._loss:
            self.lost += 1
            return
        self.passed += 1
        for _ in range(1 + (chance.random() < self._repeats)):
            at = time.monotonic() + self._delay_s + chance.uniform(0, self._jitter_s)
            heapq.heappush(self._under_way, (at, next(self._numbers), deliver))
