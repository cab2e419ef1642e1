# SPDX-License-Identifier: GPL-3.0-or-later
"""Finding the flight controller in simulated time: at every speed, mid-frame, booting, power-cycled, armed."""

import random
from collections.abc import Callable

import pytest

from bridge.controllers import other
from bridge.controllers.harakiri import profile as harakiri
from bridge.fc.states.base import Closed
from bridge.fc.states.searching import SPEEDS, Searching
from bridge.model.airframe import Airframe
from protocols.mavlink.dialect import messages
from protocols.msp.frame import request
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from tests.support.fake_controllers import (
    HARAKIRI_CAPABILITY,
    Loopback,
    MavlinkOnly,
    MspFake,
    QuietLine,
    ident,
)
from tests.support.world import World

ALL_SPEEDS = sorted(set(SPEEDS), reverse=True)
BOXES = b"ANGLE;HORIZON;BARO;MAG;CAMSTAB;ARM;GPS HOME;GPS HOLD;"


def verdict(world: World) -> bool:
    return not isinstance(world.bridge.session.state, Closed | Searching)


def reports_armed(world: World) -> bool | None:
    return world.bridge.session.vehicle.armed


@pytest.mark.parametrize("extension", [True, False])
@pytest.mark.parametrize("baud", ALL_SPEEDS)
def test_a_board_is_found_within_seconds_at_every_speed(baud: int, extension: bool) -> None:
    for seed in range(5):
        world = World(SimOptions(baud=baud), Faults(extension=extension), plugged=False)
        # A random phase of the board's heartbeat.
        world.run(random.Random(seed).random() * 4)
        world.plug()
        assert world.wait_until(verdict, 20) <= (1.5 if baud == SPEEDS[0] else 8)
        world.wait_ready()
        assert world.kind is (harakiri.PATCHED if extension else harakiri.UNPATCHED)
        assert world.bridge.session.state.speed == baud
        found = world.events("fc.found")
        assert [event.facts["speed_baud"] for event in found] == [baud]
        assert "two equal answers" in str(found[0].facts["why"])
        world.run(5)
        assert world.is_found
        world.assert_line_was_clean()


@pytest.mark.parametrize("baud", [baud for baud in ALL_SPEEDS if baud >= 2400])
def test_a_board_is_identified_within_8_s(baud: int) -> None:
    """Except at 1200 baud, where reading the box names twice takes two seconds."""
    assert World(SimOptions(baud=baud)).wait_ready() <= 8


@pytest.mark.parametrize("extension", [True, False])
def test_a_board_left_in_mid_frame_is_found(extension: bool) -> None:
    frame = request(200, bytes(64))
    for length in range(1, len(frame)):
        world = World(faults=Faults(extension=extension), plugged=False)
        world.naze.receive(frame[:length], world.now)
        world.run(0.02)
        world.plug()
        assert world.wait_ready() <= 1.5
        world.assert_line_was_clean()


@pytest.mark.parametrize("extension", [True, False])
def test_losing_the_end_of_a_frame_later_does_not_lose_the_board(extension: bool) -> None:
    frame = request(200, bytes(64))
    for length in range(1, len(frame), 7):
        world = World(faults=Faults(extension=extension))
        world.wait_ready()
        world.naze.receive(frame[:length], world.now)
        world.run(3)
        assert world.events("fc.lost") == []
        link = world.bridge.session.state.link
        assert link is not None
        assert world.now - link.last_heard_at < 0.5
        world.assert_line_was_clean()


@pytest.mark.parametrize("boot_ms", [0, 300, 1000, 1500, 2000, 2700, 3500, 6000])
@pytest.mark.parametrize("extension", [True, False])
def test_a_board_that_boots_while_the_port_opens_is_found(boot_ms: float, extension: bool) -> None:
    world = World(SimOptions(boot_ms=boot_ms), Faults(extension=extension), powered=False)
    world.power_on()
    assert world.wait_ready() <= boot_ms / 1000 + 3
    world.assert_line_was_clean()


@pytest.mark.parametrize("baud", ALL_SPEEDS)
def test_a_board_is_found_within_3_s_of_the_ports_return(baud: int) -> None:
    draw = random.Random(baud)
    for _ in range(8):
        world = World(SimOptions(baud=baud))
        world.wait_until(verdict, 10)
        # The speed may already be known when the port is lost.
        world.run(draw.random() * draw.choice((0.2, 4)))
        world.unplug()
        assert isinstance(world.bridge.session.state, Closed)
        world.run(draw.choice((0.001, draw.random() * 8)))
        world.plug()
        assert world.wait_until(verdict, 20) <= 3
        if baud >= 4800:
            world.wait_until(lambda w: w.is_found, 3)
        world.wait_ready()
        world.assert_line_was_clean()


