# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge run`: the daemon in the foreground."""

from pathlib import Path

import click

from service.settings import DEFAULT_GCS, SettingsError, load_settings
from service.settings.load import CONFIG_VARIABLE
from terminal.command_group import PATH


@click.command()
@click.option(
    "--fc",
    metavar="FC",
    help="auto (the default), /dev/ttyAMA0, /dev/ttyUSB0,57600, tcp:HOST:PORT, udp:HOST:PORT or sim",
)
@click.option("--gcs", metavar="GCS", multiple=True, help=f"Ground stations; may be repeated. Default: {DEFAULT_GCS}")
@click.option(
    "--config",
    type=PATH,
    envvar=CONFIG_VARIABLE,
    help="TOML file with all settings.",
)
@click.option("--state-dir", type=PATH, help="Folder for stored missions.")
@click.option("--verbose", is_flag=True, help="Also show debug events.")
@click.option("--check-config", is_flag=True, help="Check the settings and exit.")
def run(config: Path | None, gcs: tuple[str, ...], verbose: bool, check_config: bool, **flags: object) -> None:
    """Run the bridge between a flight controller and ground stations."""
    try:
        settings = load_settings(config, gcs, **flags, log_level="debug" if verbose else None)
    except SettingsError as error:
        raise click.UsageError(str(error)) from error
    if check_config:
        click.echo("The settings are valid.")
        return
    from service.cli.serve import serve  # the whole daemon: --help does without

    serve(settings)
