# SPDX-License-Identifier: GPL-3.0-or-later
"""Every command in the documentation: naze-bridge's own are run here, with its files and ports redirected."""

import re
import shutil
import signal
from collections.abc import Iterator
from contextlib import ExitStack
from importlib.util import find_spec
from pathlib import Path

import click
import pytest

from service.cli.main import main
from service.cli.setup.hotspot import CONNECTION
from tests.support.benches import Starter
from tests.support.doc_pages import Command, commands
from tests.support.forked import Forked
from tests.support.programs import REPOSITORY, TIMEOUT_S, Daemon, free_port, until

#: Commands that are not run here, by their beginning, with the reason.
NOT_RUN = {
    "naze-bridge card": "needs a card: tests/service/cli/test_card.py runs it",
    "naze-bridge demo": "tests/service/cli/test_demo.py runs it",
    "naze-bridge fleet list": "needs a router: tests/fleet/test_command.py runs it",
    "naze-bridge fleet watch": "needs a router: tests/fleet/test_roll_call.py runs it",
    "naze-bridge fleet push": "needs a router: tests/fleet/test_push.py runs it",
    "naze-bridge settings modes": "needs an INAV: tests/service/cli/test_settings_commands.py",
    "naze-bridge settings get MODE_ANGLE": "needs an INAV: tests/bridge/controllers/test_msp_parts.py",
    "naze-bridge settings set MODE_ANGLE": "needs an INAV: tests/bridge/controllers/test_msp_parts.py",
    "naze-bridge fleet settings": "needs a router: tests/fleet/test_settings_command.py runs it",
    "naze-bridge fleet verify": "needs a router: tests/fleet/test_push_command.py runs it",
    "naze-bridge fleet pull": "needs a router: tests/fleet/test_push_command.py runs it",
    "naze-bridge fleet logs": "needs a router: tests/fleet/test_logs.py runs it",
    "naze-bridge fleet mavlink": "needs a router: tests/service/cli/test_vehicle_relay.py runs it",
    "naze-bridge fly": "needs a firmware image: `make real-board FLY=1` flies some",
    "naze-bridge sim --image": "needs a firmware image: `make real-board` runs it",
    "naze-bridge sim --link /tmp/naze --core": "needs the compiled core: tests/e2e/test_compiled_core.py runs it",
    "make": "long, or changes the machine; its target is checked",
    "python examples/zenoh_router.py": "tests/support/zenoh_router.py runs it, for all tests of fleets",
    "python -m deb.sign": "needs the maintainer's key: tests/packaging/test_versions.py runs it",
    "ssh-keygen -t": "asks for a passphrase: tests/packaging/test_versions.py makes such a key",
    "git config": "changes the repository: tests/packaging/test_versions.py does so in a copy",
    "echo naze-bridge": "needs that key: tests/packaging/test_versions.py writes this file",
    "pip install trustme": "a test dependency",
    ".venv/bin/python -m pip install unicorn": "a test dependency",
    ".venv/bin/python -m pip wheel": "takes long; tests/packaging/test_debian_package.py builds this wheel",
    "pipx install": "needs the package index",
    "zenohd": "not in Debian; tests use it if $ZENOHD names it",
    "docker compose": "needs Docker; tests/fleet/test_fleet_kit.py checks the files",
    "git -C ~/TestCode3": "needs Harakiri's sources, which are not part of this project",
    "firmware/apply": "needs Harakiri's sources; tests/firmware/test_firmware_apply.py runs it",
    "stm32flash": "needs a board",
    "naze-bridge firmware build": "needs Harakiri's sources, which are not part of this project",
    "naze-bridge firmware flash": "needs an image: tests/e2e/test_firmware.py runs it",
    "naze-bridge firmware restore": "needs a backup: tests/e2e/test_firmware.py runs it",
    "apt": "changes the machine: `make deb-trial` runs it",
    "nano": "needs a person; the file is checked",
    "naze-bridge token": "needs the service: tests/service/cli/setup/test_command.py runs it",
    "install": "changes the machine; the folder and user are checked",
    "usermod": "changes the machine",
    "nmcli": "changes the machine; the connection's name is checked",
    "systemctl": "changes the machine: `make deb-trial` runs it; the unit is checked",
    "journalctl": "needs systemd; the unit is checked",
}
COMMANDS = commands()
OWN = [each for each in COMMANDS if each.words[0] == "naze-bridge"]


def reason_not_to_run(command: Command) -> str | None:
    return next((NOT_RUN[start] for start in NOT_RUN if f"{command.text} ".startswith(f"{start} ")), None)


def parse(words: list[str]) -> bool:
    """Parse a command line as click does; False if it only names a command, without its arguments."""
    command: click.Command = main
    context: click.Context | None = None
    name: str | None = "naze-bridge"
    try:
        while isinstance(command, click.Group):
            context = command.make_context(name, words, parent=context)
            name, found, words = command.resolve_command(context, [*context._protected_args, *context.args])
            assert found is not None
            command = found
        command.make_context(name, words, parent=context)
    except (click.MissingParameter, click.exceptions.NoArgsIsHelpError, click.exceptions.Exit):
        return False
    return True


#: The FILE of each command; the others take a mission.
_FILES = {"run": "config.toml", "setup": "gcs.key"}


