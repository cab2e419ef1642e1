# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/signing.md lists exactly the messages and commands that a link with a key accepts unsigned."""

import re
from pathlib import Path

from bridge.gcs.guard import _QUESTIONS, _READS
from protocols.mavlink.command import command_name
from protocols.mavlink.dialect import messages as m

PAGE = (Path(__file__).parents[2] / "docs" / "signing.md").read_text()


def test_the_accepted_messages_are_listed() -> None:
    listed = re.search(r"\*\*Accepted unsigned\*\*.*?the commands (.*?)\*\*Everything else", PAGE, re.DOTALL)
    assert listed is not None
    words = set(re.findall(r"\b[A-Z]{2,}(?:_[A-Z]+)*\b", listed[0]))
    told = {m.mavlink_map[msgid].msgname for msgid in _READS} | {command_name(number) for number in _QUESTIONS}
    assert words == told | {"MISSION_ACK", "ACCEPTED"}
