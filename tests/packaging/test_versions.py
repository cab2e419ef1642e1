# SPDX-License-Identifier: GPL-3.0-or-later
"""Versions from git tags, and a release, each in a copy of this repository."""

import itertools
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from deb.build import debian_version
from deb.release import cut, released_versions, section
from deb.sign import ReleaseError
from service.cli.helper.signature import check_signature
from tests.service.cli.helper.test_packages import packed
from tests.support.release_key import ReleaseKey

_REPOSITORY = Path(__file__).resolve().parents[2]
_NEWEST = released_versions((_REPOSITORY / "CHANGELOG.md").read_text())[0]
_CHANGELOG = """# Changelog

## Unreleased

### Added

- A thing.

### Changed

### Fixed

- A fault.

## 0.2.0 - 2026-01-01

- Old.
"""


class Clone:
    """A copy of this repository's commit, with a person who may commit, and no tags."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.run("git", "clone", "--quiet", "--no-tags", str(_REPOSITORY), str(folder), inside=False)
        for key, value in (("user.name", "A"), ("user.email", "a@example.org"), ("commit.gpgsign", "false")):
            self.run("git", "config", key, value)

    def has_key(self, key: ReleaseKey) -> None:
        """Make it the maintainer's."""
        self.run("git", "config", "gpg.format", "ssh")
        self.run("git", "config", "user.signingkey", str(key.file))
        shutil.copy(key.signers, self.folder / "deb")
        self.run("git", "add", "deb/signers")
        self.run("git", "commit", "--quiet", "--message", "key")

    def run(self, *command: str, inside: bool = True) -> str:
        environment = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
        done = subprocess.run(
            command, cwd=self.folder if inside else None, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout.strip()

    def version(self, folder: Path | None = None) -> str:
        return self.run(sys.executable, "-m", "hatchling", "version", *([] if folder is None else [str(folder)]))

    def commit(self, name: str) -> None:
        (self.folder / name).write_text("text\n")
        self.run("git", "add", "--all")
        self.run("git", "commit", "--quiet", "--message", name)

    def release(self, version: str) -> str:
        script = f"from deb import release; print(release.release({version!r}, ()))"
        return self.run(sys.executable, "-c", script)


@pytest.fixture
def clone(tmp_path: Path) -> Clone:
    return Clone(tmp_path / "clone")


def sorts_before(first: str, second: str) -> bool:
    return subprocess.run(["dpkg", "--compare-versions", first, "lt", second], check=False).returncode == 0


def test_the_fallback_is_the_newest_release() -> None:
    settings = tomllib.loads((_REPOSITORY / "pyproject.toml").read_text())
    assert settings["tool"]["hatch"]["version"]["fallback-version"] == _NEWEST


def test_a_version_comes_from_the_tag_and_the_commits_after_it(clone: Clone) -> None:
    untagged = clone.version()
    assert untagged.startswith(f"{_NEWEST[:-1]}{int(_NEWEST[-1]) + 1}.dev")
    clone.run("git", "tag", "7.1.0")
    assert clone.version() == "7.1.0"
    clone.commit("one")
    clone.commit("two")
    commit = clone.run("git", "rev-parse", "--short=7", "HEAD")
    assert clone.version().startswith(f"7.1.1.dev2+g{commit}")


def test_without_git_an_archive_has_the_commits_version_or_the_newest_releases(clone: Clone, tmp_path: Path) -> None:
    clone.run("git", "tag", "7.1.0")
    folder = tmp_path / "archive"
    folder.mkdir()
    packed = subprocess.run(["git", "-C", clone.folder, "archive", "HEAD"], capture_output=True, check=True).stdout
    subprocess.run(["tar", "-x", "-C", folder], input=packed, check=True)
    ask = (sys.executable, "-m", "hatchling", "version")
    told = subprocess.run(ask, cwd=folder, capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "7.1.0"
    (folder / ".git_archival.txt").unlink()
    told = subprocess.run(ask, cwd=folder, capture_output=True, text=True, check=True)
    assert told.stdout.strip() == _NEWEST


def test_debians_order_is_that_of_the_releases() -> None:
    versions = ["0.2.0rc1", "0.2.0", "0.2.1.dev2+gabc1", "0.2.1.dev12+g1234567.d20261123", "0.2.1"]
    debian = [debian_version(version) for version in versions]
    assert debian == ["0.2.0~rc1", "0.2.0", "0.2.1~dev2+gabc1", "0.2.1~dev12+g1234567.d20261123", "0.2.1"]
    assert all(sorts_before(first, second) for first, second in itertools.pairwise(debian))


def test_a_cut_makes_a_section_of_the_unreleased_changes() -> None:
    changed = cut(_CHANGELOG, "0.3.0", "2026-02-02")
    assert section(changed, "Unreleased") == ""
    assert "## 0.3.0 - 2026-02-02" in changed
    assert section(changed, "0.3.0") == "### Added\n\n- A thing.\n\n### Fixed\n\n- A fault."
    assert released_versions(changed) == ["0.3.0", "0.2.0"]
    with pytest.raises(ReleaseError, match="nothing to release"):
        cut(changed, "0.4.0", "2026-03-03")


def test_a_release_is_tagged_built_summed_and_signed(clone: Clone, tmp_path: Path) -> None:
    key = ReleaseKey(tmp_path / "key")
    clone.has_key(key)
    (clone.folder / "CHANGELOG.md").write_text(_CHANGELOG.replace("0.2.0", _NEWEST))
    clone.run("git", "commit", "--quiet", "--all", "--message", "changes")
    folder = Path(clone.release("97.0.0").splitlines()[-1])
    assert folder == clone.folder / "dist" / "97.0.0"
    assert clone.run("git", "describe", "--tags") == "97.0.0"
    assert clone.run("git", "tag", "--list", "--format=%(contents:body)", "97.0.0").startswith("### Added")
    assert clone.run("git", "status", "--porcelain") == ""
    assert {path.name for path in folder.iterdir()} == {
        *("naze_bridge-97.0.0-py3-none-any.whl", "naze_bridge-97.0.0.tar.gz"),
        *("SHA256SUMS", "SHA256SUMS.sig", "NOTES.md"),
    }
    subprocess.run(["sha256sum", "--check", "--quiet", "SHA256SUMS"], cwd=folder, check=True)
    assert "BEGIN SSH SIGNATURE" in clone.run("git", "cat-file", "tag", "97.0.0")
    named = ("-I", "naze-bridge", "-n", "file", "-s", "SHA256SUMS.sig")
    check = ["ssh-keygen", "-Y", "verify", "-f", str(key.signers), *named]
    subprocess.run(check, cwd=folder, input=(folder / "SHA256SUMS").read_bytes(), capture_output=True, check=True)
    assert (folder / "NOTES.md").read_text() == "### Added\n\n- A thing.\n\n### Fixed\n\n- A fault."
    # The source archive builds the same version without git.
    subprocess.run(["tar", "-xf", folder / "naze_bridge-97.0.0.tar.gz", "-C", clone.folder.parent], check=True)
    ask = (sys.executable, "-m", "hatchling", "version")
    source = clone.folder.parent / "naze_bridge-97.0.0"
    assert subprocess.run(ask, cwd=source, capture_output=True, text=True, check=True).stdout.strip() == "97.0.0"
    # Once more, for example after a failed build: the same tag.
    again = "from deb import release; release.build_python = lambda folder: []; release.release('97.0.0', ())"
    clone.run(sys.executable, "-c", again)


def refusal(clone: Clone, version: str = "97.0.0") -> str:
    attempt = f"try: release.release({version!r}, ())\nexcept release.ReleaseError as error: print(error)"
    return clone.run(sys.executable, "-c", f"from deb import release\n{attempt}")


def test_a_wrong_version_an_unknown_key_and_uncommitted_changes_are_refused(clone: Clone, tmp_path: Path) -> None:
    assert "there is no SSH key to sign with" in refusal(clone)
    clone.has_key(ReleaseKey(tmp_path / "key"))
    for version, reason in (("", "not a version"), ("1.0", "not a version"), ("0.1.0", "not newer")):
        assert reason in refusal(clone, version)
    (clone.folder / "README.md").write_text("other\n")
    assert "uncommitted changes" in refusal(clone)
    clone.run("git", "checkout", "--quiet", "README.md")
    clone.run("git", "config", "user.signingkey", str(ReleaseKey(tmp_path / "other").file))
    assert "is not one of deb/signers" in refusal(clone)
    assert clone.run("git", "tag") == ""


def test_a_package_is_signed_with_the_maintainers_key(clone: Clone, tmp_path: Path) -> None:
    key = ReleaseKey(tmp_path / "key")
    clone.has_key(key)
    package = packed(tmp_path)
    clone.run(sys.executable, "-m", "deb.sign", str(package))
    check_signature(package, key.signers)


def test_the_forge_runs_only_pinned_actions() -> None:
    files = sorted((_REPOSITORY / ".github/workflows").glob("*.yml"))
    used = [
        line.split("uses:")[1].split()[0] for file in files for line in file.read_text().splitlines() if "uses:" in line
    ]
    assert used
    assert [action for action in used if not re.fullmatch(r"[a-z/-]+@[0-9a-f]{40}", action)] == []
