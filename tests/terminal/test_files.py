# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that the user names are read whole and replaced in one step."""

import os
from pathlib import Path

import pytest

from protocols.param_file import ParamFileError
from terminal.files import read_file, write_file


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    file, link = tmp_path / "real", tmp_path / "link"
    file.write_text("old")
    link.symlink_to(file)
    write_file(link, "new", ParamFileError)
    assert (file.read_text(), link.is_symlink()) == ("new", True)


@pytest.mark.parametrize("name", ["/dev/null", "."])
def test_only_regular_files_are_replaced(name: str) -> None:
    with pytest.raises(ParamFileError, match="not a regular file"):
        write_file(Path(name), "text", ParamFileError)


def test_a_file_of_more_than_8_mib_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "large"
    file.touch()
    os.truncate(file, 8 * 2**20 + 1)
    with pytest.raises(ParamFileError):
        read_file(file, ParamFileError)


def test_a_missing_file_is_the_callers_error() -> None:
    with pytest.raises(ParamFileError, match="No such file or directory; check the path"):
        read_file(Path("none.param"), ParamFileError)
