# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that a person, another user or an older release made: none can hang the reader or fill its memory."""

import os
from pathlib import Path

import pytest

from storage.small_files import read_bounded


def test_a_file_is_read_up_to_the_maximum_size(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(bytes(1024))
    assert read_bounded(path, 1024) == bytes(1024)
    with pytest.raises(OSError, match="larger than"):
        read_bounded(path, 1023)


def test_a_pipe_without_a_writer_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="not a regular file"):
        read_bounded(tmp_path / "pipe", 9)


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/tty", "/"])
def test_devices_and_folders_are_refused(path: str) -> None:
    with pytest.raises(OSError):  # noqa: PT011
        read_bounded(Path(path), 9)


def test_links_are_refused_where_another_user_may_make_them(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(__file__)
    assert read_bounded(tmp_path / "link", 1 << 20)
    with pytest.raises(OSError, match="symbolic links"):
        read_bounded(tmp_path / "link", 1 << 20, follows_links=False)
