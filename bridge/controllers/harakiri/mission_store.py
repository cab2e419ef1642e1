# SPDX-License-Identifier: GPL-3.0-or-later
"""The companion's side of Harakiri's mission extension (docs/msp-mission.md)."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from zlib import crc32

from bridge.controllers.harakiri.check import USUAL_FLIGHT, FlightLimits, HarakiriRules
from bridge.controllers.harakiri.rules import items_from_records
from bridge.controllers.harakiri.settings import read_by_name
from bridge.fc.profile import FlightController, RuleSettings
from bridge.line.conversation import (
    Conversation,
    LinkLost,
    OutOfTime,
    Pause,
    Receive,
    Stopped,
    TimeLimit,
    ask,
    ask_surely,
    send,
)
from bridge.missions.fc_mission_store import (
    FcMissionStore,
    PushFailed,
    PushFailure,
    PushProgress,
    PushResult,
    StoreReport,
    StoreState,
)
from bridge.model.vehicle import Vehicle
from protocols.mission_item import ListIdentity, MissionItem, identify, pack_records
from protocols.msp import mission as ext
from protocols.msp.frame import FRAME_OVERHEAD, MspFrame
from protocols.msp.mission import (
    RECORD_SIZE,
    Info,
    InfoFlag,
    MissionCommand,
    ReplyStatus,
    Staged,
    WpRecord,
)

_SHORT_REPLY_SIZE = 7
#: Records per read request, and how often one is sent.
_READ_RECORDS = 6
_READ_TRIES = 5
_BUSY_TIMEOUT_S = 1.0
_BUSY_INTERVAL_S = 0.1
#: Restarts of one push (after a reset, damaged line, flash error) before it is given up.
_MAX_BEGINS = 3
#: A push may take this long, plus twice the time of the bytes on the line: Mission Planner waits 4.9 s for the ack.
_PUSH_S = 3.8
#: How long to ask for the outcome of a COMMIT without a reply.
_LOOK_S = 0.4
#: Losses in a row without progress before a push is given up.
_MAX_WASTED = 20

#: The failure reported if this status ends the last attempt. Any other becomes "the line is bad".
_FAILURES = {
    ReplyStatus.ARMED: PushFailure.ARMED,
    ReplyStatus.BUSY: PushFailure.BUSY,
    ReplyStatus.NO_SPACE: PushFailure.NO_SPACE,
    ReplyStatus.RANGE: PushFailure.REFUSED,
    ReplyStatus.BAD_REQUEST: PushFailure.REFUSED,
    ReplyStatus.BAD_RECORD: PushFailure.REFUSED,
    ReplyStatus.FLASH: PushFailure.FLASH,
}


class HarakiriMissions(FcMissionStore[WpRecord]):
    """The mission store of one Harakiri with the mission extension."""

    def __init__(self, board: FlightController, vehicle: Vehicle, settings: RuleSettings) -> None:
        assert board.info is not None
        self.info = board.info
        self._vehicle = vehicle
        self._settings = settings
        #: The places of the settings, as far as they are known.
        self._places: dict[str, int] = {}
        self._may_be_stored = False  # COMMIT was sent, and the result is still unknown

    def report(self) -> Conversation[StoreReport | None]:
        info = yield from self._read_info()
        if info is None:
            return None
        self.info = info
        if info.flags & InfoFlag.ARMED:
            state = StoreState.ARMED
        elif info.flags & InfoFlag.WRITE_PENDING:
            state = StoreState.BUSY
        else:
            state = StoreState.READY
        flight = None if state is StoreState.ARMED else (yield from self._read_flight())
        rules = HarakiriRules(info.capacity, info.wp_radius_cm, self._settings.takeoff_max_m, flight=flight)
        return StoreReport(state, rules, info.stored)

    def _read_flight(self) -> Conversation[FlightLimits | None]:
        """The settings that decide about a list in flight, or None for a board that does not fly it."""
        if self._vehicle.last_report is None:
            return None
        values = yield from read_by_name(self._places, "mission_first", "mission_height", "mission_radius")
        return USUAL_FLIGHT if values is None else FlightLimits(*map(int, values))

    def push(self, records: tuple[WpRecord, ...], progress: PushProgress) -> Conversation[PushResult]:
        """Write the list: BEGIN, CHUNKs, COMMIT. Verified by the checksum over the flash."""
        packed = pack_records(records)
        wanted = ListIdentity(len(records), crc32(packed))
        failure = PushFailure.NO_ANSWER
        self._may_be_stored = False
        yield TimeLimit(_PUSH_S, 2 * len(records) * (RECORD_SIZE + FRAME_OVERHEAD))
        try:
            for _ in range(_MAX_BEGINS):
                try:
                    begun = yield from self._begin(wanted)
                    self._may_be_stored = begun.status is ReplyStatus.SAME
                    if begun.status is ReplyStatus.SAME:
                        # An equal checksum is not a proof of the same list.
                        if (yield from self.pull()) == tuple(records):
                            return PushResult(None, unchanged=True)
                        continue
                    yield from self._transfer(packed, wanted, begun, progress)
                    return PushResult(None)
                except PushFailed as failed:
                    failure = failed.failure
                    if failed.is_final:
                        break
                    yield from ask(ext.ABORT_REQUEST, MissionCommand.ABORT, 1)
        except OutOfTime:
            # The transfer stays open for 5 s: the same list continues where this push ended.
            failure = PushFailure.OUT_OF_TIME
        except Stopped:
            failure = PushFailure.STOPPED
            with suppress(LinkLost):
                yield from ask(ext.ABORT_REQUEST, MissionCommand.ABORT, 1, tries=1)
        except LinkLost:
            failure = PushFailure.NO_ANSWER
        if self._may_be_stored:
            return PushResult((yield from self._outcome_of_commit(wanted, failure)))
        return PushResult(failure)

    def pull(self) -> Conversation[tuple[WpRecord, ...] | None]:
        """Read the whole list and compare the checksum; again if the list changed meanwhile."""
        for _ in range(2):
            info = yield from self._read_info()
            if info is None:
                return None
            self.info = info
            records = yield from self._read(info)
            if records is not None and identify(records) == info.stored:
                return records
        return None

    def items(self, records: Sequence[WpRecord], sent_as: Mapping[int, int]) -> tuple[MissionItem, ...]:
        """Each record is an item, home too."""
        return tuple(items_from_records(records, sent_as))

    def seq_of(self, records: Sequence[WpRecord], number: int) -> int:
        return number if number < len(records) else 0

    def _read_info(self) -> Conversation[Info | None]:
        # Every waypoint's radius depends on the one in INFO, and the checksum identifies the stored list.
        reply = yield from ask_surely(ext.INFO_REQUEST, MissionCommand.INFO, ext.INFO_SIZE)
        return None if reply is None else ext.decode_info(reply.payload)

    def _begin(self, wanted: ListIdentity) -> Conversation[Staged]:
        """Ask again for a second while it is busy writing the configuration."""
        waited_s = 0.0
        while True:
            reply = yield from ask(ext.encode_begin(wanted), MissionCommand.BEGIN, _SHORT_REPLY_SIZE, exclusive=True)
            answer = None if reply is None else ext.decode_progress(reply.payload)
            if answer is None:
                raise PushFailed(PushFailure.NO_ANSWER)
            if answer.status is not ReplyStatus.BUSY:
                break
            if waited_s >= _BUSY_TIMEOUT_S:
                info = yield from self._read_info()
                is_spent = info is not None and InfoFlag.WRITES_SPENT in info.flags
                raise PushFailed(PushFailure.WRITES_SPENT if is_spent else PushFailure.BUSY)
            yield Pause(_BUSY_INTERVAL_S)
            waited_s += _BUSY_INTERVAL_S
        if answer.status not in (ReplyStatus.OK, ReplyStatus.SAME):
            raise _again(answer.status)
        return answer

    def _transfer(
        self, packed: bytes, wanted: ListIdentity, begun: Staged, progress: PushProgress
    ) -> Conversation[None]:
        """Chunks, as many on their way as the board can queue, then COMMIT.

        After a loss the answers to the later chunks are awaited, before it goes on with the first missing record.
        """
        done = sent = _confirmed(packed, begun)
        most = self.info.chunk_records
        wasted = 0
        unanswered: list[int] = []  # the first record of each chunk
        is_lost = False
        while done < wanted.count:
            while not is_lost and sent < wanted.count and len(unanswered) < self.info.chunk_window:
                chunk = ext.encode_chunk(packed, sent, most)
                yield send(chunk.frame, MissionCommand.CHUNK, _SHORT_REPLY_SIZE)
                unanswered.append(sent)
                sent += chunk.count
            reply: MspFrame | None = yield Receive(frozenset((MissionCommand.CHUNK,)))
            answer = None if reply is None else ext.decode_progress(reply.payload)
            if answer is None:
                unanswered = []
            elif answer.status not in (ReplyStatus.OK, ReplyStatus.SEQUENCE):
                raise _again(answer.status)
            else:
                is_lost = is_lost or answer.status is ReplyStatus.SEQUENCE
                if (confirmed := _confirmed(packed, answer)) > done:
                    done, wasted = confirmed, 0
                    progress(done)
                while unanswered and unanswered[0] < done + is_lost:
                    del unanswered[0]
                if is_lost:
                    # The board refuses a chunk behind a missing one.
                    del unanswered[:1]
            if unanswered or not (is_lost or answer is None):
                continue
            # A bad line loses long frames most.
            sent, is_lost, most = done, False, max(most // 2, 1)
            wasted += 1
            if wasted > _MAX_WASTED:
                raise PushFailed(PushFailure.NO_ANSWER)
        self._may_be_stored = True
        reply = yield from ask(ext.encode_commit(wanted), MissionCommand.COMMIT, _SHORT_REPLY_SIZE, exclusive=True)
        stored = None if reply is None else ext.decode_stored(reply.payload)
        if stored is None:
            raise PushFailed(PushFailure.NO_ANSWER)
        if stored.status is not ReplyStatus.OK:
            raise _again(stored.status)
        if stored.stored != wanted:
            raise PushFailed(PushFailure.FLASH, is_final=False)

    def _outcome_of_commit(self, wanted: ListIdentity, failure: PushFailure) -> Conversation[PushFailure | None]:
        """Ask if COMMIT succeeded after all. Only silence leaves it uncertain."""
        try:
            yield TimeLimit(_LOOK_S)
            info = yield from self._read_info()
        except LinkLost:
            info = None
        if info is None:
            return PushFailure.UNCERTAIN
        return None if info.stored == wanted else failure

    def _read(self, info: Info) -> Conversation[tuple[WpRecord, ...] | None]:
        records: tuple[WpRecord, ...] = ()
        step = min(info.read_records, _READ_RECORDS)
        while len(records) < info.stored.count:
            frame = ext.encode_read(len(records), step)
            expected = min(step, info.stored.count - len(records))
            for _ in range(_READ_TRIES):
                reply = yield from ask(frame, MissionCommand.READ, 3 + step * RECORD_SIZE, tries=1)
                answer = None if reply is None else ext.decode_records(reply.payload)
                if answer is not None and answer.status is not ReplyStatus.OK:
                    return None
                # Damage that the XOR missed may look like another place.
                if answer is not None and (answer.first, len(answer.records)) == (len(records), expected):
                    records += tuple(answer.records)
                    break
            else:
                return None
        return records


def _confirmed(packed: bytes, answer: Staged) -> int:
    """The number of correct records on the flight controller. Restarts if it has others."""
    size = answer.next * RECORD_SIZE
    if size > len(packed) or crc32(packed[:size]) != answer.checksum:
        raise PushFailed(PushFailure.NO_ANSWER, is_final=False)
    return answer.next


def _again(status: ReplyStatus) -> PushFailed:
    """Retry after any refusal: on a bad line one in a hundred is a damaged reply that the XOR missed."""
    return PushFailed(_FAILURES.get(status, PushFailure.NO_ANSWER), is_final=False)


class HarakiriArmedMissions(HarakiriMissions):
    """A Harakiri that speaks MAVLink, because it is armed: the list cannot be read or written."""

    def __init__(self, _board: FlightController, vehicle: Vehicle, settings: RuleSettings) -> None:
        self._vehicle = vehicle
        self._settings = settings

    def report(self) -> Conversation[StoreReport | None]:
        yield from ()
        rules = HarakiriRules(takeoff_max_m=self._settings.takeoff_max_m)
        return StoreReport(StoreState.ARMED, rules, None) if self._vehicle.armed else None

    def push(self, records: tuple[WpRecord, ...], progress: PushProgress) -> Conversation[PushResult]:
        yield from ()
        return PushResult(PushFailure.ARMED)

    def pull(self) -> Conversation[tuple[WpRecord, ...] | None]:
        yield from ()
        return None
