# SPDX-License-Identifier: GPL-3.0-or-later
"""The radio receiver: eight channels on one wire, as times between edges (PPM)."""

from simulator.emulated_naze.clock import Alarm, Clock
from simulator.emulated_naze.timer import Timer

CHANNELS = 8
#: Roll, pitch, throttle, yaw (AETR) and the switches: sticks centred, throttle low.
CENTRED = (1500, 1500, 1000, 1500, 1000, 1000, 1000, 1000)
_FRAME_US = 22_000
# The gap that ends a frame must be longer than any channel.
_SHORTEST_GAP_US = 3_000


class PpmReceiver:
    """Connected to channel 1 of a timer. `channels`: microseconds in the order of the wire."""

    def __init__(self, clock: Clock, timer: Timer) -> None:
        self.channels = list(CENTRED)
        self._timer = timer
        self._edge = Alarm(clock, self._on_edge)
        self._next = 0

    def power_on(self) -> None:
        self._next = 0
        self._edge.set_in(_FRAME_US * 1000)

    def power_off(self) -> None:
        self._edge.cancel()

    def _on_edge(self) -> None:
        self._timer.capture(1)
        if self._next < CHANNELS:
            pause_us = self.channels[self._next]
        else:
            pause_us = max(_FRAME_US - sum(self.channels), _SHORTEST_GAP_US)
        self._next = (self._next + 1) % (CHANNELS + 1)
        self._edge.set_in(pause_us * 1000)
