# SPDX-License-Identifier: GPL-3.0-or-later
"""Watches for mission changes by others than the bridge, and settles interrupted writes. Sans-IO."""

from math import inf

from bridge.gcs.ground import Ground
from bridge.line.conversation import Conclude, Conversation, FindPending, LinkLost, Recall
from bridge.missions.fc_mission_store import Loading
from bridge.missions.mission_service import NO_LINK, HeldMission, MissionService
from bridge.model.events import Emit, Level, MissionChangedOnBoard
from bridge.model.missions import Outcome, Refusal
from bridge.voice import sentences
from bridge.voice.happening import Happening


class MissionWatch:
    """Checks at the store's interval between transfers. After a check that took longer, at once."""

    def __init__(self, missions: MissionService, ground: Ground, emit: Emit) -> None:
        self._missions = missions
        self._ground = ground
        self._emit = emit
        self._has_asked_store = False
        #: The mission store whose saved mission was last reported as not loaded.
        self._unloaded: object = None
        #: When the running check began, or None while none runs.
        self._began_at: float | None = None
        #: The time of the next `tick`. A flight controller that was just found is checked at once.
        self.due = inf

    def tick(self, now: float) -> None:
        self.due = now + self._missions.watch_s
        if self._began_at is None and not self._missions.runner.needs_line and self.due < inf:
            self._began_at, self.due = now, inf
            self._missions.runner.start(self._is_outdated(), self._looked, now, in_background=True)

    def _looked(self, is_outdated: bool | LinkLost, now: float) -> None:
        if is_outdated is True:
            # Telemetry makes room while a changed list is read, but not for the first reading: that is not urgent.
            is_first = not self._missions.is_settled
            self._missions.runner.start(self._catch_up(), self._caught_up, now, in_background=is_first)
        else:
            self._caught_up(None, now)

    def _is_outdated(self) -> Conversation[bool]:
        """True if the list must be read, because it is unknown or was changed on the board."""
        if not self._has_asked_store:
            self._has_asked_store = True
            self._missions.pending += (yield FindPending()) or ()
        if isinstance(self._missions.fc_store, Refusal):
            return False
        is_known = self._missions.is_settled and not self._missions.pending
        return not (is_known and (yield from self._missions.fc_store.is_current()))

    def _catch_up(self) -> Conversation[Happening | None]:
        """Read the list. Returns the text for the pilot if it is another."""
        is_first, before = not self._missions.is_settled, self._missions.held
        held = yield from self._missions.read_back()
        if held is NO_LINK:
            return None
        loading, self._missions.loading = self._missions.loading, Loading.NOT_NEEDED
        self._missions.is_settled = loading is not Loading.ARMED
        if isinstance(held, HeldMission) and (news := (yield from self._settle(held))) is not None:
            return news
        if loading is Loading.ARMED:
            announced, self._unloaded = self._unloaded, self._missions.fc_store
            return None if announced is self._unloaded else sentences.NOT_LOADED()
        is_loaded = loading is Loading.LOADED
        if isinstance(held, Refusal) or (is_first and not (is_loaded and held.records)):
            return None
        if is_loaded:
            is_ours = (yield Recall(held.identity)) is not None
            return (sentences.LOADED_AGAIN if is_ours else sentences.LOADED_FOREIGN)(held.identity.count)
        if before is not None and before.identity == held.identity:
            return None
        return sentences.CHANGED_ON_BOARD(held.identity.count)

    def _settle(self, held: HeldMission) -> Conversation[Happening | None]:
        """Conclude the pending missions by the list found. Returns the text about the newest for the pilot."""
        news = None
        pending, self._missions.pending = self._missions.pending, []
        for mission in pending:
            if mission.identity is None:
                outcome, why = Outcome.CANCELLED, sentences.INTERRUPTED()
            elif mission.identity == held.identity:
                outcome, why = Outcome.VERIFIED, sentences.DID_ARRIVE(held.identity.count)
            elif mission.before == held.identity or (mission.before is None and held.records):
                outcome, why = Outcome.FAILED, sentences.DID_NOT_ARRIVE()
            else:
                outcome, why = Outcome.FAILED, sentences.ARRIVED_INCOMPLETE()
            if mission.number is not None:
                yield Conclude(mission.number, outcome, why.text)
            if mission.identity is not None:
                news = why
        return news

    def _caught_up(self, news: Happening | LinkLost | None, now: float) -> None:
        assert self._began_at is not None
        self.due, self._began_at = max(now, self._began_at + self._missions.watch_s), None
        if isinstance(news, Happening):
            self._ground.say(news)
            level: Level = "warning" if news.severity.is_on_hud else "info"
            self._emit(MissionChangedOnBoard(level=level, detail=news.text))
