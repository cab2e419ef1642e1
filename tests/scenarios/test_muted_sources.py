# SPDX-License-Identifier: GPL-3.0-or-later
"""One source of a flying board falls silent: every sink says so, and all sinks agree.

Each reply or message of each kind of board is muted in turn. Every 100 ms each value is compared with the craft and
between the sinks: the state (zenoh and the page), the published groups, the overview, the metrics, the fleet's list,
and the MAVLink messages. A value that is not current is null or absent; one that is current never is.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from itertools import takewhile
from typing import Any

import pytest

from fleet.vehicle import BridgeId, FleetVehicle, vehicle_of
from payloads.mission_data import Json, plain
from payloads.overview import overview_of, state_of
from protocols.mavlink.dialect import Message
from reports.vehicle_groups import Group
from service.web.metrics import vehicle_gauges
from simulator.board.flight import Craft
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.commands.fc_kinds import make_board
from simulator.naze.board import SimulatedNaze
from tests.support.muted_board import MutedBoard
from tests.support.world import GroundStation, World

STEP_S, STALE_S = 0.1, 1.5
#: A published sample may be this much older than the state: Harakiri sends a heartbeat a second, ANALOG is polled so.
PUBLISHED_S = 1.5
#: Lost replies slow all polls down; one that is not answered is soon asked less often, and again after this time.
SLOWED_S, ASKED_AGAIN_S = 10.0, 8.0
STATUS, RC, RAW_GPS, ATTITUDE, ALTITUDE, ANALOG = 101, 105, 106, 108, 109, 110
INAV_STATUS, INAV_ANALOG = 0x2000, 0x2002
HEARTBEAT, SYS_STATUS, GPS_RAW_INT, M_ATTITUDE, RC_CHANNELS_RAW, VFR_HUD = 0, 1, 24, 30, 35, 74


@dataclass(frozen=True)
class Value:
    """A value of the state, its truth, and its resolution."""

    truth: Callable[[Craft], Any] | None = None
    resolution: float = 0.0
    is_angle: bool = False


VALUES = {
    "attitude.roll_deg": Value(lambda craft: craft.flight.roll, 0.11),
    "attitude.pitch_deg": Value(lambda craft: -craft.flight.pitch, 0.11),
    "attitude.heading_deg": Value(lambda craft: craft.flight.heading, 1.0, is_angle=True),
    "position.lat_deg": Value(lambda craft: craft.flight.lat_e7 / 1e7, 2e-7),
    "position.lon_deg": Value(lambda craft: craft.flight.lon_e7 / 1e7, 2e-7),
    "position.altitude_m": Value(lambda craft: craft.flight.altitude_m, 0.51),
    "position.height_m": Value(lambda craft: craft.flight.height_m, 0.02),
    "position.climb_m_s": Value(lambda craft: craft.flight.climb_ms, 0.02),
    "gps.fix": Value(),
    "gps.satellites": Value(lambda craft: craft.flight.satellites),
    "gps.ground_speed_m_s": Value(lambda craft: craft.flight.speed_ms, 0.02),
    "battery.voltage_v": Value(lambda craft: craft.flight.volts, 0.1),
    "rc.channels_us": Value(),
    "rc.rssi_percent": Value(),
    "status.armed": Value(lambda craft: craft.armed),
    "status.mode": Value(),
    "status.sensors": Value(),
}


def _sources(**groups: tuple[int, ...]) -> dict[str, tuple[int, ...]]:
    """By value: the messages of which one is enough to know it."""
    found = {}
    for name in VALUES:
        group, _, own = name.partition(".")
        found[name] = groups.get(own, groups.get(group, ()))
    return found


#: Commands and messages by the values that they carry.
MSP = _sources(
    attitude=(ATTITUDE,), position=(RAW_GPS,), gps=(RAW_GPS,), height_m=(ALTITUDE,), climb_m_s=(ALTITUDE,),
    battery=(ANALOG,), rc=(RC,), rssi_percent=(ANALOG,), status=(STATUS,),
)  # fmt: skip
BOARDS: Mapping[str, Mapping[str, tuple[int, ...]]] = {
    "naze": MSP,
    "multiwii": MSP,
    "inav": MSP | {"battery.voltage_v": (INAV_ANALOG,), "rc.rssi_percent": (ANALOG, INAV_ANALOG)}
    | {name: (STATUS, INAV_STATUS) for name in MSP if name.startswith("status.")},
    "betaflight": {name: () if RAW_GPS in sources else sources for name, sources in MSP.items()},
    "mavlink": _sources(
        attitude=(M_ATTITUDE,), position=(GPS_RAW_INT,), gps=(GPS_RAW_INT,), height_m=(VFR_HUD,), climb_m_s=(VFR_HUD,),
        battery=(SYS_STATUS,), rc=(RC_CHANNELS_RAW,), armed=(HEARTBEAT,), mode=(HEARTBEAT,), sensors=(SYS_STATUS,),
    ),
}  # fmt: skip
#: A second message that a value needs: Harakiri's mode follows from its heartbeat and from the switches.
ALSO_NEEDED = {("mavlink", "status.mode"): RC_CHANNELS_RAW}
#: Polled about once a second, or less often while others are not answered.
SELDOM_POLLED = {
    (board, name) for board in BOARDS for name in ("battery.voltage_v", "rc.rssi_percent", "rc.channels_us")
}
SELDOM_POLLED |= {("inav", name) for name in VALUES if name.startswith("status.")}
#: The simulated Betaflight's battery never sags.
CONSTANT = ("betaflight", "battery.voltage_v")
#: These messages have no "unknown" for these.
NEEDED = {
    "VFR_HUD": {ATTITUDE, RC, M_ATTITUDE, RC_CHANNELS_RAW},
    "GLOBAL_POSITION_INT": {RAW_GPS, GPS_RAW_INT, ALTITUDE, VFR_HUD},
}
#: The messages to ground stations and the value that each shows; None: it shows it as unknown.
SHOWN: Mapping[str, tuple[str, Callable[[Message], Any]]] = {
    "attitude.roll_deg": ("ATTITUDE", lambda msg: math.degrees(msg.roll)),
    "position.height_m": ("GLOBAL_POSITION_INT", lambda msg: msg.relative_alt / 1000),
    "position.altitude_m": ("GLOBAL_POSITION_INT", lambda msg: msg.alt / 1000 if msg.lat else None),
    "position.climb_m_s": ("VFR_HUD", lambda msg: None if math.isnan(msg.climb) else msg.climb),
    "gps.ground_speed_m_s": ("VFR_HUD", lambda msg: None if math.isnan(msg.groundspeed) else msg.groundspeed),
    "position.lat_deg": ("GPS_RAW_INT", lambda msg: msg.lat / 1e7),
    "battery.voltage_v": (
        "SYS_STATUS",
        lambda msg: None if msg.voltage_battery == 65535 else msg.voltage_battery / 1e3,
    ),
    "rc.channels_us": ("RC_CHANNELS", lambda msg: msg.chan1_raw),
}
#: Other names of the values in the sinks that have only some.
LISTED = {"position.lat_deg": "lat_deg", "position.lon_deg": "lon_deg", "position.height_m": "height_m",
          "battery.voltage_v": "battery_v", "status.armed": "armed", "status.mode": "mode"}  # fmt: skip
MEASURED = {"position.lat_deg": "latitude_degrees", "position.lon_deg": "longitude_degrees",
            "position.height_m": "height_meters", "battery.voltage_v": "battery_volts", "status.armed": "armed",
            "gps.satellites": "satellites"}  # fmt: skip


@dataclass
class Sinks:
    """Everything that a flying board's values reach."""

    board: str
    world: World
    muted_at: float = math.inf
    muted: frozenset[int] = frozenset()
    past: list[tuple[float, Craft]] = field(default_factory=list)
    published: dict[Group, tuple[float, Json]] = field(default_factory=dict)
    heard: dict[str, tuple[float, Any]] = field(default_factory=dict)

    def mute(self, *numbers: int) -> None:
        self.muted_at, self.muted = self.world.now, frozenset(numbers)
        self.world.naze.muted = self.muted

    def message(self, message: Message) -> None:
        if message.get_type() == "VFR_HUD" and not math.isnan(message.alt):  # without a GPS home's and the height
            self.is_true("position.altitude_m", message.alt)
        for name, (kind, value) in SHOWN.items():
            if kind == message.get_type():
                self.heard[name] = self.world.now, value(message)

    def step(self, *, is_compared: bool = True) -> None:
        for _ in range(5):
            self.world.run(STEP_S / 5)
            for group in self.world.take_published():
                self.published[group] = self.world.now, plain(self.world.bridge.group(group, self.world.now))
        self.past.append((self.world.now, self.world.naze.truth(self.world.now)))
        if is_compared:
            self.compare()

    def compare(self) -> None:
        report = self.world.bridge.report(self.world.now)
        state, page = plain(report), asdict(report)
        gauges = {name: value for name, (_, value) in vehicle_gauges(report).items()}
        overview = plain(overview_of(state))
        bridge = BridgeId("naze-1", "1")
        lists: list[FleetVehicle] = [vehicle_of(bridge, state), vehicle_of(bridge, state_of(overview))]
        for name in VALUES:
            value = _part(state, name)
            self.is_right(name, value)
            assert _part(page, name) == (tuple(value) if isinstance(value, list) else value)
            self.is_published(name, value)
            if name in MEASURED:
                assert gauges[MEASURED[name]] == value, name
            if name in LISTED:
                for listed in lists:
                    shown = getattr(listed, LISTED[name])
                    assert (shown is None) == (value is None), (name, shown, value)
                    assert value is None or isinstance(value, str) or shown == pytest.approx(value, abs=0.51)
            if name in self.heard:
                self.is_shown(name)

    @property
    def is_slowed(self) -> bool:
        return self.muted_at < self.world.now < self.muted_at + SLOWED_S

    def age_s(self, name: str) -> float | None:
        """How long ago its source can have been heard at most; None: the board has none."""
        sources = BOARDS[self.board][name]
        if not sources:
            return None
        is_muted = self.muted.issuperset(sources) or ALSO_NEEDED.get((self.board, name)) in self.muted
        return self.world.now - self.muted_at if is_muted else 0.0

    def is_right(self, name: str, value: Any) -> None:
        age_s = self.age_s(name)
        if age_s is None or age_s > STALE_S:
            assert value is None, (self.world.now, name, value)
        elif age_s == 0.0 and not ((self.board, name) in SELDOM_POLLED and self.is_slowed):
            assert value is not None, (self.world.now, name)
        self.is_true(name, value)

    def is_true(self, name: str, value: Any) -> None:
        """It was true within the last 1.5 s."""
        what = VALUES[name]
        if value is None or what.truth is None or (self.board, name) == CONSTANT:
            return
        begin = self.world.now - STALE_S - 2 * STEP_S
        truths = [what.truth(craft) for _, craft in takewhile(lambda past: past[0] >= begin, reversed(self.past))]
        if what.is_angle:
            assert min(abs((value - truth + 180) % 360 - 180) for truth in truths) <= what.resolution, (name, value)
        else:
            assert min(truths) - what.resolution <= value <= max(truths) + what.resolution, (name, value, truths[0])

    def is_published(self, name: str, value: Any) -> None:
        """A subscriber who keeps the last sample knows what the state says, and its age."""
        group, _, own = name.partition(".")
        if BOARDS[self.board][name] == () and Group(group) not in self.published:
            return
        at, sample = self.published[Group(group)]
        elapsed_s = self.world.now - at
        if sample[own] is not None:
            assert sample["age_s"] + elapsed_s <= STALE_S + PUBLISHED_S, (self.world.now, name, sample, elapsed_s)
            self.is_true(name, sample[own] if elapsed_s < STALE_S else None)
        if value is None:
            is_known_old = sample["age_s"] + elapsed_s > STALE_S
            assert sample[own] is None or not is_known_old, (self.world.now, name, sample)
        elif not self.is_slowed:
            assert sample[own] is not None, (self.world.now, name, sample)
            assert elapsed_s <= PUBLISHED_S, (self.world.now, name, elapsed_s)

    def is_shown(self, name: str) -> None:
        at, value = self.heard[name]
        elapsed_s, age_s = self.world.now - at, self.age_s(name)
        if age_s is None:
            assert value is None
            return
        if value is not None and not (name == "position.lat_deg" and value == 0):
            assert at - self.muted_at <= STALE_S or age_s == 0.0, (self.world.now, name)
        if elapsed_s < STEP_S and value is not None and not (name == "position.lat_deg" and value == 0):
            self.is_true(name, value)
        is_silent = self.muted & NEEDED.get(SHOWN[name][0], set())
        if age_s == 0.0 and not self.is_slowed and not is_silent:
            assert elapsed_s <= STALE_S, (self.world.now, name, elapsed_s)


