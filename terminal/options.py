# SPDX-License-Identifier: GPL-3.0-or-later
"""The types of the commands' arguments and options that several commands share."""

from pathlib import Path

import click

from protocols.mission_item import degrees_to_e7, is_on_earth

#: Not click's own check for read access: the commands' messages give a remedy.
PATH = click.Path(path_type=Path, readable=False)


def position(_ctx: click.Context, _param: click.Parameter, text: str | None) -> tuple[int, int] | None:
    """Read LAT,LON in degrees as (lat_e7, lon_e7); a click callback."""
    if text is None:
        return None
    try:
        lat, lon = (degrees_to_e7(float(each)) for each in text.split(","))
    except ValueError:
        lat = lon = None
    if lat is None or lon is None or not is_on_earth(lat, lon):
        raise click.BadParameter(f"{text!r} is not a position: write it like 45.3838,8.4733")
    return lat, lon
