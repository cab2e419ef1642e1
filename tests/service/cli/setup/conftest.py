# SPDX-License-Identifier: GPL-3.0-or-later

from pathlib import Path

import pytest

from tests.service.cli.setup.test_steps import MODELS
from tests.support.setup_pi import Pi


@pytest.fixture(params=MODELS)
def model(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def pi(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Pi:
    return Pi(tmp_path, monkeypatch)
