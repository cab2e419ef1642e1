# SPDX-License-Identifier: GPL-3.0-or-later
"""The size of the installed program without the simulator, in lines of .py, .js, .css and .html: it may only fall.

A change that needs more lines than are left removes others first. After a removal, set the ceilings to what is counted.
"""

from pathlib import Path

import pytest

_ROOT = Path(__file__).resolve().parents[1]
_SUFFIXES = {".py", ".js", ".css", ".html"}
_INSTALLED = ("bridge", "protocols", "service", "storage", "fleet", "payloads", "terminal", "reports")
#: Raised twice: the texts for pilots are in a table of their own (bridge/voice), and data from a vehicle of the
#: fleet, a board or the state folder is bounded where it is read.
CEILINGS = {_INSTALLED: 41_920, ("bridge",): 17_782}


def lines(packages: tuple[str, ...]) -> int:
    files = (file for package in packages for file in (_ROOT / package).rglob("*") if file.suffix in _SUFFIXES)
    return sum(len(file.read_bytes().splitlines()) for file in files)


@pytest.mark.parametrize("packages", CEILINGS, ids=len)
def test_the_program_does_not_grow(packages: tuple[str, ...]) -> None:
    counted, ceiling = lines(packages), CEILINGS[packages]
    assert counted <= ceiling, f"{', '.join(packages)}: {counted} lines, {counted - ceiling} more than the ceiling"
