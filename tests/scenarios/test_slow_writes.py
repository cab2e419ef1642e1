# SPDX-License-Identifier: GPL-3.0-or-later
"""Ground stations whose timeout for the final ack is shorter than the write: QGroundControl and MAVSDK."""

from abc import ABC, abstractmethod
from math import inf

import pytest

from protocols.mavlink.dialect import Message
from protocols.mission_item import MissionResult
from simulator.board.options import SimOptions
from tests.support.conversations import Upload, count_message, item_message, records_of, waypoints
from tests.support.world import GroundStation, Radio, World, flash_holding

ITEMS = waypoints(146)


class Client(ABC):
    """An upload that ends with `outcome`. It never repeats an item by itself."""

    def __init__(self, station: GroundStation) -> None:
        self.station, self.outcome = station, ""
        self._next = 0
        self._give_up_at = inf
        station.on_message.append(self._receive)
        station.send(count_message(len(ITEMS)))

    def run(self) -> str:
        world = self.station.world
        world.run_until(lambda _: bool(self.outcome) or world.now >= self._give_up_at, 120)
        return self.outcome or "timed out"

    def _receive(self, message: Message) -> None:
        if self.outcome or self.station.world.now >= self._give_up_at:
            return
        match message.get_type():
            case "MISSION_REQUEST":
                self._requested(message.seq)
            case "MISSION_ACK" if message.type == MissionResult.ACCEPTED and self._next == len(ITEMS):
                self.outcome = "accepted"
            case "MISSION_ACK":
                self.outcome = "failed"

    @abstractmethod
    def _requested(self, seq: int) -> None:
        """MISSION_REQUEST."""

    def _send(self, seq: int, timeout_s: float) -> None:
        self.station.send(item_message(seq, ITEMS[seq]))
        self._next = seq + 1
        self._give_up_at = self.station.world.now + timeout_s


class QGroundControl(Client):
    """PlanManager: any request restarts its timeout of 1.5 s."""

    def _requested(self, seq: int) -> None:
        self._send(seq, 1.5)
        self._next = len(ITEMS) if seq == len(ITEMS) - 1 else self._next


class Mavsdk(Client):
    """mavlink_mission_transfer_client.cpp: five retries of 0.5 s, which also count the repeated requests."""

    _retries = 0
    _since = 0.0

    def _requested(self, seq: int) -> None:
        now = self.station.world.now
        self._retries += int((now - self._since) / 0.5)
        self._since = now
        if seq > self._next:
            return
        if seq == self._next:
            self._retries = 0
        elif self._retries >= 5:
            self.outcome = "timed out"
            return
        self._retries += 1
        self._send(seq, 0.5 * (6 - self._retries))


@pytest.mark.parametrize("delay_s", [0.0, 0.2])
@pytest.mark.parametrize("client", [QGroundControl, Mavsdk])
def test_a_client_waits_while_the_list_is_written(client: type[Client], delay_s: float) -> None:
    world = World(SimOptions(baud=4800), speeds=(4800,))
    world.wait_ready(60)
    station = GroundStation(world, radio=Radio(delay_s=delay_s))
    assert client(station).run() == "accepted"
    assert world.stored == records_of(ITEMS)


@pytest.mark.parametrize("client", [QGroundControl, Mavsdk])
def test_a_client_waits_while_another_list_is_written(client: type[Client]) -> None:
    world = World(SimOptions(flash_erase_ms=1200), speeds=(115200,), flash=flash_holding(records_of(ITEMS[:20])))
    world.wait_ready()
    other = Upload(GroundStation(world, "other"), waypoints(146, seed=1))
    station = GroundStation(world)
    world.run(0.1)
    assert client(station).run() == "accepted"
    assert other.result is MissionResult.ACCEPTED
    assert world.stored == records_of(ITEMS)


def test_a_repeated_last_item_does_not_trigger_requests() -> None:
    """Mission Planner: each request costs it one of its tries."""
    world = World(SimOptions(baud=9600), speeds=(9600,))
    world.wait_ready(60)
    upload = Upload(GroundStation(world), ITEMS)
    assert upload.run() is MissionResult.ACCEPTED
    assert upload.requested == list(range(len(ITEMS)))
