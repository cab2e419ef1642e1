# SPDX-License-Identifier: GPL-3.0-or-later
"""Payloads: readable by their encoding, numbered for each key."""

from payloads.keys import EVENT, STATE, STATUS
from payloads.payload import Payloads, decoded, encoding_of


def test_a_reply_reads_back_by_the_encoding() -> None:
    payloads = Payloads(lambda: 1790000000.5)
    read = decoded(payloads.reply(STATE, {"vehicle": "kite"}), str(encoding_of(STATE)))
    assert read == {"v": 1, "seq": 0, "time_s": 1790000000.5, "vehicle": "kite"}


def test_each_key_counts_its_own_samples() -> None:
    payloads = Payloads(lambda: 0.0)
    assert [payloads.head(key)["seq"] for key in (STATE, STATE, EVENT, STATE)] == [0, 1, 0, 2]
    assert decoded(payloads.reply(STATE, {}), "application/json")["seq"] == 2


def test_the_reply_to_a_command_is_json_without_a_number() -> None:
    payloads = Payloads(lambda: 0.0)
    assert decoded(payloads.reply(STATUS, {"ok": True}), str(encoding_of(STATUS))) == {"ok": True}
