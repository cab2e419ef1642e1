# SPDX-License-Identifier: GPL-3.0-or-later
"""A mission that the real image flies in the simulated sky, as a ground station sees it through the bridge.

make real-board IMAGE=X.elf FLY=1. The image must be of TestCode3.
"""

import os
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from math import hypot

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.dialect import Message
from protocols.mission_item import Command, MissionItem, MissionResult
from protocols.msp.mission_flight import FlightPhase
from simulator.emulated_naze.console import Console
from simulator.emulated_naze.flying_naze import FlyingNaze
from simulator.emulated_naze.image import Image
from simulator.emulated_naze.prepared_flash import prepared_flash
from simulator.flights.pilot import HIGH, LOW, MIDDLE, Pilot
from simulator.sky.earth import Place
from simulator.sky.sky import Weather
from tests.support.conversations import Upload
from tests.support.real_bench import Figure
from tests.support.world import GroundStation, World

pytestmark = pytest.mark.skipif(not os.environ.get("NAZE_FLY"), reason="NOT RUN: takes minutes: make real-board FLY=1")
PLACE = Place()
#: nf_t in harakiri_flight.c (link-time optimisation extends the name), and its first fields.
_CORE, _PROGRESS = "flight", struct.Struct("<BBHH")
_LATE_S = 1.0
#: EXTENDED_SYS_STATE is sent once a second, and the board's report before it may be half a second old.
_STATE_LATE_S = 1.5
_STEP_S = 0.02
_FLIGHT_S = 240.0
#: The board's own judgement of a place, by its GPS, is this much off the truth at most.
_OFF_M = 5.0
AUTO, LOITER = 3, 5
NORTH, WEST = (25.0, 0.0), (25.0, 20.0)


def item(seq: int, command: int, place: tuple[float, float] | None, height: float, p1: float = 0.0) -> MissionItem:
    lat, lon = PLACE.coordinates((*place, 0.0)) if place else (0.0, 0.0)
    return MissionItem(seq, command, 3, p1, 2.0 if place else 0.0, 0.0, 0.0, round(lat * 1e7), round(lon * 1e7), height)


#: The speed is dropped, so that later items have other numbers on the board. Records by their numbers there.
ITEMS = [
    item(0, Command.NAV_WAYPOINT, (0.0, 0.0), 0.0),
    item(1, Command.NAV_TAKEOFF, None, 6.0),
    item(2, Command.DO_CHANGE_SPEED, None, 0.0, 1),
    item(3, Command.NAV_WAYPOINT, NORTH, 8.0, 1),
    item(4, Command.NAV_LOITER_TIME, WEST, 8.0, 4),
    item(5, Command.NAV_RETURN_TO_LAUNCH, None, 8.0),
    item(6, Command.NAV_LAND, None, 0.0),
]
SEQ_OF = {1: 1, 2: 3, 3: 4, 4: 5, 5: 6}
PLACES = {2: NORTH, 3: WEST, 4: (0.0, 0.0)}


@dataclass(frozen=True)
class Truth:
    """The core's progress in the board's RAM, and the body."""

    phase: int
    record: int
    reached: int
    armed: bool
    height: float
    place: tuple[float, float]


@dataclass
class Watch:
    """What is true, and what a ground station was sent, by time."""

    image: Image
    naze: FlyingNaze
    truths: list[tuple[float, Truth]] = field(default_factory=list)
    sent: list[tuple[float, Message]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._at = next(at for name, at in self.image.symbols.items() if name.split(".")[0] == _CORE)

    def look(self, now: float) -> None:
        phase, _, record, reached = _PROGRESS.unpack(self.naze.peek(self._at, _PROGRESS.size))
        north, west, height = self.naze.sky.body.position
        self.truths.append((now, Truth(phase, record, reached, self.naze.armed, height, (north, west))))

    def first(self, is_true: Callable[[Truth], bool]) -> tuple[float, Truth]:
        return next((at, truth) for at, truth in self.truths if is_true(truth))

    def first_sent(self, name: str, since: float, is_wanted: Callable[[Message], bool]) -> float:
        since -= _STEP_S  # of the truth
        return next(at for at, sent in self.sent if at >= since and sent.get_type() == name and is_wanted(sent))


class BridgedConsole(Console):
    """The pilot's time passes in the world, where the bridge has the serial port."""

    def __init__(self, world: World, on_time: Callable[[float], None]) -> None:
        super().__init__(world.naze, world.now, on_time)
        self._world = world

    def run(self, seconds: float) -> bytes:
        end = self.now + seconds
        while self.now < end - 1e-9:
            self._world.run(min(_STEP_S, end - self.now))
            self.now = self._world.now
            self._on_time(self.now)
        return b""


class Flight:
    """A craft on the ground with a list, and the ground station that has written it."""

    def __init__(self, image: Image, tele_prot: int) -> None:
        flash = prepared_flash(image, lines=("set mission_fly=1", f"set tele_prot={tele_prot}"))
        naze = FlyingNaze(image, memoryview(bytearray(flash)), weather=Weather(seed=1), place=PLACE)
        self.world = World(peer=naze)
        self.world.wait_ready(60)
        self.station = GroundStation(self.world)
        self._send_heartbeats()
        assert Upload(self.station, ITEMS).run() is MissionResult.ACCEPTED
        self.world.run(6)
        self.watch = Watch(image, naze)
        self.pilot = Pilot(naze)
        self.pilot.console = BridgedConsole(self.world, self.watch.look)
        self.station.on_message.append(lambda message: self.watch.sent.append((self.world.now, message)))

    def _send_heartbeats(self) -> None:
        self.station.send(m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3))
        self.world.after(1.0, self._send_heartbeats)

    def take_off(self) -> None:
        self.pilot.arm()
        self.pilot.wait(3.0)
        self.pilot.fly_mission()
        self.pilot.wait(0.5)
        self.pilot.naze.faults.throttle = MIDDLE

    def fly(self, until: Callable[[Truth], bool]) -> None:
        """With height and position hold switched on in the air, for after the mission."""
        switches, begun = self.pilot.naze.faults, self.pilot.now
        while not until(self.watch.truths[-1][1]):
            assert self.pilot.now < begun + _FLIGHT_S
            if self.pilot.height > 1.0 and switches.aux2 == LOW:
                switches.aux2 = HIGH
            self.pilot.wait(0.1)
        self.pilot.wait(6.0)


