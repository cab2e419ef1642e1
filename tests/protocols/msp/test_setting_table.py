# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings' messages: both directions, and bytes that make no sense."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.msp.frame import is_clean
from protocols.msp.mission import ReplyStatus
from protocols.msp.setting_table import (
    HeldSetting,
    Setting,
    SettingsReply,
    SettingType,
    TableReply,
    decode_settings,
    decode_table,
    encode_read_settings,
    encode_save,
    encode_set_setting,
)
from simulator.naze.replies import encode_reply

_LIMITS = {
    SettingType.UINT8: (0, 255), SettingType.INT8: (-128, 127), SettingType.UINT16: (0, 65535),
    SettingType.INT16: (-32768, 32767), SettingType.UINT32: (0, 2**31 - 1),
}  # fmt: skip
_names = st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=32)


@st.composite
def held_settings(draw: st.DrawFn) -> HeldSetting:
    kind = draw(st.sampled_from(SettingType))
    low, high = _LIMITS.get(kind, (-(2**31), 2**31 - 1))
    limits = st.integers(-(2**31), 2**31 - 1)
    setting = Setting(draw(_names), kind, draw(limits), draw(limits))
    is_float = kind is SettingType.FLOAT
    return HeldSetting(setting, draw(st.floats(width=32, allow_nan=False) if is_float else st.integers(low, high)))


@given(st.sampled_from(ReplyStatus), st.integers(0, 65535), st.lists(held_settings(), max_size=4))
def test_replies_survive_the_wire(status: ReplyStatus, first: int, settings: list[HeldSetting]) -> None:
    assert decode_settings(encode_reply(SettingsReply(status, first, settings))) == SettingsReply(
        status, first, settings
    )
    table = TableReply(status, first, 0xDEADBEEF)
    assert decode_table(encode_reply(table)) == table


@given(st.binary(max_size=250))
def test_bad_bytes_are_rejected_or_a_whole_reply(payload: bytes) -> None:
    reply = decode_settings(payload)
    assert reply is None or len(encode_reply(reply)) == len(payload)
    decode_table(payload)


@given(held_settings(), st.integers(0, 65535), st.integers(0, 2**32 - 1))
def test_requests_are_free_of_hazard_bytes(held: HeldSetting, index: int, checksum: int) -> None:
    assert is_clean(encode_set_setting(index, held.setting, held.value))
    assert is_clean(encode_read_settings(index, index))
    assert is_clean(encode_save(checksum))


def test_every_part_of_the_description_identifies_a_setting() -> None:
    one = Setting("p_roll", SettingType.UINT8, 1, 200)
    others = (
        one._replace(name="p_rolL"), one._replace(type=SettingType.INT8), one._replace(minimum=0),
        one._replace(maximum=201),
    )  # fmt: skip
    assert len({setting.identity for setting in (one, *others)}) == 5


def test_a_value_that_the_type_cannot_hold_is_a_bug() -> None:
    with pytest.raises(struct.error):
        Setting("p_roll", SettingType.UINT8, 1, 200).pack(-1)
