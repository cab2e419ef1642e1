# SPDX-License-Identifier: GPL-3.0-or-later
"""Imports go one way: service -> bridge -> protocols, and down within bridge/ and service/.

fleet/ needs no daemon on its machine: above protocols/ and storage/ it shares payloads/ and terminal/ with service/.
"""

import ast
from collections import Counter
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.support.forked import PRELOADED

REPOSITORY = Path(__file__).parents[1]
#: The other packages that each one may import.
BRIDGE = {
    "bridge.voice": set[str](),
    "bridge.model": {"bridge.voice"},
    "bridge.line": {"bridge.voice", "bridge.model"},
    "bridge.missions": {"bridge.voice", "bridge.line", "bridge.model"},
    "bridge.fc": {"bridge.voice", "bridge.missions", "bridge.line", "bridge.model"},
    "bridge.controllers": {"bridge.voice", "bridge.fc", "bridge.missions", "bridge.line", "bridge.model"},
    "bridge.gcs": {"bridge.voice", "bridge.model"},
    "bridge.settings": {"bridge.voice", "bridge.gcs", "bridge.fc", "bridge.missions", "bridge.line", "bridge.model"},
    "bridge.sharing": {
        "bridge.voice",
        "bridge.settings",
        "bridge.gcs",
        "bridge.fc",
        "bridge.missions",
        "bridge.line",
        "bridge.model",
    },
    "bridge.transfers": {"bridge.voice", "bridge.gcs", "bridge.missions", "bridge.line", "bridge.model"},
    "bridge.vehicle": {
        "bridge.voice",
        "bridge.transfers",
        "bridge.gcs",
        "bridge.fc",
        "bridge.settings",
        "bridge.missions",
        "bridge.line",
        "bridge.model",
    },
}
PACKAGES = {
    "protocols": set[str](),
    "storage": set[str](),
    "simulator": {"protocols"},
    "reports": {"protocols"},
    "bridge": {"reports", "protocols"},
    "payloads": {"reports", "protocols", "storage"},
    "terminal": {"payloads", "reports", "protocols", "storage"},
    "fleet": {"payloads", "terminal", "protocols", "storage"},
    "service": {"payloads", "terminal", "fleet", "bridge", "reports", "protocols", "simulator", "storage"},
}
SERVICE = {
    "service.machine": set[str](),
    "service.settings": set[str](),
    "service.links": {"service.machine", "service.settings"},
    "service.recording": {"service.settings"},
}
SERVICE["service.daemon"] = {*SERVICE}
SERVICE["service.web"] = SERVICE["service.zenoh_link"] = {*SERVICE, "service.daemon"} - {"service.links"}
SERVICE["service.cli"] = {*SERVICE} - {"service.recording"}
INSIDE = BRIDGE | SERVICE
#: The share of modules with a test file of like name.
LEAST_MIRRORED = 0.9
#: The calls of Bridge that are grouped.
GROUPS = {"missions", "settings"}
INSTALLED = (*PACKAGES.keys() - {"simulator"},)
#: Bytes that become text elsewhere, and why that is safe.
DECODERS = {
    "fleet/enrolment.py": "JSON of the administrator",
    "protocols/msp/setting_table.py": "a name's bytes count in a checksum; impossible names are left out of the table",
    "service/cli/card.py": "cloud-init's file is written again as it was",
    "service/cli/setup/answers.py": "a secret",
    "service/cli/setup/command.py": "a secret",
    "service/cli/setup/hotspot.py": "our own file",
    "service/machine/host.py": "files of the system, which are searched for words",
    "service/settings/config_files.py": "TOML is UTF-8",
    "service/settings/write_access.py": "a secret",
    "storage/database.py": "the daemon wrote it; commands print it by `printable`",
    "storage/mission_store.py": "makes text that SQLite can store",
    "storage/salvage.py": "copied as it is",
    "storage/state_lock.py": "a process id",
}
#: They open files of the program itself or of the kernel, or a closed standard stream.
OWN_FILES = {
    "service/cli/helper/signature.py",
    "service/cli/program.py",
    "service/links/serial_ports.py",
    "service/machine/captive_portal.py",
    "service/machine/package.py",
    "service/web/server.py",
    "storage/database.py",
    "storage/small_files.py",
}
#: Only service/ and simulator/ may use a clock, a port or an event loop.
IMPURE = {"asyncio", "selectors", "serial", "socket", "subprocess", "threading", "time"}


