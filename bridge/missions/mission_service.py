# SPDX-License-Identifier: GPL-3.0-or-later
"""The mission operations shared by all clients: one transfer at a time, checks, delivery, read-back.

Ground stations (bridge.transfers.uploads, downloads) and the command line (local_missions) both use it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import partial
from math import inf
from typing import Any, TypeVar

from bridge.line.conversation import (
    BeginSave,
    Conclude,
    Conversation,
    EndSave,
    LinkLost,
    NoteReader,
    Pause,
    Recall,
    Save,
    Stopped,
)
from bridge.line.runner import Runner
from bridge.missions.fc_mission_store import (
    LIST_IS_GONE,
    AnyFcMissionStore,
    Loading,
    PushFailure,
    PushProgress,
    PushResult,
    StoreReport,
    StoreState,
)
from bridge.missions.list_check import check_list
from bridge.model.missions import ARMED, ArrivedMission, Outcome, PendingMission, RecalledMission, Refusal
from bridge.model.vehicle import GlobalPosition, Vehicle
from bridge.voice import sentences
from bridge.voice.happening import Happening
from bridge.voice.mission_report import summary, with_meant_home
from protocols.mission_item import ListIdentity, MissionItem, MissionResult, identify
from protocols.msp.nav import FINISHED, NavAction, NavMode, NavStatus
from reports.verdict import FlownLeg, Result, SentSeqs, Verdict, is_renumbered

T = TypeVar("T")

#: The timeout for a running flash write (docs/mission-rules.md).
_BUSY_TIMEOUT_S = 1.0
_BUSY_INTERVAL_S = 0.1
#: A board that is lost because it has armed is found again, and heard armed, within this time.
_ARMS_WITHIN_S = 15.0


class TransferStep(Enum):
    """The two halves of an upload. A push has only the second."""

    RECEIVING = "receiving"
    WRITING = "writing"


@dataclass(frozen=True, slots=True)
class MissionTransfer:
    """`done` of `total` items or records. All records written does not mean verified: read-back follows."""

    source: str
    step: TransferStep
    done: int
    total: int


@dataclass(frozen=True, slots=True)
class DeliveryResult:
    """The result of a mission. `number` is the number in the store, None if it could not be stored.

    `change`: makes the sentence for other ground stations about a change on the aircraft, from the name of the station
    that caused it, or None if there is no change.
    """

    ack: MissionResult
    why: Happening
    number: int | None
    change: Callable[[str], Happening] | None = None

    @property
    def text(self) -> str:
        return self.why.text


@dataclass(frozen=True, slots=True)
class HeldMission:
    """The flight controller's list, as last read.

    `sent_seqs`: of each ground station that counts by them, by Sender.identity. `path`: as it is flown, if known.
    """

    identity: ListIdentity
    records: tuple[Any, ...]
    items: tuple[MissionItem, ...]
    sent_seqs: Mapping[str, SentSeqs] = field(default_factory=dict)
    path: tuple[FlownLeg, ...] = ()


#: Ground stations whose own item numbers are remembered.
_MOST_SENDERS = 16
NO_LINK = Refusal(MissionResult.DENIED, sentences.NO_LINK())
_BUSY = Refusal(MissionResult.DENIED, sentences.BUSY())
STOPPING = Refusal(MissionResult.DENIED, sentences.STOPPING())
_UNKNOWN = Refusal(MissionResult.DENIED, sentences.ARMED_AND_UNKNOWN())
OCCUPIED = Refusal(MissionResult.DENIED, sentences.OCCUPIED())


@dataclass(frozen=True, slots=True)
class MissionEnded:
    """An effect: a received mission was completed or rejected."""

    mission: ArrivedMission
    delivery: DeliveryResult


class MissionService:
    """Holds the transfer lock, the current flight controller's mission store, and the list."""

    #: MAV_MISSION_TYPE of the lists.
    mission_type: int = 0
    #: The current flight controller stores such lists, or did until it was lost. Missions are always answered.
    are_stored: bool = True
    #: Missions are also kept on the Pi.
    are_kept: bool = True

    def __init__(self, vehicle: Vehicle, runner: Runner, do: Callable[[MissionEnded | NoteReader], object]) -> None:
        self.vehicle = vehicle
        self.runner = runner
        self._do = do
        #: The mission store of the current flight controller, or the reply to every attempt.
        self.fc_store: AnyFcMissionStore | Refusal = NO_LINK
        self._owner: object | None = None
        self._closed = False
        self._flies_mission = False
        #: False until the current flight controller's list was read, and after an interrupted push.
        self.is_settled = False
        #: The saved mission's loading since MissionWatch last reported it.
        self.loading = Loading.NOT_NEEDED
        #: Missions to compare with the list when it is next read.
        self.pending: list[PendingMission] = []
        self.held: HeldMission | None = None
        #: The list as last verified before the link was lost: arming may change the protocol. Only of the same board.
        self._former: HeldMission | None = None
        #: The craft was armed by then if that list cannot have changed.
        self._former_until = -inf
        #: Set while records are written and verified.
        self.writing: MissionTransfer | None = None
        #: True while a ground station's list arrives.
        self.is_arriving = False

    def run(
        self, conversation: Conversation[T | Refusal], on_done: Callable[[T | Refusal, float], None], now: float
    ) -> None:
        """Run a conversation. `on_done` gets the result and the time. A lost line is also a refusal."""

        def done(result: T | Refusal | LinkLost, at: float) -> None:
            if isinstance(result, LinkLost):
                result = STOPPING if isinstance(result, Stopped) else NO_LINK
            on_done(result, at)

        self.runner.start(conversation, done, now)

    def use(self, store: AnyFcMissionStore | Refusal, now: float, *, is_same_board: bool) -> None:
        """Switch to another flight controller, to none, or to another protocol of the same."""
        self.fc_store = store
        if self.held is not None:
            self._former, self._former_until = self.held, now + _ARMS_WITHIN_S
        if not is_same_board:
            self._former = None
        self.held, self.loading = None, Loading.NOT_NEEDED
        self.is_settled = False

    def settings_changed(self) -> None:
        if not isinstance(self.fc_store, Refusal):
            self.fc_store.settings_changed()

    @property
    def others(self) -> tuple[HeldMission, ...]:
        """Further missions in the flight controller's store, as last read."""
        if isinstance(self.fc_store, Refusal):
            return ()
        return tuple(
            HeldMission(identify(records), records, self.fc_store.items(records, {}))
            for records in self.fc_store.others
        )

    def home_item(self) -> MissionItem | None:
        """Item 0 of the last known list."""
        known = self.held or self._former
        return known.items[0] if known is not None and known.items else None

    def _verified_before_arming(self) -> HeldMission | None:
        """The list that the armed craft still has: no flight controller whose list cannot be read armed changes it."""
        armed_at = self.vehicle.armed_at
        if self.held is not None or armed_at is None or self.pending:
            return self.held
        return self._former if armed_at <= self._former_until else None

    @property
    def on_board(self) -> HeldMission | None:
        """The flight controller's list, if it is known; even while it is armed and cannot be read."""
        return None if isinstance(self.fc_store, Refusal) else self._verified_before_arming()

    @property
    def watch_s(self) -> float:
        """How often MissionWatch asks `is_current`, s, or infinity without a store."""
        return inf if isinstance(self.fc_store, Refusal) else self.fc_store.watch_s

    def seq_of(self, number: int) -> int:
        """The seq of the item for the flight controller's record `number`, or 0 if none is known."""
        if isinstance(self.fc_store, Refusal) or (known := self.on_board) is None:
            return 0
        return self.fc_store.seq_of(known.records, number)

    def stopped(self, report: NavStatus) -> str:
        """Why the craft has just left the mission, in one sentence, or empty if it has not, or for no known reason."""
        was_flown, self._flies_mission = (
            self._flies_mission,
            report.mode == NavMode.MISSION and report.error != FINISHED,
        )
        place, is_return = self.vehicle.last(GlobalPosition), report.mode == NavMode.RTH
        has_left = was_flown and (is_return or report.mode == NavMode.HOLD) and report.action != NavAction.RTH
        if not has_left or place is None or isinstance(self.fc_store, Refusal):
            return ""
        why = self.fc_store.why_stopped(place)
        return why and f"{'Returns' if is_return else 'Holds'}: {why}"

    def occupied(self) -> Refusal | None:
        """The reason that no list can be written now, if there is one."""
        if self._closed:
            return STOPPING
        return None if self._owner is None else OCCUPIED

    def acquire(self, owner: object) -> Refusal | None:
        """Take the transfer lock. A refusal if another client has it."""
        if (refusal := self.occupied()) is None:
            self._owner = owner
        return refusal

    def armed_refusal(self) -> Refusal | None:
        """The refusal if the craft is known to be armed. Saves a request to a busy board."""
        return ARMED if not isinstance(self.fc_store, Refusal) and self.vehicle.armed else None

    def close(self) -> None:
        """Accept no more transfers: the bridge is stopping."""
        self._closed = True

    def release(self, owner: object) -> None:
        """A transfer has ended, whether or not it had the lock."""
        if self._owner is owner:
            self._owner = None

    def preflight(self) -> Conversation[StoreReport | Refusal]:
        """Ask the flight controller if it can take a list now."""
        if (armed := self.armed_refusal()) is not None:
            return armed
        waited_s = 0.0
        while True:
            if isinstance(self.fc_store, Refusal):
                return self.fc_store
            loading = yield from self.fc_store.load()
            report = yield from self.fc_store.report()
            if report is None or loading is Loading.NO_ANSWER:
                return NO_LINK
            if report.state is StoreState.READY:
                return report
            if report.state is StoreState.ARMED:
                return ARMED
            if waited_s >= _BUSY_TIMEOUT_S:
                return _BUSY
            yield Pause(_BUSY_INTERVAL_S)
            waited_s += _BUSY_INTERVAL_S

    def check(self, items: Sequence[MissionItem]) -> Conversation[Verdict[Any] | Refusal]:
        """Check a list by the rules of the current flight controller, armed or not."""
        if isinstance(self.fc_store, Refusal):
            return self.fc_store
        report = yield from self.fc_store.report()
        return NO_LINK if report is None else check_list(items, report.rules, self.vehicle.place())

    def deliver(
        self, arrived: ArrivedMission, progress: PushProgress = lambda _records: None, *, is_kept: bool = True
    ) -> Conversation[DeliveryResult]:
        """Write the mission to the flight controller if the rules accept it, store it meanwhile, and then the outcome.

        `is_kept` False: do not store it, because too many lists arrived.
        """
        if is_kept:
            yield BeginSave(Save(arrived))
        fc_store, verdict = self.fc_store, arrived.verdict
        identity, before = identify(verdict.records), None if self.held is None else self.held.identity
        outcome: Outcome | None = Outcome.FAILED
        change: Callable[[str], Happening] | None = None
        if verdict.result is Result.REJECTED:
            ack, why = verdict.ack, sentences.REJECTED(verdict.findings[-1].text())
            outcome = Outcome.CANCELLED if ack is MissionResult.OPERATION_CANCELLED else Outcome.REJECTED
        elif isinstance(fc_store, Refusal):
            ack, why = fc_store.ack, fc_store.why
        else:
            result = yield from self._push(fc_store, arrived, progress)
            if result.failure in LIST_IS_GONE:
                self.is_settled, self.held, self._former = False, None, None
            if result.failure is None:
                self.held = self._held_now(arrived, identity)
                verdict = with_meant_home(verdict) if arrived.is_home_meant() else verdict
                is_erased = verdict.result is Result.CLEARED
                outcome, ack = Outcome.VERIFIED, MissionResult.ACCEPTED
                if is_erased and not verdict.findings:
                    why = sentences.ALREADY_CLEAR() if result.unchanged else sentences.CLEARED()
                else:
                    is_lossy = any(each.is_warning for each in verdict.findings) or (is_erased and not result.unchanged)
                    stored = sentences.STORED_WITH_LOSSES if is_lossy else sentences.STORED
                    why = stored(summary(len(arrived.items), verdict, is_unchanged=result.unchanged))
                if not result.unchanged:
                    change = sentences.ERASED_BY if is_erased else partial(sentences.NEW_MISSION, len(verdict.items))
            else:
                ack, why = _ACKS.get(result.failure, MissionResult.DENIED), result.failure.value
                outcome = None if result.failure is PushFailure.UNCERTAIN else outcome
        number: int | None = (yield EndSave()) if is_kept else None
        if outcome is None:
            # Only reading the list will show it.
            self.pending.append(PendingMission(number, identity, before))
        if number is not None and outcome is not None and not (yield Conclude(number, outcome, why.text)):
            number = None
        delivery = DeliveryResult(ack, why, number, change)
        self._do(MissionEnded(arrived, delivery))
        return delivery

    def _held_now(self, arrived: ArrivedMission, identity: ListIdentity) -> HeldMission:
        verdict, before = arrived.verdict, self.held
        sent_seqs = {} if before is None or before.identity != identity else {**before.sent_seqs}
        sent_seqs.pop(arrived.sender, None)
        if arrived.sender and is_renumbered(verdict.sent_seqs):
            sent_seqs[arrived.sender] = verdict.sent_seqs
        newest = dict([*sent_seqs.items()][-_MOST_SENDERS:])
        return HeldMission(identity, verdict.records, verdict.items, newest, verdict.path)

    def note_reader(self, reader: str) -> None:
        """A ground station (its Sender.identity) has read the list: from now on it counts the items as read."""
        if self.held is not None and reader in self.held.sent_seqs:
            others = {sender: seqs for sender, seqs in self.held.sent_seqs.items() if sender != reader}
            self.held = replace(self.held, sent_seqs=others)
            self._do(NoteReader(self.held.identity, reader))

    def _push(
        self, fc_store: AnyFcMissionStore, arrived: ArrivedMission, progress: PushProgress
    ) -> Conversation[PushResult]:
        records = arrived.verdict.records

        def written(count: int) -> None:
            self.writing = MissionTransfer(arrived.source, TransferStep.WRITING, count, len(records))
            progress(count)

        self.writing = MissionTransfer(arrived.source, TransferStep.WRITING, 0, len(records))
        try:
            return (yield from fc_store.push(records, written))
        finally:
            self.writing = None

    def read_back(self) -> Conversation[HeldMission | Refusal]:
        """The flight controller's list. A cached copy is used only if the checksum is the same.

        After connecting or an interrupted push, the flight controller first loads the saved mission if it holds none.
        """
        fc_store = self.fc_store
        if isinstance(fc_store, Refusal):
            return fc_store
        if not self.is_settled:
            loading = yield from fc_store.load()
            if loading is Loading.NO_ANSWER:
                return NO_LINK
            if self.loading is not Loading.LOADED:
                self.loading = loading
        report = yield from fc_store.report()
        if report is None:
            return NO_LINK
        if self.held is not None and self.held.identity == report.stored:
            return self._refreshed(fc_store, self.held)
        if report.state is StoreState.ARMED and report.stored is None and not fc_store.reads_armed:
            return ARMED
        records = yield from fc_store.pull()
        if records is None:
            return NO_LINK
        identity = identify(records)
        if self.held is not None and self.held.identity == identity:
            return self._refreshed(fc_store, self.held)
        known: RecalledMission = (yield Recall(identity)) or RecalledMission()
        sent_seqs = {sender: seqs for sender, seqs in known.sent_seqs.items() if is_renumbered(seqs)}
        items = fc_store.items(records, known.sent_as)
        path = check_list(items, report.rules, self.vehicle.place()).path
        held = HeldMission(identity, records, items, sent_seqs, path)
        if fc_store is self.fc_store:
            # By the time the store answers, another flight controller may be connected.
            self.held = held
        return held

    def shown(self) -> Conversation[HeldMission | Refusal]:
        """The list for a reader. Of an armed flight controller that cannot be read, as verified before arming."""
        held = yield from self.read_back()
        if isinstance(held, Refusal) and self.vehicle.armed:
            return self._verified_before_arming() or (_UNKNOWN if held is ARMED else held)
        return held

    def _refreshed(self, fc_store: AnyFcMissionStore, held: HeldMission) -> HeldMission:
        return replace(held, items=fc_store.refreshed(held.items))


_ACKS = {
    PushFailure.NO_SPACE: MissionResult.NO_SPACE,
    PushFailure.REFUSED: MissionResult.INVALID,
}
