# SPDX-License-Identifier: GPL-3.0-or-later
"""One place to ask what is known of the vehicle, whatever protocol its flight controller speaks now. Sans-IO."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

from bridge.fc.session import FcSession
from bridge.fc.states import Mavlink
from bridge.gcs.ground import Ground
from bridge.missions.mission_service import MissionService
from bridge.model.vehicle_groups import Group, Link, MissionIdentity, VehicleReport
from bridge.vehicle.mavlink_groups import MavlinkGroups
from bridge.vehicle.msp_groups import POLLED_FOR, TOLD_BY, MspGroups
from protocols.mavlink.frame import MavlinkFrame
from protocols.msp.commands import Msp

_FROM_MSP = {group: getattr(MspGroups, group.value) for group in Group if group is not Group.LINK}
_FROM_MAVLINK = {group: getattr(MavlinkGroups, group.value) for group in Group if group is not Group.LINK}
_NOTHING: frozenset[Group] = frozenset()


class VehicleReporter:
    """Tells groups when it is asked to. `want`: sets how often the flight controller is to be asked what, seconds."""

    def __init__(
        self, session: FcSession, missions: MissionService, ground: Ground, want: Callable[[dict[Msp, float]], None]
    ) -> None:
        self._session = session
        self._missions = missions
        self._ground = ground
        self._want = want
        self._fresh: set[Group] = set()
        self._watched: frozenset[Group] = frozenset()
        self._mavlink = MavlinkGroups(self._fresh, is_harakiri=False)

    # What the bridge tells.

    def answered(self, command: int) -> None:
        """The flight controller has answered a poll."""
        if self._watched:
            self._fresh.update(TOLD_BY.get(command, ()))

    def mavlink_received(self, frames: Sequence[MavlinkFrame]) -> None:
        """The flight controller speaks MAVLink, and has sent this."""
        self._mavlink.take(frames)

    def controller_changed(self) -> None:
        """It is another flight controller, or none, or it speaks otherwise."""
        controller = self._session.controller
        is_harakiri = controller is not None and not controller.profile.is_passed_through
        self._mavlink = MavlinkGroups(self._fresh, is_harakiri=is_harakiri)
        self._mavlink.is_watched = bool(self._watched)

    # What others ask.

    def watch(self, groups: Iterable[Group]) -> None:
        """Follow these groups from now on: they are polled for, and `take_fresh` tells of them."""
        self._watched = frozenset(groups)
        self._mavlink.is_watched = bool(self._watched)
        polls: dict[Msp, float] = {}
        for group in self._watched:
            for poll, interval_s in POLLED_FOR[group].items():
                polls[poll] = min(polls.get(poll, interval_s), interval_s)
        self._want(polls)

    def take_fresh(self) -> frozenset[Group]:
        """Return the watched groups that there is news of since the last time."""
        if not self._fresh:
            return _NOTHING
        fresh = self._watched & self._fresh
        self._fresh.clear()
        return fresh

    def group(self, group: Group) -> Any:
        """Return one group as it is now: an instance of its class in bridge.vehicle_groups."""
        if group is Group.LINK:
            return self._link()
        if not isinstance(self._session.state, Mavlink):
            return _FROM_MSP[group](MspGroups(self._session.vehicle))
        found = _FROM_MAVLINK[group](self._mavlink)
        home = self._session.vehicle.home
        if group is Group.POSITION and found.home_lat_deg is None and home is not None:
            # It was told of before the craft armed.
            return replace(found, home_lat_deg=home.lat_e7 / 1e7, home_lon_deg=home.lon_e7 / 1e7)
        return found

    def whole(self) -> VehicleReport:
        """Return everything."""
        held = self._missions.held
        mission = None if held is None else MissionIdentity(held.identity.count, f"{held.identity.checksum:08x}")
        return VehicleReport(**{group.value: self.group(group) for group in Group}, mission=mission)

    def _link(self) -> Link:
        session, controller = self._session, self._session.controller
        msp = session.link
        return Link(
            state=session.state.name,
            flight_controller=None if controller is None else controller.name,
            speed_baud=None if controller is None else session.speed,
            round_trip_ms=None if msp is None else round(msp.round_trip_s * 1000, 1),
            requests_lost=None if msp is None else msp.requests_lost,
            bad_checksums=session.bad_checksums,
            ground_stations=tuple(str(peer) for peer in self._ground.peers()),
        )