class Sandbox:
    """A folder in which commands run, next to a daemon with a simulated Naze and two stored missions."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "examples").symlink_to(REPOSITORY / "examples")
        shutil.copy(REPOSITORY / "examples" / "config.toml", folder)
        (folder / "gcs.key").write_text("a passphrase of the pilot\n")
        (folder / "gcs.key").chmod(0o600)
        # Only parsed.
        (folder / "firmware" / "build").mkdir(parents=True)
        for name in ("X.elf", "sticks.txt", "pilot.json5", "firmware/build/libnaze_mission.so"):
            (folder / name).touch()

    def redirected(self, command: Command) -> list[str]:
        """Its arguments with the files, ports and placeholders of the page replaced by this folder's."""
        instead = {
            **dict.fromkeys(("/dev/ttyAMA0", "/dev/ttyUSB0", "/dev/serial0", "/tmp/naze"), str(self.folder / "naze")),  # noqa: S108
            "udpin:14550": f"udpin:127.0.0.1:{free_port()}",
            "tcpin:5760": f"tcpin:127.0.0.1:{free_port()}",
            "FILE": _FILES.get(command.words[1], "examples/naze-field.waypoints"),
            "N": "1",
            "M": "2",
        }
        words = [instead.get(word, word) for word in command.words[1:]]
        if words[0] == "setup":
            words.append("--dry-run")
        if words[0] == "sim" and "--link" not in words:
            words += ["--link", str(self.folder / "naze")]
        return words

    def start(self, words: list[str]) -> Forked:
        return Forked(words, self.folder, self.folder / "output", self.folder / "output")

    def run(self, *words: str) -> tuple[int, str]:
        """Run a command to its end; a `run` or `sim` until it is up. Return its exit status and output."""
        (self.folder / "output").write_text("")
        process = self.start([*words])
        try:
            if words[0] in {"run", "sim"} and "--check-config" not in words:
                until(lambda: process.poll() is not None or self._is_up(), f"the start of {words}")
                process.send_signal(signal.SIGTERM)
            code = process.wait(TIMEOUT_S)
        finally:
            process.kill()
        return code, (self.folder / "output").read_text()

    def _is_up(self) -> bool:
        return re.search(r"daemon\.started|Simulated|Playing", (self.folder / "output").read_text()) is not None


@pytest.fixture(scope="module")
def sandbox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Sandbox]:
    folder = tmp_path_factory.mktemp("docs")
    with ExitStack() as stack, pytest.MonkeyPatch.context() as environment:
        environment.setenv("XDG_STATE_HOME", str(folder))
        daemon: Daemon = Starter(folder, stack).daemon("sim:", state_dir=folder / "naze-bridge")
        sandbox = Sandbox(folder)
        daemon.wait()
        for name in ("naze-field.plan", "naze-field.waypoints"):
            code, output = sandbox.run("push", f"examples/{name}")
            assert code == 0, output
        yield sandbox


def test_the_commands_of_naze_bridge_work(sandbox: Sandbox, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(sandbox.folder)
    for command in OWN:
        words = sandbox.redirected(command)
        if not parse([*words]) or reason_not_to_run(command):
            continue
        with monkeypatch.context() as environment:
            if words[0] == "run":
                # A second daemon has its own folder and ports.
                environment.setenv("XDG_STATE_HOME", str(sandbox.folder / "second"))
                words += [] if "--fc" in words else ["--fc", str(sandbox.folder / "naze")]
                words += [] if "--gcs" in words else ["--gcs", f"udpin:127.0.0.1:{free_port()}"]
            code, output = sandbox.run(*words)
        # Exit status 1: doctor found a problem of this machine, or the settings differ.
        assert code == 0 or (code == 1 and {"doctor", "diff"} & {*words}), f"{command.place}: {command.text}: {output}"


def test_the_commands_of_other_programs_name_existing_files() -> None:
    for command in COMMANDS:
        if command not in OWN:
            assert reason_not_to_run(command), f"{command.place}: {command.text}: run it, or add it to NOT_RUN"
            assert names_existing_files(command), f"{command.place}: {command.text}"


def names_existing_files(command: Command) -> bool:
    program, *words = command.words
    if program == "make" and "~" not in command.text:
        folder = Path(REPOSITORY, words[words.index("-C") + 1]) if "-C" in words else REPOSITORY
        (target,) = (word for word in words if "=" not in word and word not in {"-C", folder.name})
        if not re.search(rf"^{target}\b[^:=]*:(?!=)", (folder / "Makefile").read_text(), re.MULTILINE):
            return False
    if words[0] == "-m" and program == "python" and not find_spec(words[1]):
        return False
    named = [REPOSITORY / word for word in words if word.startswith("examples/")]
    ours = [word for word in words if word.startswith("naze")]
    if program in {"systemctl", "journalctl", "apt"}:
        units = [word.replace("@*", "@") for word in ours]
        named += [REPOSITORY / "systemd" / (unit if "." in unit else f"{unit}.service") for unit in units]
    return all(path.exists() for path in named) and (program != "nmcli" or {*ours} <= {CONNECTION})


def test_every_exception_is_needed_and_the_test_exists() -> None:
    used = {reason_not_to_run(command) for command in COMMANDS}
    assert [start for start, reason in NOT_RUN.items() if reason not in used] == []
    named = [path for reason in NOT_RUN.values() for path in re.findall(r"tests/\S+\.py", reason)]
    assert [path for path in named if not (REPOSITORY / path).exists()] == []
