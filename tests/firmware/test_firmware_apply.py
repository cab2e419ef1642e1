# SPDX-License-Identifier: GPL-3.0-or-later
"""firmware/apply on a small test tree: applying, removing, and refusals."""

import hashlib
import io
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from errno import ENOSPC
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from itertools import count
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

FIRMWARE = Path(__file__).parents[2] / "firmware"
PATCHES = sorted((FIRMWARE / "patches").glob("*.patch"))
MODULES = (
    "naze_slots",
    "naze_mission",
    *(f"harakiri_{name}" for name in ["mission", "guard", "config", "flash", "settings"]),
)
CORE = tuple(f"{module}.{suffix}" for module in MODULES for suffix in "hc")
PATCH = """\
The mission extension for a tree of our own, commit 0123abc, for tests.
base {makefile} Makefile
base {main} src/main.c
base {mw} src/mw.h
base {util} src/util.c

diff --git a/Makefile b/Makefile
--- a/Makefile
+++ b/Makefile
@@ -1,0 +2,2 @@
+SOURCES += naze_slots.c naze_mission.c harakiri_mission.c harakiri_guard.c
+SOURCES += harakiri_config.c harakiri_flash.c harakiri_settings.c
diff --git a/src/main.c b/src/main.c
--- a/src/main.c
+++ b/src/main.c
@@ -0,0 +1 @@
+#include "naze_mission.h"
@@ -2,0 +4,2 @@
+    one();
+    two();
diff --git a/src/util.c b/src/util.c
--- a/src/util.c
+++ b/src/util.c
@@ -1,0 +2 @@
+int three(void);
"""
MAKEFILE = b"SOURCES = main.c util.c\n"
MAIN = b"int main(void)\n{\n    loop();\n}\n"
PATCHED = b'#include "naze_mission.h"\nint main(void)\n{\n    one();\n    two();\n    loop();\n}\n'
MW = b"void loop(void);\n"
UTIL = b"int two(void);\n"


