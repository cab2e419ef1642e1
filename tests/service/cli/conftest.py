# SPDX-License-Identifier: GPL-3.0-or-later

from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from tests.support.benches import Starter
from tests.support.programs import Daemon


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    """A daemon with its built-in simulated Naze."""
    with ExitStack() as stack:
        daemon = Starter(tmp_path_factory.mktemp("cli"), stack).daemon("sim:")
        daemon.wait()
        yield daemon
