# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands are listed and suggested without being imported."""

import subprocess
import sys

import pytest

from tests.support.programs import run_naze_bridge


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["psuh"], "did you mean 'push'?"),
        (["missions", "lst"], "did you mean 'list'?"),
        (["fleet", "wacth"], "did you mean 'watch'?"),
        (["status", "--jsn"], "Did you mean"),
    ],
)
def test_a_misspelt_word_gets_a_suggestion(words: list[str], hint: str) -> None:
    ended = run_naze_bridge(*words)
    assert ended.returncode == 2
    assert ended.stderr.startswith("naze-bridge: ")
    assert hint in ended.stderr


def test_the_list_of_commands_does_not_import_them() -> None:
    program = "import sys; from service.cli.main import main\ntry: main(['-h'])\nfinally: print(*sys.modules)"
    printed = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False).stdout
    assert "Commands:" in printed
    assert not {"asyncio", "pymavlink", "rich", "structlog"} & set(printed.split())
