# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV: the list is only in RAM until SAVE. An incomplete list cannot be flown (docs/inav.md).

The store holds up to nine missions in a row, each ended by the flag LAST. Disarmed, all missions are counted and read.
Armed, only the loaded mission. Writing record 1 wipes them all, so they are written again behind a new list.

Set waypoint makes an INAV that flies the mission fly to another of the records (MSP2_INAV_SET_WP_INDEX). INAV checks
that it is armed, in waypoint mode, and that the list has the record. It also accepts a new record while it lands and
lands nevertheless, and would take off again after a landing: both are refused here.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain

from bridge.controllers.inav.geozones import has_zones, read_zones_in_force
from bridge.controllers.inav.limits import DECISIVE_NAMES, SETTING_NAMES, InavLimits, Platform, platform_of, readable
from bridge.controllers.inav.places import read_approaches, read_safehomes, with_approaches, write_approaches
from bridge.controllers.inav.settings import read_values
from bridge.controllers.inav.zone_check import zone_ahead
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.mission_store import NOTHING, NavMissions
from bridge.controllers.nav.rules import Mission, NavProfile
from bridge.fc.profile import FlightController
from bridge.line.conversation import Conversation, LinkLost, Pause, ask
from bridge.missions.fc_mission_store import (
    FliesToItems,
    Loading,
    PushFailed,
    PushFailure,
    PushProgress,
    PushResult,
    StoreReport,
)
from bridge.model.craft import ARM_BOX, MISSION_BOXES, names_of_active
from bridge.model.ground_track import Place
from bridge.model.missions import Refusal
from bridge.model.vehicle import Vehicle
from bridge.voice import sentences
from protocols.mission_item import MissionResult
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, request
from protocols.msp.inav import STATUS_SIZE, decode_inav_status
from protocols.msp.inav_places import APPROACHES, MISSION_APPROACH, FwApproach
from protocols.msp.nav import (
    FINISHED,
    INFO_SIZE,
    LANDING,
    LAST,
    LEGS,
    LOAD_REQUEST,
    NAV_STATUS_SIZE,
    SAVE_REQUEST,
    SELECTED_REQUEST,
    SET_WP_INDEX,
    SETTING,
    Nav,
    NavAction,
    NavInfo,
    NavMode,
    NavRecord,
    NavStatus,
    decode_info,
    decode_nav_status,
    encode_fly_to,
)
from protocols.msp.nav_items import item_seqs

_MAX_SAVES = 3
#: Requests after SAVE: their timeouts together exceed the flash time.
_ASKS_AFTER_SAVE = 12
_MAX_READS = 2
_SETTING_SIZE = 1