@pytest.mark.parametrize("tele_prot", [0, 2, 3])
def test_a_flown_mission_is_seen_as_it_is(image: Image, figure: Figure, tele_prot: int) -> None:
    if not any(name.split(".")[0] == _CORE for name in image.symbols):
        pytest.skip("NOT RUN: the image has no mission flight, or no symbols")
    flight = Flight(image, tele_prot)
    flight.take_off()
    flight.fly(lambda truth: not truth.armed)
    watch, late = flight.watch, {"current": 0.0, "reached": 0.0, "mode": 0.0, "landed state": 0.0}

    for record, seq in SEQ_OF.items():
        since, _ = watch.first(lambda truth, record=record: truth.phase and truth.record == record)  # type: ignore[misc]
        at = watch.first_sent("MISSION_CURRENT", since, lambda sent, seq=seq: sent.seq == seq)  # type: ignore[misc]
        late["current"] = max(late["current"], at - since)
    off = {}
    for record in (1, *PLACES):
        since, truth = watch.first(lambda truth, record=record: truth.reached == record)  # type: ignore[misc]
        seq = SEQ_OF[record]
        at = watch.first_sent("MISSION_ITEM_REACHED", since, lambda sent, seq=seq: sent.seq == seq)  # type: ignore[misc]
        late["reached"] = max(late["reached"], at - since)
        if record in PLACES:
            (north, west), place = truth.place, PLACES[record]
            off[record] = hypot(north - place[0], west - place[1])
    since, _ = watch.first(lambda truth: bool(truth.phase))
    late["mode"] = watch.first_sent("HEARTBEAT", since, lambda sent: sent.custom_mode == AUTO) - since
    since, _ = watch.first(lambda truth: truth.height > 1.5)
    in_air = (m.MAV_LANDED_STATE_IN_AIR, m.MAV_LANDED_STATE_TAKEOFF)
    shown = watch.first_sent("EXTENDED_SYS_STATE", since, lambda sent: sent.landed_state in in_air)
    late["landed state"] = shown - since
    since, _ = watch.first(lambda truth: truth.phase in (FlightPhase.DESCENT, FlightPhase.SINK))
    is_landing = watch.first_sent(
        "EXTENDED_SYS_STATE", since, lambda sent: sent.landed_state == m.MAV_LANDED_STATE_LANDING
    )
    late["landing"] = is_landing - since
    figure(f"tele_prot {tele_prot}, later than the board's RAM", {name: f"{s:.2f} s" for name, s in late.items()})
    figure(
        f"tele_prot {tele_prot}, body off the place when reached", {n: f"{metres:.1f} m" for n, metres in off.items()}
    )
    reached = [sent.seq for _, sent in watch.sent if sent.get_type() == "MISSION_ITEM_REACHED"]
    figure(f"tele_prot {tele_prot}, items reached", reached)
    figure(f"tele_prot {tele_prot}, texts", flight.station.texts())
    current = next(sent for _, sent in reversed(watch.sent) if sent.get_type() == "MISSION_CURRENT")
    assert reached == [1, 3, 4, 5, 6]
    assert (current.seq, current.mission_state) == (6, m.MISSION_STATE_COMPLETE)
    assert flight.station.texts().count("Mission flown") == 1
    assert max(off.values()) < _OFF_M
    assert max(late.pop(name) for name in ("landed state", "landing")) <= _STATE_LATE_S
    assert max(late.values()) <= _LATE_S, late


@pytest.mark.parametrize("tele_prot", [0, 2])
def test_a_stop_is_seen_with_the_reason(image: Image, figure: Figure, tele_prot: int) -> None:
    """The pilot moves the roll stick on the way to the second place."""
    flight = Flight(image, tele_prot)
    flight.take_off()
    flight.fly(lambda truth: truth.phase == FlightPhase.LEG and truth.record == 3)
    faults = flight.pilot.naze.faults
    faults.roll, faults.throttle = 1700, MIDDLE
    flight.pilot.wait(1.0)
    faults.roll = MIDDLE
    flight.pilot.wait(4.0)
    watch = flight.watch
    since, _ = watch.first(lambda truth: truth.phase == FlightPhase.HELD)
    why = "Mission stopped: roll or pitch stick moved"
    late = {
        "text": watch.first_sent("STATUSTEXT", since, lambda sent: sent.text == why) - since,
        "paused": watch.first_sent(
            "MISSION_CURRENT", since, lambda sent: sent.mission_state == m.MISSION_STATE_PAUSED and sent.seq == 4
        )
        - since,
        "mode": watch.first_sent("HEARTBEAT", since, lambda sent: sent.custom_mode == LOITER) - since,
    }
    figure(f"tele_prot {tele_prot}, a stop by stick, later", {name: f"{s:.2f} s" for name, s in late.items()})
    assert flight.station.texts().count(why) == 1
    assert max(late["text"], late["paused"]) <= _LATE_S
    assert late["mode"] <= 2 * _LATE_S, "a heartbeat in MAVLink comes once a second"
