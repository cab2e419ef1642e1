# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge and the image, in simulated time: an interrupted upload, a torn MAVLink stream, and a board in its CLI."""

from collections.abc import Callable

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.fc.states.mavlink import HarakiriMavlink
from bridge.fc.states.msp import Cli, Identifying, Polling
from protocols.mission_item import MissionItem, MissionResult
from simulator.emulated_naze.board import EmulatedNaze
from simulator.emulated_naze.image import Image
from tests.support.conversations import Download, Upload, records_of, waypoints
from tests.support.real_bench import Figure, RealBench
from tests.support.world import GroundStation, World

_OLD, _NEW = waypoints(20), waypoints(60, seed=1)
#: Time to read the list, with default telemetry.
_SETTLED_S = 2.0
_BOOT_S = 20.0
#: A byte at 115200 baud.
_BYTE_S = 10 / 115200
_SLOW_BAUD = 2400
_LONGEST_SEARCH_S = 10.0
_FOUND_WITHIN_S = 8.0
_STICKS_S = 5.0
#: Longer than the bridge's timeout for a torn stream.
_FLIGHT_S = 8.0


@pytest.fixture
def world(image: Image, flash: bytes) -> World:
    world = World(peer=EmulatedNaze(image, flash=memoryview(bytearray(flash))))
    world.wait_ready()
    return world


@pytest.fixture
def station(world: World) -> GroundStation:
    return GroundStation(world)


def reach_last_records(world: World) -> None:
    """Until the last records are being programmed, eight half-words each."""
    enough = world.naze.flash_operations + 8 * (len(_NEW) - 5)
    world.wait_until(lambda world: world.naze.flash_operations >= enough, 5)


def reach_seal(world: World) -> None:
    """Until the seal is programmed: the reply to COMMIT follows in 1.3 ms, less than the board's usual step."""
    reach_last_records(world)
    deadline = world.now + 1
    while len(world.naze.stored_records) != len(_NEW):
        assert world.now < deadline
        world.run(_BYTE_S)


@pytest.mark.parametrize(
    ("reach_moment", "last_word", "stored"),
    [
        (reach_last_records, "No answer, old mission kept: write it again", _OLD),
        (reach_seal, f"The mission did arrive: {len(_NEW)} records", _NEW),
    ],
)
def test_an_upload_interrupted_by_a_reset_is_settled(
    world: World,
    station: GroundStation,
    figure: Figure,
    reach_moment: Callable[[World], None],
    last_word: str,
    stored: list[MissionItem],
) -> None:
    assert Upload(station, _OLD).run() is MissionResult.ACCEPTED
    world.run(_SETTLED_S)
    ended = world.push(_NEW)
    reach_moment(world)
    assert not ended
    world.naze.reset(world.now)
    began = world.now
    world.wait_until(lambda _: last_word in joined_texts(station), _BOOT_S)
    figure(f"reset in mid upload: '{last_word}'", f"after {world.now - began:.1f} s")
    assert ended
    assert world.naze.stored_records == [record.pack() for record in records_of(stored)]
    world.run(_SETTLED_S)
    # After a boot, texts about arming may follow: Webstore1's first throttle is that of no receiver.
    assert ("did arrive" in joined_texts(station)) is (stored is _NEW)


