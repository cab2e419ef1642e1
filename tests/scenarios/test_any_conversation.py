# SPDX-License-Identifier: GPL-3.0-or-later
"""Random actions of two ground stations, command line, pilot and cables: no wrong list, no deadlock."""

from collections.abc import Sequence

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.fc.states.msp import Polling
from protocols.mission_item import MissionResult
from protocols.msp.mission import WpRecord
from simulator.board.options import SimOptions
from tests.support.conversations import (
    Upload,
    ack_message,
    clear_message,
    count_message,
    item_message,
    list_message,
    records_of,
    request_message,
    waypoints,
)
from tests.support.world import GroundStation, World, flash_holding

OLD_RECORDS = records_of(waypoints(20, seed=77))
OLD_FLASH = flash_holding(OLD_RECORDS)
LONGEST = 25

who = st.integers(0, 1)
seqs = st.integers(0, LONGEST + 2)
results = st.sampled_from(list(MissionResult))


def places(records: Sequence[WpRecord]) -> list[tuple[int, int, int]]:
    """The fields that distinguish lists; the radius depends on the flight controller's setting."""
    return [(record.lat_e7, record.lon_e7, record.height_m) for record in records]


class Conversation(RuleBasedStateMachine):
    """Each announced list has a different length, so an item cannot be attributed to the wrong list."""

    @initialize(slow_store=st.sampled_from([0.0, 0.05, 1.0]), flash_erase_ms=st.sampled_from([20.0, 100.0, 400.0]))
    def start(self, slow_store: float, flash_erase_ms: float) -> None:
        options = SimOptions(boot_ms=300, flash_erase_ms=flash_erase_ms)
        self.world = World(options, speeds=(115200,), flash=OLD_FLASH)
        self.world.wait_ready()
        self.world.store.delay_s = slow_store
        self.stations = [GroundStation(self.world, "first"), GroundStation(self.world, "second", sysid=254)]
        self.announced = [0, 0]
        self.used: set[int] = set()
        self.lists = [[], places(OLD_RECORDS)]
        self.plugged = self.powered = True

    @rule(station=who, count=st.integers(2, LONGEST))
    def announce(self, station: int, count: int) -> None:
        if count in self.used:
            return
        self.used.add(count)
        self.announced[station] = count
        self.lists.append(places(records_of(waypoints(count, count))))
        self.stations[station].send(count_message(count))

    @rule(station=who)
    def announce_again(self, station: int) -> None:
        self.stations[station].send(count_message(self.announced[station]))

    @rule(station=who, count=st.sampled_from([0, 1, 147, 65535]))
    def announce_a_refused_count_or_a_clear(self, station: int, count: int) -> None:
        self.stations[station].send(count_message(count))

    @rule(station=who, seq=seqs)
    def send_an_item(self, station: int, seq: int) -> None:
        items = waypoints(LONGEST + 3, self.announced[station])
        self.stations[station].send(item_message(seq, items[seq]))

    @rule(station=who, first=st.integers(0, 3))
    def send_the_rest(self, station: int, first: int) -> None:
        count = self.announced[station]
        for seq, item in enumerate(waypoints(count, count)):
            if seq >= first:
                self.stations[station].send(item_message(seq, item))

    @rule(station=who, result=results)
    def acknowledge(self, station: int, result: MissionResult) -> None:
        self.stations[station].send(ack_message(result))

    @rule(station=who)
    def clear(self, station: int) -> None:
        self.stations[station].send(clear_message())

    @rule(station=who)
    def write_a_part(self, station: int) -> None:
        self.stations[station].send(messages.MAVLink_mission_write_partial_list_message(1, 1, 0, 3, 0))

    @rule(station=who, seq=seqs)
    def read(self, station: int, seq: int) -> None:
        self.stations[station].send(list_message())
        self.stations[station].send(request_message(seq))

    @rule(radius=st.sampled_from([200.0, 300.0, 900.0]))
    def set_the_radius(self, radius: float) -> None:
        self.stations[0].send(messages.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", radius, 9))

    @rule()
    def push_from_the_command_line(self) -> None:
        items = waypoints(LONGEST + 1, 500)
        self.lists.append(places(records_of(items)))
        self.world.push(items)

    @rule(seconds=st.sampled_from([0.001, 0.01, 0.05, 0.2, 0.6, 2.0, 6.0]))
    def wait(self, seconds: float) -> None:
        self.world.run(seconds)

    @rule()
    def arm_or_disarm(self) -> None:
        self.world.faults.armed = not self.world.faults.armed

    @rule()
    def hang_or_resume(self) -> None:
        self.world.faults.hang = not self.world.faults.hang

    @rule()
    def pull_or_plug(self) -> None:
        if self.plugged:
            self.world.unplug()
        else:
            self.world.plug()
        self.plugged = not self.plugged

    @rule()
    def switch_off_or_on(self) -> None:
        if self.powered:
            self.world.power_off()
        else:
            self.world.power_on()
        self.powered = not self.powered

    @precondition(lambda self: hasattr(self, "world"))
    @invariant()
    def the_board_holds_a_list_that_was_sent(self) -> None:
        assert places(self.world.stored) in self.lists

    def teardown(self) -> None:
        if not hasattr(self, "world"):
            return
        world = self.world
        world.faults.armed = world.faults.hang = False
        if not self.plugged:
            world.plug()
        if not self.powered:
            world.power_on()
        world.run(10)
        self.the_board_holds_a_list_that_was_sent()
        assert isinstance(world.inside.session.state, Polling)
        assert not world.inside.uploads._uploads
        assert not world.bridge.is_busy
        items = waypoints(LONGEST + 5, 900)
        for station in self.stations:
            assert Upload(station, items).run(5) is MissionResult.ACCEPTED
            assert places(world.stored) == places(records_of(items))
            station.send(list_message())
        world.run(1)
        for station in self.stations:
            assert station.messages("MISSION_COUNT")[-1].count == len(items)


TestConversation = Conversation.TestCase
TestConversation.settings = settings(
    max_examples=40, stateful_step_count=30, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
