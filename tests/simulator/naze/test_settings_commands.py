# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated Naze's settings over MSP, through the UART."""

import pytest

from protocols.msp.mission import ReplyStatus
from protocols.msp.setting_table import (
    TABLE_REQUEST,
    HeldSetting,
    SettingsReply,
    TableReply,
    decode_settings,
    decode_table,
    encode_read_settings,
    encode_save,
    encode_set_setting,
    table_checksum,
)
from simulator.naze.setting_table import SETTINGS
from tests.support.naze_bench import BOOT_SECONDS, Bench

_SAVE_S = 1.0
_NAMES = [held.setting.name for held in SETTINGS]


@pytest.fixture
def bench() -> Bench:
    return Bench()


def answer(bench: Bench, frame: bytes) -> SettingsReply:
    reply = decode_settings(bench.payload(frame))
    assert reply is not None
    return reply


def table(bench: Bench, frame: bytes = TABLE_REQUEST) -> TableReply:
    reply = decode_table(bench.payload(frame))
    assert reply is not None
    return reply


def power_cycle(bench: Bench) -> None:
    bench.naze.power_off(bench.now)
    bench.naze.power_on(bench.now)
    bench.run(BOOT_SECONDS + 0.1)


def put(bench: Bench, name: str, value: float) -> SettingsReply:
    index = _NAMES.index(name)
    return answer(bench, encode_set_setting(index, SETTINGS[index].setting, value))


def held(bench: Bench, name: str) -> float:
    return answer(bench, encode_read_settings(_NAMES.index(name), 1)).settings[0].value


def test_all_settings_are_read_in_parts(bench: Bench) -> None:
    found: list[HeldSetting] = []
    while len(found) < table(bench).total:
        found += answer(bench, encode_read_settings(len(found), 100)).settings
    assert [one.setting for one in found] == [one.setting for one in SETTINGS]
    assert table(bench).checksum == table_checksum(found)


def test_a_change_is_in_ram_until_it_is_saved(bench: Bench) -> None:
    assert put(bench, "p_roll", 40).status is ReplyStatus.OK
    power_cycle(bench)
    assert held(bench, "p_roll") == 35
    put(bench, "p_roll", 40)
    put(bench, "gps_wp_radius", 450)
    saved = table(bench)
    assert table(bench, encode_save(saved.checksum + 1)).status is ReplyStatus.CHECKSUM
    assert table(bench, encode_save(saved.checksum)) == saved
    bench.run(_SAVE_S)
    power_cycle(bench)
    assert table(bench) == saved
    assert (held(bench, "p_roll"), held(bench, "gps_wp_radius")) == (40, 450)


def test_out_of_range_shows_the_setting_as_it_is(bench: Bench) -> None:
    index = _NAMES.index("p_roll")
    for value in (0, 201):
        reply = put(bench, "p_roll", value)
        assert (reply.status, list(reply.settings)) == (ReplyStatus.RANGE, [SETTINGS[index]])
    assert put(bench, "esc_moff", 1001).status is ReplyStatus.RANGE
    assert put(bench, "align_acc_x", 1).status is ReplyStatus.RANGE
    other = SETTINGS[index + 1].setting
    assert answer(bench, encode_set_setting(index, other, 1)) == SettingsReply(ReplyStatus.CHECKSUM, index, [])
    assert answer(bench, encode_read_settings(len(SETTINGS), 1)).status is ReplyStatus.RANGE
    assert answer(bench, encode_read_settings(0, 0)).status is ReplyStatus.BAD_REQUEST


def test_everything_is_refused_while_armed(bench: Bench) -> None:
    checksum = table(bench).checksum
    bench.naze.faults.armed = True
    bench.run(_SAVE_S)
    for frame in (TABLE_REQUEST, encode_save(checksum), encode_read_settings(3, 1)):
        assert answer(bench, frame).status is ReplyStatus.ARMED
    assert put(bench, "p_roll", 40).status is ReplyStatus.ARMED


def test_a_pending_write_allows_reading_only(bench: Bench) -> None:
    bench.naze.faults.busy = True
    assert put(bench, "p_roll", 40).status is ReplyStatus.BUSY
    assert answer(bench, encode_read_settings(0, 1)).status is ReplyStatus.OK


def test_another_accelerometer_clears_the_trims(bench: Bench) -> None:
    put(bench, "rc_trm_rll", 7.5)
    put(bench, "acc_hdw", 1)
    assert held(bench, "rc_trm_rll") == 0
