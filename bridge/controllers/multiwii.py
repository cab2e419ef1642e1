# SPDX-License-Identifier: GPL-3.0-or-later
"""MultiWii 2.4 with navigation (docs/inav.md): each record goes to EEPROM at once, and the flag LAST ends the list.

The record last read or written stays in RAM, and p1 decides if a return home by the pilot's switch or by failsafe
lands there: after each conversation it is cleared, as after power-on.
"""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from bridge.controllers.msp_parts import MspPartSettings
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.mission_store import NOTHING, NavMissions
from bridge.controllers.nav.rules import NavProfile
from bridge.fc.profile import FlightController, Interview, Profile
from bridge.line.conversation import Conversation, LinkLost, ask
from bridge.line.poll_schedule import NAV_POLL, POLLS
from bridge.missions.fc_mission_store import PushProgress, PushResult, StoreReport
from bridge.missions.flown_legs import Departure, FlownPath, Judgement, beyond_plain_limits, first_of
from bridge.missions.list_check import Range
from bridge.model.craft import airframe
from bridge.model.ground_track import passing_distance_m
from protocols.msp.frame import request
from protocols.msp.nav import (
    LAST,
    NAV_CONFIG_SIZE,
    Nav,
    NavAction,
    NavRecord,
    decode_nav_config,
    decode_nav_limits,
    encode_set_wp,
)
from protocols.rights.msp import Firmware

#: The capacity of the navigation build, in records. A board reports its own.
MULTIWII_CAPACITY = 178
#: types.h: analog.amperage.
CURRENTS_PER_A = 10
#: IDENT's capability bit of boards that fly missions.
_NAV_CAPABILITY = 1 << 4
#: A craft may stray this far from the line.
_STRAYS_M = 5
#: Flags of invalid records: a wrong checksum in EEPROM, and erased EEPROM.
_NO_RECORD = (0xFE, 0xFF)
#: Action and flag of every reply while it flies a mission.
_NAVIGATING = (0, 0xFF)
#: Numbers above its capacity are not stored: SET_WP changes only the record in RAM. (255 would move a position hold.)
_NOT_STORED = 254
_CLEARED = NavRecord(0)


@dataclass(frozen=True, slots=True)
class LegLimits:
    """MultiWii's wp_radius, safe_wp_distance (it stops before a leg of this length) and nav_max_altitude."""

    radius_cm: int
    stops_at_m: int
    highest_m: int
    is_assumed: bool = False

    def assumed(self) -> Sequence[str]:
        values = f"safe_wp_distance = {self.stops_at_m}", f"nav_max_altitude = {self.highest_m}"
        return values if self.is_assumed else ()

    def return_cm(self, rth: NavRecord, _here_cm: int | None, _highest_cm: int) -> int | None:
        """The board's RTH altitude is not known."""
        return rth.alt_cm or None

    def judge(self, _records: Sequence[NavRecord], path: FlownPath, departure: Departure) -> Iterable[Judgement]:
        legs = [leg for leg in path.legs if not leg.is_return]
        high = f"flown at {self.highest_m} m (nav_max_altitude)"
        too_high = [leg for leg in path.legs if (leg.end_cm or 0) > 100 * self.highest_m]
        yield from first_of([(leg.target, high) for leg in too_high], "alt_m")
        stop = f"leg of {self.stops_at_m} m or more: stops there"
        yield from first_of([(leg.cause, stop) for leg in legs if leg.length_m >= self.stops_at_m], "lat_e7")
        # With a region of interest set, MultiWii compares the distance with wp_radius, not the waypoint's.
        near_m = self.radius_cm / 100 + _STRAYS_M
        near = f"passes the ROI within {near_m:g} m: may end there"
        passing = [leg for leg in legs if leg.roi and passing_distance_m(leg.start, leg.end, leg.roi) < near_m]
        yield from first_of([(leg.cause, near) for leg in passing], "lat_e7")
        yield from beyond_plain_limits(path, departure, leg=False, height=False)


#: MultiWii's defaults.
USUAL_LEGS = LegLimits(radius_cm=100, stops_at_m=500, highest_m=100, is_assumed=True)


