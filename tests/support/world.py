# SPDX-License-Identifier: GPL-3.0-or-later
"""A world in simulated time: the bridge, a simulated Naze on a wire, a store, and ground stations on a radio link.

Nothing here sleeps, opens a socket or reads a clock. Every step asserts invariants: complete frames without hazard
bytes to the flight controller, each with a right, deadlines in the future, a bounded queue of conversations.
"""

import heapq
import itertools
import random
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from pymavlink.dialects.v20 import all as every_message
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.bridge import Bridge
from bridge.config import BridgeConfig, BridgeSettings, PassThroughRule
from bridge.controllers import multiwii, other
from bridge.controllers.harakiri import profile as harakiri
from bridge.controllers.inav import profile as inav
from bridge.controllers.table import PROFILES
from bridge.effects import PublishGroups, RecordFrames, RememberFlight, SendToBoard
from bridge.fc.profile import Profile
from bridge.fc.states.mavlink import MavlinkLine
from bridge.fc.states.msp import Cli, Polling
from bridge.fc.states.searching import SPEEDS
from bridge.gcs.rights import LinkAccess
from bridge.gcs.station import Datagrams, Peer
from bridge.line.conversation import Conclude, FindPending, NoteReader, Recall, Save, StoreEffect
from bridge.missions.mission_service import HeldMission, MissionEnded
from bridge.model.craft import FlightMemory
from bridge.model.events import BridgeEvent, Level
from bridge.model.missions import ArrivedMission, Outcome, PendingMission, RecalledMission, Refusal
from bridge.model.settings import SettingsMemory, TakenBackup
from bridge.sharing.msp_sharing import Program
from protocols.mavlink.dialect import Message
from protocols.mavlink.frame import MAGIC_V1, MavlinkSplitter
from protocols.mission_item import ListIdentity, identify
from protocols.msp.frame import MspFrame, MspParser, is_clean
from protocols.msp.mission import WpRecord, unpack_records
from protocols.msp.nav import SET_WP_INDEX
from protocols.rights import Effect
from protocols.rights.mavlink import effect_of
from protocols.rights.msp import Firmware, msp_right
from reports.vehicle_groups import Group
from reports.verdict import SentSeqs
from simulator.board.flash import ERASED, PAGE_SIZE, NorFlash
from simulator.board.line import garble
from simulator.board.options import Faults, SimOptions
from simulator.naze.board import SimulatedNaze
from simulator.naze.mission_slots import MissionSlots, flash_size, slot_pages
from tests.support.inside import Inside

#: Limit on waiting conversations: a flood of requests must not fill the bridge's memory.
MAX_QUEUED = 12
_MAX_TICKS_AT_ONCE = 8
_RIGHTS_IN_SEARCH, _RIGHTS = frozenset((Effect.READ,)), frozenset((Effect.READ, Effect.CHANGE))
#: Their parsers act on no byte inside a frame.
_TAKES_ANY_BYTE = (inav.PROFILE, multiwii.PROFILE, other.CLEANFLIGHT, other.OLD_MULTIWII)


@dataclass(frozen=True, slots=True)
class Event:
    """A logged event and its time."""

    at: float
    level: Level
    name: str
    facts: Mapping[str, object]