@pytest.mark.parametrize("extension", [True, False])
@pytest.mark.parametrize("baud", ALL_SPEEDS)
def test_a_board_is_found_within_3_s_of_booting_after_any_power_cycle(baud: int, extension: bool) -> None:
    draw = random.Random(baud)
    for _ in range(8):
        boot_s = draw.choice((0.5, 1.0, 2.0, 3.5))
        world = World(SimOptions(baud=baud, boot_ms=boot_s * 1000), Faults(extension=extension))
        world.wait_until(verdict, 10)
        world.run(draw.random() * draw.choice((0.2, 4)))
        world.power_off()
        world.run(draw.choice((0.001, draw.random() * 3, draw.random() * 12)))
        world.power_on()
        world.run(boot_s)
        began = world.now

        def answers(world: World, began: float = began) -> bool:
            link = world.bridge.session.state.link
            return link is not None and link.last_heard_at > began

        assert world.wait_until(answers, 20) <= 3
        world.wait_ready()
        world.assert_line_was_clean()


def test_the_board_is_found_after_random_power_and_port_losses() -> None:
    for seed in range(12):
        world = World(SimOptions(boot_ms=800), seed=seed)
        draw = random.Random(seed)
        plugged = powered = True
        for _ in range(12):
            world.run(draw.random() * draw.choice((0.05, 0.5, 3)))
            match draw.randrange(4):
                case 0:
                    world.unplug() if plugged else world.plug()
                    plugged = not plugged
                case 1:
                    world.power_off() if powered else world.power_on()
                    powered = not powered
                case 2:
                    world.faults.hang = not world.faults.hang
                case _:
                    world.push([])
        world.faults.hang = False
        if not plugged:
            world.plug()
        if not powered:
            world.power_on()
        world.run(0.8)
        # Time to notice that the board was lost.
        world.run(2.0)
        world.wait_until(lambda w: w.kind is harakiri.PATCHED, 3)


@pytest.mark.parametrize(
    ("protocol", "baud"),
    [
        # At 9600 baud the board's own MAVLink telemetry exceeds the line's capacity.
        (TelemetryProtocol.MAVLINK, 115200),
        (TelemetryProtocol.MAVLINK, 57600),
        (TelemetryProtocol.MAVLINK_57600, 115200),
        (TelemetryProtocol.MAVLINK_57600, 57600),
        (TelemetryProtocol.MAVLINK_57600, 9600),
    ],
)
def test_the_bridge_follows_to_mavlink_on_arming_and_back(protocol: TelemetryProtocol, baud: int) -> None:
    world = World(SimOptions(baud=baud, tele_prot=protocol))
    world.wait_ready()
    for _ in range(2):
        world.faults.armed = True
        assert world.wait_until(lambda w: w.kind is harakiri.MAVLINK, 20) <= 8
        world.run(1.2)
        assert reports_armed(world) is True
        world.run(6)
        assert world.kind is harakiri.MAVLINK
        world.faults.armed = False
        assert world.wait_until(lambda w: w.kind is harakiri.PATCHED, 20) <= 8
        world.run(0.5)
        assert reports_armed(world) is False
        world.run(3)
    names = [event.name for event in world.log_event if event.name.startswith("vehicle.")]
    assert names == ["vehicle.armed", "vehicle.disarmed"] * 2
    world.assert_line_was_clean()


@pytest.mark.parametrize("protocol", [TelemetryProtocol.MAVLINK, TelemetryProtocol.MAVLINK_57600])
def test_a_board_that_is_armed_from_the_start_is_found(protocol: TelemetryProtocol) -> None:
    world = World(SimOptions(tele_prot=protocol), Faults(armed=True))
    world.run(0.5)
    assert world.naze.armed
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK, 3)
    assert "no answer to" in str(world.events("fc.found")[0].facts["why"])
    world.faults.armed = False
    world.wait_until(lambda w: w.kind is harakiri.PATCHED, 8)
    world.assert_line_was_clean()


def test_frsky_telemetry_while_armed_is_ignored() -> None:
    """The board still answers MSP, at FrSky's speed and between FrSky frames."""
    world = World(SimOptions(tele_prot=TelemetryProtocol.FRSKY_9600))
    world.wait_ready()
    world.faults.armed = True
    world.wait_until(lambda w: w.bridge.session.state.speed == 9600 and w.kind is harakiri.PATCHED, 15)
    world.run(30)
    assert world.bridge.session.vehicle.armed
    world.faults.armed = False
    world.wait_until(lambda w: w.bridge.session.state.speed == 115200 and w.kind is harakiri.PATCHED, 8)
    assert {event.facts["protocol"] for event in world.events("fc.found")} == {"MSP"}
    world.assert_line_was_clean()


@pytest.mark.parametrize("extension", [True, False])
@pytest.mark.parametrize("rate", [1e-4, 1e-3])
def test_bit_errors_delay_identification_but_never_change_it(rate: float, extension: bool) -> None:
    kind = harakiri.PATCHED if extension else harakiri.UNPATCHED
    found = 0
    for seed in range(120):
        faults = Faults(bit_error_rate=rate, extension=extension)
        world = World(SimOptions(seed=seed), faults, speeds=(115200,))
        world.run_until(lambda w: w.kind is not None, 8)
        controller = world.bridge.session.state.controller
        if controller is None:
            continue
        found += 1
        assert controller.profile is kind
        assert controller.arm_bit == 5
        assert controller.airframe is Airframe.QUADROTOR
        if controller.info is not None:
            assert (controller.info.capacity, controller.info.wp_radius_cm) == (146, 200)
    assert found >= 110


