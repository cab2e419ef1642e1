# SPDX-License-Identifier: GPL-3.0-or-later

from pathlib import Path

import pytest

from tests.support.faulty_machine import FaultyMachine


@pytest.fixture
def pi(tmp_path: Path) -> FaultyMachine:
    return FaultyMachine(tmp_path / "root")