class MemoryStore:
    """Answers store effects after `delay_s`; `failing`: like a full disk."""

    def __init__(self) -> None:
        self.missions: list[tuple[ArrivedMission, Conclude | None]] = []
        self.readers: set[tuple[ListIdentity, str]] = set()
        self.delay_s = 0.0
        self.failing = False

    def carry_out(self, effect: StoreEffect) -> object:
        match effect:
            case Save(mission):
                if self.failing:
                    return None
                self.missions.append((mission, None))
                return len(self.missions)
            case Conclude(number):
                if self.failing:
                    return None
                self.missions[number - 1] = (self.missions[number - 1][0], effect)
                return True
            case Recall(identity):
                for mission, ended in reversed(self.missions):
                    verified = ended is not None and ended.outcome is Outcome.VERIFIED
                    if verified and identify(mission.verdict.records) == identity:
                        return RecalledMission(mission.verdict.sent_as, self._sent_seqs(identity))
            case NoteReader(identity, reader):
                self.readers.add((identity, reader))
            case FindPending():
                return [
                    PendingMission(number, identify(mission.verdict.records))
                    for number, (mission, ended) in enumerate(self.missions, 1)
                    if ended is None
                ]
        return None

    def _sent_seqs(self, identity: ListIdentity) -> dict[str, SentSeqs]:
        """As storage.mission_store.MissionStore.item_numbers, but a reading counts for later uploads, too."""
        return {
            mission.sender: mission.verdict.sent_seqs
            for mission, ended in self.missions
            if ended is not None and ended.outcome is Outcome.VERIFIED and mission.sender
            if identify(mission.verdict.records) == identity and (identity, mission.sender) not in self.readers
        }

    def outcomes(self) -> list[Outcome | None]:
        return [conclusion.outcome if conclusion else None for _, conclusion in self.missions]


@dataclass(slots=True)
class Radio:
    """Properties of the link, each way: probability of loss and of duplication, delay and its spread in seconds."""

    loss: float = 0.0
    repeat: float = 0.0
    delay_s: float = 0.0
    spread_s: float = 0.0


