# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a release: `make release VERSION=0.3.0`, or `python -m deb.release 0.3.0` in the project's folder.

It cuts the changelog, commits, tags the commit and builds the source archive, the wheel and the Debian packages in
dist/VERSION, with their checksums and the release notes. The tag, the packages and the checksums are signed with git's
user.signingkey, which must be one of deb/signers. Nothing is pushed. If a step fails, fix its cause and run it again:
finished steps are kept.
"""

import hashlib
import re
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

from deb.build import build, build_python
from deb.sign import ReleaseError, check_key, sign, sign_package

_PROJECT = Path(__file__).resolve().parent.parent
_CHANGELOG = _PROJECT / "CHANGELOG.md"
_PYPROJECT = _PROJECT / "pyproject.toml"
_FALLBACK = re.compile(r'^fallback-version = "(.*)"$', re.MULTILINE)
_VERSION = re.compile(r"(\d+)\.(\d+)\.(\d+)")
_ARCHITECTURES = ("amd64", "arm64", "armhf")
SUMS, NOTES = "SHA256SUMS", "NOTES.md"


def release(version: str, architectures: tuple[str, ...] = _ARCHITECTURES) -> Path:
    """Make the release. Returns the folder of the files."""
    newest = released_versions(_CHANGELOG.read_text())[0]
    if not _VERSION.fullmatch(version):
        raise ReleaseError(f"{version!r} is not a version: write three numbers, as in 0.3.0")
    if _git("status", "--porcelain"):
        raise ReleaseError("there are uncommitted changes: commit or stash them first")
    check_key()
    if version != newest:
        if _numbers(version) <= _numbers(newest):
            raise ReleaseError(f"{version} is not newer than {newest}, the last release in CHANGELOG.md")
        _CHANGELOG.write_text(cut(_CHANGELOG.read_text(), version, f"{datetime.now(UTC):%Y-%m-%d}"))
        _PYPROJECT.write_text(_FALLBACK.sub(f'fallback-version = "{version}"', _PYPROJECT.read_text()))
        _git("commit", "--quiet", "--all", "--message", f"Release {version}")
    notes = section(_CHANGELOG.read_text(), version)
    if not _git("tag", "--list", version):
        if section(_CHANGELOG.read_text(), "Unreleased"):
            raise ReleaseError(f"CHANGELOG.md has changes after {version}: tag the commit that released it by hand")
        # Verbatim, because # begins a heading in the notes.
        _git("tag", "--sign", "--cleanup=verbatim", "--message", f"naze-bridge {version}\n\n{notes}", version)
    if _git("rev-parse", f"{version}^{{commit}}") != _git("rev-parse", "HEAD"):
        raise ReleaseError(f"the tag {version} is on another commit: git checkout {version}, and run this again")
    folder = _PROJECT / "dist" / version
    folder.mkdir(parents=True, exist_ok=True)
    files = [*build_python(folder), *(build(each, folder=folder) for each in architectures)]
    files += folder.glob("naze-bridge-sim_*.deb")
    for package in files:
        if package.suffix == ".deb":
            sign_package(package)
    (folder / NOTES).write_text(notes)
    sums = folder / SUMS
    sums.write_text("".join(f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in files))
    sign(sums, "file")
    return folder


def released_versions(changelog: str) -> list[str]:
    """The versions with a section, newest first."""
    return re.findall(r"^## (\d\S*)", changelog, re.MULTILINE)


def section(changelog: str, version: str) -> str:
    """The section of a version, or of "Unreleased", without its heading; empty headings are left out."""
    found = re.search(rf"^## {re.escape(version)}\b.*\n((?:(?!## ).*\n?)*)", changelog, re.MULTILINE)
    if found is None:
        raise ReleaseError(f"CHANGELOG.md has no section {version}")
    return re.sub(r"^### .*\n+(?=### |\Z)", "", found[1].strip() + "\n", flags=re.MULTILINE).strip("\n")


def cut(changelog: str, version: str, date: str) -> str:
    """The changelog with the unreleased changes as the section of a version."""
    notes = section(changelog, "Unreleased")
    if not notes:
        raise ReleaseError("CHANGELOG.md has nothing under Unreleased: there is nothing to release")
    before, _, rest = changelog.partition("## Unreleased\n")
    _, _, older = rest.partition("\n## ")
    return f"{before}## Unreleased\n\n## {version} - {date}\n\n{notes}\n\n## {older}"


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(number) for number in version.split("."))


def _git(*words: str) -> str:
    asked = subprocess.run(("git", "-C", str(_PROJECT), *words), capture_output=True, text=True, check=False)
    if asked.returncode:
        raise ReleaseError(f"git {words[0]} failed: {asked.stderr.strip()}")
    return asked.stdout.strip()


if __name__ == "__main__":
    try:
        made = release(sys.argv[1] if sys.argv[1:] else "")
    except ReleaseError as error:
        sys.exit(f"no release: {error}")
    sys.stdout.write(
        f"{made.relative_to(_PROJECT)} is ready: {', '.join(sorted(path.name for path in made.iterdir()))}\n"
        f"To publish it: git push --follow-tags, and attach these files with {NOTES} as the text\n"
    )
