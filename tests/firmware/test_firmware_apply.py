# SPDX-License-Identifier: GPL-3.0-or-later
"""firmware/apply on a tree of our own making: in, out again, and what it refuses."""

import hashlib
import re
import shutil
import subprocess
from pathlib import Path

import pytest

FIRMWARE = Path(__file__).parents[2] / "firmware"
PATCHES = sorted((FIRMWARE / "patches").glob("*.patch"))
CORE = ("naze_mission.h", "naze_mission.c", "harakiri_mission.h", "harakiri_mission.c")

PATCH = """\
base {main} src/main.c
base {mw} src/mw.h

diff --git a/src/main.c b/src/main.c
--- a/src/main.c
+++ b/src/main.c
@@ -0,0 +1 @@
+#include "naze_mission.h"
@@ -2,0 +4,2 @@
+    one();
+    two();
"""
MAIN = b"int main(void)\n{\n    loop();\n}\n"
PATCHED = b'#include "naze_mission.h"\nint main(void)\n{\n    one();\n    two();\n    loop();\n}\n'
MW = b"void loop(void);\n"


class Workshop:
    """A copy of firmware/ that knows one tree, and that tree."""

    def __init__(self, path: Path) -> None:
        self.firmware, self.tree = path / "firmware", path / "Tree"
        (self.firmware / "patches").mkdir(parents=True)
        (self.tree / "src").mkdir(parents=True)
        for name in (*CORE, "apply"):
            shutil.copy(FIRMWARE / name, self.firmware)
        (self.tree / "src" / "main.c").write_bytes(MAIN)
        (self.tree / "src" / "mw.h").write_bytes(MW)
        hashes = {"main": hashlib.sha256(MAIN).hexdigest(), "mw": hashlib.sha256(MW).hexdigest()}
        (self.firmware / "patches" / "Tree.patch").write_text(PATCH.format(**hashes))

    def run(self, *arguments: str) -> tuple[int, str]:
        command = [str(self.firmware / "apply"), *arguments, str(self.tree)]
        done = subprocess.run(command, capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr

    def files(self) -> dict[str, bytes]:
        return {str(path.relative_to(self.tree)): path.read_bytes() for path in self.tree.rglob("*") if path.is_file()}


@pytest.fixture
def workshop(tmp_path: Path) -> Workshop:
    return Workshop(tmp_path)


def test_applies_and_removes_without_a_trace(workshop: Workshop) -> None:
    before = workshop.files()
    assert workshop.run() == (0, "Tree: patched; build it with make\n")
    after = workshop.files()
    assert after["src/main.c"] == PATCHED
    assert after["src/mw.h"] == MW
    for name in CORE:
        assert after[f"src/{name}"] == (FIRMWARE / name).read_bytes()
    assert workshop.run("--remove") == (0, "Tree: as it was before the patch\n")
    assert workshop.files() == before


def test_applying_again_brings_the_core_up_to_date(workshop: Workshop) -> None:
    workshop.run()
    patched = workshop.files()
    (workshop.tree / "src" / "naze_mission.c").write_text("an older version")
    assert workshop.run() == (0, "Tree: brought up to date; build it with make\n")
    assert workshop.files() == patched


def test_removing_what_is_not_there(workshop: Workshop) -> None:
    assert workshop.run("--remove") == (0, "Tree: the patch is not in it, nothing to do\n")


@pytest.mark.parametrize("remove", [False, True])
@pytest.mark.parametrize("applied", [False, True])
def test_another_tree_is_left_alone(workshop: Workshop, remove: bool, applied: bool) -> None:
    if applied:
        workshop.run()
    main = workshop.tree / "src" / "main.c"
    main.write_bytes(main.read_bytes().replace(b"loop();", b"loop(1);"))
    (workshop.tree / "src" / "mw.h").unlink()
    before = workshop.files()
    code, printed = workshop.run(*(["--remove"] if remove else []))
    assert code == 1
    assert "nothing was changed" in printed
    assert re.search(r"src/main\.c: has SHA-256 [0-9a-f]{64}, expected", printed)
    assert "src/mw.h: is not there" in printed
    assert workshop.files() == before


def test_dos_line_ends_are_named(workshop: Workshop) -> None:
    main = workshop.tree / "src" / "main.c"
    main.write_bytes(MAIN.replace(b"\n", b"\r\n"))
    code, printed = workshop.run()
    assert code == 1
    assert "src/main.c: has CRLF line ends" in printed
    assert "mw.h" not in printed


def test_no_tree_at_all(workshop: Workshop) -> None:
    shutil.rmtree(workshop.tree)
    code, printed = workshop.run()
    assert code == 1
    assert "is not a directory" in printed


@pytest.mark.parametrize("path", PATCHES, ids=lambda path: path.stem)
def test_shipped_patches_hold_only_lines_of_ours(path: Path) -> None:
    """No context, no line taken away, no function name of Harakiri's behind a hunk header."""
    header, _, body = path.read_text().partition("diff --git")
    assert len(re.findall(r"^base [0-9a-f]{64} \S+$", header, re.MULTILINE)) == 11
    for line in body.splitlines()[1:]:
        assert re.match(r"\+|--- a/|diff --git a/|index [0-9a-f]+\.\.[0-9a-f]+ 100644$|@@ -\d+,0 \+[\d,]+ @@$", line), (
            line
        )


def test_a_patch_for_each_tree() -> None:
    assert [path.stem for path in PATCHES] == ["HarakiriWebstore1", "TestCode3"]
