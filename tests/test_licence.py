# SPDX-License-Identifier: GPL-3.0-or-later
"""Every source file begins with its licence."""

import subprocess
from pathlib import Path

_REPOSITORY = Path(__file__).parents[1]
_SOURCES = ("*.py", "*.c", "*.h", "*.sh", "*.js", "*.css", "Makefile", "*/Makefile")


def test_every_source_names_the_licence() -> None:
    listed = subprocess.run(["git", "ls-files", *_SOURCES], cwd=_REPOSITORY, capture_output=True, text=True, check=True)
    files = listed.stdout.split()
    assert len(files) > 300
    silent = [name for name in files if "SPDX-License-Identifier: " not in (_REPOSITORY / name).read_text()[:200]]
    assert silent == []