def _part(data: Any, path: str) -> Any:
    group, _, name = path.partition(".")
    return data[group][name]


def flying(board: str) -> Sinks:
    """An armed craft, some seconds after the start of its flight."""
    faults = Faults(boxes=1)
    if board in ("naze", "mavlink"):
        protocol = TelemetryProtocol.MAVLINK if board == "mavlink" else TelemetryProtocol.MSP
        device: Any = SimulatedNaze(SimOptions(tele_prot=protocol), faults)
    else:
        device = make_board(board, faults=faults)
    world = World(peer=MutedBoard(device), faults=faults)
    world.wait_ready(30)
    station = GroundStation(world)
    station.stay_connected()
    world.bridge.watch(Group)
    sinks = Sinks(board, world)
    world.run(6)
    faults.armed = True
    for _ in range(60):
        sinks.step(is_compared=False)
    station.on_message.append(sinks.message)
    for _ in range(20):
        sinks.step(is_compared=False)
    return sinks


@pytest.mark.parametrize("board", BOARDS)
def test_a_muted_source_is_unknown_in_all_sinks(board: str) -> None:
    sinks = flying(board)
    for _ in range(20):
        sinks.step()
    assert {Group(name.partition(".")[0]) for name, sources in BOARDS[board].items() if sources} <= set(sinks.published)
    for number in sorted({each for sources in BOARDS[board].values() for each in sources}):
        sinks.mute(number)
        for _ in range(130):
            sinks.step()
        sinks.mute()
        for _ in range(round(ASKED_AGAIN_S / STEP_S)):
            sinks.step(is_compared=False)
        sinks.muted_at = math.inf
        for _ in range(10):
            sinks.step()


