# SPDX-License-Identifier: GPL-3.0-or-later
"""All supported flight controllers. The first profile that recognises a board is used."""

from bridge.controllers import multiwii, other
from bridge.controllers.harakiri import profile as harakiri
from bridge.controllers.inav import profile as inav
from bridge.fc.profile import Profile

PROFILES: tuple[Profile, ...] = (
    *harakiri.PROFILES,
    multiwii.PROFILE,
    inav.PROFILE,
    other.OTHER_MSP,
    other.OTHER_MAVLINK,
)
