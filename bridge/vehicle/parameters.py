# SPDX-License-Identifier: GPL-3.0-or-later
"""The short list of parameters that ground stations need to see (https://mavlink.io/en/services/parameter.html)."""

import math

from bridge.gcs.flash_budget import TOO_MANY_WRITES
from bridge.gcs.ground import Ground
from bridge.gcs.station import Severity, Station
from bridge.line.conversation import LinkLost
from bridge.missions.fc_mission_store import AnyFcMissionStore, PushFailure
from bridge.missions.mission_service import MissionService
from bridge.model.refusal import Refusal
from protocols.mavlink.dialect import messages
from protocols.msp.mission import MAX_RADIUS_CM

_REAL32 = 9
#: Mission Planner's name for the radius in its plan screen; with this name it is in cm.
WP_RADIUS = "WPNAV_RADIUS"
SYSID = "SYSID_THISMAV"


class Parameters:
    """Answers PARAM_REQUEST_LIST, PARAM_REQUEST_READ and PARAM_SET. Values are REAL32."""

    def __init__(self, missions: MissionService, ground: Ground, sysid: int) -> None:
        self._missions = missions
        self._ground = ground
        self._sysid = sysid
        self._is_setting = False

    def send_all(self, station: Station) -> None:
        """PARAM_REQUEST_LIST."""
        for name in self._values():
            self._send(station, name)

    def send_one(self, station: Station, name: str, index: int) -> None:
        """PARAM_REQUEST_READ: by index, or by name where index is -1."""
        names = list(self._values())
        if index >= 0:
            name = names[index] if index < len(names) else ""
        self._send(station, name)

    def set(self, station: Station, name: str, value: float, now: float) -> None:
        """PARAM_SET: answered with the value then in force, as the protocol requires."""
        fc_store, radius_cm = self._missions.fc_store, self._values().get(WP_RADIUS)
        # Mission Planner keeps metres as text: 2.10 m arrives as 209.99998 cm.
        wanted_cm = round(value) if math.isfinite(value) else -1
        if name != WP_RADIUS or wanted_cm == radius_cm:
            # An equal value is not written: that would erase and rewrite the board's whole configuration.
            self._send(station, name)
            return
        if isinstance(fc_store, Refusal) or radius_cm is None:
            refusal = f"{WP_RADIUS} cannot be set on this flight controller now"
        elif not 0 <= wanted_cm <= MAX_RADIUS_CM:
            # No error: after each Write, Mission Planner sends its default of 30 m if its plan screen was open first.
            self._ground.say(Severity.NOTICE, f"{WP_RADIUS} stays {radius_cm:.0f}: 0..{MAX_RADIUS_CM} cm", station)
            self._send(station, name)
            return
        elif self._is_setting:
            # A change is pending; a station that requested another value repeats its request.
            return
        elif self._missions.armed_refusal() is not None:
            refusal = f"{WP_RADIUS} stays {radius_cm:.0f}: {PushFailure.ARMED.value}"
        elif not self._ground.flash.allows(station.peer, now):
            refusal = TOO_MANY_WRITES
        else:
            self._write(fc_store, wanted_cm, station, now)
            return
        self._ground.say(Severity.ERROR, refusal, station)
        self._send(station, name)

    def _write(self, fc_store: AnyFcMissionStore, wanted_cm: int, station: Station, now: float) -> None:
        def done(failure: PushFailure | LinkLost | None, _at: float) -> None:
            self._is_setting = False
            if failure is PushFailure.NO_ANSWER or isinstance(failure, LinkLost):
                self._ground.say(Severity.ERROR, f"No answer: {WP_RADIUS} may be set, read it again", station)
            elif failure is not None:
                self._ground.flash.not_written(station.peer)
                text = f"{WP_RADIUS} stays {fc_store.wp_radius_cm}: {failure.value}"
                self._ground.say(Severity.ERROR, text, station)
            self._send(station if failure else None, WP_RADIUS)

        self._is_setting = True
        self._missions.runner.start(fc_store.set_wp_radius(wanted_cm), done, now)

    def _values(self) -> dict[str, float]:
        values = {SYSID: float(self._sysid)}
        fc_store = self._missions.fc_store
        if not isinstance(fc_store, Refusal) and fc_store.wp_radius_cm is not None:
            values[WP_RADIUS] = float(fc_store.wp_radius_cm)
        return values

    def _send(self, station: Station | None, name: str) -> None:
        """Send PARAM_VALUE, if there is such a parameter; None: to all stations, which keep a copy."""
        values = self._values()
        if name in values:
            index = list(values).index(name)
            message = messages.MAVLink_param_value_message(name.encode(), values[name], _REAL32, len(values), index)
            if station is None:
                self._ground.broadcast(message)
            else:
                self._ground.to(station, message)