def imports(folder: Path) -> Iterator[tuple[str, str]]:
    """Pairs of a file below a folder and a module it imports."""
    for file in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module:
                # `from bridge.vehicle import vehicle_messages` also imports a module.
                yield from ((str(file), f"{node.module}.{alias.name}") for alias in node.names)
            elif isinstance(node, ast.Import):
                yield from ((str(file), alias.name) for alias in node.names)


@cache
def all_calls() -> list[tuple[str, str, ast.Call]]:
    """Each call in the installed packages: the file, the name of the called function or method, and the call."""
    found = []
    for file in (file for package in INSTALLED for file in (REPOSITORY / package).rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute | ast.Name):
                name = node.func.attr if isinstance(node.func, ast.Attribute) else node.func.id
                found.append((str(file.relative_to(REPOSITORY)), name, node))
    return found


def test_files_are_read_by_the_bounded_reader() -> None:
    """`storage.small_files`: another reader could wait for a pipe, or read a device until the memory is full."""
    readers = {
        file
        for file, name, call in all_calls()
        if name in ("read_text", "read_bytes") or (name == "open" and _opens_to_read(call))
    }
    assert readers - OWN_FILES == set()


def _opens_to_read(call: ast.Call) -> bool:
    """True for open(path), open(path, "r...") and path.open("r...")."""
    is_builtin = isinstance(call.func, ast.Name)
    modes = [each.value for each in call.args[is_builtin:] if isinstance(each, ast.Constant)]
    return str(modes[0]).startswith("r") if modes else is_builtin and len(call.args) == 1


def test_foreign_bytes_are_decoded_in_one_module() -> None:
    """`protocols.plain_text`, and `file_text` for whole files: text from elsewhere could hold what a terminal obeys."""
    decoders = {file for file, name, call in all_calls() if name == "decode" and _decodes_bytes(call)}
    assert decoders - {"protocols/file_text.py", "protocols/plain_text.py"} == DECODERS.keys()


def _decodes_bytes(call: ast.Call) -> bool:
    """True for data.decode(), also with an encoding, but not for other methods of that name and base64."""
    assert isinstance(call.func, ast.Attribute | ast.Name)
    of = call.func.value if isinstance(call.func, ast.Attribute) else None
    is_base64 = isinstance(of, ast.Call) and isinstance(of.func, ast.Attribute) and of.func.attr == "b64encode"
    return of is not None and not is_base64 and all(isinstance(each, ast.Constant) for each in call.args)


def test_every_sentence_for_pilots_is_in_the_table() -> None:
    """`bridge.voice.sentences`: Ground.say and refusals take only what these make. Others pack a text of theirs."""
    makers = {(file, name) for file, name, _ in all_calls() if name in ("Sentence", "MAVLink_statustext_message")}
    assert makers == {
        ("bridge/voice/sentences.py", "Sentence"),
        ("bridge/gcs/ground_station.py", "MAVLink_statustext_message"),
        ("bridge/gcs/return_path.py", "MAVLink_statustext_message"),  # before the station is known
        ("bridge/vehicle/incoming.py", "MAVLink_statustext_message"),  # in the name of an autopilot
    }


def test_the_terminal_gets_text_and_never_markup() -> None:
    """A name such as "[/x]" would end a command, and "[link=...]" would become a link."""
    makers = {"Console", "TextColumn", "from_markup"}
    made = {(file, name) for file, name, _ in all_calls() if name in makers}
    assert made == {("terminal/printing.py", "Console"), ("terminal/printing.py", "TextColumn")}
    text = (REPOSITORY / "terminal/printing.py").read_text()
    assert "markup=False, emoji=False" in text
    assert 'TextColumn("{task.description}", markup=False)' in text


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_between_packages_have_one_direction(package: str) -> None:
    allowed = tuple(f"{each}." for each in (package, *PACKAGES[package]))
    ours = tuple(f"{each}." for each in PACKAGES)
    found = [(file, name) for file, name in imports(REPOSITORY / package) if f"{name}.".startswith(ours)]
    assert [(file, name) for file, name in found if not f"{name}.".startswith(allowed)] == []