@pytest.mark.parametrize("number", [20, 101, 102, 0x2000])
def test_an_unanswered_inav_request_blanks_only_its_values(number: int) -> None:
    """Without a ground station, so that polls are due once a second. 20 is asked before each mission list."""
    world = World(peer=MutedBoard(make_board("inav")))
    world.wait_ready(30)
    world.run(5)
    world.naze.muted = frozenset([number])
    for _ in range(300):
        world.run(STEP_S)
        report = world.bridge.report(world.now)
        shown = report.battery.voltage_v, report.position.lat_deg, report.gps.fix, report.position.height_m
        assert None not in shown, (world.now, shown)


@pytest.mark.parametrize(("stations", "lost", "unknown_for"), [(0, 0.05, 0.01), (1, 0.05, 0.01), (1, 0.2, 0.1)])
def test_on_a_line_that_loses_replies_values_are_seldom_unknown(stations: int, lost: float, unknown_for: float) -> None:
    """Lost replies slow all polls down, and values remain fresh for as much longer."""
    world = World(peer=MutedBoard(make_board("inav")))
    world.wait_ready(30)
    for _ in range(stations):
        GroundStation(world).stay_connected()
    world.run(5)
    world.naze.lost_rate = lost
    world.run(10)
    unknown = Counter[str]()
    for _ in range(3000):
        world.run(STEP_S)
        report = world.bridge.report(world.now)
        unknown["battery"] += report.battery.voltage_v is None
        unknown["position"] += report.position.lat_deg is None
        unknown["fix"] += report.gps.fix is None
        unknown["height"] += report.position.height_m is None
        unknown["attitude"] += report.attitude.roll_deg is None
        assert report.status.armed is not None, world.now
    assert max(unknown.values()) <= unknown_for * 3000, unknown
