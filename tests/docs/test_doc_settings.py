# SPDX-License-Identifier: GPL-3.0-or-later
"""The documentation's settings are valid: blocks of a configuration file, single settings and options."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from service.cli.main import main
from service.settings import Settings, load_settings
from service.settings.addresses import parse_gcs
from service.settings.load import CONFIG_VARIABLE
from service.settings.table import KEYS
from tests.support.doc_pages import PAGES, Block, blocks, place_of, spans
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


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.place)
def test_a_block_of_settings_is_valid(block: Block, tmp_path: Path) -> None:
    assert load(tmp_path, block.text) != load(tmp_path, "")


@pytest.mark.parametrize("setting", SETTINGS)
def test_a_setting_in_the_text_is_valid(setting: str, tmp_path: Path) -> None:
    name = setting.split()[0]
    if name in IN_A_TABLE:
        load(tmp_path, IN_A_TABLE[name].format(setting))
        return
    tables = {key.name.rpartition(".")[0] for key in KEYS if key.name.rpartition(".")[2] == name}
    table = tables.pop() if len(tables) == 1 else "zenoh" if "[" in setting else "web"  # both have `listen`
    # Commands need authentication, which is in other settings.
    waived = 'commands_without_authentication = "I know"\n' if name in {"commands", "mavlink_in"} else ""
    load(tmp_path, f"[{table}]\n{waived}{setting}" if table else setting)


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


@pytest.mark.parametrize(("span", "place"), OPTIONS)
def test_an_option_in_the_text_exists(span: str, place: str) -> None:
    option, _, value = span.partition(" ")
    assert option.partition("=")[0] in {*options(main), "--json"} | OTHER_PROGRAMS, place
    if option == "--gcs" and value:
        parse_gcs(value.replace("ADDRESS", "192.168.4.20"))
