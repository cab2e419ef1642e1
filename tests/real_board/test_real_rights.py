# SPDX-License-Identifier: GPL-3.0-or-later
"""No request that a read-only share lets through changes anything on the image, whatever the one before it was.

The firmware reads what is missing in a payload from the buffer that the previous request, or the extension's previous
reply, filled: so requests are tried in pairs. For an image without the patch: `make real-board ARGS="-k rights"`.
"""

from collections.abc import Iterator
from itertools import product

from protocols.msp.frame import Direction, MspFrame, request
from protocols.msp.mission import INFO_REQUEST, MissionCommand
from protocols.rights import Effect
from protocols.rights.msp import MSP_RIGHTS, Firmware
from simulator.board.simulated_board import Power
from simulator.emulated_naze.board import EmulatedNaze
from simulator.emulated_naze.image import Image
from tests.support.real_bench import IDENT, Figure, RealBench
from tests.support.share_program import ShareProgram
from tests.support.world import World

_LENGTHS = (0, 1, 2, 7, 16, 58, 64, 243)
#: The two waypoints that Harakiri has, and bits that would put ARM on every switch.
_FILLS = (0x00, 0x10, 0xFF)
_SWITCH_ON_US = 2000
_BOOT_S = 20.0
_STICKS_S = 5.0
#: Time for a scheduled write of the configuration, and for what a request starts.
_SETTLED_S = 3.0


class Watch:
    """What must stay: the configuration in RAM, the flash, the armed flag, and that the board runs."""

    def __init__(self, naze: EmulatedNaze, image: Image) -> None:
        self._naze = naze
        self._at = image.symbols["cfg"]
        self._size = min(address for address in image.symbols.values() if address > self._at) - self._at
        self._flag = image.symbols["f"] + 1
        self._cfg, self._flash, self._armed = self._configuration(), bytes(naze.flash), naze.armed

    def _configuration(self) -> bytes:
        return self._naze.peek(self._at, self._size)

    def changes(self) -> str:
        """What has changed, and bring it back as far as possible, for the next request."""
        naze, counters = self._naze, self._naze.counters
        found = {
            "configuration": self._configuration() != self._cfg,
            "flash": naze.flash != self._flash,
            "armed" if naze.armed else "disarmed": naze.armed is not self._armed,
            "reset": naze.power is not Power.RUNNING or bool(counters.resets),
        }
        naze.poke(self._at, self._cfg)
        naze.poke(self._flag, bytes((self._armed,)))
        naze.flash[:] = self._flash
        counters.resets = 0
        return ", ".join(name for name, has_changed in found.items() if has_changed)


def all_requests() -> Iterator[MspFrame]:
    for command, size in product(range(255), _LENGTHS):
        for fill in _FILLS if size else (0,):
            yield MspFrame(Direction.REQUEST, command, bytes((fill,)) * size)


def set_switches(naze: EmulatedNaze) -> None:
    faults = naze.faults
    faults.aux1 = faults.aux2 = faults.aux3 = faults.aux4 = _SWITCH_ON_US


def test_a_read_only_share_cannot_change_settings(image: Image, flash: bytes, figure: Figure) -> None:
    world = World(speeds=(115200,), peer=EmulatedNaze(image, flash=memoryview(bytearray(flash))))
    set_switches(world.naze)
    world.wait_until(lambda w: w.bridge.vehicle.armed is False and not w.bridge.is_busy, _BOOT_S)
    through_share(world, image, figure, "disarmed")
    world.naze.faults.armed = True
    world.wait_until(lambda w: w.naze.armed and w.bridge.vehicle.armed is True, _STICKS_S)
    through_share(world, image, figure, "armed")


def through_share(world: World, image: Image, figure: Figure, state: str) -> None:
    """Send every request, then every one that is let through after each that fills the buffer."""
    watch = Watch(world.naze, image)
    requests = list(all_requests())
    let_through: list[MspFrame] = []
    found: dict[str, str] = {}
    for frame in requests:
        if ask(world, frame):
            let_through.append(frame)
            found[name(frame)] = watch.changes()
    sent = len(let_through)
    for first in filter(fills_buffer, let_through):
        for second in let_through:
            sent += ask(world, first) + ask(world, second)
            found[f"{name(second)} after {name(first)}"] = watch.changes()
    world.run(_SETTLED_S)
    found["in the end"] = watch.changes()
    found = {pair: changed for pair, changed in found.items() if changed}
    figure(f"read-only share, {state}", f"{len(let_through)} of {len(requests)} requests let through")
    figure(f"read-only share, {state}: with pairs", f"{sent} sent, {len(found)} changed something")
    assert not found, f"{len(found)}: {dict(list(found.items())[:20])}"
    assert world.is_found


def fills_buffer(frame: MspFrame) -> bool:
    """True if a request leaves bytes in the receive buffer: its payload, or the extension's reply."""
    return bool(frame.payload) or frame.command in MissionCommand.__members__.values()


def ask(world: World, frame: MspFrame) -> bool:
    """Send a request through a read-only share and wait for its end; True if it reached the board."""
    world.written.clear()
    ShareProgram(world).outcome(frame.command, frame.payload)
    return request(frame.command, frame.payload) in [data for _, _, data in world.written]


def name(frame: MspFrame) -> str:
    return f"{frame.command} with {len(frame.payload)} bytes {frame.payload[:1].hex()}"


def test_no_read_of_the_table_changes_anything(image: Image, flash: bytes, figure: Figure) -> None:
    """Sent to the board itself, in every order of pairs, disarmed and armed."""
    bench = RealBench(image, flash)
    set_switches(bench.naze)
    info = bench.ask(INFO_REQUEST)
    is_patched = info is not None and info.direction is Direction.REPLY
    firmware = Firmware.HARAKIRI_MISSIONS if is_patched else Firmware.HARAKIRI
    reads = [
        (request(command, payload), right.reply)
        for command, right in MSP_RIGHTS[firmware].items()
        if right.effect is Effect.READ
        for payload in right.only or {bytes((fill,)) * size for size in right.lengths for fill in _FILLS}
    ]
    for is_armed in (False, True):
        bench.arm(is_armed)
        watch = Watch(bench.naze, image)
        found: dict[tuple[str, str], str] = {}
        for (first, _), (second, largest) in product(reads, repeat=2):
            bench.ask(first)
            answer = bench.ask(second)
            assert answer is not None
            assert len(answer.payload) <= largest
            found[first.hex(), second.hex()] = watch.changes()
        bench.run(_SETTLED_S)
        found["in", "the end"] = watch.changes()
        found = {pair: changed for pair, changed in found.items() if changed}
        state = "armed" if is_armed else "disarmed"
        figure(f"pairs of {len(reads)} reads, {state}", f"{len(reads) ** 2} sent, {len(found)} changed something")
        assert not found
    assert bench.ask(IDENT) is not None
