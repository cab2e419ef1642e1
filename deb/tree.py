# SPDX-License-Identifier: GPL-3.0-or-later
"""The files of the packages, and their places."""

import filecmp
import gzip
import hashlib
import shutil
from collections.abc import Mapping
from pathlib import Path

from click.shell_completion import get_completion_class

from generators.man_page import man_page
from service.cli.main import main
from service.machine.helper_socket import UNITS

_HERE = Path(__file__).resolve().parent
_LIB = Path("usr/lib/naze-bridge")
#: Pages outside docs/ that the docs link to.
_PAGES = (
    *("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "LICENSE"),
    *("benchmarks/README.md", "service/web/static/wiring.svg"),
    *("systemd/naze-bridge.service", "systemd/60-naze-bridge.rules"),
)
_NOT_THE_PATCH = ("__pycache__", "build", "tests", "sim", "Makefile")
_UNITS = (
    "naze-bridge.service",
    *(f"naze-bridge-helper-{unit}{kind}" for unit in UNITS for kind in (".socket", "@.service")),
    *("naze-bridge-captive.socket", "naze-bridge-captive.service", "naze-bridge-finish-update.service"),
)
_SCHEMAS = "payloads/schemas"
#: The folders of simulator/ that neither the bridge nor its demonstration uses: naze-bridge-sim.
SIM = ("commands", "emulated_naze", "flights", "inav", "multiwii", "sky")
_NEEDLESS = ("bin", "share")


def lay_out(
    root: Path, sim: Path, libraries: Mapping[str, Path], project: Path, version: str, architecture: str
) -> None:
    """Lay out the folders of both packages from the installed `libraries` of each Python version."""
    environment = root / _LIB
    (environment / "bin").mkdir(parents=True)
    (environment / "pyvenv.cfg").write_text("home = /usr/bin\ninclude-system-site-packages = false\n")
    (environment / "bin" / "python3").symlink_to("../../../bin/python3")
    shutil.copy(_HERE / "naze-bridge", environment / "bin")
    sites = []
    for python, folder in libraries.items():
        sites.append(environment / "lib" / f"python{python}" / "site-packages")
        for name in _NEEDLESS:
            shutil.rmtree(folder / name, ignore_errors=True)
        shutil.copytree(folder, sites[-1])
    _share(*sites)
    for site in sites:
        part = sim / site.relative_to(root) / "simulator"
        part.mkdir(parents=True)
        for name in SIM:
            (site / "simulator" / name).rename(part / name)
    (root / "usr/bin").mkdir()
    (root / "usr/bin/naze-bridge").symlink_to("../lib/naze-bridge/bin/naze-bridge")
    for unit in _UNITS:
        _copy(project / "systemd" / unit, root / "usr/lib/systemd/system")
    wanted = root / "usr/lib/systemd/system/multi-user.target.wants/naze-bridge-finish-update.service"
    wanted.parent.mkdir()
    wanted.symlink_to("../naze-bridge-finish-update.service")
    _copy(project / "systemd/60-naze-bridge.rules", root / "usr/lib/udev/rules.d")
    _copy(project / "systemd/naze-bridge.sysusers", root / "usr/lib/sysusers.d", "naze-bridge.conf")
    (root / "etc/naze-bridge").mkdir(parents=True)
    _copy(_HERE / "signers", environment)
    # Not in /etc: dpkg asks about changed files that a package brings. postinst copies it if there is none.
    _copy(_HERE / "config.toml", root / "usr/share/naze-bridge")
    documents = root / "usr/share/doc/naze-bridge"
    _copy(_HERE / "copyright", documents)
    # As in the repository, so that the pages' links work.
    shutil.copytree(project / "docs", documents / "docs", ignore=shutil.ignore_patterns("before"))
    for page in _PAGES:
        _copy(project / page, documents / Path(page).parent)
    shutil.copytree(project / _SCHEMAS, documents / _SCHEMAS, ignore=shutil.ignore_patterns("__pycache__"))
    # The patch, so that a pilot needs nothing but the package and Harakiri's sources.
    shutil.copytree(project / "firmware", documents / "firmware", ignore=shutil.ignore_patterns(*_NOT_THE_PATCH))
    shutil.copytree(project / "examples", documents / "examples", ignore=shutil.ignore_patterns("__pycache__"))
    (documents / "changelog.gz").write_bytes(gzip.compress((project / "CHANGELOG.md").read_bytes(), mtime=0))
    _write(root / "usr/share/man/man1/naze-bridge.1.gz", gzip.compress(man_page(version).encode(), mtime=0))
    _write(root / "usr/share/bash-completion/completions/naze-bridge", _completion("bash").encode())
    _write(root / "usr/share/zsh/vendor-completions/_naze-bridge", _completion("zsh").encode())
    _copy(_HERE / "lintian-overrides", root / "usr/share/lintian/overrides", "naze-bridge")
    # Both packages have the same version, so one set of documents.
    (sim / "usr/share/doc").mkdir(parents=True)
    (sim / "usr/share/doc/naze-bridge-sim").symlink_to("naze-bridge")
    for path in (*root.rglob("*"), *sim.rglob("*")):
        if not path.is_symlink():
            runs = path.is_dir() or path.parent == environment / "bin" or path == documents / "firmware/apply"
            path.chmod(0o755 if runs else 0o644)
    _describe(root, _HERE, version, architecture)
    _describe(sim, _HERE / "sim", version, "all")


def _share(first: Path, *others: Path) -> None:
    """Store files that are the same for every Python once: most are."""
    for other in others:
        for path in other.rglob("*"):
            twin = first / path.relative_to(other)
            if path.is_file() and twin.is_file() and filecmp.cmp(path, twin, shallow=False):
                path.unlink()
                path.hardlink_to(twin)


def _write(path: Path, data: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)


def _completion(shell: str) -> str:
    script = get_completion_class(shell)
    assert script is not None
    return script(main, {}, "naze-bridge", "_NAZE_BRIDGE_COMPLETE").source()


def _copy(source: Path, folder: Path, name: str = "") -> None:
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, folder / (name or source.name))


def _describe(root: Path, described: Path, version: str, architecture: str) -> None:
    """Add the control files. Those that are not computed are in the folder `described`."""
    folder = root / "DEBIAN"
    folder.mkdir(mode=0o755)
    files = sorted(path for path in root.rglob("*") if path.is_file() and not path.is_symlink())
    sums = [f"{_md5(path)}  {path.relative_to(root)}\n" for path in files]
    size = sum(size for _, size in {(path.stat().st_ino, path.stat().st_size) for path in files})
    fields = (
        (described / "control").read_text().format(version=version, architecture=architecture, kilobytes=size // 1024)
    )
    (folder / "control").write_text(fields)
    (folder / "md5sums").write_text("".join(sums))
    for name in ("triggers", "postinst", "prerm", "postrm"):
        if (described / name).exists():
            shutil.copyfile(described / name, folder / name)
            (folder / name).chmod(0o644 if name == "triggers" else 0o755)


def _md5(path: Path) -> str:
    return hashlib.md5(path.read_bytes(), usedforsecurity=False).hexdigest()
