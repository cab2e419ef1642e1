# SPDX-License-Identifier: GPL-3.0-or-later
"""A port on which an armed Harakiri sends FrSky telemetry (tele_prot 1): watched only for its end."""

from protocols.frsky import FrskyWatch

#: Harakiri sends eight times a second.
_SILENCE_S = 1.0


class FrskyLine:
    """Feed bytes and time; `ended` is set to the reason when the telemetry stops."""

    def __init__(self, now: float) -> None:
        self._watch = FrskyWatch()
        self._heard_at = now
        self.ended: str | None = None

    def receive(self, data: bytes, now: float) -> bool:
        """Take bytes from the port; True if they belong to FrSky telemetry."""
        self._watch.feed(data)
        if not self._watch.values_in_a_row:
            return False
        self._heard_at = now
        return True

    def tick(self, now: float) -> None:
        """Notice silence."""
        if now >= self.next_deadline():
            self.ended = f"no FrSky telemetry for {_SILENCE_S} s"

    def next_deadline(self) -> float:
        """The time of the next `tick`."""
        return self._heard_at + _SILENCE_S
