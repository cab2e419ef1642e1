# SPDX-License-Identifier: GPL-3.0-or-later

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.support.benches import Starter
from tests.support.programs import Daemon


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Starter]:
    with ExitStack() as stack:
        yield Starter(tmp_path, stack)


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    """A daemon with its built-in simulated Naze."""
    with ExitStack() as stack:
        daemon = Starter(tmp_path_factory.mktemp("daemon"), stack).daemon("sim:")
        daemon.wait()
        yield daemon