@pytest.mark.parametrize("package", INSIDE)
def test_imports_within_a_package_go_one_way(package: str) -> None:
    allowed = INSIDE[package] | {package}
    whole = package.partition(".")[0]
    found = [
        (file, name)
        for file, name in imports(REPOSITORY / package.replace(".", "/"))
        if name.startswith(f"{whole}.") and ".".join(name.split(".")[:2]) not in allowed
    ]
    assert found == []


def test_imports_between_the_simulators_packages_are_acyclic() -> None:
    """Between its packages. CycleError names the cycle."""
    graph: dict[str, set[str]] = {}
    for file, name in imports(REPOSITORY / "simulator"):
        package = Path(file).relative_to(REPOSITORY / "simulator").parts[0]
        if name.startswith("simulator.") and (imported := name.split(".")[1]) != package:
            graph.setdefault(package, set()).add(imported)
    TopologicalSorter(graph).prepare()


def test_most_modules_have_a_test_file_of_like_name() -> None:
    """tests/bridge/gcs/test_ground.py tests bridge/gcs/ground.py.

    Modules of up to 40 lines may do without, and the simulator, whose parts are tested as whole boards."""
    files = (file for package in PACKAGES.keys() - {"simulator"} for file in (REPOSITORY / package).rglob("[!_]*.py"))
    modules = [file.relative_to(REPOSITORY) for file in files if len(file.read_text().splitlines()) > 40]
    tests = REPOSITORY / "tests"
    lacking = [str(file) for file in modules if not (tests / file.with_name(f"test_{file.name}")).exists()]
    share = 1 - len(lacking) / len(modules)
    assert share >= LEAST_MIRRORED, f"{share:.2f}; without: {', '.join(sorted(lacking))}"


def test_the_bridge_is_used_through_the_front_door() -> None:
    """Never a part of it: outside, no `bridge._x`, and `bridge.x.y` only of its two groups of calls. Tests reach its
    parts in one place."""
    found = []
    packages = "service", "fleet", "simulator", "benchmarks"
    for file in (file for package in packages for file in (REPOSITORY / package).rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text())):
            match node:
                case ast.Attribute(value=ast.Attribute(value=owner, attr=name)) if (
                    _is_bridge(owner) and name not in GROUPS
                ):
                    found.append((file.name, ast.unparse(node)))
                case ast.Attribute(value=owner, attr=name) if _is_bridge(owner) and name.startswith("_"):
                    found.append((file.name, ast.unparse(node)))
    assert found == []


def _is_bridge(node: ast.expr) -> bool:
    name = node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")
    return name in ("bridge", "_bridge")


def test_every_package_of_the_service_is_listed() -> None:
    # A folder without modules is the byte code of a removed package.
    found = [path for path in (REPOSITORY / "service").glob("[!_.]*") if path.is_file() or any(path.glob("*.py"))]
    assert {f"service.{path.name}" for path in found} == {*SERVICE}


def test_class_names_are_unique() -> None:
    """Except in the simulator, which may use the same name for a simulated part."""
    files = (file for package in PACKAGES.keys() - {"simulator"} for file in (REPOSITORY / package).rglob("*.py"))
    nodes = (node for file in files for node in ast.walk(ast.parse(file.read_text())))
    names = Counter(node.name for node in nodes if isinstance(node, ast.ClassDef) and node.name[0] != "_")
    assert [name for name, count in names.items() if count > 1] == []


@pytest.mark.parametrize("package", ["protocols", "bridge"])
def test_only_service_and_simulator_use_clocks_and_ports(package: str) -> None:
    assert [(file, name) for file, name in imports(REPOSITORY / package) if name.split(".")[0] in IMPURE] == []


@pytest.mark.parametrize("module", PRELOADED)
def test_preloaded_modules_exist(module: str) -> None:
    assert find_spec(module) is not None
