# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/signing.md: the messages and commands that a link with a key accepts unsigned, and the key for pymavlink."""

import re
from hashlib import sha256
from pathlib import Path

from pymavlink import mavutil

from bridge.gcs.guard import _QUESTIONS, _READS
from protocols.mavlink.command import command_name
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.signing import key_from_passphrase

PAGE = (Path(__file__).parents[2] / "docs" / "signing.md").read_text()


def test_the_accepted_messages_are_listed() -> None:
    listed = re.search(r"\*\*Accepted unsigned\*\*.*?the commands (.*?)\*\*Everything else", PAGE, re.DOTALL)
    assert listed is not None
    words = set(re.findall(r"\b[A-Z]{2,}(?:_[A-Z]+)*\b", listed[0]))
    told = {m.mavlink_map[msgid].msgname for msgid in _READS} | {command_name(number) for number in _QUESTIONS}
    assert words == told | {"MISSION_ACK", "ACCEPTED"}


def test_pymavlink_gets_the_same_key() -> None:
    found = re.search(r"`(link\.setup_signing.*)`", PAGE)
    assert found is not None
    link = mavutil.mavlink_connection("udpout:127.0.0.1:9")
    try:
        exec(found[1], {"sha256": sha256, "link": link})  # noqa: S102
        assert link.mav.signing.secret_key == key_from_passphrase("PASSPHRASE")
    finally:
        link.close()
