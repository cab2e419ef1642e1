# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups refusals by attempt: Mission Planner repeats a request up to seven times, and one text is enough."""

#: A client repeats a request within 0.7 s; a pilot who tries again takes longer, and gets the reason again.
_QUIET_S = 1.0
#: Beyond this limit a text may be repeated.
_MAX_TEXTS = 16


class RecentTexts:
    """Remembers each text to one ground station until 1 s has passed without a repetition."""

    def __init__(self) -> None:
        self._sent: dict[str, float] = {}  # oldest first

    def is_new(self, text: str, now: float) -> bool:
        """True if the text is new in this attempt."""
        sent_at = self._sent.pop(text, None)
        self._sent[text] = now
        if len(self._sent) > _MAX_TEXTS:
            del self._sent[next(iter(self._sent))]
        return sent_at is None or now >= sent_at + _QUIET_S