def multiwii_profile(capacity: int = MULTIWII_CAPACITY) -> NavProfile:
    return NavProfile(
        capacity,
        # The defaults, where a board does not report NAV_CONFIG.
        USUAL_LEGS,
        endless_hold=(NavAction.POSHOLD_UNLIM, 0),
        sea_level=False,
        leg_speed=False,
        rth_height=True,
        jumps_back_only=True,
        # It counts milliseconds in 16 bits.
        longest_hold=Range(0, 65, "at most 65 s"),
        ends_on_any_record=False,
        own_rth_landing=True,
    )


class MultiwiiMissions(NavMissions):
    """The mission store of one MultiWii NAV. Its EEPROM takes 70 ms for a record."""

    _stores_slowly = True
    #: The records of a list that reads as empty.
    _empty: tuple[NavRecord, ...] = NOTHING

    def report(self) -> Conversation[StoreReport | None]:
        """Also read the limits of the legs: the pilot may change these settings at any time."""
        config = yield from ask(request(Nav.NAV_CONFIG), Nav.NAV_CONFIG, NAV_CONFIG_SIZE)
        limits = None if config is None else decode_nav_limits(config.payload)
        if limits is not None:
            self._profile = replace(self._profile, limits=LegLimits(*limits))
        return (yield from super().report())

    def push(self, records: tuple[NavRecord, ...], progress: PushProgress) -> Conversation[PushResult]:
        result = yield from super().push(records, progress)
        yield from self._clear_step()
        return result

    def pull(self) -> Conversation[tuple[NavRecord, ...] | None]:
        """Read up to the last record. A list without one reads as empty, as does the single RTH of a cleared list."""
        known = yield from self._read_list()
        yield from self._clear_step()
        return known

    def _read_list(self) -> Conversation[tuple[NavRecord, ...] | None]:
        records: list[NavRecord] = []
        known: tuple[NavRecord, ...] = ()
        for number in range(1, self._profile.capacity + 1):
            record = yield from self.read(number)
            if record is None:
                return None
            if (record.action, record.flag) == _NAVIGATING:
                return None
            records.append(record)
            if record.flag in _NO_RECORD:
                break
            if record.flag == LAST:
                known = () if tuple(records) == NOTHING else tuple(records)
                break
        self._known, self._empty = known, tuple(records)
        return known

    def is_current(self) -> Conversation[bool]:
        """Read some records, while disarmed: only this shows whether another client has changed the list.

        In flight, a return home may begin between two requests.
        """
        if self._known is None or self._vehicle.armed is not False:
            return True
        is_same = yield from self._has_same_records(self._known or self._empty)
        yield from self._clear_step()
        return is_same

    def _clear_step(self) -> Conversation[None]:
        """Clear the record in RAM, unless the craft is armed or may be: telemetry may not have noticed arming yet."""
        with suppress(LinkLost):
            if self._profile.capacity < _NOT_STORED and (yield from self._ask_armed()) is False:
                yield from ask(encode_set_wp(_NOT_STORED, _CLEARED), Nav.SET_WP, 0)

    def _order(self, wanted: tuple[NavRecord, ...]) -> list[tuple[int, NavRecord]]:
        """Write a single RTH first and the real record 1 last: a list interrupted midway only flies home."""
        first, *rest = enumerate(wanted, 1)
        return [(1, NOTHING[0]), *rest, first] if rest else [first]

    def _keep(self) -> Conversation[None]:
        yield from ()


def _recognise(board: Interview) -> Conversation[FlightController | None]:
    ident = yield from board.ident()
    if ident is None or not ident.capability & _NAV_CAPABILITY or (yield from board.variant()) is not None:
        return None
    boxes = yield from board.box_names()
    name = f"MultiWii {ident.version}"
    controller = FlightController(
        PROFILE, name, airframe(ident.mixer), boxes, version=ident.release, firmware=Firmware.MULTIWII
    )
    if controller.arm_bit is None:
        return None
    capacity = decode_nav_config((yield from board.ask(Nav.NAV_CONFIG, NAV_CONFIG_SIZE)).payload)
    if not capacity:
        return None
    return replace(controller, capacity=capacity)


PROFILE = Profile(
    "MultiWii NAV",
    "MultiWii",
    recognise=_recognise,
    polls=(*POLLS, NAV_POLL),
    accepts_any_byte=True,
    currents_per_a=CURRENTS_PER_A,
    missions=lambda board, vehicle, _: MultiwiiMissions(multiwii_profile(board.capacity), board, vehicle),
    settings=MspPartSettings,
    check_kind="multiwii",
    rules=lambda _: NavRules(multiwii_profile()),
)
