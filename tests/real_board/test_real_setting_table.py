# SPDX-License-Identifier: GPL-3.0-or-later
"""harakiri_settings.c on the image: every setting read, set and saved over MSP, compared with the CLI and with RAM."""

import struct
from math import inf, nan
from zlib import crc32

import pytest

from protocols.msp.frame import Direction, masked_request, request
from protocols.msp.mission import ReplyStatus
from protocols.msp.setting_table import (
    TABLE_REQUEST,
    HeldSetting,
    Setting,
    SettingCommand,
    SettingsReply,
    SettingType,
    TableReply,
    decode_settings,
    decode_table,
    encode_read_settings,
    encode_save,
    encode_set_setting,
    table_checksum,
)
from tests.real_board.test_real_guard import configuration
from tests.support.real_bench import Figure, RealBench

_SAVE_S = 1.0
#: The CLI prints three decimals.
_PRINTED = 0.0006
_SIZES = {
    SettingType.UINT8: 1, SettingType.INT8: 1, SettingType.UINT16: 2, SettingType.INT16: 2, SettingType.UINT32: 4,
    SettingType.FLOAT: 4,
}  # fmt: skip
#: Another accelerometer clears the calibration too.
_WITH_EFFECTS = ("acc_hdw", "mag_gain")


def settings_of(bench: RealBench) -> list[HeldSetting]:
    found: list[HeldSetting] = []
    while len(found) < table(bench).total:
        reply = read(bench, len(found), 8)
        assert reply.status is ReplyStatus.OK
        found += reply.settings
    return found


def read(bench: RealBench, first: int, count: int) -> SettingsReply:
    reply = decode_settings(bench.payload(encode_read_settings(first, count)))
    assert reply is not None
    return reply


def table(bench: RealBench) -> TableReply:
    reply = decode_table(bench.payload(TABLE_REQUEST))
    assert reply is not None
    return reply


def put(bench: RealBench, index: int, setting: Setting, value: float) -> SettingsReply:
    return put_bits(bench, index, setting.identity, setting.pack(value))


def put_bits(bench: RealBench, index: int, identity: int, bits: bytes) -> SettingsReply:
    body = struct.pack("<HI", index, identity) + bits
    reply = decode_settings(bench.payload(masked_request(SettingCommand.SET_SETTING, body)))
    assert reply is not None
    return reply


def save(bench: RealBench) -> ReplyStatus:
    reply = decode_table(bench.payload(encode_save(table(bench).checksum)))
    assert reply is not None
    bench.run(_SAVE_S)
    return reply.status


def position(settings: list[HeldSetting], name: str) -> tuple[int, Setting, float]:
    return next((at, held.setting, held.value) for at, held in enumerate(settings) if held.setting.name == name)


@pytest.fixture
def settable(bench: RealBench) -> RealBench:
    reply = bench.ask(TABLE_REQUEST)
    if reply is None or reply.direction is not Direction.REPLY:
        pytest.skip("NOT RUN: an image without harakiri_settings.c")
    return bench


def test_every_setting_equals_the_cli(settable: RealBench, figure: Figure) -> None:
    bench = settable
    before = bench.now
    settings = settings_of(bench)
    figure("settings, and s to read them at 115200", f"{len(settings)}, {bench.now - before:.2f}")
    assert table(bench) == TableReply(ReplyStatus.OK, len(settings), table_checksum(settings))
    bench.enter_cli()
    bench.send(b"set *\r")
    printed = [line.split() for line in bench.run(5.0).decode("latin-1").splitlines() if " = " in line]
    assert len(printed) == len(settings)
    for (name, _, value, minimum, maximum), held in zip(printed, settings, strict=True):
        assert (name, float(minimum), float(maximum)) == (held.setting.name, held.setting.minimum, held.setting.maximum)
        assert float(value) == pytest.approx(held.value, abs=_PRINTED)


def test_every_setting_takes_only_the_values_in_range(settable: RealBench, figure: Figure) -> None:
    bench = settable
    taken = refused = 0
    flash = bytes(bench.flash)
    for index, held in enumerate(settings_of(bench)):
        setting, before = held.setting, configuration(bench)
        for value in (setting.minimum, setting.maximum):
            reply = put(bench, index, setting, value)
            if is_dangerous(held, value):
                assert (reply.status, len(reply.settings)) == (ReplyStatus.RANGE, 1)
                refused += 1
                continue
            assert (reply.status, list(reply.settings)) == (ReplyStatus.OK, [HeldSetting(setting, value)])
            assert read(bench, index, 1).settings == reply.settings
            taken += 1
            if setting.name not in _WITH_EFFECTS:
                assert_only(before, configuration(bench), setting.pack(value)[: _SIZES[setting.type]])
        for bits in outside(setting):
            now = configuration(bench)
            reply = put_bits(bench, index, setting.identity, bits)
            assert (reply.status, len(reply.settings)) == (ReplyStatus.RANGE, 1)
            assert configuration(bench) == now
            refused += 1
        bench.naze.poke(bench.image.symbols["cfg"], before)
    assert bytes(bench.flash) == flash
    assert (bench.naze.counters.hazard_runs, bench.naze.counters.crashes) == (0, 0)
    figure("settings' values taken, refused", f"{taken}, {refused}")


def is_dangerous(held: HeldSetting, value: float) -> bool:
    """The motors' pulse while disarmed is not raised, nor is a setting changed that crashes a running board."""
    name = held.setting.name
    if name == "esc_moff":
        return value > held.value
    is_fixed = name == "gbl_flg" or name.startswith(("align_gyro", "align_acc", "align_mag"))
    return is_fixed and value != held.value


