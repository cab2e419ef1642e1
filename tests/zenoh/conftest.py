"""What the tests over zenoh start with."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from benches import Starter


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Starter]:
    with ExitStack() as stack:
        yield Starter(tmp_path, stack)
