# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs conversations one at a time, so that two of them never mix on the wire."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Any, Generic, TypeVar

from bridge.line.conversation import (
    BeginSave,
    Conclude,
    Conversation,
    EndSave,
    FindPending,
    LinkLost,
    OutOfTime,
    Pause,
    Recall,
    Receive,
    Save,
    Send,
    Stopped,
    StoreEffect,
    TimeLimit,
)
from bridge.line.msp_link import MspLink

#: A failing SD card may hang forever, and the flight controller's conversations wait behind it.
_STORE_TIMEOUT_S = 3.0
#: The final ack waits for these, and Mission Planner waits 5 s for the ack, of which an INAV's 120 records take 2.4 s.
_ACK_WAITS_S = 1.5


T = TypeVar("T")


@dataclass(slots=True)
class Task(Generic[T]):
    """A conversation that was started. `began_at`: None while it waits for its turn. `ends_at`: set by TimeLimit."""

    conversation: Conversation[T]
    on_done: Callable[[T | LinkLost, float], None]
    in_background: bool
    began_at: float | None = None
    ends_at: float = inf


@dataclass(slots=True)
class _BegunSave:
    """The last BeginSave. `answers`: the store's, once it has answered."""

    save: Save
    answers: list[object] = field(default_factory=list)


class Runner:
    """Runs conversations in the order they were started. Time is passed in.

    `do` gets the effects for the store. Each is answered with `store_answered`.
    """

    def __init__(self, do: Callable[[StoreEffect], object]) -> None:
        self._do = do
        #: The commands whose replies the running conversation waits for: the next is passed to `advance`.
        self.awaited_replies: frozenset[int] = frozenset()
        self._link: MspLink | None = None
        self._queue: deque[Task[Any]] = deque()
        self._current: Task[Any] | None = None
        self._awaited: Receive | Pause | StoreEffect | EndSave | None = None
        self._begun: _BegunSave | None = None
        #: The time of the next `tick`, or infinity without a pending request.
        self.due = inf
        self._busy = False
        #: True while requests of other programs wait for the line.
        self.programs_wait = False

    @property
    def is_busy(self) -> bool:
        return self._current is not None

    @property
    def needs_line(self) -> bool:
        """True while a conversation that telemetry should make room for runs or waits."""
        return self._current is not None and not all(task.in_background for task in (self._current, *self._queue))

    def start(
        self,
        conversation: Conversation[T],
        on_done: Callable[[T | LinkLost, float], None],
        now: float,
        *,
        in_background: bool = False,
    ) -> Task[T]:
        """Queue a conversation. `on_done` gets the result, or the LinkLost that ended it, and the time."""
        task = Task(conversation, on_done, in_background)
        self._queue.append(task)
        self._begin_next(now)
        return task

    def reset(self, now: float) -> None:
        """End the running conversation as if the line were gone."""
        if self._current is not None and not self._busy:
            self.advance(LinkLost("internal error"), now)

    def link_up(self, link: MspLink) -> None:
        self._link = link

    def link_down(self, now: float) -> None:
        """The line is down: LinkLost is raised in the running conversation."""
        self._link = None
        if self._interruptible is not None:
            self.advance(LinkLost("the flight controller's port is gone"), now)

    def stop(self, now: float) -> None:
        """Raise Stopped in the running conversation, which may still use the line to clean up."""
        if self._interruptible is not None:
            self.advance(Stopped("the bridge is stopping"), now)

    def store_answered(self, effect: StoreEffect, answer: object, now: float) -> None:
        """Pass on the store's reply to an effect. A reply after the timeout is ignored."""
        if self._begun is not None and effect is self._begun.save:
            self._begun.answers.append(answer)
            is_awaited = isinstance(self._awaited, EndSave)
        else:
            is_awaited = effect is self._awaited
        if is_awaited:
            self.advance(answer, now)

    def tick(self, now: float) -> None:
        """End a wait that has timed out."""
        if now < self.due:
            return
        task = self._interruptible
        if task is not None and now >= task.ends_at:
            task.ends_at = inf
            self.advance(OutOfTime("the time limit has passed"), now)
            return
        if task is not None and isinstance(self._awaited, Receive) and self._link is not None:
            # The link may have delayed the request, or received other replies first.
            deadline = self._link.reply_deadline(self._awaited.commands, now)
            if now < deadline:
                self.due = min(deadline, task.ends_at)
                return
        self.advance(None, now)

    @property
    def _interruptible(self) -> Task[Any] | None:
        """The running conversation, unless it waits for the store, which has its own timeout."""
        return self._current if isinstance(self._awaited, Receive | Pause) else None

    def _begin_next(self, now: float) -> None:
        """Run the queue. A loop, because without a link every conversation may end at once."""
        while self._current is None and self._queue and not self._busy:
            self._current = self._queue.popleft()
            self._current.began_at = now
            self._run(None, now)

    def advance(self, answer: object, now: float) -> None:
        """Resume the current conversation with the answer that it waits for. Start the next when it ends."""
        try:
            self._run(answer, now)
        finally:
            if self._current is None:
                self._begin_next(now)

    def _run(self, answer: object, now: float) -> None:
        assert self._current is not None
        self.awaited_replies = frozenset()
        task = self._current
        conversation = task.conversation
        self._awaited = None
        self.due = inf
        try:
            while True:
                effect = conversation.throw(answer) if isinstance(answer, LinkLost) else conversation.send(answer)
                answer = None
                match effect:
                    case TimeLimit(seconds, size):
                        task.ends_at = now + seconds + (size * self._link.byte_s if self._link else 0.0)
                        continue
                    case Send() if self._link:
                        self._link.send(effect, now)
                        continue
                    case Receive(commands, request) if self._link:
                        if request is not None:
                            self._link.send(request, now)
                        deadline = min(self._link.reply_deadline(commands, now), task.ends_at)
                        self.awaited_replies = commands
                    case Send() | Receive():
                        answer = LinkLost("the flight controller does not speak this protocol now")
                        continue
                    case Pause(seconds):
                        deadline = min(now + seconds, task.ends_at)
                    case BeginSave(mission):
                        self._begun = _BegunSave(mission)
                        self._do(mission)
                        continue
                    case EndSave():
                        assert self._begun is not None
                        if self._begun.answers:
                            answer = self._begun.answers[0]
                            continue
                        deadline = now + _ACK_WAITS_S
                    case Conclude() | Recall() | FindPending():
                        self._do(effect)
                        deadline = now + (_ACK_WAITS_S if isinstance(effect, Conclude) else _STORE_TIMEOUT_S)
                self._awaited = effect
                self.due = deadline
                return
        except StopIteration as stop:
            self._end(task, stop.value, now)
        except LinkLost as lost:
            self._end(task, lost, now)
        except Exception:
            # A bug, which the caller logs: the requester still needs a result.
            self._end(task, LinkLost("internal error"), now)
            raise

    def _end(self, task: Task[Any], result: object, now: float) -> None:
        """Report the result. Conversations started by on_done run after it has returned: it sees a consistent state."""
        self._current = None
        self._busy = True
        try:
            task.on_done(result, now)
        finally:
            self._busy = False
