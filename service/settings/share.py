# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of `[[share]]`."""

from dataclasses import dataclass
from pathlib import Path

from service.settings.addresses import AddressError, GcsAddress, parse_table

_KINDS = ("tcpin", "udpin")


@dataclass(frozen=True, slots=True)
class ShareSettings:
    """`address`: tcpin or udpin. `write`: also forward requests that change something."""

    address: GcsAddress
    write: bool = False


def parse_share(entry: object, _folder: Path) -> ShareSettings:
    """Read one entry of `share`, or one [[share]] table; AddressError explains problems."""
    address, table = parse_table(entry, "share", "tcpin:127.0.0.1:5761", ["write"])
    if address.kind not in _KINDS:
        raise AddressError(f"share {address}: programs connect to it, so write tcpin:ADDR:PORT or udpin:ADDR:PORT")
    write = table.get("write", False)
    if not isinstance(write, bool):
        raise AddressError(f"share {address}: write is {write!r}, but must be true or false")
    return ShareSettings(address, write)