class InavMissions(NavMissions, FliesToItems):
    """The mission store of one INAV. Record 1 wipes all missions, and no list is valid before the last record."""

    reads_armed = True
    #: All records in the store, as last read or written while disarmed.
    _stored: Mission = ()
    #: GETINFO's reply and the selected mission, as of the last read or write, or None if it is being written.
    _seen: tuple[NavInfo, int] | None = None
    #: The same, as of the last check for changes.
    _last_look: tuple[NavInfo, int] | None = None
    #: The board's own settings about missions, as last read. They may have changed since if they are doubtful.
    _limits: InavLimits | None = None
    _are_limits_doubtful = True
    #: A board that does not answer about them is asked again only at the next upload.
    _are_limits_silent = False
    #: All of the board's landing approaches, as last read, or None if they may have changed.
    _approaches: tuple[FwApproach, ...] | None = None
    #: The same before the current Write.
    _previous_approaches: tuple[FwApproach, ...] = ()

    def __init__(self, profile: NavProfile, controller: FlightController, vehicle: Vehicle) -> None:
        super().__init__(profile, controller, vehicle)
        self._has_zones = has_zones(controller)
        self._platform = platform_of(controller.airframe)
        self._board = controller

    def report(self) -> Conversation[StoreReport | None]:
        """Also read the settings and approaches that the rules depend on, if they may have changed."""
        yield from self._read_limits() if self._are_limits_doubtful else self._read_decisive_limits()
        if self._approaches is None and not self._vehicle.armed:
            self._approaches = yield from read_approaches(range(APPROACHES))
        return (yield from super().report())

    def settings_changed(self) -> None:
        self._are_limits_doubtful, self._are_limits_silent = True, False
        self._approaches = None

    def push(self, records: Mission, progress: PushProgress) -> Conversation[PushResult]:
        """Write the list, followed by the other missions, and verify it."""
        result = yield from super().push(records, progress)
        if result.failure is None:
            self._stored = self._store_content(records or NOTHING)
        return result

    def pull(self) -> Conversation[Mission | None]:
        """Read the loaded mission. An incomplete one reads as empty, as does the single RTH of a cleared list."""
        for _ in range(_MAX_READS):
            seen = yield from self._look()
            if seen is None:
                return None
            info, _ = seen
            records: list[NavRecord] = []
            for number in range(1, info.count + 1 if info.is_valid else 1):
                record = yield from self.read(number)
                if record is None:
                    return None
                records.append(record)
            # If it armed during the reading, numbers count from the loaded mission's first record.
            if (yield from self._look()) == seen:
                self._take_over(records, seen)
                return self._known
        return None

    def is_current(self) -> Conversation[bool]:
        """Read GETINFO, the selection and some records of all missions: the sticks or another client may change them.

        A list that is incomplete, with another size each time, is still being written. Once it is complete, it is read.
        """
        if not self._are_limits_silent:
            yield from self._read_limits()
        seen = yield from self._look()
        if seen is None:
            return True
        before, self._last_look = self._last_look, seen
        if not seen[0].is_valid and seen != before:
            self._seen = None
            return True
        return (yield from self._is_unchanged(seen))

    def why_stopped(self, place: Place) -> str:
        limits = self._limits or InavLimits()
        return zone_ahead(limits.zones, place, limits.geozone_mr_stop_distance / 100)

    def leg_of(self, records: Sequence[NavRecord], seq: int) -> int:
        numbers = (number for number, shown in enumerate(item_seqs(records), 1) if shown == seq)
        return next((number for number in numbers if records[number - 1].action in FLOWN_TO), 0)

    def fly_to(self, records: Sequence[NavRecord], number: int) -> Conversation[Refusal | None]:
        return fly_to(number, records[number - 1], self.read(number), self._board)

    def _is_unchanged(self, seen: tuple[NavInfo, int] | None) -> Conversation[bool]:
        if seen != self._seen:
            return False
        return (yield from self._has_same_records((self._known or ()) if self._vehicle.armed else self._stored))

    def load(self) -> Conversation[Loading]:
        """Load the saved mission: INAV's list in RAM is empty after a restart."""
        info = yield from self._info()
        if info is not None and info.is_valid:
            return Loading.NOT_NEEDED
        armed = None if info is None else (yield from self._ask_armed())
        if armed:
            return Loading.ARMED
        if armed is None or (yield from ask(LOAD_REQUEST, Nav.LOAD, 0)) is None:
            return Loading.NO_ANSWER
        info = yield from self._info()
        if info is None:
            return Loading.NO_ANSWER
        return Loading.LOADED if info.is_valid else Loading.NOT_NEEDED

    def _take_over(self, records: list[NavRecord], seen: tuple[NavInfo, int]) -> None:
        self._seen, missions = seen, _split(records)
        is_armed = bool(self._vehicle.armed)
        # Without the selected mission INAV flies the first.
        place = seen[1] - 1 if not is_armed and 1 <= seen[1] <= len(missions) else 0
        loaded = missions[place] if missions else ()
        if not is_armed:
            self.others = tuple(mission for mission in missions if mission is not loaded)
            self._stored = tuple(records)
        self._known = () if loaded == NOTHING else loaded

    def _rules(self) -> NavRules:
        limits = self._limits
        if limits is not None:
            approaches = self._approaches or ()
            limits = replace(
                limits,
                selected=self._seen[1] if self._seen and self.others else 1,
                safehomes=with_approaches(limits.safehomes, approaches),
                approach=approaches[MISSION_APPROACH] if approaches else None,
            )
        return NavRules(replace(self._profile, limits=limits), self._known or (), self.others)

    def _read_limits(self) -> Conversation[None]:
        if not self._are_limits_doubtful or self._vehicle.armed:
            return
        self._are_limits_doubtful = False
        values = yield from read_values(SETTING_NAMES)
        safehomes = (yield from read_safehomes()) if values else ()
        zones = (yield from read_zones_in_force()) if values and self._has_zones else ()
        if values is None or safehomes is None or zones is None:
            self._are_limits_doubtful = self._are_limits_silent = True
        elif values:
            known = readable(values)
            unknown = tuple(sorted(values.keys() - known.keys()))
            limits = InavLimits(safehomes=safehomes, zones=zones, platform=self._platform, unknown=unknown)
            version = self._board.version or limits.version
            self._limits = replace(limits, version=version).with_settings(known)

    def _read_decisive_limits(self) -> Conversation[None]:
        """Another client may have changed them unnoticed: read again before each Write, a few requests."""
        if self._limits is not None and not self._vehicle.armed:
            values = yield from read_values(DECISIVE_NAMES)
            self._limits = self._limits.with_settings(readable(values or {}))

    def _store_content(self, records: Mission) -> Mission:
        """SAVE selects the first mission, so the new mission goes there."""
        return (*records, *chain.from_iterable(self.others))

    def _order(self, wanted: Mission) -> list[tuple[int, NavRecord]]:
        return list(enumerate(wanted, 1))

    def _prove(self, count: int) -> Conversation[None]:
        info = yield from self._info()
        if info is None:
            raise PushFailed(PushFailure.NO_ANSWER)
        if not info.is_valid or info.count != count:
            raise PushFailed(PushFailure.REFUSED, is_final=False)
        if not (yield from write_approaches(self._previous_approaches)):
            raise PushFailed(PushFailure.NO_ANSWER, is_final=False)

    def _keep(self) -> Conversation[None]:
        """SAVE, then verify again: the flight controller stalls during SAVE, and may have restarted."""
        before = yield from self._info()
        if before is None:
            raise PushFailed(PushFailure.UNCERTAIN)
        for _ in range(_MAX_SAVES):
            reply = yield from ask(SAVE_REQUEST, Nav.SAVE, 0, tries=1, exclusive=True)
            if (yield from self._info(tries=_ASKS_AFTER_SAVE)) != before:
                raise PushFailed(PushFailure.UNCERTAIN)
            if reply is not None:
                break
        last = yield from self.read(before.count)
        if reply is None or reply.direction is Direction.ERROR or last is None:
            raise PushFailed(PushFailure.NOT_SAVED)
        yield from self._load_first(before)

    def _load_first(self, saved: NavInfo) -> Conversation[None]:
        """Until LOAD, INAV treats the written records as one long mission, whose last record decides about landing.

        An aeroplane would land without the approach: only a loaded mission has a number (loadedMultiMissionIndex).
        """
        if self.others or self._platform is Platform.AEROPLANE:
            reply = yield from ask(LOAD_REQUEST, Nav.LOAD, 0)
            if reply is None or reply.direction is Direction.ERROR or (yield from self._info()) != saved:
                raise PushFailed(PushFailure.UNCERTAIN)
        self._seen = yield from self._look()

    def _confirm(self, before: Mission | None) -> Conversation[Mission | None]:
        known = self._approaches
        if known is None or self._platform is Platform.AEROPLANE or not all(each.is_empty for each in known):
            # Another client may have set one since.
            self._approaches = yield from read_approaches(range(APPROACHES))
            if self._approaches is None:
                raise PushFailed(PushFailure.NO_ANSWER)
        self._previous_approaches = self._approaches or ()
        if (yield from self._is_unchanged((yield from self._look()))):
            return before
        # Another client has written or loaded a list since: its other missions must also be kept.
        if (yield from self.pull()) is None:
            raise PushFailed(PushFailure.NO_ANSWER)
        return None

    def _restore(self, before: Mission | None) -> Conversation[bool]:
        """Make it LOAD the saved missions. If that is not the old list, write it again."""
        if self._vehicle.armed:
            return False
        with suppress(LinkLost):
            yield from ask(LOAD_REQUEST, Nav.LOAD, 0)
            loaded = yield from self.pull()
            if loaded == before and (loaded or self.others):
                return (yield from write_approaches(self._previous_approaches))
        return (yield from super()._restore(before))

    def _restore_at_once(self, before: Mission | None) -> Conversation[bool]:
        """Make it LOAD the saved missions: the old list, unless another client wrote one without saving it."""
        with suppress(LinkLost):
            yield from ask(LOAD_REQUEST, Nav.LOAD, 0, tries=1)
            yield from write_approaches(self._previous_approaches)
            return bool(before) and (yield from self._is_unchanged((yield from self._look())))
        return False

    def _look(self) -> Conversation[tuple[NavInfo, int] | None]:
        """GETINFO, and the number of the selected mission, from 1. Of an incomplete list, none is selected."""
        info = yield from self._info()
        if info is None:
            return None
        if not info.is_valid:
            return info, 1
        reply = yield from ask(SELECTED_REQUEST, SETTING, _SETTING_SIZE)
        return info, reply.payload[0] if reply is not None and reply.payload else 1

    def _info(self, *, tries: int = 3) -> Conversation[NavInfo | None]:
        reply = yield from ask(request(Nav.GETINFO), Nav.GETINFO, INFO_SIZE, tries=tries)
        return None if reply is None else decode_info(reply.payload)


