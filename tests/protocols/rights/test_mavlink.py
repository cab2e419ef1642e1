# SPDX-License-Identifier: GPL-3.0-or-later
"""The effect of MAVLink messages: unknown ones are never harmless."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.rights import Effect
from protocols.rights.mavlink import COMMANDS, effect_of

SENDER = mavlink.MAVLink(None, srcSystem=255)


def frame(message: mavlink.MAVLink_message) -> MavlinkFrame:
    (found,) = MavlinkSplitter().feed(message.pack(SENDER))
    return found


@given(command=st.integers(0, 65535).filter(lambda number: number not in COMMANDS))
def test_an_unlisted_command_counts_as_a_move(command: int) -> None:
    long = mavlink.MAVLink_command_long_message(1, 1, command, 0, 0, 0, 0, 0, 0, 0, 0)
    whole = mavlink.MAVLink_command_int_message(1, 1, 0, command, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    assert effect_of(frame(long)) is effect_of(frame(whole)) is Effect.MOVE


@pytest.mark.parametrize(
    ("interval_us", "effect"),
    [(0, Effect.RATE), (1e6, Effect.RATE)]
    + [(number, Effect.SILENCE) for number in (-1, -0.5, 1e6 + 1, math.inf, -math.inf, math.nan)],
)
def test_an_interval_above_one_second_counts_as_silence(interval_us: float, effect: Effect) -> None:
    number = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
    assert (
        effect_of(frame(mavlink.MAVLink_command_long_message(1, 1, number, 0, 30, interval_us, 0, 0, 0, 0, 0)))
        is effect
    )


@pytest.mark.parametrize(("rate_hz", "starts"), [(4, 0), (0, 1), (0, 0), (4, 1)])
def test_a_stream_that_is_stopped_is_silenced(rate_hz: int, starts: int) -> None:
    effect = effect_of(frame(mavlink.MAVLink_request_data_stream_message(1, 1, 0, rate_hz, starts)))
    assert effect is (Effect.RATE if rate_hz and starts else Effect.SILENCE)


@pytest.mark.parametrize(
    ("current", "effect"), [(0, Effect.CHANGE), (1, Effect.CHANGE), *((number, Effect.MOVE) for number in (2, 3, 255))]
)
def test_a_guided_item_is_not_an_upload(current: int, effect: Effect) -> None:
    item = mavlink.MAVLink_mission_item_int_message(1, 1, 0, 3, 16, current, 1, 0, 0, 0, 0, 0, 0, 0.0)
    assert effect_of(frame(item)) is effect


def test_arming_moves_and_a_request_for_the_list_does_not_change_anything() -> None:
    arm = mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1, 0, 0, 0, 0, 0, 0)
    assert effect_of(frame(arm)) is Effect.MOVE
    assert effect_of(frame(mavlink.MAVLink_mission_request_list_message(1, 1))) is Effect.DIALOGUE
