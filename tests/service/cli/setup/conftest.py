# SPDX-License-Identifier: GPL-3.0-or-later

import pytest

from tests.service.cli.setup.test_steps import MODELS


@pytest.fixture(params=MODELS)
def model(request: pytest.FixtureRequest) -> str:
    return str(request.param)
