# SPDX-License-Identifier: GPL-3.0-or-later
"""A request that was not carried out, and why."""

from dataclasses import dataclass

from protocols.mission_item import MissionResult


@dataclass(frozen=True, slots=True)
class Refusal:
    """The reply to a ground station: the MISSION_ACK code, and the reason as a STATUSTEXT."""

    ack: MissionResult
    text: str


ARMED = Refusal(MissionResult.DENIED, "Armed: disarm to change the mission")
