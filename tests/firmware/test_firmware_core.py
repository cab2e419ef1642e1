# SPDX-License-Identifier: GPL-3.0-or-later
"""The tests of `make -C firmware test`, and a short run of the core's fuzzer."""

import re
import subprocess
from pathlib import Path

import pytest

from protocols.msp.mission_flight import FlightReason

FIRMWARE = Path(__file__).parents[2] / "firmware"


def make(*arguments: str) -> str:
    """Run make in firmware/ and return its output; skip the test if its tools are missing."""
    run = subprocess.run(["make", "-s", "-C", FIRMWARE, "APT=no", *arguments], capture_output=True, text=True)
    printed = run.stdout + run.stderr
    assert run.returncode == 0, printed
    if "NOT RUN" in printed:
        pytest.skip(printed.strip())
    return printed


def test_core_survives_power_cuts_under_sanitizers() -> None:
    """With the board's word size. Clang builds the 64 bit fuzzers; `make soak` has all cuts in all eight builds."""
    cut_step, flights = 17, 17
    printed = make("gcc-c99-32", f"CUT_STEP={cut_step}", f"TEST_FLIGHTS={flights}")
    cuts = re.findall(r"(?<!steps of )\b(\d+) of (\d+)", printed)
    assert len(cuts) == 4  # of the core's lists and of Harakiri's configuration, and each in the recovery again
    assert all(whole == all_ for whole, all_ in cuts)
    assert int(cuts[0][0]) > 10_000 // cut_step
    assert re.search(r"\d+ checks passed", printed)
    assert re.search(r"mission flight on Harakiri: \d+ checks passed", printed)
    assert f"{flights} lists flown" in printed


def test_core_passes_the_tests_on_an_emulated_cortex_m3() -> None:
    printed = make("test-arm")
    stack = re.search(r"(\d+) bytes at most", printed)
    assert stack is not None
    assert int(stack[1]) <= 256
    assert re.search(r"\d+ checks passed", printed)


_RULES = {
    "none": "",
    "fixed": "{} s",
    "climb": "{} s + 4 times the climb",
    "metre": "{} s + 2 s for each metre",
    "turn": "{} s + 72 s for each turn",
    "record": "its seconds",
    "fix": "`mission_fix`",
}


def test_the_manuals_table_of_flight_states_is_the_cores() -> None:
    rows = [line.split("|") for line in make("flights", "FLIGHTS=--states").splitlines()]
    expected = []
    for name, mode, rule, seconds, then, reason in rows:
        lasting = rule == "none"
        words = FlightReason(int(reason)).name.lower().replace("_", " ") if int(reason) else ""
        cells = [name, mode, _RULES[rule].format(seconds), "" if lasting else then, words]
        expected.append("| " + " | ".join(cells) + " |")
    page = (FIRMWARE.parent / "docs" / "mission-flight.md").read_text()
    table = page.partition("## States")[2].partition("## ")[0]
    assert [re.sub(" +", " ", row) for row in expected] == [
        re.sub(" +", " ", line) for line in table.splitlines() if line.startswith("| ")
    ][1:]


def test_core_stays_small() -> None:
    """Harakiri must have room for the cores and for the changes around them."""
    printed = make("size")
    sizes = re.findall(r"^\s*(\d+)\s+(\d+)\s+(\d+)\s", printed, re.MULTILINE)
    mission, slots, flight, steer = ([int(column) for column in size] for size in sizes)
    assert mission[0] + slots[0] <= 3000
    assert flight[0] + steer[0] <= 9500
    assert all(column == 0 for size in (mission, slots, flight, steer) for column in size[1:])


def test_fuzzer_finds_no_fault_in_a_few_seconds() -> None:
    assert "stat::number_of_executed_units" in make("fuzz", "FUZZ_SECONDS=1")


@pytest.mark.parametrize(("pages", "compiles"), [(128, True), (64, False)])
def test_slots_must_match_the_linker_script(pages: int, compiles: bool) -> None:
    """A build for 64 KB of flash would put the slots into the program's area of stm32_flash.ld."""
    folders = [f"-I{FIRMWARE}", f"-I{FIRMWARE}/tests/harakiri"]
    command = ["gcc", "-std=c99", "-fsyntax-only", f"-DFLASH_PAGE_COUNT={pages}", *folders, "harakiri_flash.c"]
    run = subprocess.run(command, cwd=FIRMWARE, capture_output=True, text=True)
    assert (run.returncode == 0) is compiles
    assert ("slots_lie_where_stm32_flash_ld_says" in run.stderr) is not compiles


@pytest.mark.parametrize("patch", ["TestCode3", "HarakiriWebstore1"])
def test_the_linker_scripts_limit_is_the_slots_address(patch: str) -> None:
    source = (FIRMWARE / "harakiri_flash.c").read_text()
    limit = re.search(r"#define LINKED_BELOW (0x[0-9A-F]{8})u", source)
    assert limit is not None
    assert f"<= {limit[1]}," in (FIRMWARE / "patches" / f"{patch}.patch").read_text()
