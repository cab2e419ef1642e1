# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge firmware` through a daemon, on the simulated Naze's boot loader: in real time, at 115200 baud."""

from pathlib import Path

import pytest

from simulator.naze.whole_flash import stand_in
from tests.support.benches import Starter
from tests.support.programs import Program, happens, run_naze_bridge, until

_BOARD = ("--no-extension", "--boot", "300")
#: Reading the whole flash takes 15 s on the wire.
_LONGEST_S = 180.0


class FlashingBench:
    """A daemon on a Harakiri without the patch, and an image with it."""

    def __init__(self, start: Starter, *board: str) -> None:
        self._start = start
        self.bench = start.bench(*(board or _BOARD))
        self.state_dir = self.bench.daemon.state_dir
        self.image = start.directory / "patched.bin"
        self.image.write_bytes(stand_in(patched=True).ljust(3000, b"\x5a"))

    def begin(self, *words: str) -> Program:
        return self._start.program(f"{words[0]}.log", "firmware", *words, "--state-dir", str(self.state_dir))

    def flash(self, *words: str) -> tuple[int, str]:
        """The exit status and the output of a command, on one line."""
        program = self.begin(*words)
        assert happens(lambda: not program.is_alive, _LONGEST_S), program.printed
        return program.end(), " ".join(program.printed.split())

    @property
    def controller(self) -> str:
        return str((self.bench.daemon.status() or {}).get("flight_controller"))

    @property
    def backups(self) -> list[Path]:
        return sorted((self.state_dir / "firmware").glob("*.bin"))


@pytest.fixture
def flashing(start: Starter) -> FlashingBench:
    return FlashingBench(start)


def test_settings_that_the_new_firmware_has_forgotten_are_restored(start: Starter) -> None:
    flashing = FlashingBench(start, "--boot", "300")
    daemon = ("--state-dir", flashing.state_dir)
    run_naze_bridge("settings", "set", "gps_wp_radius", "345", *daemon)
    assert run_naze_bridge("settings", "save", *daemon).returncode == 0
    flashing.image.write_bytes(stand_in(patched=True, version=2))
    status, said = flashing.flash("flash", str(flashing.image), "--battery")
    assert status == 0, said
    assert "It began with its default settings. 1 setting restored, saved and verified." in said
    assert run_naze_bridge("settings", "get", "gps_wp_radius", *daemon).stdout == "345\n"


def test_after_an_unplugged_cable_the_board_waits_and_the_backup_leads_back(flashing: FlashingBench) -> None:
    board = flashing.bench.board
    # Writing and verifying it takes ten seconds after the backup.
    flashing.image.write_bytes(stand_in(patched=True).ljust(60_000, b"\x5a"))
    program = flashing.begin("flash", str(flashing.image), "--battery")
    assert happens(lambda: bool(flashing.backups), _LONGEST_S), program.printed
    board.set("unplug")
    assert happens(lambda: not program.is_alive, _LONGEST_S), program.printed
    assert program.end() == 1
    assert "The board stays in its boot loader: run the same command again" in " ".join(program.printed.split())
    assert board.stats()["power"] == "BOOTLOADER"
    board.set("plug")
    (backup,) = flashing.backups
    status, said = flashing.flash("restore", str(backup))
    assert status == 0, said
    assert flashing.controller == "Harakiri without the mission extension"


def test_without_a_daemon_the_patch_is_flashed_after_a_backup_and_must_answer(start: Starter) -> None:
    board, image, state_dir = start.board(*_BOARD), start.directory / "patched.bin", start.directory / "mine"
    image.write_bytes(stand_in(patched=True))
    words = ("--battery", "--fc", str(board.link), "--state-dir", str(state_dir))
    program = start.program("flash.log", "firmware", "flash", str(image), *words)
    assert happens(lambda: not program.is_alive, _LONGEST_S), program.printed
    status, said = program.end(), " ".join(program.printed.split())
    assert status == 0, said
    assert said.startswith(
        "Harakiri with the mission extension runs; the flash was verified. Backup of the previous flash:"
    )
    (backup,) = (state_dir / "firmware").glob("*.bin")
    assert str(backup) in said
    assert len(backup.read_bytes()) == 128 * 1024
    assert backup.with_suffix(".txt").read_text().startswith("Config:\nFW: simulated\n")


def test_without_a_daemon_a_battery_is_noticed_before_the_first_change(start: Starter) -> None:
    # At 9600 baud a round of polls takes longer than identifying the flight controller.
    board, image = start.board(*_BOARD, "--baud", "9600"), start.directory / "patched.bin"
    image.write_bytes(stand_in(patched=True))
    ended = run_naze_bridge("firmware", "flash", image, "--fc", f"{board.link},9600")
    assert (ended.returncode, "a battery is connected" in ended.stderr) == (1, True), ended
    assert not board.stats()["bootloader_entered"]


def test_armed_boards_and_boards_with_a_battery_are_refused_untouched(flashing: FlashingBench) -> None:
    bench = flashing.bench
    until(lambda: (bench.daemon.status() or {}).get("battery_v"), "the battery's voltage")
    status, said = flashing.flash("flash", str(flashing.image))
    assert (status, "Nothing was changed: a battery is connected" in said) == (1, True), said
    bench.board.set("armed 1")
    until(lambda: (bench.daemon.status() or {}).get("armed"), "the arming")
    status, said = flashing.flash("flash", str(flashing.image), "--battery")
    assert (status, "Nothing was changed: the craft is armed" in said) == (1, True), said
    assert not bench.board.stats()["bootloader_entered"]
    assert flashing.controller == "Harakiri without the mission extension"
