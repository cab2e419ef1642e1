# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of MSP rights has every request that the bridge sends, with the effect that its use claims."""

from collections.abc import Iterable

import pytest

from bridge.controllers.inav.profile import INAV_POLLS
from bridge.line.msp_link import PROBE, RESYNC
from bridge.line.poll_schedule import BOX_POLL, NAV_POLL, POLLS
from protocols.mission_item import ListIdentity, pack_records
from protocols.msp.commands import Msp, MspAction
from protocols.msp.frame import MspFrame, MspParser, request
from protocols.msp.inav import MIXER
from protocols.msp.mission import (
    ABORT_REQUEST,
    INFO_REQUEST,
    MAX_CHUNK_RECORDS,
    MissionCommand,
    WpRecord,
    encode_begin,
    encode_chunk,
    encode_commit,
    encode_read,
)
from protocols.msp.mission_flight import FLIGHT_REQUEST
from protocols.msp.nav import (
    LOAD_REQUEST,
    SAVE_REQUEST,
    SELECTED_REQUEST,
    SET_WP_INDEX,
    SETTING,
    Nav,
    NavAction,
    NavRecord,
    encode_fly_to,
    encode_read_wp,
    encode_set_wp,
)
from protocols.msp.setting_table import TABLE_REQUEST, SettingCommand, encode_save
from protocols.msp.settings import SETTINGS
from protocols.rights import Effect
from protocols.rights.msp import MSP_RIGHTS, Firmware, msp_right
from simulator.naze.replies import encode_radius

EVERY = tuple(Firmware)
MISSIONS = (Firmware.HARAKIRI_MISSIONS,)
HARAKIRI = (Firmware.HARAKIRI, Firmware.HARAKIRI_MISSIONS)
NAV = (Firmware.INAV, Firmware.MULTIWII)
INAV = (Firmware.INAV,)
LIST = ListIdentity(2, 0x12345678)
RECORDS = [WpRecord(453838000, 84733000, 20, 0, 0, 2, 0, 0)] * MAX_CHUNK_RECORDS

#: Every frame that the bridge can send, with the firmware it sends it to.
#: Their chip's number can be read.
NUMBERED = (Firmware.BASEFLIGHT, Firmware.CLEANFLIGHT, Firmware.BETAFLIGHT, Firmware.INAV)
READS: list[tuple[Iterable[Firmware], bytes]] = [
    (EVERY, PROBE),
    (EVERY, RESYNC),
    (EVERY, request(Msp.API_VERSION)),
    (EVERY, request(Msp.BOXNAMES)),
    *((EVERY, poll.frame) for poll in POLLS),
    (HARAKIRI, BOX_POLL.frame),
    (NAV, NAV_POLL.frame),
    *((INAV, poll.frame) for poll in INAV_POLLS),
    ((Firmware.INAV, Firmware.BETAFLIGHT), request(Msp.FC_VERSION)),
    ((Firmware.INAV, Firmware.BETAFLIGHT), request(Msp.BOXIDS)),
    (INAV, request(MIXER)),
    (INAV, request(Nav.GETINFO)),
    (INAV, SELECTED_REQUEST),
    ((Firmware.MULTIWII,), request(Nav.NAV_CONFIG)),
    *((INAV, encode_read_wp(number)) for number in range(256)),
    (NAV, encode_read_wp(0)),
    (HARAKIRI, INFO_REQUEST),
    (MISSIONS, encode_read(0, 15)),
    (MISSIONS, FLIGHT_REQUEST),
    *(((firmware,), request(wanted.command)) for firmware, parts in SETTINGS.items() for wanted in parts),
    *((INAV, request(Msp(command))) for command in (0x2070, 0x2030, 34, 0x2007, 0x2003)),
    (MISSIONS, TABLE_REQUEST),
    (EVERY, request(Msp.PIDNAMES)),
    (NUMBERED, request(Msp.UID)),
]
CHANGES: list[tuple[Iterable[Firmware], bytes]] = [
    (MISSIONS, encode_save(0)),
    *((set(EVERY) - {Firmware.UNKNOWN}, request(action)) for action in MspAction),
    *(((Firmware.MULTIWII,), encode_read_wp(number)) for number in range(1, 255)),
    (INAV, LOAD_REQUEST),
    (INAV, SAVE_REQUEST),
    (NAV, encode_set_wp(1, NavRecord(NavAction.WAYPOINT, 1, 1))),
    (MISSIONS, ABORT_REQUEST),
    (MISSIONS, encode_begin(LIST)),
    (MISSIONS, encode_commit(LIST)),
    (MISSIONS, encode_radius(300)),
    *((MISSIONS, encode_chunk(pack_records(RECORDS), 0, most).frame) for most in range(1, MAX_CHUNK_RECORDS + 1)),
]

#: The only one: a station's Set WP.
MOVES: list[tuple[Iterable[Firmware], bytes]] = [((Firmware.INAV,), encode_fly_to(3))]


def frames(rows: Iterable[tuple[Iterable[Firmware], bytes]]) -> list[tuple[Firmware, MspFrame]]:
    return [(firmware, frame) for boards, data in rows for firmware in boards for frame in MspParser().feed(data)]


@pytest.mark.parametrize(("rows", "effect"), [(READS, Effect.READ), (CHANGES, Effect.CHANGE), (MOVES, Effect.MOVE)])
def test_requests_of_the_bridge_have_the_effect_of_their_use(
    rows: list[tuple[Iterable[Firmware], bytes]], effect: Effect
) -> None:
    found = [(firmware, frame.command, len(frame.payload)) for firmware, frame in frames(rows)
             if msp_right(firmware, frame.command, frame.payload).effect is not effect]  # fmt: skip
    assert found == []


def test_every_command_of_the_bridge_is_among_them() -> None:
    sent = {frame.command for _, frame in frames([*READS, *CHANGES, *MOVES])}
    assert sent == {*Msp, *MspAction, *MissionCommand, *SettingCommand, *Nav, MIXER, SETTING, SET_WP_INDEX}


@pytest.mark.parametrize("firmware", Firmware)
def test_a_nested_frame_is_refused(firmware: Firmware) -> None:
    assert all(msp_right(firmware, 255, bytes(size)).effect is Effect.UNKNOWN for size in range(256))


@pytest.mark.parametrize("firmware", [Firmware.HARAKIRI, Firmware.BASEFLIGHT, Firmware.MULTIWII, Firmware.UNKNOWN])
def test_v2_is_sent_only_to_boards_that_speak_it(firmware: Firmware) -> None:
    """Others read the letters of such a frame as typed ones."""
    assert max(MSP_RIGHTS[firmware]) < 255


def test_only_waypoint_0_is_readable_on_every_firmware() -> None:
    effects = [msp_right(Firmware.UNKNOWN, Nav.WP, bytes((number,))).effect for number in range(256)]
    assert effects == [Effect.READ] + [Effect.UNKNOWN] * 255


def test_ambiguous_commands_are_refused_on_unknown_boards() -> None:
    """INAV's RTC sets Betaflight's clock, SERVO_MIX_RULES is BIND on MultiWii, GPSSVINFO polls baseflight's GPS."""
    refused = {246, 241, 164, 209, 202}
    assert all(msp_right(Firmware.UNKNOWN, command, b"").effect is Effect.UNKNOWN for command in refused)
    assert all(right.effect is Effect.READ for right in MSP_RIGHTS[Firmware.UNKNOWN].values())