def assert_only(before: bytes, after: bytes, value: bytes) -> None:
    """The variable has this value, and no other byte of the configuration has changed."""
    changed = [at for at, pair in enumerate(zip(before, after, strict=True)) if pair[0] != pair[1]]
    if changed:
        starts = range(changed[-1] - len(value) + 1, changed[0] + 1)
        assert any(after[start : start + len(value)] == value for start in starts)


def outside(setting: Setting) -> list[bytes]:
    if setting.type is SettingType.FLOAT:
        numbers = (setting.minimum - 0.01, setting.maximum + 0.01, nan, inf, -inf)
        return [struct.pack("<f", number) for number in numbers]
    return [struct.pack("<i", number) for number in (setting.minimum - 1, -(2**31))] + [
        struct.pack("<I", setting.maximum + 1),
        struct.pack("<I", 0x8000_0000 | setting.maximum),
    ]


def test_another_builds_setting_is_not_set(settable: RealBench) -> None:
    bench = settable
    settings = settings_of(bench)
    before = configuration(bench)
    for index, held in enumerate(settings):
        other = settings[(index + 1) % len(settings)].setting
        for wrong in (other, held.setting._replace(maximum=held.setting.maximum - 1)):
            reply = put(bench, index, wrong, wrong.minimum)
            assert reply == SettingsReply(ReplyStatus.CHECKSUM, index, [])
    assert configuration(bench) == before
    for index in (len(settings), 0xFFFE):
        assert put(bench, index, settings[0].setting, 0).status is ReplyStatus.RANGE
        assert read(bench, index, 1) == SettingsReply(ReplyStatus.RANGE, index, [])


def test_another_size_is_refused(settable: RealBench) -> None:
    bench = settable
    before, flash = configuration(bench), bytes(bench.flash)
    for command, right in ((SettingCommand.SETTING, 5), (SettingCommand.SET_SETTING, 11)):
        for size in range(244):
            if size != right:
                reply = decode_settings(bench.payload(request(command, bytes(size))))
                assert reply == SettingsReply(ReplyStatus.BAD_REQUEST, 0, [])
    assert (configuration(bench), bytes(bench.flash)) == (before, flash)


def test_settings_cannot_be_read_or_changed_while_armed(settable: RealBench, figure: Figure) -> None:
    bench = settable
    settings, checksum = settings_of(bench), table(bench).checksum
    bench.arm()
    before, flash = configuration(bench), bytes(bench.flash)
    for index, held in enumerate(settings):
        assert read(bench, index, 1).status is ReplyStatus.ARMED
        assert put(bench, index, held.setting, held.setting.maximum).status is ReplyStatus.ARMED
    for frame in (TABLE_REQUEST, encode_save(checksum)):
        reply = decode_settings(bench.payload(frame))
        assert reply is not None
        assert reply.status is ReplyStatus.ARMED
        bench.run(_SAVE_S)
    assert (configuration(bench), bytes(bench.flash), bench.naze.armed) == (before, flash, True)
    figure("armed: requests to set refused", len(settings))


def test_only_a_save_survives_a_reset(settable: RealBench) -> None:
    bench = settable
    index, setting, value = position(settings_of(bench), "p_roll")
    original = table(bench)
    assert put(bench, index, setting, value + 1).status is ReplyStatus.OK
    bench.power_cycle()
    assert table(bench) == original
    assert put(bench, index, setting, value + 2).status is ReplyStatus.OK
    assert save(bench) is ReplyStatus.OK
    saved = table(bench)
    bench.power_cycle()
    assert table(bench) == saved
    assert read(bench, index, 1).settings[0].value == value + 2


def test_a_save_of_other_settings_is_refused(settable: RealBench) -> None:
    bench = settable
    flash = bytes(bench.flash)
    reply = decode_table(bench.payload(encode_save(crc32(b"others"))))
    assert reply == table(bench)._replace(status=ReplyStatus.CHECKSUM)
    bench.hold_write(True)
    busy = decode_settings(bench.payload(encode_save(table(bench).checksum)))
    assert busy == SettingsReply(ReplyStatus.BUSY, 0xFFFF, [])
    bench.hold_write(False)
    bench.run(_SAVE_S)
    assert bytes(bench.flash) == flash


def test_another_accelerometer_clears_the_calibration_as_in_the_cli(settable: RealBench) -> None:
    bench = settable
    index, setting, value = position(settings_of(bench), "acc_hdw")
    for name in ("rc_trm_rll", "rc_trm_ptch"):
        trim_index, trim, _ = position(settings_of(bench), name)
        put(bench, trim_index, trim, 5.0)
    assert put(bench, index, setting, value + 1 if value < setting.maximum else value - 1).status is ReplyStatus.OK
    settings = settings_of(bench)
    assert [position(settings, name)[2] for name in ("rc_trm_rll", "rc_trm_ptch")] == [0.0, 0.0]


def test_the_motors_off_pulse_is_never_raised(settable: RealBench) -> None:
    """While disarmed the mixer sends it to the motors at once."""
    bench = settable
    index, setting, value = position(settings_of(bench), "esc_moff")
    reply = decode_settings(bench.payload(encode_set_setting(index, setting, value + 1)))
    assert reply == SettingsReply(ReplyStatus.RANGE, index, [HeldSetting(setting, value)])
    assert put(bench, index, setting, value - 1).status is ReplyStatus.OK
