# SPDX-License-Identifier: GPL-3.0-or-later
"""Set WP: the item that an armed craft flies to, on boards that have a request for that (INAV). Sans-IO.

Nothing else that a ground station sends changes a flight. It takes the right to move a passed-through autopilot, which
a station on an open link does not have.
"""

from collections.abc import Callable

from bridge.gcs.budget import Cost
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import Sender
from bridge.missions.fc_mission_store import FliesToItems
from bridge.missions.mission_service import HeldMission, MissionService
from bridge.model.missions import Refusal
from bridge.vehicle.own_vehicle import OwnVehicle
from bridge.voice import sentences
from bridge.voice.happening import Happening
from protocols.mavlink.dialect import command_name
from protocols.mission_item import MissionResult
from protocols.rights import Effect

_NOT_FLOWN = Refusal(MissionResult.DENIED, sentences.SET_IN_FLIGHT())
_UNKNOWN = Refusal(MissionResult.DENIED, sentences.SET_ON_CHANGED_LIST())
_BUSY = Refusal(MissionResult.DENIED, sentences.SET_TOO_SOON())


class SetWaypoint:
    """Carries out one request at a time."""

    def __init__(self, missions: MissionService, vehicle: OwnVehicle, ground: Ground) -> None:
        self._missions = missions
        self._vehicle = vehicle
        self._ground = ground
        #: The station and the item of the request in progress.
        self._present: tuple[Sender, float] | None = None

    @property
    def is_possible(self) -> bool:
        """True if the flight controller has a request for it."""
        return isinstance(self._missions.fc_store, FliesToItems)

    def begin(self, sender: Sender, seq: float, on_end: Callable[[Refusal | None], None], now: float) -> None:
        """Make the craft fly to item `seq`, in the station's numbers. `on_end` gets None once it does.

        A repetition of the request in progress is ignored.
        """
        if self._present == (sender, seq):
            return
        store, held = self._missions.fc_store, self._missions.on_board
        assert isinstance(store, FliesToItems)
        refusal = self._obstacle(sender)
        number = 0
        if held is None:
            refusal = refusal or _UNKNOWN
        elif refusal is None:
            item = self._as_read(held, sender, seq)
            number = store.leg_of(held.records, item)
            refusal = None if number else Refusal(MissionResult.DENIED, _why_not(held, item, seq))
        if held is None or refusal is not None:
            on_end(refusal)
            return

        def ended(refused: Refusal | None, _at: float) -> None:
            self._present = None
            if refused is not None:
                self._vehicle.progress.set_to = 0
            else:
                self._vehicle.confirm_current(sender)
                self._ground.say(sentences.SET_BY_ANOTHER(), but=sender.station)
            on_end(refused)

        self._present = sender, seq
        self._vehicle.withhold_current(sender.station, now)
        self._vehicle.progress.set_to = number
        self._missions.run(store.fly_to(held.records, number), ended, now)

    def _obstacle(self, sender: Sender) -> Refusal | None:
        if (refused := sender.station.passing_refusal(Effect.MOVE)) is not None:
            return Refusal(MissionResult.DENIED, sentences.SET_WITHOUT_RIGHT(refused.why))
        if not self._missions.vehicle.armed:
            return _NOT_FLOWN
        if self._present is not None or self._missions.runner.needs_line:
            return _BUSY
        return None if sender.station.allows(Cost.BOARD) else _BUSY

    def _as_read(self, held: HeldMission, sender: Sender, seq: float) -> int:
        """The number in the list as read back of the item that the station calls `seq`, or 0 if there is none."""
        numbers = self._vehicle.sent_seqs(sender.station) or range(len(held.items))
        return next((number for number, shown in enumerate(numbers) if shown == seq), 0)


def _why_not(held: HeldMission, item: int, seq: float) -> Happening:
    if item:
        return sentences.SET_TO_ACTION(seq, command_name(held.items[item].command))
    return sentences.SET_TO_HOME() if seq == 0 else sentences.SET_TO_MISSING(seq)