@pytest.mark.parametrize("tele_prot", [2, 3])
def test_arming_into_mavlink_on_a_slow_line(image: Image, flash: bytes, figure: Figure, tele_prot: int) -> None:
    """At 2400 baud and `tele_prot` 2 its stream overruns its own send ring, so that most frames are torn."""
    bench = RealBench(image, flash)
    bench.configure(tele_prot=tele_prot, serial_baudrate=_SLOW_BAUD)
    world = World(peer=EmulatedNaze(image, flash=memoryview(bytearray(bench.flash))))
    world.wait_until(lambda w: isinstance(w.inside.session.state, Identifying), _FOUND_WITHIN_S + _LONGEST_SEARCH_S)
    world.naze.faults.armed = True
    world.wait_until(lambda w: w.naze.armed, _STICKS_S)
    at_arming = world.now
    world.wait_until(
        lambda w: isinstance(w.inside.session.state, HarakiriMavlink) and w.bridge.vehicle.armed is True,
        _FOUND_WITHIN_S,
    )
    found_s = world.now - at_arming
    world.run(_FLIGHT_S)
    assert isinstance(world.inside.session.state, HarakiriMavlink)
    world.naze.faults.armed = False
    world.wait_until(lambda w: not w.naze.armed, _STICKS_S)
    back_s = world.wait_until(
        lambda w: isinstance(w.inside.session.state, Polling) and w.bridge.vehicle.armed is False,
        _FOUND_WITHIN_S,
    )
    figure(f"armed at {_SLOW_BAUD} baud with tele_prot {tele_prot}", f"found in {found_s:.1f} s, MSP in {back_s:.1f} s")


@pytest.mark.parametrize("tele_prot", [0, 2])
def test_the_mission_is_readable_while_armed(image: Image, flash: bytes, figure: Figure, tele_prot: int) -> None:
    """Over MSP it is read from the armed board; over MAVLink, which refuses that, it is the list as verified before."""
    bench = RealBench(image, flash)
    bench.configure(tele_prot=tele_prot)
    world = World(peer=EmulatedNaze(image, flash=memoryview(bytearray(bench.flash))))
    world.wait_ready()
    assert Upload(GroundStation(world, "writer"), _NEW).run() is MissionResult.ACCEPTED
    world.naze.faults.armed = True
    world.wait_until(lambda w: w.naze.armed, _STICKS_S)
    world.wait_until(lambda w: w.is_found and w.bridge.vehicle.armed is True, _FOUND_WITHIN_S)
    world.run(_SETTLED_S)
    if tele_prot == 0:
        world.inside.missions.held = None
    operations, began = world.naze.flash_operations, world.now
    download = Download(GroundStation(world, "reader", sysid=254))
    items = download.run()
    figure(f"{len(_NEW)} items read armed with tele_prot {tele_prot}", f"in {world.now - began:.2f} s")
    assert download.result is None
    assert [(item.lat_e7, item.lon_e7, item.alt_m) for item in items] == [
        (item.lat_e7, item.lon_e7, item.alt_m) for item in _NEW
    ]
    assert (world.naze.armed, world.naze.flash_operations) == (True, operations)


def joined_texts(station: GroundStation) -> str:
    """All texts joined; each has at most 50 characters."""
    return " ".join(station.texts())


def test_the_cli_is_recognised_and_not_touched(world: World, station: GroundStation, figure: Figure) -> None:
    world.run(_SETTLED_S)
    world.naze.receive(b"\r\r\r", world.now)
    began = world.now
    world.wait_until(lambda w: isinstance(w.inside.session.state, Cli), 5)
    figure("its command line is recognised", f"after {world.now - began:.2f} s")
    world.run(8)
    assert isinstance(world.inside.session.state, Cli)
    assert Upload(station, _OLD).run() is MissionResult.DENIED
    # On the tree Webstore1 the first one is appended to the bridge's requests.
    for _ in range(2):
        world.naze.receive(b"exit\r", world.now)
        world.run(0.5)
    world.wait_until(lambda w: w.is_found, _BOOT_S)
    assert Upload(station, _OLD).run() is MissionResult.ACCEPTED


def test_the_accelerometer_page_of_mission_planner_ends_with_success(
    world: World, station: GroundStation, figure: Figure
) -> None:
    """It collects values for 9 s, stores the result, restarts, and then reads level."""
    began = world.now
    station.send(m.MAVLink_command_long_message(1, 1, m.MAV_CMD_PREFLIGHT_CALIBRATION, 0, 0, 0, 0, 0, 2, 0, 0))
    world.wait_until(lambda _: "calibration" in joined_texts(station).split("restarts")[-1], 2 * _BOOT_S)
    assert "Accel calibration successful" in joined_texts(station)
    assert "lost" not in joined_texts(station)
    figure("accelerometer calibration, from the button to the result", f"{world.now - began:.1f} s")
