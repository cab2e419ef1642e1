# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests on a real, patched firmware image, which is not in this repository: set NAZE_IMAGE (make real-board)."""

import os
from pathlib import Path

import pytest

from simulator.emulated_naze.image import Image, load_image
from tests.support.real_bench import Figure, RealBench, calibrated_flash

_ROWS = pytest.StashKey[list[tuple[str, str]]]()


@pytest.fixture(scope="session")
def image() -> Image:
    path = os.environ.get("NAZE_IMAGE")
    if not path:
        pytest.skip("NOT RUN: needs a built Harakiri with the patch: make real-board IMAGE=path/to/X.elf")
    return load_image(Path(path).read_bytes(), path)


@pytest.fixture(scope="session")
def flash(image: Image) -> bytes:
    """The flash of a board with a calibrated accelerometer and no list."""
    return calibrated_flash(image)


@pytest.fixture
def bench(image: Image, flash: bytes) -> RealBench:
    return RealBench(image, flash)


@pytest.fixture
def figure(request: pytest.FixtureRequest) -> Figure:
    """Adds a row to the table printed at the end."""
    rows = request.config.stash.setdefault(_ROWS, [])
    return lambda name, value: rows.append((name, str(value)))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    rows = config.stash.get(_ROWS, [])
    if rows:
        terminalreporter.section(f"real board: {Path(os.environ['NAZE_IMAGE']).name}")
        width = max(len(name) for name, _ in rows)
        for name, value in rows:
            terminalreporter.write_line(f"{name:<{width}}  {value}")
