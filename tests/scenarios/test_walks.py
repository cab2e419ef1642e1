# SPDX-License-Identifier: GPL-3.0-or-later
"""The length of five walks through the code: a budget that may only shrink.

A walk is one or more whole wake-ups of a daemon on a simulated Naze (one UDP station, memory instead of a disk, no log
file), from the event loop's callback until it returns. Counted with sys.setprofile are the Python functions called in
bridge/, protocols/, reports/, service/ and storage/, comprehensions and resumed generators included; the calls into a
file that was entered and left before; and the files.

attitude: a reply to MSP_ATTITUDE is read and sent on, at the default rates.
item: a MISSION_ITEM_INT in the middle of a list of nine is received, and the next one requested.
ack: from the last of three items to its MISSION_ACK: the list is stored, pushed, verified and concluded. Telemetry that
arrives meanwhile counts, too.
setting: from a PARAM_SET to its PARAM_VALUE: the board is asked whether it is armed, then the value is written.
arming: a reply to MSP_STATUS in which the craft is armed, and the heartbeat that reports it, with no other telemetry.
"""

import asyncio
from functools import partial

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.dialect import Message
from tests.support.walks import TracedDaemon, WakeUp, Walk, measure, run_traced

#: Lower these whenever a walk has become shorter.
CEILINGS = {
    "attitude": Walk(calls=39, returns=12, files=16),
    "item": Walk(calls=55, returns=23, files=14),
    "ack": Walk(calls=383, returns=197, files=38),
    "setting": Walk(calls=216, returns=90, files=30),
    "arming": Walk(calls=64, returns=18, files=23),
}
#: A walk may be this much shorter than its ceiling.
_SLACK = 0.05
_TARGET = (1, 1)


def _item(seq: int) -> Message:
    frame = m.MAV_FRAME_GLOBAL_RELATIVE_ALT if seq else m.MAV_FRAME_GLOBAL
    place = (453_838_000 + 1000 * seq, 84_733_000, 20.0)
    return m.MAVLink_mission_item_int_message(
        *_TARGET, seq, frame, m.MAV_CMD_NAV_WAYPOINT, 0, 1, 0.0, 2.0, 0.0, 0.0, *place
    )


def _requests(seq: int, wake_up: WakeUp) -> bool:
    return any(message.get_type() == "MISSION_REQUEST" and message.seq == seq for message in wake_up.sent)


def _reports_armed(wake_up: WakeUp) -> bool:
    armed = m.MAV_MODE_FLAG_SAFETY_ARMED
    return any(message.get_type() == "HEARTBEAT" and message.base_mode & armed for message in wake_up.sent)


async def _upload(daemon: TracedDaemon, count: int, last: int) -> None:
    """Send a list up to the item `last`; only the wake-ups after it are kept."""
    daemon.send(m.MAVLink_mission_count_message(*_TARGET, count))
    for seq in range(last + 1):
        await daemon.until(partial(_requests, seq))
        daemon.wake_ups.clear()
        daemon.send(_item(seq))


async def _attitude(daemon: TracedDaemon) -> Walk:
    return measure(await daemon.until(lambda wake_up: wake_up.types == ["ATTITUDE"]))


async def _middle_item(daemon: TracedDaemon) -> Walk:
    await _upload(daemon, 9, 4)
    return measure(await daemon.until(partial(_requests, 5)))


async def _ack(daemon: TracedDaemon) -> Walk:
    await _upload(daemon, 3, 2)
    ack = await daemon.until(lambda wake_up: "MISSION_ACK" in wake_up.types)
    return measure(*daemon.wake_ups[: daemon.wake_ups.index(ack) + 1])


async def _without_telemetry(daemon: TracedDaemon) -> None:
    daemon.send(m.MAVLink_request_data_stream_message(*_TARGET, m.MAV_DATA_STREAM_ALL, 0, 0))
    await asyncio.sleep(2.3)  # STATUS is polled alone from now on, except each full second
    daemon.wake_ups.clear()


async def _setting(daemon: TracedDaemon) -> Walk:
    await _without_telemetry(daemon)
    daemon.send(m.MAVLink_param_set_message(*_TARGET, b"P_ROLL", 44.0, m.MAV_PARAM_TYPE_REAL32))
    answer = await daemon.until(lambda wake_up: "PARAM_VALUE" in wake_up.types)
    return measure(*daemon.wake_ups[: daemon.wake_ups.index(answer) + 1])


async def _arming(daemon: TracedDaemon) -> Walk:
    await _without_telemetry(daemon)
    daemon.faults.armed = True
    return measure(await daemon.until(_reports_armed))


_WALKS = {"attitude": _attitude, "item": _middle_item, "ack": _ack, "setting": _setting, "arming": _arming}


@pytest.mark.parametrize("name", CEILINGS)
def test_a_walk_does_not_get_longer(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    walks: list[Walk] = []

    async def story(daemon: TracedDaemon) -> None:
        await daemon.until(lambda wake_up: "ATTITUDE" in wake_up.types)
        await asyncio.sleep(6.0)  # the first heartbeats and texts, and the settings
        daemon.wake_ups.clear()
        walks.append(await _WALKS[name](daemon))

    run_traced(story, monkeypatch)
    (walk,), ceiling = walks, CEILINGS[name]
    for what in ("calls", "returns", "files"):
        measured, most = getattr(walk, what), getattr(ceiling, what)
        assert measured <= most, f"{name}: {measured} {what}, more than the ceiling of {most}: {walk}"
        assert measured >= most * (1 - _SLACK) - 1, f"{name} has become shorter: lower its ceiling to {walk}"
