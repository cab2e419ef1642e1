# SPDX-License-Identifier: GPL-3.0-or-later

from pathlib import Path

import pytest

from tests.support.fixable_pi import FixablePi


@pytest.fixture
def pi(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FixablePi:
    return FixablePi(tmp_path / "root", monkeypatch)