def _split(records: Sequence[NavRecord]) -> list[Mission]:
    """The missions in a store. Records after the last flag belong to none."""
    missions: list[Mission] = []
    start = 0
    for end, record in enumerate(records, 1):
        if record.flag == LAST:
            missions.append(tuple(records[start:end]))
            start = end
    return missions


#: Actions that it flies to; INAV executes the others and continues to the next of these.
FLOWN_TO = LEGS | {NavAction.RTH}
#: The first version with the request.
_FIRST = 9, 1, 0
_LOOKS, _LOOK_INTERVAL_S = 5, 0.1


_NOT_FLOWN = Refusal(MissionResult.DENIED, sentences.SET_IN_FLIGHT())
_LANDS = Refusal(MissionResult.DENIED, sentences.SET_WHILE_LANDING())
_CHANGED = Refusal(MissionResult.DENIED, sentences.SET_ON_CHANGED_LIST())
_UNCHANGED = Refusal(MissionResult.ERROR, sentences.SET_WITHOUT_EFFECT())
_NO_ANSWER = Refusal(MissionResult.ERROR, sentences.SET_UNANSWERED())


def fly_to(
    number: int, record: NavRecord, held: Conversation[NavRecord | None], board: FlightController
) -> Conversation[Refusal | None]:
    """Make INAV fly to record `number`. Returns None if it does. held: reads the record that INAV has there."""
    reply = yield from ask(request(Msp.INAV_STATUS), Msp.INAV_STATUS, STATUS_SIZE)
    state = None if reply is None else decode_inav_status(reply.payload)
    active = names_of_active(state.box_flags, board.boxes) if state else set()
    status = yield from _ask_status()
    if state is None or status is None:
        return _NO_ANSWER
    if ARM_BOX not in active or not active & MISSION_BOXES or status.mode != NavMode.MISSION:
        return _NOT_FLOWN
    if status.state in LANDING or (status.error == FINISHED and status.action == NavAction.LAND):
        return _LANDS
    if (yield from held) != record:
        return _CHANGED
    reply = yield from ask(encode_fly_to(number), SET_WP_INDEX, 0, tries=1)
    if reply is not None and reply.direction is Direction.ERROR:
        return _refused(board)
    for _ in range(_LOOKS):
        status = yield from _ask_status()
        if status is not None and status.number == number:
            return None
        yield Pause(_LOOK_INTERVAL_S)
    return _NO_ANSWER if reply is None or status is None else _UNCHANGED


def _ask_status() -> Conversation[NavStatus | None]:
    reply = yield from ask(request(Msp.NAV_STATUS), Msp.NAV_STATUS, NAV_STATUS_SIZE)
    return None if reply is None else decode_nav_status(reply.payload)


def _refused(board: FlightController) -> Refusal:
    if board.version is not None and board.version < _FIRST:
        older = sentences.SET_ON_NEWER_INAV(".".join(map(str, board.version)))
        return Refusal(MissionResult.DENIED, older)
    return Refusal(MissionResult.DENIED, sentences.SET_REFUSED_BY_INAV())