class World:
    """By default the board is powered and booted at time 0, when the port opens.

    `flash`: initial contents of its flash. `peer`: a device in place of the simulated Naze (fake_controllers).
    `late_s`: maximum delay of the bridge's wake-ups, as on a busy machine. `links`: write access per link. `is_near`:
    True for an address on the bridge's own networks; stations with a name instead of an address need no proof.
    """

    def __init__(
        self,
        options: SimOptions | None = None,
        faults: Faults | None = None,
        *,
        speeds: Sequence[int | None] = SPEEDS,
        seed: int = 0,
        powered: bool = True,
        plugged: bool = True,
        flash: bytes | None = None,
        peer: Any = None,
        late_s: float = 0.0,
        links: Mapping[str, LinkAccess] | None = None,
        is_near: Callable[[str], bool] = lambda _host: True,
        profiles: Sequence[Profile] = PROFILES,
        passes_everything: bool = False,
        has_log: bool = False,
        memory: SettingsMemory | None = None,
    ) -> None:
        self.random = random.Random(seed)
        self.now = 0.0
        self.faults = faults or Faults()
        self.naze: Any = peer or SimulatedNaze(
            options, self.faults, None if flash is None else memoryview(bytearray(flash))
        )
        self.store = MemoryStore()
        self.log_event: list[Event] = []
        self.stations: dict[Peer, GroundStation] = {}
        #: The bytes that the bridge wrote to the flight controller, with time and speed.
        self.written: list[tuple[float, int | None, bytes]] = []
        self._events: list[tuple[float, int, Callable[[], None]]] = []
        self._numbers = itertools.count()
        self._plugged = self._is_away = False
        self._late_s = late_s
        self._lateness_s = 0.0
        self._config = BridgeConfig(
            speeds,
            BridgeSettings(pass_through=PassThroughRule.EVERYTHING) if passes_everything else BridgeSettings(),
            access=links or {},
            is_near=is_near,
            profiles=profiles,
            settings_memory={} if memory is None else memory,
            has_log=has_log,
        )
        #: The frames for the telemetry log, if there is one.
        self.recorded: list[bytes] = []
        self.flight: FlightMemory | None = None
        self._published: set[Group] = set()
        self.backups: list[TakenBackup] = []
        self._start_bridge()
        if powered:
            self.naze.power_on_booted(self.now)
        if plugged:
            self.plug()

    # Actions for tests.

    def plug(self) -> None:
        self._plugged = True
        self.bridge.fc_opened(self.now)
        self._flush()

    def unplug(self) -> None:
        """Remove the port; the board keeps its power."""
        self._plugged = False
        self.bridge.fc_closed(self.now, "unplugged")
        self._flush()

    def restart_bridge(self, away_s: float = 2.0, *, flight: bool = True) -> None:
        """Kill the bridge, and start another one after `away_s`, with the flight that the previous one left."""
        left = self.flight if flight else None
        self._plugged = False
        self._start_bridge()
        self._is_away = True
        self.run(away_s)
        self._is_away = False
        self._start_bridge(left)
        self.plug()

    def arm(self, within_s: float = 20.0, *, then_s: float = 0.0) -> None:
        """Arm the board, and wait until the bridge knows."""
        self.naze.faults.armed = True
        self.wait_until(lambda _: self.bridge.vehicle.armed is True, within_s, then_s=then_s)

    def power_off(self) -> None:
        self.naze.power_off(self.now)

    def power_on(self) -> None:
        self.naze.power_on(self.now)

    def at(self, when: float, what: Callable[[], None]) -> None:
        """Schedule a call at a future time."""
        heapq.heappush(self._events, (when, next(self._numbers), what))

    def after(self, seconds: float, what: Callable[[], None]) -> None:
        self.at(self.now + seconds, what)

    def run(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end:
            self._step(end)

    def run_until(self, done: "Callable[[World], bool]", seconds: float) -> bool:
        """Let time pass until `done`; False if that takes more than `seconds`."""
        end = self.now + seconds
        while not done(self):
            if self.now >= end:
                return False
            self._step(end)
        return True

    def wait_until(self, done: "Callable[[World], bool]", seconds: float, *, then_s: float = 0.0) -> float:
        """Like `run_until`, but fail on timeout; return the elapsed time. Afterwards `then_s` pass."""
        began = self.now
        assert self.run_until(done, seconds), f"not within {seconds} s, state {self.inside.session.state}"
        elapsed_s = self.now - began
        self.run(then_s)
        return elapsed_s

    def wait_ready(self, seconds: float = 20.0, *, then_s: float = 0.0) -> float:
        """Wait until the flight controller is found and its list is read; its settings may be read after that."""
        settings = self.inside.board_settings

        def is_ready(world: World) -> bool:
            is_idle = not world.bridge.is_busy or settings._reading is not None
            return world.is_found and is_idle and not world.inside.runner.needs_line

        return self.wait_until(is_ready, seconds, then_s=then_s)

    def receive_from_fc(self, data: bytes) -> None:
        """Let the bridge read bytes that are not from the simulated board."""
        self.bridge.fc_received(data, self.now)
        self._flush()

    def receive_from(self, station: "GroundStation", data: bytes, *, datagram: bool = True) -> None:
        """Let bytes from a ground station arrive at the bridge now."""
        if not self._is_away:
            self.bridge.gcs_received(station.peer, data, self.now, datagram=datagram)
            self._flush()

    def receive_from_program(self, program: Program, data: bytes) -> None:
        """Let bytes from a program on a share arrive now."""
        self.bridge.program_received(program, data, self.now)
        self._flush()

    def push(self, items: Sequence[Any]) -> list[Any]:
        """Push like the command line; the returned list receives the outcome."""
        outcome: list[Any] = []
        self.bridge.missions.push(items, "test", lambda _: None, lambda *args: outcome.append(args), self.now)
        self._flush()
        return outcome

    def pushed(self, items: Sequence[Any], within_s: float = 20.0) -> Any:
        """The result of a push."""
        outcome = self.push(items)
        self.wait_until(lambda _: bool(outcome), within_s)
        return outcome[0][0]

    def pull(self, within_s: float = 60.0) -> HeldMission | Refusal:
        """The mission on the board, as the command line gets it."""
        answers: list[HeldMission | Refusal] = []
        self.bridge.missions.pull(answers.append, self.now)
        self.wait_until(lambda _: bool(answers), within_s)
        return answers[0]

    # State for tests.

    @property
    def kind(self) -> Profile | None:
        controller = self.inside.session.state.controller
        return None if controller is None else controller.profile

    @property
    def is_found(self) -> bool:
        return isinstance(self.inside.session.state, Polling | MavlinkLine)

    @property
    def stored(self) -> tuple[WpRecord, ...]:
        """The list in the board's flash that the next boot would load."""
        return tuple(unpack_records(self.naze.stored))

    def events(self, name: str) -> list[Event]:
        self._flush()  # for tests that call the bridge themselves
        return [event for event in self.log_event if event.name == name]

    def requests(self, since: float = 0.0) -> list[MspFrame]:
        """The MSP frames that were written to the flight controller since then, as far as `written` has them."""
        return [frame for at, _, data in self.written if at >= since for frame in MspParser().feed(data)]

    def requests_during(self, seconds: float) -> list[MspFrame]:
        """Let time pass; the MSP frames that are written to the flight controller meanwhile."""
        began = self.now
        self.run(seconds)
        return self.requests(began)

    def take_published(self) -> set[Group]:
        """The watched groups with new values since the last call."""
        published, self._published = self._published, set()
        return published

    def assert_line_was_clean(self) -> None:
        """Assert that no hazard run and no ring overflow occurred. True on any line without damage."""
        counters = self.naze.counters
        assert counters.hazard_runs == 0
        assert counters.tx_overflows == 0
        assert counters.rx_overflows == 0
        assert not counters.cli_entered
        assert counters.max_outstanding_reply_bytes <= 255

    # Passing time.

    def _start_bridge(self, flight: FlightMemory | None = None) -> None:
        config = replace(self._config, flight=flight)
        self.flight = flight
        self.bridge = Bridge(config, self.now)
        self.inside = Inside(self.bridge)

    def _step(self, end: float) -> None:
        """Advance to the next event and execute it."""
        wakeup = max(self.naze.next_wakeup(self.now), self.now + 1e-6)
        wanted = min(self.bridge.due + self._lateness_s, wakeup, end)
        if self._events:
            wanted = min(wanted, self._events[0][0])
        self.now = max(self.now, wanted)
        data = self.naze.advance(self.now)
        if data and self._plugged:
            speed = self.inside.session.state.speed
            received = garble(data, self.naze.baud, speed) if speed else data
            if received:
                self.bridge.fc_received(received, self.now)
                self._flush()
        while self._events and self._events[0][0] <= self.now:
            heapq.heappop(self._events)[2]()
        assert len(self.inside.runner._queue) <= MAX_QUEUED
        if self.bridge.due + self._lateness_s > self.now:
            return
        self._lateness_s = self.random.random() * self._late_s
        for _ in range(_MAX_TICKS_AT_ONCE):
            if self.bridge.due > self.now:
                break
            self.bridge.tick(self.now)
            self._flush()
        else:
            raise AssertionError(f"the bridge spins at {self.now}: {self.inside.session.state}")

    def _flush(self) -> None:
        effects = self.bridge.take()
        is_known = self.bridge.is_passing_through or self.bridge.due <= self.inside.session.state.due
        assert is_known, "the line is due before the bridge"
        for effect in effects:
            match effect:
                case SendToBoard(written):
                    for data in written:
                        self._write(data)
                case Datagrams():
                    for peer, frame in effect:
                        if (station := self.stations.get(peer)) is not None:
                            station.carry(frame)
                case RecordFrames():
                    self.recorded += effect
                case PublishGroups(groups):
                    self._published |= groups
                case RememberFlight():
                    self.flight = effect.flight
                case BridgeEvent():
                    self.log_event.append(Event(self.now, effect.level, effect.name_in_log, effect.facts()))
                case TakenBackup():
                    self.backups.append(effect)
                case Save() | Conclude() | Recall() | NoteReader() | FindPending():
                    self._carry_out(effect)
                case MissionEnded():
                    pass

    def _write(self, data: bytes) -> None:
        assert self._plugged
        if self.kind is other.OTHER_MAVLINK:
            # Frames from ground stations to an autopilot that speaks MAVLink itself.
            (passed,) = MavlinkSplitter().feed(data)
            assert passed.raw == data
        elif self.kind is harakiri.MAVLINK and data[0] == MAGIC_V1:
            # The board counts hazard runs.
            (sent,) = MavlinkSplitter().feed(data)
            assert sent.raw == data
            assert effect_of(sent) in (Effect.READ, Effect.DIALOGUE, Effect.CHANGE), sent
        else:
            rubbed_out = b"\x7f" if isinstance(self.inside.session.state, Cli) else b""
            assert is_clean(data) or self.kind in _TAKES_ANY_BYTE, data.hex()
            for frame in _whole_frames(data.rstrip(rubbed_out)):
                self._assert_has_right(frame)
        speed = self.inside.session.state.speed
        self.written.append((self.now, speed, data))
        self.naze.receive(garble(data, speed, self.naze.baud) if speed else data, self.now)

    def _assert_has_right(self, frame: MspFrame) -> None:
        """A board is asked what its kind is only as far as that is known. One request changes a flight."""
        controller = self.inside.session.state.controller
        if frame.command == SET_WP_INDEX:
            assert controller is not None
            assert (controller.firmware, self.bridge.vehicle.armed) == (Firmware.INAV, True)
            return
        firmware = None if controller is None else controller.firmware
        rights = _RIGHTS_IN_SEARCH if controller is None else _RIGHTS
        assert not rights.isdisjoint(_effects(firmware, frame.command, frame.payload)), (firmware, frame)

    def _carry_out(self, effect: StoreEffect) -> None:
        def answer() -> None:
            self.bridge.store_answered(effect, self.store.carry_out(effect), self.now)
            self._flush()

        self.after(self.store.delay_s, answer)


@lru_cache(4096)  # the same few requests are sent over and over
def _whole_frames(data: bytes) -> tuple[MspFrame, ...]:
    """The frames in these bytes, which must be nothing else."""
    frames = tuple(MspParser().feed(data))
    assert b"".join(frame.encode() for frame in frames) == data, f"not whole frames: {data.hex()}"
    return frames


@lru_cache(4096)
def _effects(firmware: Firmware | None, command: int, payload: bytes) -> frozenset[Effect]:
    """The effect of a request on this board; on each possible one if it is None."""
    boards = Firmware if firmware is None else (firmware,)
    return frozenset(msp_right(board, command, payload).effect for board in boards)


def ready_world(
    options: SimOptions | None = None, faults: Faults | None = None, *, within_s: float = 20.0, **others: Any
) -> World:
    """A world at 115200 baud whose board has been found; `others`: as of a World."""
    world = World(options, faults, speeds=(115200,), **others)
    world.wait_ready(within_s)
    return world


def flash_holding(records: Sequence[WpRecord], options: SimOptions | None = None) -> bytes:
    """Flash of a board in use: one slot has a list, the other the remains of an earlier one."""
    options = options or SimOptions()
    memory = bytearray((ERASED,)) * flash_size(options)
    slots = MissionSlots(NorFlash(memoryview(memory), Faults()), options)
    for index, record in enumerate(records):
        slots.stage(index, record.pack())
    slots.commit(identify(records))
    pages = slot_pages(options.capacity)
    for page in range(pages, 2 * pages):  # of the second slot: the first list on new flash goes into the first slot
        memory[page * PAGE_SIZE + PAGE_SIZE // 2] = 0
    return bytes(memory)


class GroundStation:
    """A MAVLink ground station on a radio link. `received` has all received messages; `on_message` reacts to them."""

    def __init__(
        self,
        world: World,
        name: Hashable = "gcs",
        *,
        sysid: int = 255,
        compid: int = 190,
        version: int = 2,
        radio: Radio | None = None,
    ) -> None:
        self.world = world
        self.peer = Peer("udp", name)
        self.version = version
        self.radio = radio or Radio()
        self._received: list[tuple[float, Message]] = []
        # pymavlink takes a twentieth of a test's time, so it decodes only frames that are looked at.
        self._undecoded: list[tuple[float, bytes]] = []
        self.frames: list[bytes] = []
        self.on_message: list[Callable[[Message], None]] = []
        self._mavlink = messages.MAVLink(None, srcSystem=sysid, srcComponent=compid)
        #: Dialect `all`, which has more messages than the bridge's own dialect.
        self._decoder = every_message.MAVLink(None)
        self.sysid, self.compid = sysid, compid
        self.heartbeat = messages.MAVLink_heartbeat_message(
            messages.MAV_TYPE_GCS, messages.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3
        )
        world.stations[self.peer] = self

    @property
    def received(self) -> list[tuple[float, Message]]:
        """All received messages, each with its time."""
        self._received += [(at, self._decoder.decode(bytearray(frame))) for at, frame in self._undecoded]
        self._undecoded.clear()
        return self._received

    def send(self, message: Message, *, wait_s: float = 0.0) -> None:
        data = self.pack(message)
        self._transmit(lambda: self.world.receive_from(self, data))
        self.world.run(wait_s)

    def ask(self, message: Message, *, wait_s: float = 0.0) -> list[Message]:
        """Forget earlier messages and send one; the messages received meanwhile."""
        self.take()
        self.send(message, wait_s=wait_s)
        return self.messages()

    def stay_connected(self, *, wait_s: float = 0.0) -> "GroundStation":
        """Send a heartbeat each second from now on."""
        self._beat()
        self.world.run(wait_s)
        return self

    def _beat(self) -> None:
        self.send(self.heartbeat)
        self.world.after(1.0, self._beat)

    def sign(self, key: bytes, timestamp: int, link_id: int = 0) -> None:
        signing = self._mavlink.signing
        signing.secret_key, signing.timestamp, signing.link_id, signing.sign_outgoing = key, timestamp, link_id, True

    def pack(self, message: Message) -> bytes:
        data = bytes(message.pack(self._mavlink, force_mavlink1=self.version == 1))
        self._mavlink.seq = (self._mavlink.seq + 1) % 256
        return data

    def carry(self, frame: bytes) -> None:
        """Deliver a frame from the bridge over the link."""
        self._transmit(lambda: self._arrived(frame))

    def take(self, *types: str) -> list[Message]:
        """Return the received messages of these types and clear all received ones."""
        found = self.messages(*types)
        self.received.clear()
        return found

    def messages(self, *types: str) -> list[Message]:
        return [message for _, message in self.received if not types or message.get_type() in types]

    def is_target_of(self, message: Message) -> bool:
        """True if a message is addressed to exactly this station, as Mission Planner requires."""
        address = (getattr(message, "target_system", None), getattr(message, "target_component", None))
        return address == (self.sysid, self.compid)

    def texts(self) -> list[str]:
        """All texts; the pieces of long ones separately, without their padding."""
        return [message.text.rstrip() for message in self.messages("STATUSTEXT")]

    def _arrived(self, frame: bytes) -> None:
        found = MavlinkSplitter().feed(frame, is_end=True)
        assert b"".join(each.raw for each in found) == frame, f"not whole frames: {frame.hex()}"
        assert len(found) == 1 or len(frame) <= 280
        for each in found:
            self.frames.append(each.raw)
            self._undecoded.append((self.world.now, each.raw))
            if each.msgid in (messages.MAVLINK_MSG_ID_PING, messages.MAVLINK_MSG_ID_TIMESYNC):
                self._answer(*(message for _, message in self.received[-2:]))
            if self.on_message:
                message = self.received[-1][1]
                for react in self.on_message:
                    react(message)

    def _answer(self, before: Message, message: Message | None = None) -> None:
        """Answer a question with a text as Mission Planner, QGroundControl and MAVSDK do; others are the test's."""
        if message is None or before.get_type() != "STATUSTEXT":
            return
        if message.get_type() == "TIMESYNC" and message.tc1 == 0:
            self.send(messages.MAVLink_timesync_message(1 + round(self.world.now * 1e9), message.ts1))
        elif message.get_type() == "PING" and message.target_system == 0:
            ids = message.get_srcSystem(), message.get_srcComponent()
            self.send(messages.MAVLink_ping_message(message.time_usec, message.seq, *ids))

    def _transmit(self, arrive: Callable[[], None]) -> None:
        chance, radio = self.world.random, self.radio
        for _ in range(1 + (chance.random() < radio.repeat)):
            if chance.random() < radio.loss:
                continue
            delay = radio.delay_s + chance.random() * radio.spread_s
            if delay:
                self.world.after(delay, arrive)
            else:
                # At once, but after the current event: a ground station never replies from within the bridge.
                self.world.at(self.world.now, arrive)
