# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of `[[share]]`."""

from dataclasses import dataclass
from pathlib import Path

from service.settings.addresses import AddressError, GcsAddress, parse_gcs

_KEYS = ("address", "write")
_KINDS = ("tcpin", "udpin")


@dataclass(frozen=True, slots=True)
class ShareSettings:
    """The address, tcpin or udpin; `write`: True if requests that change something are forwarded."""

    address: GcsAddress
    write: bool = False


def parse_share(entry: object, _folder: Path) -> ShareSettings:
    """Read one entry of `share`, or one [[share]] table; AddressError explains problems."""
    if not isinstance(entry, dict) or not isinstance(entry.get("address"), str):
        raise AddressError(f'share: {entry!r} is not a table with address = "tcpin:127.0.0.1:5761"')
    address, write = parse_gcs(entry["address"]), entry.get("write", False)
    if address.kind not in _KINDS:
        raise AddressError(f"share {address}: programs connect to it, so write tcpin:ADDR:PORT or udpin:ADDR:PORT")
    for key in entry:
        if key not in _KEYS:
            raise AddressError(f"share {address}: {key!r} is not a setting of a share; known are {', '.join(_KEYS)}")
    if type(write) is not bool:
        raise AddressError(f"share {address}: write is {write!r}, but must be true or false")
    return ShareSettings(address, write)
