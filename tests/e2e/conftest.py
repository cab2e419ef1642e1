# SPDX-License-Identifier: GPL-3.0-or-later

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.benches import Bench, Starter
from tests.support.plan import plain_plan
from tests.support.programs import until


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Starter]:
    with ExitStack() as stack:
        yield Starter(tmp_path, stack)


@pytest.fixture
def bench(start: Starter) -> Iterator[Bench]:
    """A bench for a single test, which may break it."""
    bench = start.bench()
    yield bench
    bench.board.assert_unharmed()


@pytest.fixture(scope="module")
def module_bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with ExitStack() as stack:
        bench = Starter(tmp_path_factory.mktemp("shared"), stack).bench()
        yield bench
        bench.board.assert_unharmed()


@pytest.fixture
def shared(module_bench: Bench) -> Iterator[Bench]:
    """A bench shared by the tests of a module that leave only missions behind; each test has its own clients.

    Each test starts with an empty board and after any earlier transfer: the daemon waits 5 s for missing items.
    """
    until(module_bench.daemon.try_clear, "the end of an earlier test's transfer")
    with ExitStack() as stack:
        yield replace(module_bench, stack=stack)


@pytest.fixture
def kept(shared: Bench) -> list[str]:
    """The shared board's list before a test that must not change it."""
    shared.daemon.push(plain_plan(12))
    return shared.board.records()
