# SPDX-License-Identifier: GPL-3.0-or-later

from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from tests.support.links import Links
from tests.support.pi_with_ports import Pi


@pytest.fixture
async def links() -> AsyncIterator[Links]:
    links = Links()
    yield links
    links.close()


@pytest.fixture
def pi(tmp_path: Path) -> Pi:
    return Pi(tmp_path / "root")
