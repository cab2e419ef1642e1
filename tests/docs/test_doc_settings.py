# SPDX-License-Identifier: GPL-3.0-or-later
"""The documentation's settings are valid: blocks of a configuration file, single settings and options."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import click

from service.cli.main import main
from service.settings import Settings, load_settings
from service.settings.addresses import parse_gcs
from service.settings.load import CONFIG_VARIABLE
from service.settings.table import KEYS
from tests.support.doc_pages import PAGES, blocks, place_of, spans
from tests.support.programs import REPOSITORY

BLOCKS = [block for block in blocks() if block.language == "toml"]
#: `name = value` in the text, each once.
SETTINGS = {span: place_of(page) for page in PAGES for span in spans(page) if re.match(r'\w+ = ["\[{\dtf]', span)}
#: Keys of the tables within a list.
IN_A_TABLE = {
    "writers": 'gcs = [{{address = "udpin:0.0.0.0:14550", {}}}]',
    "write": 'share = [{{address = "tcpin:127.0.0.1:5761", {}}}]',
}
OPTIONS = sorted({(span, place_of(page)) for page in PAGES for span in spans(page) if span.startswith("--")})
#: Options of other programs: MAVProxy, and firmware/apply.
OTHER_PROGRAMS = {"--master", "--remove"}


def load(folder: Path, text: str) -> Settings:
    """Load settings whose files are in `folder` instead of /etc/naze-bridge."""
    (folder / "gcs.key").write_text("a passphrase of the pilot\n")
    (folder / "gcs.key").chmod(0o600)
    shutil.copy(REPOSITORY / "examples" / "zenoh-tls" / "vehicle.json5", folder)
    file = folder / "config.toml"
    file.write_text(text.replace("/etc/naze-bridge", str(folder)))
    return load_settings(file, state_dir=folder)


def test_blocks_of_settings_are_valid(tmp_path: Path) -> None:
    for block in BLOCKS:
        assert load(tmp_path, block.text) != load(tmp_path, ""), block.place


def test_settings_in_the_text_are_valid(tmp_path: Path) -> None:
    wrong = {}
    for setting, place in SETTINGS.items():
        try:
            load(tmp_path, file_with(setting))
        except ValueError as error:
            wrong[setting] = place, error
    assert wrong == {}


def file_with(setting: str) -> str:
    name = setting.split()[0]
    if name in IN_A_TABLE:
        return IN_A_TABLE[name].format(setting)
    tables = {key.name.rpartition(".")[0] for key in KEYS if key.name.rpartition(".")[2] == name}
    table = tables.pop() if len(tables) == 1 else "zenoh" if "[" in setting else "web"  # both have `listen`
    # Commands need authentication, which is in other settings.
    waived = 'commands_without_authentication = "I know"\n' if name in {"commands", "mavlink_in"} else ""
    return f"[{table}]\n{waived}{setting}" if table else setting


def test_environment_variables_exist() -> None:
    named = {span for page in PAGES for span in spans(page) if re.fullmatch(r"NAZE_BRIDGE_\w*[A-Z]", span)}
    assert named == {CONFIG_VARIABLE}


def options(command: click.Command) -> Iterator[str]:
    """All options of a command and of those below it."""
    for parameter in command.params:
        yield from (*parameter.opts, *parameter.secondary_opts)
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            if inner := command.get_command(context, name):
                yield from options(inner)


def test_options_in_the_text_exist() -> None:
    known = {*options(main), "--json"} | OTHER_PROGRAMS
    for span, place in OPTIONS:
        option, _, value = span.partition(" ")
        assert option.partition("=")[0] in known, f"{place}: {span}"
        if option == "--gcs" and value:
            parse_gcs(value.replace("ADDRESS", "192.168.4.20"))
