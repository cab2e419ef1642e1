# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures for the status page's tests."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from tests.support.chromium import Browsers
from tests.support.web_bench import WebBench, web_bench


@pytest.fixture(scope="session")
def browsers() -> Iterator[Browsers]:
    """Chromium for all tests of a worker."""
    with closing(Browsers()) as opened:
        yield opened


@pytest.fixture
def web(tmp_path: Path) -> Iterator[WebBench]:
    """A daemon with its page and a board for one test."""
    with web_bench(tmp_path) as bench:
        yield bench


@pytest.fixture(scope="module")
def shared_web(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WebBench]:
    """A page and a board for the tests of a module that leave them usable; the store has one mission."""
    with web_bench(tmp_path_factory.mktemp("web")) as bench:
        bench.push_example()
        yield bench
