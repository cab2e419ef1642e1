# SPDX-License-Identifier: GPL-3.0-or-later
"""Check of the signing keys of ground station links."""

from collections.abc import Iterator, Mapping

from service.cli.doctor.checked import Checked, note, ok
from service.settings.passphrase import STRONGER
from service.settings.write_access import WriteAccess


def check_keys(access_by_link: Mapping[str, WriteAccess]) -> Iterator[Checked]:
    """Check that the links' keys, if they have any, cannot be guessed."""
    for link, access in access_by_link.items():
        if access.weak_key is not None:
            yield note("key", f"{link}: {access.weak_key}", STRONGER)
        elif access.key is not None:
            yield ok("key", f"required for changes on {link}")
