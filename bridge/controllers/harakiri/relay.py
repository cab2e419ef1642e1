# SPDX-License-Identifier: GPL-3.0-or-later
"""A Harakiri in MAVLink mode, shown as the vehicle that ground stations know already. Sans-IO.

It sends as component 200 and in MAVLink 1. Passed on as they are, its frames would be a second vehicle on every screen
the moment the craft arms. So its telemetry is given our ids, and each receiver's version and sequence;
the contents stay as they came.
"""

from collections.abc import Sequence

from bridge.gcs.ground import Ground
from protocols.mavlink.codec import Packed
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame

#: The telemetry of baseflight_mavlink.c. Its heartbeat is ours to send, parameters and missions are ours to answer.
RELAYED = frozenset(
    {
        m.MAVLINK_MSG_ID_SYS_STATUS,
        m.MAVLINK_MSG_ID_GPS_RAW_INT,
        m.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        m.MAVLINK_MSG_ID_SCALED_PRESSURE,
        m.MAVLINK_MSG_ID_ATTITUDE,
        m.MAVLINK_MSG_ID_RC_CHANNELS_RAW,
        m.MAVLINK_MSG_ID_VFR_HUD,
    }
)


class HarakiriRelay:
    """Gives telemetry frames the vehicle's ids."""

    def __init__(self, ground: Ground) -> None:
        self._ground = ground

    def take(self, frames: Sequence[MavlinkFrame]) -> None:
        """Send on what is telemetry."""
        everyone = self._ground.everyone()
        for frame in frames:
            if frame.msgid in RELAYED:
                payload = frame.payload
                self._ground.multicast(Packed(frame.msgid, payload, payload.rstrip(b"\0") or b"\0"), everyone)