class Workshop:
    """A copy of firmware/ that knows one tree, and the tree."""

    def __init__(self, path: Path) -> None:
        self.firmware, self.tree = path / "firmware", path / "Tree"
        self.main = self.tree / "src" / "main.c"
        (self.firmware / "patches").mkdir(parents=True)
        (self.tree / "src").mkdir(parents=True)
        for name in (*CORE, "apply"):
            shutil.copy(FIRMWARE / name, self.firmware)
        (self.tree / "Makefile").write_bytes(MAKEFILE)
        self.main.write_bytes(MAIN)
        (self.tree / "src" / "mw.h").write_bytes(MW)
        (self.tree / "src" / "util.c").write_bytes(UTIL)
        files = {"makefile": MAKEFILE, "main": MAIN, "mw": MW, "util": UTIL}
        hashes = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
        (self.firmware / "patches" / "Tree.patch").write_text(PATCH.format(**hashes))

    def run(self, *arguments: str) -> tuple[int, str]:
        """The exit code and output, within this process: Python starts in a tenth of a second."""
        apply, printed = load_apply(self.firmware / "apply"), io.StringIO()
        with (
            mock.patch.object(sys, "argv", ["apply", *arguments, str(self.tree)]),
            redirect_stdout(printed),
            redirect_stderr(printed),
        ):
            return apply.main(), printed.getvalue()

    def refuse(self, *words: str, remove: bool = False, code: int = 1) -> str:
        """The output of a run that is refused with these words and changes no file."""
        before = self.files()
        ended, printed = self.run(*(["--remove"] if remove else []))
        assert (ended, self.files()) == (code, before)
        assert [word for word in ("nothing was changed", *words) if word not in printed] == []
        return printed

    def git(self, *arguments: str) -> str:
        command = ["git", "-C", str(self.tree), "-c", "user.name=A", "-c", "user.email=a@b", *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    def make_clone(self) -> None:
        """Make the tree a git work tree, and the patch one for its commit."""
        self.git("init", "-q")
        self.git("add", "-A")
        self.git("commit", "-qm", "base")
        path = self.firmware / "patches" / "Tree.patch"
        path.write_text(path.read_text().replace("0123abc", self.git("rev-parse", "HEAD").strip()))

    def files(self) -> dict[str, bytes]:
        files = (path for path in self.tree.rglob("*") if path.is_file() and ".git" not in path.parts)
        return {str(path.relative_to(self.tree)): path.read_bytes() for path in files}


@pytest.fixture
def workshop(tmp_path: Path) -> Workshop:
    return Workshop(tmp_path)


def test_applies_and_removes_without_a_trace(workshop: Workshop) -> None:
    before = workshop.files()
    done = subprocess.run([workshop.firmware / "apply", workshop.tree], check=True, capture_output=True, text=True)
    assert done.stdout == "Tree: patched; build it with make\n"
    after = workshop.files()
    assert after["src/main.c"] == PATCHED
    assert after["src/mw.h"] == MW
    for name in CORE:
        assert after[f"src/{name}"] == (FIRMWARE / name).read_bytes()
    assert workshop.run("--remove") == (0, "Tree: restored to the state before the patch\n")
    assert workshop.files() == before


def test_applying_again_updates_the_core(workshop: Workshop) -> None:
    workshop.run()
    patched = workshop.files()
    (workshop.tree / "src" / "naze_mission.c").write_text("an older version")
    assert workshop.run() == (0, "Tree: brought up to date; build it with make\n")
    assert workshop.files() == patched


def test_removing_an_unapplied_patch_leaves_the_tree(workshop: Workshop) -> None:
    assert workshop.run("--remove") == (0, "Tree: the patch is not in it, nothing to do\n")


@pytest.mark.parametrize("remove", [False, True])
@pytest.mark.parametrize("applied", [False, True])
def test_another_tree_is_not_touched(workshop: Workshop, remove: bool, applied: bool) -> None:
    if applied:
        workshop.run()
    workshop.main.write_bytes(workshop.main.read_bytes().replace(b"loop();", b"loop(1);"))
    (workshop.tree / "src" / "mw.h").unlink()
    files = " -- src/main.c src/mw.h" if applied else ""
    way_back = f"git -C {workshop.tree} checkout 0123abc{files}\n"
    printed = workshop.refuse("src/mw.h: is not there", way_back, remove=remove)
    assert re.search(r"src/main\.c: has SHA-256 [0-9a-f]{64}, expected", printed)
    assert ("lines of this patch" in printed) is applied


@pytest.mark.parametrize("remove", [False, True])
@pytest.mark.parametrize("applied", [False, True])
def test_a_checkout_with_dos_line_ends_is_reported(workshop: Workshop, remove: bool, applied: bool) -> None:
    if applied:
        workshop.run()
    for name in ("main.c", "mw.h"):
        path = workshop.tree / "src" / name
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    printed = workshop.refuse("src/main.c: has CRLF line ends", "core.autocrlf false", remove=remove)
    assert printed.startswith(f"apply: {workshop.tree} is Tree at commit 0123abc, but checked out with CRLF line ends;")
    assert "SHA-256" not in printed


def test_dos_line_ends_of_one_file_are_reported_with_other_differences(workshop: Workshop) -> None:
    workshop.main.write_bytes(MAIN.replace(b"\n", b"\r\n"))
    (workshop.tree / "src" / "mw.h").write_bytes(b"another\n")
    workshop.refuse("src/main.c: has CRLF line ends", "src/mw.h: has SHA-256")


LONG = b"".join(b"    line(%d);\n" % number for number in range(40))


@pytest.fixture
def clone(tmp_path: Path) -> Workshop:
    """A workshop whose tree is a git clone, and whose main.c has room for other changes."""
    workshop = Workshop(tmp_path)
    workshop.main.write_bytes(MAIN + LONG)
    patch = workshop.firmware / "patches" / "Tree.patch"
    short, long = (hashlib.sha256(content).hexdigest() for content in (MAIN, MAIN + LONG))
    patch.write_text(patch.read_text().replace(short, long))
    workshop.make_clone()
    return workshop


@pytest.mark.parametrize("committed", [False, True])
def test_a_tree_with_changes_of_its_own_is_merged(clone: Workshop, committed: bool) -> None:
    clone.main.write_bytes(clone.main.read_bytes().replace(b"line(30)", b"line(31)"))
    if committed:
        clone.git("commit", "-qam", "my defaults")
    mine = clone.files()
    note = "merged with, or relying on, files with changes of your own: src/main.c\n"
    assert clone.run() == (0, f"Tree: patched; build it with make\n{note}")
    patched = clone.files()
    assert patched["src/main.c"] == PATCHED + LONG.replace(b"line(30)", b"line(31)")
    assert patched["src/util.c"] == UTIL + b"int three(void);\n"
    assert clone.run() == (0, f"Tree: brought up to date; build it with make\n{note}")
    assert clone.files() == patched
    clone.main.write_bytes(clone.main.read_bytes().replace(b"line(20)", b"line(21)"))
    assert clone.run("--remove") == (0, f"Tree: restored to the state before the patch\n{note}")
    assert clone.files() == mine | {"src/main.c": mine["src/main.c"].replace(b"line(20)", b"line(21)")}


def test_a_change_of_a_file_that_the_patch_relies_on_is_reported(clone: Workshop) -> None:
    (clone.tree / "src" / "mw.h").write_bytes(b"void loop(int);\n")
    code, printed = clone.run()
    assert code == 0
    assert "relying on, files with changes of your own: src/mw.h" in printed


def test_conflicts_are_named_by_file_and_line_and_the_tree_is_unchanged(clone: Workshop) -> None:
    clone.main.write_bytes(b"/* mine */\n\n" + MAIN + LONG)
    (clone.tree / "src" / "util.c").write_bytes(UTIL + b"int four(void);\n")
    clone.refuse("\n  src/main.c:1\n", "\n  src/util.c:2\n", code=2)


def test_removing_keeps_a_changed_line_of_the_patch_as_a_conflict(clone: Workshop) -> None:
    clone.run()
    clone.main.write_bytes(clone.main.read_bytes().replace(b"two();", b"two(2);"))
    printed = clone.refuse(remove=True, code=2)
    assert re.search(r"^  src/main\.c:\d$", printed, re.MULTILINE)


@given(
    edits=st.lists(
        st.tuples(st.integers(0, 43), st.sampled_from(["change", "insert", "delete"])), min_size=1, max_size=4
    )
)
def test_a_merge_keeps_both_sides_or_is_a_conflict(edits: list[tuple[int, str]]) -> None:
    apply = load_apply(FIRMWARE / "apply")
    old = (MAIN + LONG).splitlines(keepends=True)
    mine = list(old)
    for number, (at, edit) in enumerate(sorted(edits, reverse=True)):
        line = b"edit(%d);\n" % number
        mine[at : at + (edit != "insert")] = [] if edit == "delete" else [line]
    merged, conflicts = apply.merge(b"".join(mine), b"".join(old), PATCHED + LONG)
    assert all(1 <= line <= len(mine) + 1 for line in conflicts)
    if not conflicts:
        added = [line for line in PATCHED.splitlines(keepends=True) if line not in old]
        assert [line for line in merged.splitlines(keepends=True) if line not in added] == mine
        assert [line for line in merged.splitlines(keepends=True) if line in added] == added


def half_patch(workshop: Workshop) -> None:
    """Leave the state of an interrupted copy: a patched file, an unpatched file, one of the core's files."""
    workshop.run()
    (workshop.tree / "src" / "util.c").write_bytes(UTIL)
    for name in CORE[1:]:
        (workshop.tree / "src" / name).unlink()


def test_a_half_patched_tree_is_completed(workshop: Workshop) -> None:
    workshop.run()
    patched = workshop.files()
    half_patch(workshop)
    assert workshop.run() == (0, "Tree: brought up to date (it was half patched); build it with make\n")
    assert workshop.files() == patched


def test_a_half_patched_tree_is_restored(workshop: Workshop) -> None:
    before = workshop.files()
    half_patch(workshop)
    assert workshop.run("--remove") == (0, "Tree: restored to the state before the patch (it was half patched)\n")
    assert workshop.files() == before


def test_a_foreign_file_with_a_core_files_name_is_not_overwritten(workshop: Workshop) -> None:
    (workshop.tree / "src" / "naze_mission.c").write_text("/* my own */")
    workshop.refuse("src/naze_mission.c")


def test_removing_keeps_foreign_files(workshop: Workshop) -> None:
    workshop.run()
    (workshop.tree / "src" / "naze_mission.c").write_text("/* changed by hand */")
    code, printed = workshop.run("--remove")
    assert code == 0
    assert "kept" in printed
    assert "src/naze_mission.c" in printed
    assert "src/naze_mission.h" not in printed
    assert (workshop.tree / "src" / "naze_mission.c").read_text() == "/* changed by hand */"
    assert not (workshop.tree / "src" / "naze_mission.h").exists()


def load_apply(path: Path) -> ModuleType:
    loader = SourceFileLoader("firmware_apply", str(path))
    module = module_from_spec(spec_from_loader("firmware_apply", loader))  # type: ignore[arg-type]
    sys.modules["firmware_apply"] = module  # required by dataclass
    loader.exec_module(module)
    return module


def failing_at(number: int, operation: Callable[..., Any]) -> Callable[..., Any]:
    """`operation`, but its n-th call fails."""
    calls = count(1)

    def call(path: Path, *args: Any, **kwargs: Any) -> Any:
        if next(calls) == number:
            raise OSError(ENOSPC, "No space left on device", str(path))
        return operation(path, *args, **kwargs)

    return call


@pytest.mark.parametrize("remove", [False, True])
@pytest.mark.parametrize("operation", ["write_bytes", "replace", "unlink"])
def test_all_files_change_or_none(
    workshop: Workshop, remove: bool, operation: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first, second, ... write, rename or deletion fails, as on a full disk."""
    apply = load_apply(workshop.firmware / "apply")
    if remove:
        workshop.run()
    before = workshop.files()
    arguments = ["apply", *(["--remove"] if remove else []), str(workshop.tree)]
    monkeypatch.setattr(sys, "argv", arguments)
    failed = 0
    for number in count(1):
        with monkeypatch.context() as patching:
            patching.setattr(Path, operation, failing_at(number, getattr(Path, operation)))
            if apply.main() == 0:
                break
        failed += 1
        assert workshop.files() == before
    # Of the three patched files old and new contents are written, and of the core's files one of them.
    times = {"write_bytes": (len(CORE) + 6, len(CORE) + 6), "replace": (len(CORE) + 3, 3), "unlink": (0, len(CORE))}
    assert failed == times[operation][remove]


def test_a_missing_tree_is_reported(workshop: Workshop) -> None:
    shutil.rmtree(workshop.tree)
    code, printed = workshop.run()
    assert code == 1
    assert "is not a directory" in printed


@pytest.mark.parametrize("path", PATCHES, ids=lambda path: path.stem)
def test_shipped_patches_have_only_our_own_lines(path: Path) -> None:
    """No context, no removed line, no function name of Harakiri after a hunk header."""
    header, _, body = path.read_text().partition("diff --git")
    bases = re.findall(r"^base [0-9a-f]{64} \S+$", header, re.MULTILINE)
    assert len(bases) == (15 if path.stem == "TestCode3" else 13)
    for line in body.splitlines()[1:]:
        assert re.match(r"\+|--- a/|diff --git a/|index [0-9a-f]+\.\.[0-9a-f]+ 100644$|@@ -\d+,0 \+[\d,]+ @@$", line), (
            line
        )


def test_each_known_tree_has_a_patch() -> None:
    assert [path.stem for path in PATCHES] == ["HarakiriWebstore1", "TestCode3"]
