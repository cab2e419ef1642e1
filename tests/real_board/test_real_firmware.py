# SPDX-License-Identifier: GPL-3.0-or-later
"""The patch flashed over the image without it, on the emulated chip: cuts at every step, power cuts, and the way back.

NAZE_PLAIN_IMAGE is a build of the same tree without the patch.
"""

import os
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest

from bridge.firmware.reflash import FlashingError, find_chip, read_dump, read_flash, rewrite_flash, start_boot_loader
from protocols.msp.mission import INFO_REQUEST, decode_info
from protocols.stm32_boot_loader import Dialogue, start_program
from simulator.board.simulated_board import Power
from simulator.emulated_naze.image import Image, load_image
from tests.support.benches import Starter
from tests.support.boot_loader_bench import CablePulledError, DialogueBench
from tests.support.programs import happens
from tests.support.real_bench import Figure, RealBench

#: A setting that both trees have, and a value that is not the default.
_CHANGED, _VALUE = "fs_delay", 33
_TIMEOUT_S = 400.0


@pytest.fixture(scope="module")
def plain() -> Image:
    path = os.environ.get("NAZE_PLAIN_IMAGE")
    if not path:
        pytest.skip("NOT RUN: needs NAZE_PLAIN_IMAGE, a build without the patch")
    return load_image(Path(path).read_bytes(), path)


@pytest.fixture
def bench(plain: Image) -> RealBench:
    bench = RealBench(plain)
    bench.configure(**{_CHANGED: _VALUE})
    return bench


def enter(bench: RealBench) -> tuple[DialogueBench, str]:
    """Start the boot loader; return the settings printed before."""
    line = DialogueBench(bench.naze, bench.now)
    dump = line.run(read_dump())
    line.run(start_boot_loader())
    assert bench.naze.power is Power.BOOTLOADER
    return line, dump


def flash(program: bytes, mark: Callable[[str], None] = lambda _: None) -> Dialogue[bytes]:
    """Flash, and start the program. Returns the previous flash."""

    def progress(step: str, _done: int, _total: int) -> None:
        mark(step)

    yield from find_chip(5.0, lambda: None)
    present = yield from read_flash(progress)
    yield from rewrite_flash(present, program.ljust(0x1D800, b"\xff") + present[0x1D800:], progress)
    yield from start_program()
    return present


def settings(dump: str) -> list[str]:
    """Without those of mission flight, which only the patch has."""
    return [line for line in dump.splitlines() if " = " in line and not line.startswith("mission_")]


def assert_runs(bench: RealBench, now: float, patched: bool) -> None:
    bench.now = now
    bench.wait_for_boot()
    answer = bench.ask(INFO_REQUEST)
    assert (answer is not None and decode_info(answer.payload) is not None) is patched


def test_the_patch_is_flashed_with_the_settings_and_missions_kept(
    bench: RealBench, image: Image, figure: Figure
) -> None:
    line, dump = enter(bench)
    began = line.now
    before = line.run(flash(image.program))
    figure("flashing the patch over the plain image", f"{line.now - began:.1f} s on the wire")
    assert bytes(bench.flash[0x1D800:]) == before[0x1D800:]
    assert_runs(bench, line.now, patched=True)
    line, after = enter(bench)
    assert f"{_CHANGED} = {_VALUE}" in settings(after)
    assert settings(after) == settings(dump)
    line.run(find_chip(5.0, lambda: None))
    present = line.run(read_flash(lambda *_: None))
    line.run(rewrite_flash(present, before, lambda *_: None))
    line.run(start_program())
    assert_runs(bench, line.now, patched=False)


@pytest.fixture(scope="module")
def cuts(plain: Image, image: Image) -> list[int]:
    """Numbers of sent bytes: in the middle of each step, and just before the first erase."""
    bench = RealBench(plain)
    line, _ = enter(bench)
    at: dict[str, list[int]] = {}
    sent = line.sent
    line.run(flash(image.program, lambda step: at.setdefault(step, []).append(line.sent - sent)))
    return sorted((at["reading"][-1], *(marks[len(marks) // 2] - 3 for marks in at.values())))


def test_a_flash_broken_off_at_any_step_is_resumed(plain: Image, image: Image, cuts: list[int], figure: Figure) -> None:
    figure("cables pulled after so many bytes, then resumed", ", ".join(map(str, cuts)))
    for cut in cuts:
        bench = RealBench(plain)
        line, _ = enter(bench)
        line.cut_after = line.sent + cut
        with pytest.raises(CablePulledError):
            line.run(flash(image.program))
        assert bench.naze.power is Power.BOOTLOADER
        again = DialogueBench(bench.naze, line.now + 3)
        again.run(flash(image.program))
        assert_runs(bench, again.now, patched=True)


@pytest.mark.parametrize("operation", [1, 60, 20_000])
def test_a_flash_with_a_power_cut_is_resumed_by_the_boot_pads(bench: RealBench, image: Image, operation: int) -> None:
    line, dump = enter(bench)
    bench.naze.faults.power_cut_at_flash_operation = operation
    with pytest.raises(FlashingError):
        line.run(flash(image.program))
    assert bench.is_off
    bench.naze.power_on(line.now)
    line.wait(1.0)
    assert bench.naze.power is Power.CRASHED, "half a program runs"
    bench.naze.faults.boot_pads = True
    bench.naze.reset(line.now)
    bench.naze.faults.boot_pads = False
    line.run(flash(image.program))
    assert_runs(bench, line.now, patched=True)
    assert settings(enter(bench)[1]) == settings(dump)


def test_the_daemon_flashes_the_patch_in_real_time(plain: Image, image: Image, tmp_path: Path, figure: Figure) -> None:
    link = tmp_path / "naze"
    with ExitStack() as stack:
        start = Starter(tmp_path, stack)
        board = start.program("board.log", "sim", "--image", os.environ["NAZE_PLAIN_IMAGE"], "--link", str(link))
        assert happens(lambda: "Simulated " in board.printed or not board.is_alive, _TIMEOUT_S), board.printed
        daemon = start.daemon(str(link))
        assert happens(lambda: (daemon.status() or {}).get("armed") is False, _TIMEOUT_S), daemon.printed
        binary = tmp_path / "patched.bin"
        binary.write_bytes(image.program)
        arguments = ("firmware", "flash", str(binary), "--state-dir", str(daemon.state_dir))
        began = time.monotonic()
        flashing = start.program("flash.log", *arguments)
        assert happens(lambda: not flashing.is_alive, _TIMEOUT_S), flashing.printed
        assert flashing.end() == 0, flashing.printed
        figure("naze-bridge firmware flash over a pty", f"{time.monotonic() - began:.0f} s")
        assert (daemon.status() or {})["flight_controller"] == "Harakiri with the mission extension"
        (backup,) = (daemon.state_dir / "firmware").glob("*.bin")
        assert backup.read_bytes().startswith(plain.program)
