# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures for the end-to-end tests."""

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
    """A bench for one test, for tests that break things."""
    bench = start.bench()
    yield bench
    bench.board.assert_was_treated_well()


@pytest.fixture(scope="module")
def lasting_bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with ExitStack() as stack:
        bench = Starter(tmp_path_factory.mktemp("shared"), stack).bench()
        yield bench
        bench.board.assert_was_treated_well()


@pytest.fixture
def shared(lasting_bench: Bench) -> Iterator[Bench]:
    """The bench of all tests of a module that leave no trace but missions; the clients are one test's own.

    Each test finds an empty board, and no transfer that the one before left behind: the daemon waits 5 s for its items.
    """
    until(lasting_bench.daemon.clears, "the end of a transfer that an earlier test began")
    with ExitStack() as stack:
        yield replace(lasting_bench, stack=stack)


@pytest.fixture
def kept(shared: Bench) -> list[str]:
    """What the shared board holds before a test that must change nothing."""
    shared.daemon.push(plain_plan(12))
    return shared.board.records()
