# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/signing.md: the key for pymavlink."""

import re
from hashlib import sha256
from pathlib import Path

from pymavlink import mavutil

from protocols.mavlink.signing import key_from_passphrase

PAGE = (Path(__file__).parents[2] / "docs" / "signing.md").read_text()


def test_pymavlink_gets_the_same_key() -> None:
    found = re.search(r"`(link\.setup_signing.*)`", PAGE)
    assert found is not None
    link = mavutil.mavlink_connection("udpout:127.0.0.1:9")
    try:
        exec(found[1], {"sha256": sha256, "link": link})  # noqa: S102
        assert link.mav.signing.secret_key == key_from_passphrase("PASSPHRASE")
    finally:
        link.close()
