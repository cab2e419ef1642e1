# SPDX-License-Identifier: GPL-3.0-or-later
"""Random searches with a short form in `make test` and a long one in `make soak`."""

import os


def seeds(short: int) -> range:
    """The seeds of a search: `short` of them, or SEEDS times as many."""
    return range(short * int(os.environ.get("SEEDS", "1")))
