# SPDX-License-Identifier: GPL-3.0-or-later
"""An autopilot represents itself in MAVLink."""

from bridge.fc.mavlink_telemetry import MavlinkTelemetry
from bridge.fc.states.base import Found, Port
from bridge.fc.states.mavlink import MavlinkLine
from protocols.mavlink.frame import MavlinkFrame


class PassThrough(MavlinkLine):
    """The autopilot gets nothing but the frames of ground stations, and the bridge sends nothing in its name."""

    def __init__(self, port: Port, event: Found, now: float) -> None:
        super().__init__(port, event, now)
        if port.telemetry is None or self.controller.profile.family != port.family:
            port.telemetry = MavlinkTelemetry(port.vehicle, is_harakiri=False)
        self.telemetry = port.telemetry
        port.meet(self.controller)
        assert event.heard is not None
        self.telemetry.take([event.heard], now)

    def take(self, frames: list[MavlinkFrame], now: float) -> None:
        """Keep the newest values, and send all frames to the ground stations."""
        self.telemetry.take(frames, now)
        self.port.on_mavlink(frames)
