# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated I2C bus and its three sensors, accessed like a driver does."""

from tests.support.table_program import Rig, Steps

CR1, CR2, DR, SR1, SR2, CCR = (0x4000_5800 + offset for offset in (0x00, 0x04, 0x10, 0x14, 0x18, 0x1C))
PE, START, STOP, ACK, POS = 1, 1 << 8, 1 << 9, 1 << 10, 1 << 11
SB, ADDR, BTF, RXNE, TXE, AF = 1, 2, 4, 1 << 6, 1 << 7, 1 << 10
MPU6050, HMC5883L, MS5611 = 0x68, 0x1E, 0x77


def bus() -> Steps:
    return Steps().store(CR2, 8).store(CCR, 1 << 15 | 7).store(CR1, PE)


def address(steps: Steps, device: int, direction: int) -> Steps:
    steps.store(CR1, PE | ACK | START).wait(SR1, SB).store(DR, device << 1 | direction)
    return steps.wait(SR1, ADDR)


def write(steps: Steps, device: int, *data: int) -> Steps:
    """The first byte is a register or a command."""
    address(steps, device, 0).load(SR2)
    for byte in data:
        steps.wait(SR1, TXE).store(DR, byte)
    return steps.wait(SR1, BTF).store(CR1, PE | ACK | STOP)


def read(steps: Steps, device: int, count: int) -> Steps:
    """Log one word for SR2, then one for each byte; the last byte is not acknowledged, which ends the transfer."""
    address(steps, device, 1)
    if count == 1:
        return steps.store(CR1, PE).load(SR2).store(CR1, PE | STOP).wait(SR1, RXNE).load(DR)
    if count == 2:
        steps.store(CR1, PE | ACK | POS).load(SR2).store(CR1, PE | POS)
        return steps.wait(SR1, BTF).store(CR1, PE | STOP).load(DR).load(DR)
    steps.load(SR2)
    for _ in range(count - 3):
        steps.wait(SR1, RXNE).load(DR)
    steps.wait(SR1, BTF).store(CR1, PE).load(DR).store(CR1, PE | STOP).load(DR)
    return steps.wait(SR1, RXNE).load(DR)


def ask(device: int, register: int, count: int, *before: tuple[int, ...]) -> list[int]:
    """The bytes of a register after some writes."""
    steps = bus()
    for data in before:
        write(steps, device, *data)
    read(write(steps, device, register), device, count)
    return Rig(steps).run(0.05).log(count + len(before) + 2)[-count:]


def signed(high: int, low: int) -> int:
    return int.from_bytes(bytes((high, low)), "big", signed=True)


def test_the_gyroscope_identifies_itself() -> None:
    assert ask(MPU6050, 0x75, 1) == [0x68]


def test_the_board_is_level_and_at_rest() -> None:
    measured = ask(MPU6050, 0x3B, 14)
    x, y, z, _, *rotation = (signed(*measured[at : at + 2]) for at in range(0, 14, 2))
    assert abs(x) <= 2
    assert abs(y) <= 2
    assert abs(z - 4096) <= 2
    assert all(abs(rate) <= 4 for rate in rotation)


def test_a_register_keeps_the_value_until_a_reset() -> None:
    assert ask(MPU6050, 0x1B, 2, (0x1B, 0x18, 0x10)) == [0x18, 0x10]
    assert ask(MPU6050, 0x1B, 2, (0x1B, 0x18, 0x10), (0x6B, 0x80)) == [0, 0]


def test_the_magnetometer_identifies_itself_and_passes_the_self_test() -> None:
    assert ask(HMC5883L, 10, 3) == [*b"H43"]
    without, positive, negative = (signed(*ask(HMC5883L, 3, 2, (0, mode))) for mode in (0x10, 0x11, 0x12))
    assert abs(without - 300) <= 1
    assert abs(positive - 766) <= 1
    assert abs(negative + 766) <= 1


def test_the_barometers_coefficients_have_a_checksum() -> None:
    words = [int.from_bytes(bytes(ask(MS5611, 0xA0 + 2 * index, 2)), "big") for index in range(8)]
    remainder = 0
    for at, byte in enumerate(b"".join(word.to_bytes(2, "big") for word in words)):
        remainder ^= byte if at < 15 else 0
        for _ in range(8):
            remainder = (remainder << 1 ^ 0x3000 if remainder & 0x8000 else remainder << 1) & 0xFFFF
    assert words[0]
    assert remainder >> 12 == words[7] & 0xF


def test_the_barometer_converts_on_command() -> None:
    temperature = int.from_bytes(bytes(ask(MS5611, 0, 3, (0x58,))), "big")
    pressure = int.from_bytes(bytes(ask(MS5611, 0, 3, (0x48,))), "big")
    assert temperature == 8_569_150
    assert abs(pressure - 9_085_466) <= 100


def test_other_addresses_are_not_answered() -> None:
    steps = bus().store(CR1, PE | START).wait(SR1, SB).store(DR, 0x50 << 1).wait(SR1, AF).store(SR1, 0)
    rig = Rig(steps.store(CR1, PE | STOP).load(SR1).load(SR2)).run(0.01)
    assert rig.log(1) == [0]


def test_the_bus_is_free_after_a_stop() -> None:
    steps = write(bus(), MPU6050, 0x75)
    for _ in range(20):
        steps.load(SR2)
    assert Rig(steps).run(0.01).log(21)[-1] == 0
