# SPDX-License-Identifier: GPL-3.0-or-later
"""The type of the commands' arguments and options that name a file or folder."""

from pathlib import Path

import click

#: Not click's own check for read access: the commands' messages give a remedy.
PATH = click.Path(path_type=Path, readable=False)
