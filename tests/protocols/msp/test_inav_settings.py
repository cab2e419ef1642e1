# SPDX-License-Identifier: GPL-3.0-or-later

import random

import pytest

from protocols.msp.inav_settings import (
    InavSetting,
    InavType,
    decode_setting_info,
    encode_about_index,
    encode_about_name,
)

SETTINGS = (
    InavSetting("nav_rth_altitude", 1000, InavType.UINT16, 0, 0, 65000, 12, (), 1000),
    InavSetting("inav_w_z_baro_p", 1000, InavType.FLOAT, 0, 0, 10, 13, (), 0.5),
    InavSetting("mag_declination", 1000, InavType.INT16, 0, -18000, 18000, 14, (), -113),
    InavSetting("failsafe_procedure", 1000, InavType.UINT8, 8, 0, 3, 15, ("LAND", "DROP", "RTH", "NONE"), 2),
    InavSetting("name", 1000, InavType.STRING, 0, 0, 16, 16, (), "Kite"),
    InavSetting("battery_capacity", 1000, InavType.UINT32, 0, 0, 0xFFFFFFFF, 17, (), 2200),
)


@pytest.mark.parametrize("setting", SETTINGS, ids=lambda setting: setting.name)
def test_a_description_is_read_as_it_was_sent(setting: InavSetting) -> None:
    assert decode_setting_info(setting.encode()) == setting


def test_inavs_own_bytes_are_read() -> None:
    """Name, group 2, u8 in the profile's section, looked up from 0 to 1, index 5, profile 0 of 3, two names, value."""
    sent = b"mc_iterm_relax\0" + bytes.fromhex("0200 00 08 40 00000000 01000000 0500 00 03") + b"OFF\0ON\0\1"
    found = decode_setting_info(sent)
    assert found is not None
    assert (found.name, found.place, found.choices, found.value) == ("mc_iterm_relax", 5, ("OFF", "ON"), 1)


@pytest.mark.parametrize("setting", SETTINGS, ids=lambda setting: setting.name)
def test_a_truncated_description_is_rejected_or_lacks_only_the_end_of_a_text(setting: InavSetting) -> None:
    sent = setting.encode()
    for size in range(len(sent)):
        found = decode_setting_info(sent[:size])
        assert found is None or setting.type is InavType.STRING


def test_arbitrary_bytes_never_raise() -> None:
    dice = random.Random(1)
    for _ in range(5000):
        sent = bytearray(dice.choice(SETTINGS).encode())
        for _ in range(dice.randrange(4)):
            sent[dice.randrange(len(sent))] = dice.randrange(256)
        decode_setting_info(bytes(sent[: dice.randrange(len(sent) + 1)]))
        decode_setting_info(dice.randbytes(dice.randrange(60)))


def test_a_setting_is_named_by_the_text_or_behind_a_zero_by_the_index() -> None:
    assert encode_about_name("name") == b"name\0"
    assert encode_about_index(258) == b"\0\2\1"