def test_lost_bytes_delay_identification_but_never_change_it() -> None:
    for seed in range(60):
        world = World(SimOptions(seed=seed), Faults(lost_byte_rate=3e-3), speeds=(115200,))
        world.wait_until(lambda w: w.kind is not None, 20)
        assert world.kind is harakiri.PATCHED


OTHERS: dict[str, Callable[[], MspFake]] = {
    "MultiWii": lambda: MspFake({100: ident(241, 1 << 4), 116: BOXES, 101: bytes(11)}),
    "Baseflight": lambda: MspFake({100: ident(230, HARAKIRI_CAPABILITY), 116: BOXES + b"GTUNE;", 101: bytes(11)}),
    "no GTUNE": lambda: MspFake({100: ident(211, HARAKIRI_CAPABILITY), 116: BOXES, 101: bytes(11)}),
    "capability": lambda: MspFake({100: ident(211, 0), 116: BOXES + b"GTUNE;", 101: bytes(11)}),
    "INAV": lambda: MspFake({1: bytes((0, 2, 5)), 2: b"INAV", 116: BOXES, 101: bytes(11)}),
    "no boxes": lambda: MspFake({2: b"BTFL", 101: bytes(11)}),
    "long boxes": lambda: MspFake({2: b"INAV", 116: (BOXES * 5)[:255], 101: bytes(11)}),
}


@pytest.mark.parametrize("name", OTHERS)
def test_similar_firmware_is_not_mistaken_for_harakiri(name: str) -> None:
    fake = OTHERS[name]()
    world = World(peer=fake)
    world.wait_until(lambda w: w.is_found, 3)
    assert world.kind in (other.OTHER_MSP, other.OLD_MULTIWII)
    world.run(10)
    assert world.kind in (other.OTHER_MSP, other.OLD_MULTIWII)
    # These command numbers may mean something else to other firmware.
    assert not {190, 191, 192, 193, 194, 195, 196} & set(fake.asked)


def test_firmware_that_ignores_unknown_requests_is_not_identified() -> None:
    world = World(peer=MspFake({100: ident(240, 0), 116: BOXES, 101: bytes(11)}, silent_on_unknown=True))
    world.run(20)
    assert world.kind is None


def test_the_arm_box_is_found_by_its_name() -> None:
    for boxes in (b"ARM;ANGLE;", b"ANGLE;ARM;HORIZON;", b"ANGLE;HORIZON;ARM"):
        flags = 1 << boxes.split(b";").index(b"ARM")
        status = bytes(6) + flags.to_bytes(4, "little") + b"\0"
        world = World(peer=MspFake({100: ident(241, 0), 2: b"MWII", 116: boxes, 101: status}))
        world.wait_until(lambda w: w.is_found, 3)
        world.run(1)
        assert world.bridge.session.vehicle.armed is True


@pytest.mark.parametrize("version", [1, 2])
def test_one_heartbeat_a_second_is_recognised_as_mavlink(version: int) -> None:
    world = World(peer=MavlinkOnly(version))
    assert world.wait_until(lambda w: w.is_found, 5) <= 1.5
    assert world.kind is other.OTHER_MAVLINK
    world.run(20)
    assert world.kind is other.OTHER_MAVLINK
    assert world.events("fc.lost") == []


def test_an_empty_heartbeat_is_ignored() -> None:
    """MAVLink 2 drops trailing zeros: an empty heartbeat is one byte long."""
    world = World(peer=MavlinkOnly())
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 3)
    mavlink = messages.MAVLink(None, srcSystem=1, srcComponent=1)
    for fields in ((0, 0, 0, 0, 0, 0), (2, 3, 0x80, 0, 3, 0), (2, 3, 0x80 | 81, 0, 4, 3)):
        for version in (1, 2):
            message = messages.MAVLink_heartbeat_message(*fields)
            world.receive_from_fc(bytes(message.pack(mavlink, force_mavlink1=version == 1)))
    assert reports_armed(world) is True


@pytest.mark.parametrize("peer", [QuietLine, Loopback])
def test_an_empty_line_yields_no_flight_controller(peer: Callable[[], QuietLine]) -> None:
    world = World(peer=peer())
    world.run(60)
    assert isinstance(world.bridge.session.state, Searching)
    assert world.events("fc.found") == world.events("fc.in_command_line") == []


def test_a_looped_back_line_is_not_mistaken_for_a_board() -> None:
    """The adapter's RX and TX wires touch after the flight controller was unplugged from it."""
    world = World()
    world.wait_ready()
    world.naze = Loopback()
    world.run(3)
    assert world.kind is None
