# SPDX-License-Identifier: GPL-3.0-or-later
"""The versions and addresses of installed packages."""

from importlib import metadata
from pathlib import Path

import pytest

from service.machine.package import address, version


@pytest.mark.parametrize("package", ["naze-bridge", "eclipse-zenoh", "pyserial"])
def test_the_version_is_that_of_the_metadata(package: str) -> None:
    assert version(package) == metadata.version(package)


def test_a_package_that_is_not_installed_has_an_unknown_version() -> None:
    assert version("no-such-package") == "unknown"


def test_a_failing_disk_hides_the_version_only(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_path: Path, _pattern: str) -> None:
        raise OSError

    monkeypatch.setattr(Path, "glob", fail)
    assert version() == "unknown"


def test_an_address_is_shown_once_the_project_is_published(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "naze_bridge-9.8.7.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text(
        "Name: naze-bridge\nProject-URL: Repository, https://a/b\nProject-URL: Issues, https://a/OWNER/b\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert (version(), address("Repository"), address("Issues"), address("Other")) == (
        "9.8.7",
        "https://a/b",
        None,
        None,
    )
